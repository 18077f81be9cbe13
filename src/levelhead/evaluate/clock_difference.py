"""The clock of one sensor against that of another on the same body: offset and drift with their 1σ.

The rotation that both measure is aligned in windows (``align``). A line through the shifts of the windows is the clock:
shift(t) = offset + drift · (t − t_m), fitted with the weight of each window's standard error. The standard errors grow
by √χ² per degree of freedom where the windows scatter more than their standard errors.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.evaluate.align.search import align
from levelhead.track import Track

WINDOW = 30.0  # s
MIN_WINDOWS = 3
MIN_ERROR = 1e-5  # s, of a window's shift: that of its stamps


class ClockDifference(NamedTuple):
    """By how much the clock of a sensor is late.

    Attributes:
        offset: s, at ``middle``.
        drift: s per s; None where one window holds all.
        sigma_offset: s, 1σ.
        sigma_drift: s per s, 1σ.
        middle: s on the clock of the reference.
        windows: that have a shift.
    """

    offset: float
    drift: float | None
    sigma_offset: float
    sigma_drift: float | None
    middle: float
    windows: int

    def __str__(self) -> str:
        text = f"{1e3 * self.offset:+.3f} ± {1e3 * self.sigma_offset:.3f} ms at {self.middle:.1f} s".replace("-", "−")
        if self.drift is None or self.sigma_drift is None:
            return text
        return f"{text}, drift {1e6 * self.drift:+.1f} ± {1e6 * self.sigma_drift:.1f} ppm".replace("-", "−")


def clock_difference(late: Track, reference: Track) -> ClockDifference:
    """The clock of ``late`` against that of ``reference``; both sensors sit on one rigid body, in any mounting.

    Raises:
        LevelheadError: no rotation in common from which the shift could be found.
    """
    whole = align(late.t, late.quat, reference.t, reference.quat, convention="same", simplest=False)
    if whole.shift_error is None:
        raise LevelheadError(
            "the two logs share no rotation: their clocks cannot be compared. Turn both sensors together"
        )
    start, end = reference.t[0], reference.t[-1]
    edges = np.linspace(start, end, max(1, int((end - start) / WINDOW)) + 1)
    found: list[tuple[float, float, float]] = []
    for first, last in pairwise(edges.tolist()):
        rows = (reference.t >= first) & (reference.t < last)
        there = (late.t >= first + whole.shift - 2.0) & (late.t < last + whole.shift + 2.0)
        if rows.sum() < 50 or there.sum() < 50:
            continue
        try:
            one = align(
                late.t[there] - whole.shift, late.quat[there], reference.t[rows], reference.quat[rows],
                convention="same", shift=2.0, simplest=False,
            )  # fmt: skip
        except LevelheadError:
            continue
        if one.shift_error is not None:
            found.append((0.5 * (first + last), one.shift, max(one.shift_error, MIN_ERROR)))
    if len(found) < MIN_WINDOWS:
        middle = float(0.5 * (start + end))
        return ClockDifference(whole.shift, None, max(whole.shift_error, MIN_ERROR), None, middle, 1)
    t, shift, error = np.array(found).T
    weight = 1.0 / error**2
    middle = float(np.sum(weight * t) / weight.sum())
    lever = t - middle
    offset = float(np.sum(weight * shift) / weight.sum())
    drift = float(np.sum(weight * lever * shift) / np.sum(weight * lever**2))
    left = shift - offset - drift * lever
    scatter = max(1.0, float(np.sqrt(np.sum(weight * left**2) / (len(t) - 2))))
    return ClockDifference(
        whole.shift + offset,
        drift,
        scatter / float(np.sqrt(weight.sum())),
        scatter / float(np.sqrt(np.sum(weight * lever**2))),
        middle,
        len(t),
    )
