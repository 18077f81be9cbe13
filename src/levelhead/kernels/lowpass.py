"""Weights of first-order low-pass filters, which average all samples until they are as old as their time constant."""

from levelhead.compiler.mark import kernel
from levelhead.kernels.tilt import GAP_SECONDS

AGE_LIMIT = 1e6  # s: beyond this age the weight no longer depends on it


@kernel
def advance_age(age: float, dt: float) -> float:
    """Seconds for which the attitude has been tracked without a gap; 0 after a gap."""
    if dt > GAP_SECONDS:
        return 0.0
    return min(age + dt, AGE_LIMIT)


@kernel
def lowpass_weight(tau: float, age: float, dt: float) -> float:
    """The weight of a new sample in a first-order low-pass of time constant ``tau``: dt/(min(τ, age) + dt).

    While the filter is younger than τ this is the running mean of all samples since its start: the first one counts
    fully, the second half, so that a wrong first sample is averaged away instead of being forgotten over several τ.
    """
    return dt / (min(tau, age) + dt)
