"""When a Kalman gain has stopped changing."""

import numpy as np
from numpy.typing import ArrayLike

from levelhead.errors import LevelheadError
from levelhead.recording import real_array, time_array


def find_convergence(t: ArrayLike, gain: ArrayLike, tolerance: float = 0.01) -> int:
    """Index of the first sample from which the gain stays within ``tolerance`` of its final value ever after.

    From there on the filter is, to that tolerance, a fixed-gain (complementary) filter. An index near the end means
    that the gain was still changing when the recording ended: its last value is then no final one.

    Args:
        t: (n,) seconds, strictly increasing.
        gain: (n,) one gain, or (n, k) several: all of them must have settled.
        tolerance: allowed distance as a share of the final value, 0.01 for 1 %.

    Returns:
        Index into ``t``; ``t[find_convergence(t, gain)]`` is the time.

    Raises:
        LevelheadError: lengths differ, a gain is NaN, or the tolerance is not positive.
    """
    stamps = time_array(t)
    columns = np.atleast_2d(np.asarray(gain, dtype=float).T).T
    values = real_array("gain", columns, (len(stamps), None), "any unit")
    lost = np.isnan(values).any(axis=1)
    if lost.any():
        raise LevelheadError(f"gain is NaN at row {int(lost.argmax())}; expected one for every sample")
    if not tolerance > 0.0:
        raise LevelheadError(f"tolerance is {tolerance:g}; expected a positive share, such as 0.01 for 1 %")
    away = (np.abs(values - values[-1]) > tolerance * np.abs(values[-1])).any(axis=1)
    return int(np.flatnonzero(away)[-1]) + 1 if away.any() else 0
