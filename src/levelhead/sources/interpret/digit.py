"""The digit of a gyroscope: the step between its numbers is that of a chip's converter, in deg/s or in rad/s."""

import math

import numpy as np

from levelhead.recording import Array, median
from levelhead.sources.interpret.counts import CHIPS
from levelhead.units import DEGREE

_ROWS = 20_000  # that are looked at
_MIN_NUMBERS = 12  # different numbers of an axis by which a step is found
_MAX_SHARE = 0.5  # share of the numbers that may differ: more are no multiples of a step, or too few samples
_FRACTION = 0.12  # rms by which multiples may miss whole numbers: 0.29 for numbers without a step
_MAX_DEVIATION = 0.004  # by which a step may differ from a chip's: decimals of a text
_FULL_SCALES = (125.0, 250.0, 500.0, 1000.0, 2000.0)  # deg/s, over 2^15
_STEPS = (
    *sorted({1.0 / per for chip in CHIPS for per in chip.gyr}),
    *(full / 32768.0 for full in _FULL_SCALES),
)  # deg/s


def step_of(values: Array) -> float | None:
    """The step of which (n,) numbers are multiples, up to an offset; None if there is none."""
    finite = values[np.isfinite(values)][:_ROWS]
    levels = np.unique(finite)
    if len(levels) < _MIN_NUMBERS or len(levels) > _MAX_SHARE * len(finite):
        return None
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-4 * median(gaps)]
    step = float(np.quantile(gaps, 0.1))
    for _ in range(3):
        multiples = np.rint(gaps / step)
        known = (multiples > 0.0) & (multiples < 20.0)
        if not known.any():
            return None
        step = float((gaps[known] * multiples[known]).sum() / (multiples[known] ** 2).sum())
    off = gaps / step
    off = off[off < 20.0]
    return step if float(np.sqrt(np.mean((off - np.rint(off)) ** 2))) < _FRACTION and (np.rint(off) > 0).all() else None


def unit_by_digit(gyr: Array) -> tuple[str, float] | None:
    """("deg/s" or "rad/s", the step in deg/s) of (n, 3) rates whose step is a chip's in one of them; else None."""
    steps = [step for axis in gyr.T if (step := step_of(axis)) is not None]
    if len(steps) < 2 or max(steps) > 1.01 * min(steps):
        return None
    step = median(np.array(steps))
    fits = {unit: _is_chips(step / factor) for unit, factor in (("deg/s", 1.0), ("rad/s", DEGREE))}
    if sum(fits.values()) != 1:
        return None
    return ("deg/s", step) if fits["deg/s"] else ("rad/s", step / DEGREE)


def _is_chips(step: float) -> bool:
    """Whether a step is a chip's, and no last decimal."""
    if abs(math.log10(step) - round(math.log10(step))) < _MAX_DEVIATION:
        return False
    return min(abs(math.log(step / one)) for one in _STEPS) < _MAX_DEVIATION
