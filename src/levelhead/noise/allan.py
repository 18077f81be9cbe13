"""Overlapping Allan deviation with confidence intervals.

With the angle θ = ∫ ω dt at N samples τ₀ apart and τ = m τ₀,

    σ²(τ) = Σ (θ[k+2m] − 2 θ[k+m] + θ[k])² / (2 τ² (N − 2m))                                                    (1)

(IEEE Std 952-1997, annex C; W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065, 2008, 5.2.4). An
estimate with ν equivalent degrees of freedom is distributed like σ² χ²(ν)/ν; ν depends on the type of noise (the same
handbook, 5.4.1, after Howe, Allan & Barnes 1981).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array

PER_OCTAVE = 4  # values of τ
CHUNK = 1 << 15  # differences at a time: they stay in the processor's cache
TERMS = 1 << 18  # of the sum: with twice as many there may be steps between them, of which there are at least
FINE = 5  # octaves of factors below 32
STEPS = 32  # to a τ, which leaves the estimate as it is (neighbouring terms are nearly equal)

# Types of noise by their place in ``noise.fit.TERMS``
QUANTISATION, WHITE, FLICKER, WALK = range(4)


@dataclass(frozen=True, eq=False)
class AllanCurve:
    """The Allan deviation of one axis.

    Attributes:
        tau: (k,) averaging times in s.
        factor: (k,) the same in samples.
        deviation: (k,) Allan deviation in the sensor's unit.
        count: samples.
    """

    tau: Array
    factor: NDArray[np.int64]
    deviation: Array
    count: int


def integral(rate: Array, interval: float) -> Array:
    """(n + 1,) ∫ of (n,) values ``interval`` s apart, without their mean, which no Allan deviation contains."""
    angle, mean, last = np.empty(len(rate) + 1), rate.mean(), 0.0
    angle[0] = 0.0
    for start in range(0, len(rate), CHUNK):
        part = angle[start + 1 : start + CHUNK + 1]
        np.subtract(rate[start : start + CHUNK], mean, out=part)
        part[0] += last
        np.cumsum(part, out=part)
        last = part[-1]
        part *= interval
    return angle


def every_second(angle: Array) -> Array:
    """Values 0, 2, 4, …, moved to the front of the same memory: fresh memory costs more than the copy."""
    count = (len(angle) + 1) // 2
    for start in range(0, count, CHUNK):
        end = min(start + CHUNK, count)
        angle[start:end] = angle[2 * start : 2 * end : 2]
    return angle[:count]


def variance(angle: Array, factor: int, interval: float) -> float:
    """Equation 1 at τ = factor × interval from every term of it."""
    terms, total, work = len(angle) - 2 * factor, 0.0, np.empty(CHUNK)
    for start in range(0, terms, CHUNK):
        end = min(start + CHUNK, terms)
        middle = angle[start + factor : end + factor]
        second = work[: len(middle)]
        np.subtract(angle[start + 2 * factor : end + 2 * factor], middle, out=second)
        second -= middle
        second += angle[start:end]
        total += float(np.einsum("i,i->", second, second))  # no BLAS: its threads would wait for each other
    return total / (2.0 * terms * (factor * interval) ** 2)


def factors(count: int, longest: int) -> NDArray[np.int64]:
    """Averaging factors, four an octave, from 1 to ``longest``, with every power of 2 among them.

    A factor m needs 3 m of ``count`` samples. Those from 32 on are 32, 38, 45 or 54 times a power of 2, so that a sum
    with steps of that power stays among the same angles.
    """
    top = max(1, min(longest, count // 3))
    steps = np.arange(math.floor(PER_OCTAVE * math.log2(top) + 1e-9) + PER_OCTAVE)
    octave, place = np.divmod(steps - PER_OCTAVE * FINE, PER_OCTAVE)
    coarse = np.rint(STEPS * 2.0 ** (place / PER_OCTAVE)) * 2.0 ** np.maximum(octave, 0)
    every = np.where(octave < 0, np.rint(2.0 ** (steps / PER_OCTAVE)), coarse)
    found: NDArray[np.int64] = np.unique(every[every <= top].astype(np.int64))
    return found


def thinning(factor: int, terms: int) -> int:
    """The step between terms: the largest power of 2 that leaves 262 144 of them and is at most 1/32 of the factor."""
    step = 1
    while 2 * step <= min(factor // STEPS, terms // TERMS) and factor % (2 * step) == 0:
        step *= 2
    return step


def allan_curve(
    rate: Array, interval: float, longest: int, report: Callable[[float], None] = lambda fraction: None
) -> AllanCurve:
    """The curve of (n,) values ``interval`` s apart, up to a factor of ``longest``."""
    angle = integral(rate, interval)
    several = factors(len(rate), longest)
    squares = np.empty(len(several))
    thinned = 1  # steps between the angles, which grow with the factor
    for i, factor in enumerate(several.tolist()):
        while thinned < thinning(factor, len(rate) + 1 - 2 * factor):
            angle, thinned = every_second(angle), 2 * thinned
        squares[i] = variance(angle, factor // thinned, thinned * interval)
        report((i + 1) / len(several))
    tau = several.astype(np.float64) * interval
    return AllanCurve(tau, several, np.sqrt(squares), len(rate))


def degrees_of_freedom(kind: int, count: int, factor: int) -> float:
    """ν of an overlapping estimate from ``count`` samples at an averaging factor (NIST SP 1065, table 5).

    Args:
        kind: QUANTISATION (white noise of the angle), WHITE, FLICKER or WALK (of the rate).
        count: samples of the rate.
        factor: m.
    """
    n, m = count + 1.0, float(factor)
    if kind == QUANTISATION:
        return (n + 1.0) * (n - 2.0 * m) / (2.0 * (n - m))
    if kind == WHITE:
        return (3.0 * (n - 1.0) / (2.0 * m) - 2.0 * (n - 2.0) / n) * 4.0 * m * m / (4.0 * m * m + 5.0)
    if kind == FLICKER:
        return 2.0 * (n - 2.0) ** 2 / (2.3 * n - 4.9) if factor == 1 else 5.0 * n * n / (4.0 * m * (n + 3.0 * m))
    return (n - 2.0) / m * ((n - 1.0) ** 2 - 3.0 * m * (n - 1.0) + 4.0 * m * m) / (n - 3.0) ** 2


def interval_of(deviation: Array, freedom: Array, level: float = 0.95) -> tuple[Array, Array]:
    """(k,) lower and upper ends of the confidence intervals of (k,) deviations with ν = ``freedom``."""
    from scipy.special import gammaincinv

    tail = 0.5 * (1.0 - level)
    low, high = (deviation * np.sqrt(freedom / (2.0 * gammaincinv(0.5 * freedom, p))) for p in (1.0 - tail, tail))
    return low, high
