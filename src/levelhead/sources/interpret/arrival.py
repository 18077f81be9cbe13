"""Stamps of arrival: the regular clock of a sensor under a latency that varies.

A filter that integrates the rate over differences of such stamps errs by the latency times the change of rate. The
sensor's clock is put back where two statistics, of stamps and of readings, both show that the sensor was regular.

**Stamps.** A latency L_i about a regular grid makes intervals b + L_i - L_(i-1): a long one is followed by a short one
(lag-1 autocorrelation -1/2), and their sums stay bounded. The intervals of a loop that samples when it is done with the
rest are independent, and their sum is a random walk. The variance ratio (A. Lo, C. MacKinlay, Review of Financial
Studies 1, 1988) VR(m) = Var(t_(i+m) - t_i) / (m Var(t_(i+1) - t_i)) is 1 for the walk, with a standard deviation of
√(2(2m-1)(m-1)/(3mn)), and 1/m for independent latencies.

**Readings.** A timer that reads a sensor late, and stamps when it reads, is bounded too, but its stamps are true. Then
a reading x_i differs from its neighbours' prediction of the middle of the grid by x' δ_i, δ_i the same difference of
stamps; where only the stamp is late, it does not differ. The regression of one on the other is β = 1 or 0, and with
normal errors the logarithm of the likelihood ratio is (1 - 2β)/(2σ_β²). The slope x' is measured twice, over two and
four intervals, one the instrument of the other, so that a sensor at rest, whose slopes are noise, proves nothing.
"""

from typing import NamedTuple

import numpy as np

from levelhead.recording import Array, median
from levelhead.sources.interpret.regular_grid import SampleGrid, find_grid, refine_grid

_MIN_ROWS = 256  # rows of a stretch
_UNEVEN = 0.2  # of the median interval, between the 1st and the 99th percentile of intervals; less is even
_PAUSE, _PAUSE_ROWS = 1.0, 32.0  # s, and intervals: a longer step parts stretches, each with a grid of its own
_MIN_LATENCY = 0.08  # of the interval, rms of the latency; with less the stamps are good enough
_SPAN = 32  # intervals whose sum is compared with one
_BOUNDED = _SPAN**-0.5  # the geometric mean of 1 and 1/m, below which sums are bounded
_ROUGHLY = 0.3  # the same while losses are misplaced; with all right it is 0.11 at most, of a walk 0.6 at least
_NULL_SIGMA = 3.0  # below the walk's ratio
_LOST = 0.2  # share of samples lost, beyond which the stamps show no grid
_SPLITS = 4  # times that a stretch is split where its rate may change
_CERTAIN = 10.0  # logarithm of the likelihood ratio
_MIXED = 0.25  # β from which the readings themselves are partly late
_MIN_ON_GRID = 0.8  # of the rows lie on a grid, or the sensor is not regular
_READINGS = 400_000  # rows that are compared, at most
_PROBES, _PROBE = 8, 4096  # parts of a long log that are looked at first, and their rows
_MIN_STEP = 0.2  # of an interval, between stamps where two grids meet


class Restored(NamedTuple):
    """The clock that was put back.

    Attributes:
        t: (n,) s.
        rows: whose stamps were changed.
        jitter: s, rms of their latency beyond the mean.
        lost: samples that are missing between them.
    """

    t: Array
    rows: int
    jitter: float
    lost: int


class _Stretch(NamedTuple):
    begin: int
    end: int
    grid: SampleGrid


class _Sums(NamedTuple):
    """Of the regression of readings on late stamps."""

    cross: float
    square: float
    variance: float


def restore_clock(t: Array, values: Array | None) -> Restored | None:
    """The sensor's own clock under (n,) increasing stamps ``t`` in s; None where they are right.

    ``values`` (n, k) are the readings beside them; without them nothing is known, and None is returned.
    """
    if values is None or len(t) < _MIN_ROWS:
        return None
    steps = np.diff(t)
    low, high = np.quantile(steps, [0.01, 0.99])
    typical = median(steps)
    if high - low < _UNEVEN * typical or not typical > 0.0:
        return None
    if len(t) > 2 * _PROBES * _PROBE and not _is_worth_it(t):
        return None
    edges = np.flatnonzero(steps > max(_PAUSE, _PAUSE_ROWS * float(steps.mean()))) + 1
    stretches: list[_Stretch] = []
    for begin, end in zip([0, *edges.tolist()], [*edges.tolist(), len(t)], strict=True):
        stretches += _bounded(t, begin, end, _SPLITS)
    if sum(one.end - one.begin for one in stretches) < _MIN_ON_GRID * len(t) or not _only_stamps_are_late(
        t, values, stretches
    ):
        return None
    return _join(t, stretches)


def _is_worth_it(t: Array) -> bool:
    """Whether half of some short parts of a long log are bounded, roughly: of a walk none is."""
    starts = np.linspace(0, len(t) - _PROBE, _PROBES).astype(int).tolist()
    ratios = [_variance_ratio(find_grid(t[row : row + _PROBE])) for row in starts]
    return sum(ratio < _ROUGHLY for ratio in ratios) >= _PROBES // 2


def _bounded(t: Array, begin: int, end: int, splits: int) -> list[_Stretch]:
    """The parts of the rows from ``begin`` to ``end`` whose stamps stay within bounds of a grid."""
    if end - begin < _MIN_ROWS:
        return []
    grid = find_grid(t[begin:end])
    if _variance_ratio(grid) < _ROUGHLY:
        grid = refine_grid(t[begin:end], grid)
        if _is_bounded(grid):
            return [_Stretch(begin, end, grid)]
    if splits == 0 or end - begin < 2 * _MIN_ROWS:
        return []
    row = begin + _change(t[begin:end])
    return _bounded(t, begin, row, splits - 1) + _bounded(t, row, end, splits - 1)


def _variance_ratio(grid: SampleGrid) -> float:
    """Variance of the sum of ``_SPAN`` intervals over so many variances of one, about the grid; inf if all are even."""
    late = grid.late
    one, many = late[1:] - late[:-1], late[_SPAN:] - late[:-_SPAN]
    variance = float((one * one).mean())
    return float((many * many).mean()) / (_SPAN * variance) if variance > 0.0 else np.inf


def _is_bounded(grid: SampleGrid) -> bool:
    """Whether stamps are late by so much, and sums of intervals so little off, that a walk is ruled out."""
    n = len(grid.late)
    if not (np.diff(grid.t) > 0.0).all() or grid.number[-1] + 1 - n > _LOST * n:
        return False
    if float((grid.late * grid.late).mean()) < (_MIN_LATENCY * grid.period) ** 2:
        return False
    sigma = (2.0 * (2.0 * _SPAN - 1.0) * (_SPAN - 1.0) / (3.0 * _SPAN * n)) ** 0.5
    limit: float = min(_BOUNDED, 1.0 - _NULL_SIGMA * sigma)
    return _variance_ratio(grid) < limit


def _change(t: Array) -> int:
    """The row at which two straight lines fit (n,) stamps best, by least squares in closed form."""
    n = len(t)
    x = np.arange(n, dtype=np.float64) - 0.5 * n
    y = t - t[0] - np.polyval(np.polyfit(x, t - t[0], 1), x)
    rows = np.arange(_MIN_ROWS, n - _MIN_ROWS + 1)
    sums = [np.concatenate([[0.0], np.cumsum(one)]) for one in (np.ones(n), x, y, x * x, x * y, y * y)]
    error = np.zeros(len(rows))
    slopes, means = [], []
    for parts in ([one[rows] for one in sums], [one[-1] - one[rows] for one in sums]):
        count, sx, sy, xx, xy, yy = parts
        slope = (xy - sx * sy / count) / (xx - sx * sx / count)
        error += yy - sy * sy / count - slope * (xy - sx * sy / count)
        slopes.append(slope)
        means.append((sy - slope * sx) / count)
    best = int(np.argmin(error))
    bend = float(slopes[0][best] - slopes[1][best])
    if bend != 0.0:  # where the lines meet, so that no interval is lost between them
        meet = float(means[1][best] - means[0][best]) / bend + 0.5 * n
        if abs(meet - rows[best]) < 0.25 * _MIN_ROWS:
            return int(np.clip(np.ceil(meet), rows[0], rows[-1]))
    return int(rows[best])


def _only_stamps_are_late(t: Array, values: Array, stretches: list[_Stretch]) -> bool:
    """Whether the readings are those of the grid, by the regression of all columns."""
    cross = square = variance = 0.0
    left = _READINGS
    for begin, end, grid in stretches:
        count = min(end - begin, left)
        left -= count
        if count < _MIN_ROWS:
            break
        late = grid.late[:count]
        whole = np.diff(grid.number[:count]) == 1
        inner = whole[:-3] & whole[1:-2] & whole[2:-1] & whole[3:]
        for column in np.asarray(values[begin : begin + count], dtype=np.float64).T:
            sums = _regress(column, late / grid.period, inner)
            cross, square, variance = cross + sums.cross, square + sums.square, variance + sums.variance
    if not square > 0.0 or variance <= 0.0:
        return False
    beta, beta_variance = cross / square, variance / square**2
    return beta < _MIXED and (1.0 - 2.0 * beta) / (2.0 * beta_variance) > _CERTAIN


def _regress(x: Array, late: Array, inner: np.ndarray) -> _Sums:
    """Sums over the rows 2 … n-3 that ``inner`` marks as free of losses beside them; ``late`` in intervals.

    The neighbours' prediction is the cubic through them, (-1, 4, 4, -1)/6. The sums are divided by the variance of the
    rest, so that columns of any unit add up.
    """
    residual = x[2:-2] - (4.0 * (x[1:-3] + x[3:-1]) - x[:-4] - x[4:]) / 6.0
    delta = late[2:-2] - (4.0 * (late[1:-3] + late[3:-1]) - late[:-4] - late[4:]) / 6.0
    near, far = 0.5 * (x[3:-1] - x[1:-3]), 0.25 * (x[4:] - x[:-4])
    use = inner & np.isfinite(residual) & np.isfinite(near + far)
    residual, delta, near, far = residual[use], delta[use], near[use], far[use]
    if len(residual) < _MIN_ROWS // 2:
        return _Sums(0.0, 0.0, 0.0)
    instrument, size = far * delta, near * delta
    cross, square = float(instrument @ residual), float(instrument @ size)
    if not square > 0.0:
        return _Sums(0.0, 0.0, 0.0)
    left = residual - cross / square * size
    scale = float(left @ left) / len(left)
    if scale == 0.0:
        return _Sums(0.0, 0.0, 0.0)
    weighted = instrument * left
    return _Sums(cross / scale, square / scale, float(weighted @ weighted) / scale**2)


def _join(t: Array, stretches: list[_Stretch]) -> Restored | None:
    """The stamps with the grids of the stretches in place; None if time would not increase from one to the next."""
    made = t.copy()
    for begin, end, grid in stretches:
        made[begin:end] = grid.t
    for begin, end, grid in stretches:
        around = np.diff(made[max(begin - 1, 0) : begin + 1]), np.diff(made[end - 1 : end + 1])
        if any((one < _MIN_STEP * grid.period).any() for one in around):
            return None
    late = np.concatenate([one.grid.late for one in stretches])
    lost = sum(int(one.grid.number[-1]) + 1 - len(one.grid.number) for one in stretches)
    return Restored(made, len(late), float(np.sqrt((late * late).mean())), lost)
