"""The random processes of inertial sensors, at any sample rate: white noise, Gauss–Markov, flicker, random walk.

Names and coefficients are those of IEEE Std 952-1997, annex C: N for white noise (angle random walk), B for the bias
instability, K for the rate random walk. A coefficient belongs to the sensor and never to the sample rate: the same
coefficient at 100 Hz and at 400 Hz gives the same Allan deviation.
"""

import math
import operator
from itertools import accumulate

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array

# The flat part of an Allan deviation lies at √(2·ln 2/π)·B (IEEE Std 952-1997, annex C, bias instability).
FLICKER_FLOOR = math.sqrt(2.0 * math.log(2.0) / math.pi)  # 0.664
# A Gauss–Markov process peaks at 0.437·q·√T, at τ = 1.89·T, where q = σ·√(2/T) (same annex, correlated noise).
GAUSS_MARKOV_PEAK = 0.437 * math.sqrt(2.0)  # 0.618


def generator(seed: int, *stream: int) -> np.random.Generator:
    """A generator of its own for each (seed, stream): switching one effect off leaves all others as they were.

    Args:
        seed: a whole number, zero or more.
        stream: which sensor and which effect; different streams are independent (``numpy.random.SeedSequence``).

    Raises:
        LevelheadError: the seed is negative or not a whole number.
    """
    return np.random.default_rng(np.random.SeedSequence(check_seed(seed), spawn_key=stream))


def check_seed(seed: int, below: float = math.inf) -> int:
    """The seed, if it is a whole number from zero to ``below``.

    Raises:
        LevelheadError: it is not.
    """
    try:
        number = operator.index(seed)
    except TypeError:
        number = -1
    if 0 <= number < below:
        return number
    limit = "or more" if math.isinf(below) else f"to {below - 1:.0f}"
    raise LevelheadError(f"the seed is {seed}; expected a whole number, zero {limit}")


def white(random: np.random.Generator, n: int, rate: float, density: Array) -> Array:
    """(n, 3) white noise whose samples have σ = N·√rate.

    Args:
        random: where the numbers come from.
        n: number of samples.
        rate: samples a second.
        density: (3,) N in unit/√Hz, which is unit·√s: the Allan deviation at τ = 1 s.
    """
    return random.standard_normal((n, 3)) * (density * math.sqrt(rate))


def random_walk(random: np.random.Generator, n: int, rate: float, coefficient: Array) -> Array:
    """(n, 3) random walk that starts at zero and has σ = K·√t after t seconds.

    Args:
        random: where the numbers come from.
        n: number of samples.
        rate: samples a second.
        coefficient: (3,) K in unit/√s, which is unit/s/√Hz; the Allan deviation is K·√(τ/3).
    """
    steps = random.standard_normal((n, 3)) * (coefficient / math.sqrt(rate))
    steps[0] = 0.0
    return np.cumsum(steps, axis=0)


def gauss_markov(random: np.random.Generator, n: int, rate: float, instability: Array, time: float) -> Array:
    """(n, 3) first-order Gauss–Markov process, stationary from its first sample: the stand-in for flicker noise.

    True flicker noise has no finite state model; the first-order Gauss–Markov process is the customary one (IEEE Std
    952-1997, annex C; Brown & Hwang, Introduction to Random Signals and Applied Kalman Filtering). Its deviation is
    such that its Allan deviation peaks where the flat part of the flicker noise lies: 0.618·σ = 0.664·B. The discrete
    form x ← φ·x + σ·√(1 − φ²)·w with φ = exp(−dt/time) is exact at every rate.

    Args:
        random: where the numbers come from.
        n: number of samples.
        rate: samples a second.
        instability: (3,) B in the sensor's unit.
        time: correlation time in s.
    """
    sigma = instability * (FLICKER_FLOOR / GAUSS_MARKOV_PEAK)
    decay = math.exp(-1.0 / (rate * time))
    drive = random.standard_normal((n, 3)) * sigma
    drive[1:] *= math.sqrt(1.0 - decay * decay)
    # In plain Python: 0.1 µs a number, and scipy.signal.lfilter would first take a second to import.
    columns = [list(accumulate(column.tolist(), lambda last, new: decay * last + new)) for column in drive.T]
    return np.array(columns).T


def flicker(random: np.random.Generator, n: int, instability: Array) -> Array:
    """(n, 3) flicker noise, whose Allan deviation is flat at 0.664·B at any sample rate.

    White noise through the fractional integrator with h₀ = 1, hₖ = hₖ₋₁ (k − ½)/k (N. J. Kasdin, Discrete simulation of
    colored noise and stochastic processes and 1/f^α power law noise generation, Proc. IEEE 83(5), 1995, eq. 104 with
    α = 1). The spectrum of the result is B²/(2πf), that of IEEE Std 952.

    Args:
        random: where the numbers come from.
        n: number of samples.
        instability: (3,) B in the sensor's unit.
    """
    k = np.arange(1, n)
    response = np.cumprod(np.concatenate([[1.0], (k - 0.5) / k]))
    drive = random.standard_normal((n, 3)) * instability
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(drive, size, axis=0) * np.fft.rfft(response, size)[:, None]
    made: Array = np.fft.irfft(spectrum, size, axis=0)[:n]
    return made


def angle_white(random: np.random.Generator, n: int, rate: float, coefficient: Array) -> Array:
    """(n, 3) rates whose integral has white noise of σ = Q: quantisation noise of an integrating sensor.

    Args:
        random: where the numbers come from.
        n: number of samples.
        rate: samples a second.
        coefficient: (3,) Q in unit·s.
    """
    return np.diff(random.standard_normal((n + 1, 3)) * coefficient, axis=0) * rate
