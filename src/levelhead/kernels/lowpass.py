"""Weights of first-order low-pass filters, which average all samples until they are as old as their time constant."""

from levelhead.compiler.mark import kernel
from levelhead.kernels.tilt import GAP_SECONDS

DIRECTION_DENSITY = 0.03  # rad²·s, of a direction: 2 τ s of a field that iron turns by 5° (1σ) for 2 s
STEADY_AGE = 1e6  # s: of a filter whose weights no longer depend on its age


@kernel
def advance_age(age: float, dt: float) -> float:
    """Seconds for which the attitude has been tracked without a gap; 0 after a gap."""
    if dt > GAP_SECONDS:
        return 0.0
    return age + dt


@kernel
def inflate_age(age: float, variance: float) -> float:
    """The age (s) of a mean of directions whose error has grown by a turn of ``variance`` (rad²).

    The mean over an age a of a direction of density ρ has the variance ρ/a. So the age becomes a/(1 + a v/ρ): after a
    small turn it hardly changes, after a large one the mean starts again.
    """
    return age / (1.0 + age * variance / DIRECTION_DENSITY)


@kernel
def lowpass_weight(tau: float, age: float, dt: float) -> float:
    """The weight of a new sample in a first-order low-pass of time constant ``tau``: dt/(min(τ, age) + dt).

    While the filter is younger than τ this is the running mean of all samples since its start: the first one counts
    fully, the second half, so that a wrong first sample is averaged away instead of being forgotten over several τ.
    """
    return dt / (min(tau, age) + dt)
