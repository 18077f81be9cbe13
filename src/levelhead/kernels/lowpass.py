"""Gains of filters with a time constant, and how they start: quickly at first, as an average of what there is."""

from levelhead.compiler.mark import kernel
from levelhead.kernels.tilt import GAP_SECONDS

OLD = 1e6  # s: nothing distinguishes older filters


@kernel
def older(age: float, dt: float) -> float:
    """Seconds for which the attitude has been followed: 0 again after a gap, in which anything may have happened."""
    if dt > GAP_SECONDS:
        return 0.0
    return min(age + dt, OLD)


@kernel
def share(tau: float, age: float, dt: float) -> float:
    """The weight of a new sample in a first-order low-pass of time constant ``tau``: dt/(min(τ, age) + dt).

    While the filter is younger than τ this is the running mean of all samples since its start: the first one counts
    fully, the second half, so that a wrong first sample is averaged away instead of being forgotten over several τ.
    """
    return dt / (min(tau, age) + dt)
