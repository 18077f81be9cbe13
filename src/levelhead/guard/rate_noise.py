"""A gyroscope that no longer measures, known by the noise that it has no more.

A chip or its firmware that hangs may repeat a rate to a digit instead of exactly, so that no axis is stuck to the last
bit. But the noise of a sensor does not vanish. At rest an axis changes from one sample to the next by c in the mean,
and by more than ``SMALL`` c with the probability p. If it then changes by less n times in a row while the accelerometer
decides that the body moves, that has the probability (1 − p)ⁿ < exp(−p n): beyond p n = ``SURE`` it does not measure.
An axis that stays at one digit at rest has a small p, and is given that much more time.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.lowpass import lowpass_weight
from levelhead.kernels.vec3 import ZERO, Vec3

SMALL = 0.03  # of the mean change at rest: a change that noise hardly ever makes so small
SURE = 20.0  # p n: once in 5 · 10⁸ runs of samples
NOISE_TIME = 10.0  # s of rest over which the noise is averaged,
LEAST_TIME = 1.0  # and at least
LEAST_SCALE = 1.7  # rad/s: a rate beyond may be at full scale (the smallest is 125 °/s), where noise is cut off


class RateNoise(NamedTuple):
    """The noise of a gyroscope at rest, and for how long each axis has been without it."""

    last: Vec3  # rad/s, the last rate
    change: Vec3  # rad/s, mean size of the change from one sample to the next at rest
    share: Vec3  # p: of these changes, those that are not small
    time: float  # s of rest over which both were averaged
    evidence: Vec3  # p n of the run of small changes


NO_NOISE = RateNoise(last=ZERO, change=ZERO, share=ZERO, time=0.0, evidence=ZERO)


@kernel
def axis_share(share: float, change: float, mean: float, weight: float) -> float:
    """p after another change (rad/s) at rest."""
    return share + weight * ((1.0 if change > SMALL * mean else 0.0) - share)


@kernel
def axis_evidence(evidence: float, rate: float, change: float, mean: float, share: float) -> float:
    """p n after another change, in motion; rates in rad/s."""
    return 0.0 if change > SMALL * mean or abs(rate) > LEAST_SCALE else evidence + share


@kernel
def update_noise(noise: RateNoise, rate: Vec3, quiet: bool, dt: float) -> RateNoise:
    """After a rate (rad/s) over ``dt`` seconds, which is of the noise alone where it is ``quiet``."""
    (a, b, c), (p, q, r), (u, v, w), (e, f, g) = noise.last, noise.change, noise.share, noise.evidence
    time = noise.time
    x = abs(rate.x - a)
    y = abs(rate.y - b)
    z = abs(rate.z - c)
    if quiet:
        weight = lowpass_weight(NOISE_TIME, time, dt)
        share = Vec3(axis_share(u, x, p, weight), axis_share(v, y, q, weight), axis_share(w, z, r, weight))
        change = Vec3(p + weight * (x - p), q + weight * (y - q), r + weight * (z - r))
        return RateNoise(last=rate, change=change, share=share, time=min(time + dt, NOISE_TIME), evidence=ZERO)
    if not has_elapsed(time, dt, LEAST_TIME):
        return RateNoise(last=rate, change=noise.change, share=noise.share, time=time, evidence=ZERO)
    evidence = Vec3(
        axis_evidence(e, rate.x, x, p, u), axis_evidence(f, rate.y, y, q, v), axis_evidence(g, rate.z, z, r, w)
    )
    return RateNoise(last=rate, change=noise.change, share=noise.share, time=time, evidence=evidence)


@kernel
def is_silent(noise: RateNoise) -> bool:
    """Whether an axis has been without its noise for longer than chance allows."""
    x, y, z = noise.evidence
    return max(x, y, z) > SURE
