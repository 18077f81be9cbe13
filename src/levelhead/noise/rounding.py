"""The size of a sensor's bit, and the white noise that its rounding adds.

Rounding to steps of Δ adds white noise of variance Δ²/12 (W. F. Sheppard, Proc. London Math. Soc. 29, 1898) as long as
Δ is at most about 2.6 times the noise. Beyond that the rounded noise depends on where the mean lies between two steps.
"""

import numpy as np

from levelhead.recording import Array, median

MAX_SHARE = 0.05  # of the readings may be distinct values; with more they are not rounded
BLOCK = 50  # readings, whose standard deviation is short-term noise
MAX_CORRECTED = 2.1  # steps over the noise as read, up to which the rounding can be subtracted
MIN_NAMED = 0.9  # from which on it changes the density by more than 3 %


def rounding_step(values: Array) -> float:
    """Δ of (n,) readings; 0: they are not rounded."""
    several = np.unique(values)
    if not 1 < len(several) <= max(2.0, MAX_SHARE * len(values)):
        return 0.0
    return float(np.diff(several).min())


def rounding_ratio(values: Array, step: float) -> float:
    """Δ over the standard deviation of short stretches of (n,) readings, rounding included; infinite for no noise."""
    blocks = values[: len(values) // BLOCK * BLOCK].reshape(-1, BLOCK)
    noise = median(blocks.std(axis=1))
    return step / noise if noise > 0.0 else np.inf


def without_rounding(density: Array, step: Array, ratio: Array, rate: float) -> Array:
    """(3,) densities N without the rounding of three axes, where it can be subtracted: N² − Δ²/(12 rate)."""
    known = ratio <= MAX_CORRECTED
    left: Array = np.sqrt(np.maximum(density**2 - np.where(known, step**2 / (12.0 * rate), 0.0), 0.0))
    return left
