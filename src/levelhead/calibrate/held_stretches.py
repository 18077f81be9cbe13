"""Where in a recording a hand held the sensor still enough: it trembles, and stays where it is."""

from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from levelhead.recording import Array, Recording
from levelhead.signals.rest import StillStretch
from levelhead.units import DEGREE

BLOCK = 0.1  # s, over which readings are averaged
WINDOW = 5  # blocks, over which a tremor has no mean
QUIETEST = 0.3  # share of the windows of which the rate is that at rest
MAX_MEAN_RATE, MAX_RATE = 3.0 * DEGREE, 15.0 * DEGREE  # rad/s off that rate: of a window's mean, of a block
MAX_SPREAD, MAX_CHANGE = 0.6, 0.3  # m/s²: of the blocks of a window; of a window's mean off the stretch's median


def held_stretches(recording: Recording, least: float) -> list[StillStretch]:
    """Stretches of at least ``least`` s in which the sensor trembled at most, in order.

    A hand's tremor has rates as high as those of a slow turn, but their mean over half a second is that of rest, and
    the mean specific force stays.
    """
    size = max(1, round(BLOCK * recording.rate))
    count = len(recording) // size
    if count < 2 * WINDOW:
        return []
    gyr, acc = (_means(values, count, size) for values in (recording.gyr, recording.acc))
    rate, force = _sliding(gyr), _sliding(acc)
    with np.errstate(invalid="ignore"):
        shaking = np.linalg.norm(rate.std(axis=-1), axis=1)
        known = np.isfinite(shaking)
        if not known.any():
            return []
        quiet = known & (shaking <= np.quantile(shaking[known], QUIETEST))
        rest = np.median(rate.mean(axis=-1)[quiet], axis=0)
        still = np.linalg.norm(rate.mean(axis=-1) - rest, axis=1) < MAX_MEAN_RATE
        still &= np.linalg.norm(rate - rest[:, None], axis=1).max(axis=1) < MAX_RATE
        still &= force.std(axis=-1).max(axis=1) < MAX_SPREAD
    whole = np.zeros(count, dtype=bool)  # blocks of a window that is still
    for shift in range(WINDOW):
        whole[shift : shift + len(still)] |= still
    torn = np.diff(recording.t[: count * size : size]) > 1.5 * size / recording.rate
    return [
        StillStretch(int(first * size), int(last * size))
        for first, last in _runs(whole, torn)
        if last - first >= least / BLOCK and _stays(force.mean(axis=-1)[first : last - WINDOW + 1])
    ]


def _means(values: Array, count: int, size: int) -> Array:
    """(count, 3) means of blocks; NaN where a reading is missing."""
    made: Array = values[: count * size].reshape(count, size, 3).mean(axis=1)
    return made


def _sliding(blocks: Array) -> Array:
    """(k, 3, WINDOW) windows of (n, 3) blocks, a step of one block apart."""
    return sliding_window_view(blocks, WINDOW, axis=0)


def _runs(still: NDArray[np.bool_], torn: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First block and block after the last of each run, cut where time has a gap."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(np.int8), [0]])))
    runs = []
    for first, last in edges.reshape(-1, 2):
        cuts = [first, *(first + 1 + np.flatnonzero(torn[first : last - 1])), last]
        runs += list(pairwise(cuts))
    return runs


def _stays(force: Array) -> bool:
    """Whether the specific force is at the end as it was at the start."""
    offset = np.linalg.norm(force - np.median(force, axis=0), axis=1)
    return bool(np.quantile(offset, 0.9) < MAX_CHANGE)
