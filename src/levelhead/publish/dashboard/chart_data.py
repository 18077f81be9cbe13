"""What the charts show, and how numbers become curves that can be read."""

from typing import NamedTuple

import numpy as np

from levelhead.recording import Array

LEAST_MARGIN = 2.0  # degrees above and below the curves
SETTLING = 1.0  # s at the beginning that do not widen a chart
SHORT_GAP = 20  # points of a chart
SPIKES = 0.5  # % of values at either end that do not widen a chart


class ChartData(NamedTuple):
    """What the charts show; angles in degrees.

    Attributes:
        t: (n,) s, since the beginning or since 1970.
        angles: (n, 3) roll, pitch, yaw, without jumps by 360° (``unwrap``).
        two_sigma: (n, 3) 2σ of them.
        tilt: (n, 2) roll and pitch by the accelerometer alone, ``beside`` angles.
        bias: (n, 3) gyroscope bias, °/s.
        gyr: (n, 3) raw rate, °/s.
        acc: (n, 3) raw specific force, m/s².
        mag: (n, 3) raw field, µT, or None.
        truth: (n, 3) as angles, or None.
        second: (n, 3) the angles of another filter, or None.
    """

    t: Array
    angles: Array
    two_sigma: Array
    tilt: Array
    bias: Array
    gyr: Array
    acc: Array
    mag: Array | None = None
    truth: Array | None = None
    second: Array | None = None


def tilt_of(acc: Array) -> Array:
    """(n, 2) roll and pitch in degrees of (n, 3) specific forces."""
    x, y, z = acc.T
    tilt: Array = np.degrees(np.stack([np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))], axis=1))
    return tilt


def two_sigma(sigma: Array) -> Array:
    """(n, 3) 2σ of roll, pitch and yaw in degrees: that of tilt for the first two, that of heading for the third."""
    tilt = np.hypot(sigma[:, 0], sigma[:, 1])
    return np.degrees(2.0 * np.stack([tilt, tilt, sigma[:, 2]], axis=1))


def unwrap(angles: Array) -> Array:
    """(n, k) angles in degrees without jumps by 360°; NaN stays."""
    found = np.array(angles, float)
    for column in found.T:
        known = np.isfinite(column)
        column[known] = np.unwrap(column[known], period=360.0)
    return found


def unwrap_to(angles: Array, reference: Array) -> Array:
    """(n, k) angles in degrees, moved by multiples of 360° to within 180° of curves without jumps."""
    moved: Array = reference + (angles - reference + 180.0) % 360.0 - 180.0
    return moved


def at_edge(curve: Array, low: float) -> Array:
    """A curve that can be drawn: across short gaps a line, else missing values lie on the chart's lower edge.

    A single NaN would empty the chart.
    """
    rows, known = np.arange(len(curve)), np.flatnonzero(np.isfinite(curve))
    if len(known) in (0, len(curve)):
        return np.where(np.isfinite(curve), curve, low)
    after = np.searchsorted(known, rows)
    inside = (after > 0) & (after < len(known))
    gap = known[np.minimum(after, len(known) - 1)] - known[np.maximum(after - 1, 0)]
    drawn = np.isfinite(curve) | (inside & (gap <= SHORT_GAP))
    found: Array = np.where(drawn, np.interp(rows, known, curve[known]), low)
    return found


def y_range(t: Array, *curves: Array) -> tuple[float, float]:
    """Where a chart of these curves ends: neither the first second nor single spikes widen it."""
    later = t >= t[0] + SETTLING
    values = np.concatenate([curve[later] if later.sum() > 1 else curve for curve in curves])
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return -LEAST_MARGIN, LEAST_MARGIN
    low, high = np.percentile(values, [SPIKES, 100.0 - SPIKES])
    margin = max(LEAST_MARGIN, 0.25 * (high - low))
    return float(low - margin), float(high + margin)
