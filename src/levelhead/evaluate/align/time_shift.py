"""The shift in time of two courses, from how fast they turn.

The speed of a unit quaternion in four dimensions is half the angular rate, and no orthogonal map changes it: neither
constant rotations nor an inverse nor a wrong order. So |ω| of both courses can be held against each other before
anything else is known. Their correlation coefficient over all shifts, over known samples only, is that of D. Padfield,
Masked Object Registration in the Fourier Domain, IEEE Transactions on Image Processing 21(5), 2012, eqs. (5) to (12).
"""

from typing import NamedTuple

import numpy as np

from levelhead.evaluate.align.series import OrientationSeries
from levelhead.recording import Array

STEP = 0.05  # s, the grid on which rates are compared, where neither course is slower
MIN_CORRELATION = 0.5  # correlation coefficient below which a shift is rejected
PREFERRED_SHIFT = 1.0  # s; a shift within it is preferred to a longer one that fits hardly better
_MIN_OVERLAP = 0.5  # of the shorter course, at least, for a shift to be thought of
_RATE_STEPS = 4  # steps of the grid over which a rate is taken: noise counts less, and delays both alike
_MEDIAN_OF = 7  # rates
_GRID = 1 << 20  # points at most


class Shift(NamedTuple):
    """Seconds by which the estimate is late, and the correlation of the two rates there."""

    seconds: float
    correlation: float


def estimate_shift(estimate: OrientationSeries, reference: OrientationSeries, longest: float = np.inf) -> Shift | None:
    """The shift at which both turn equally fast, to a fraction of ``STEP``; None where the rates do not correlate.

    No shift beyond ``longest`` s is thought of.
    """
    spans = [float(course.t[-1] - course.t[0]) for course in (estimate, reference)]
    step = max(min(STEP, min(spans) / 200.0), estimate.interval, reference.interval, max(spans) / _GRID)
    a, b = angular_speeds(estimate, step), angular_speeds(reference, step)
    if min(len(a), len(b)) < 8:
        return None
    found = correlation(a, b)
    # zero lag of the grids is not zero shift of the clocks: each grid begins with its own course
    shifts = step * (np.arange(len(found)) - (len(b) - 1)) + float(estimate.t[0] - reference.t[0])
    found[np.abs(shifts) > max(longest, step)] = 0.0
    best = int(np.argmax(found))
    usual = np.flatnonzero(np.abs(shifts) <= max(PREFERRED_SHIFT, step))
    if len(usual) and found[usual].max() > 0.95 * found[best]:
        best = int(usual[np.argmax(found[usual])])
    if found[best] < MIN_CORRELATION:
        return None
    return Shift(float(shifts[best]) + step * _vertex(found, best), float(found[best]))


def angular_speeds(course: OrientationSeries, step: float) -> Array:
    """(k,) angular rate in rad/s on a grid of ``step`` s from the start of the series; NaN if unknown.

    Each value is the mean rate over ``_RATE_STEPS`` steps of the grid. The result is the running
    median over ``_MEDIAN_OF`` values, so that a jump of the orientation does not outweigh the motion.
    """
    from scipy.ndimage import median_filter

    grid = course.t[0] + step * np.arange(int((course.t[-1] - course.t[0]) / step) + 1)
    quat = course.at(grid)
    ahead, behind = quat[_RATE_STEPS:], quat[:-_RATE_STEPS]
    near = np.where(np.sum(ahead * behind, axis=1, keepdims=True) < 0.0, -ahead, ahead)
    rate = 4.0 * np.arcsin(np.minimum(0.5 * np.sqrt(np.sum((near - behind) ** 2, axis=1)), 1.0)) / (_RATE_STEPS * step)
    known = np.isfinite(rate)
    smooth: Array = median_filter(np.where(known, rate, 0.0), _MEDIAN_OF, mode="nearest")
    return np.where(known, smooth, np.nan)


def correlation(a: Array, b: Array) -> Array:
    """(len(a) + len(b) − 1,) correlation coefficients of a(i + k) with b(i), k from −(len(b) − 1); 0 where few overlap.

    NaN marks missing values.
    """
    from scipy.signal import correlate

    def sums(x: Array, y: Array) -> Array:
        result: Array = correlate(x, y, mode="full", method="fft")
        return result

    known_a, known_b = np.isfinite(a).astype(float), np.isfinite(b).astype(float)
    a = np.where(known_a > 0.0, a - np.nanmean(a), 0.0) if known_a.any() else 0.0 * known_a
    b = np.where(known_b > 0.0, b - np.nanmean(b), 0.0) if known_b.any() else 0.0 * known_b
    count = np.maximum(np.round(sums(known_a, known_b)), 1.0)
    sum_a, sum_b = sums(a, known_b), sums(known_a, b)
    covariance = sums(a, b) - sum_a * sum_b / count
    power_a = sums(a * a, known_b) - sum_a**2 / count
    power_b = sums(known_a, b * b) - sum_b**2 / count
    enough = count >= _MIN_OVERLAP * min(known_a.sum(), known_b.sum())
    floor = 1e-6 * float(np.sqrt(np.sum(a * a) * np.sum(b * b))) + 1e-300
    scale = np.sqrt(np.maximum(power_a, 0.0) * np.maximum(power_b, 0.0))
    return np.where(enough & (scale > floor), covariance / np.maximum(scale, floor), 0.0)


def _vertex(values: Array, at: int) -> float:
    """Where between its neighbours, in steps, the parabola through a peak has its vertex."""
    if not 0 < at < len(values) - 1:
        return 0.0
    left, middle, right = values[at - 1 : at + 2]
    bend = left - 2.0 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0.0 else 0.0
