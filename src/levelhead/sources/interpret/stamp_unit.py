"""The unit of time stamps by their size and their steps."""

import numpy as np
from numpy.typing import NDArray

from levelhead import units
from levelhead.recording import Array, median

EPOCH = (0.9e9, 4.2e9)  # seconds since 1970 that lie between 1998 and 2103
_SLOWEST_MEDIAN = {"s": 0.25, "ms": 250.0, "us": 250e3, "ns": 250e6}  # 4 Hz
_DAYS, _DAYS_STEP = ((36_500.0, 55_000.0), (730_000.0, 750_000.0)), 2e-5  # of this century; 1.7 s


def guess_unit(stamps: Array | NDArray[np.int64]) -> str:
    """The unit of (n,) stamps: the one in which they lie in our century, or else give 4 Hz or more.

    Days are those of spreadsheets, which count from 1900, and of MATLAB, which count from year 0.
    """
    step, first = usual_interval(stamps), abs(float(stamps[0]))
    if 0.0 < step < _DAYS_STEP and any(low < first < high for low, high in _DAYS):
        return "days"
    for unit in ("s", "ms", "us", "ns"):
        factor = units.factor("time", unit)
        if EPOCH[0] < first * factor < EPOCH[1] and 1e-5 < step * factor < 10.0:
            return unit
    return next((unit for unit, limit in _SLOWEST_MEDIAN.items() if step < limit), "ns")


def guess_tick(stamps: Array | NDArray[np.int64]) -> str:
    """The unit of Xsens' SampleTimeFine: 100 µs of an MTi, 1 µs of a DOT, which gives 4 Hz or more."""
    return "100us" if usual_interval(stamps) < 1e4 * _SLOWEST_MEDIAN["s"] else "us"


def usual_interval(stamps: Array | NDArray[np.int64]) -> float:
    """The median interval, in stamps; where most stamps stand still, as in bursts, the mean one."""
    if len(stamps) < 2:
        return 0.0
    steps = np.diff(stamps[:100_000])
    step = median(steps)
    return step if step > 0.0 else float(steps[steps > 0].sum() / len(steps)) if (steps > 0).any() else 0.0
