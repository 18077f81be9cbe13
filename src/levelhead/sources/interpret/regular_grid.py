"""The regular grid that stamps of arrival lie on: the sensor's interval, samples lost, its clock's wander.

The model is that of passive synchronisation (E. Olson, A passive solution to the sensor synchronization problem, IROS
2010, section III): the stamp is t_i = a + b k_i + w(k_i) + L_i, where k_i is the number of the sample, b the sensor's
interval, w the slow wander of its clock and L_i the latency. The least latencies of windows show how the grid goes on,
whatever the others are (S. Moon, P. Skelly, D. Towsley, Estimation and removal of clock skew from network delay
measurements, INFOCOM 1999): the least of n exponential latencies of mean τ lies τ/n above the bound.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array

_BLOCK = 16  # rows whose least latency is one point of the interval's estimate
_LEVEL_TIME, _LEVEL_ROWS = 1.0, (20, 1000)  # s, and rows: window of a level
_ROUNDING = 0.2  # of an interval, by which a level may be off
_EARLY, _POINTS, _PART = 0.2, 100, 10_000  # quantile of stamps that is their level; of so many; rows at a time
_IN_STEP, _BLOCKS, _TRIALS = 1000, 16, 60  # rows of a block, blocks; quarters of their resolution to either side
_MIN_POWER_RATIO = 4.0  # times the power of stamps that are not in step
_KNOTS = 20.0  # s between knots of the wander; a warming oscillator's 10 ppm/s bends by 0.5 ms in between
_STIFF = 200.0  # s between them while samples are numbered, so that a wrong number bends nothing
_CLIP, _ROUNDS = 4.0, 3  # robust σ at which a latency is clipped, refits
_PASSES = 8  # over the numbers, at most
_REACH, _BIN = 3, 0.1  # samples by which numbers are mended at once; intervals, of the histogram of latencies


class SampleGrid(NamedTuple):
    """A regular clock under stamps.

    Attributes:
        number: (n,) number of each sample, from 0; it leaves out those that were lost.
        period: s, between samples.
        t: (n,) s, the grid under the stamps, in the mean as late as they are.
        late: (n,) s, the stamps less the grid.
    """

    number: NDArray[np.int64]
    period: float
    t: Array
    late: Array


def find_grid(t: Array) -> SampleGrid:
    """A grid under (n,) increasing stamps ``t`` in s, n at least 48; numbers may be wrong where samples are lost."""
    rough = _period(t)
    period = _in_step(t, rough)
    number = _number(t, period)
    for _ in range(_ROUNDS if period == rough else 0):
        period = _slope(t, number, period)
        number = _number(t, period)
    return _fit(t, number, period, _STIFF)


def refine_grid(t: Array, grid: SampleGrid) -> SampleGrid:
    """The grid with the likeliest numbers and with the wander of its clock; ``grid`` is one that was found."""
    number, period = grid.number, grid.period
    for _ in range(_PASSES):
        period = _slope(t, number, period)
        likely = _likeliest(_fit(t, number, period, _STIFF))
        if np.array_equal(likely, number):
            break
        number = likely
    return _fit(t, number, period, _KNOTS)


def _slope(t: Array, number: NDArray[np.int64], period: float) -> float:
    """s, between samples by least squares; ``period`` where that is far from it."""
    slope = float(np.polyfit(number, t - t[0], 1)[0])
    return slope if 0.9 * period < slope < 1.1 * period else period


def _fit(t: Array, number: NDArray[np.int64], period: float, knots: float) -> SampleGrid:
    even = number.astype(np.float64) * period
    fitted = t[0] + _wander(even, t - t[0] - even, knots) + even
    return SampleGrid(number, period, fitted, t - fitted)


def _period(t: Array) -> float:
    """s, the commonest interval over a block, from least latency to least latency."""
    rows = np.arange(len(t))
    blocks = len(t) // _BLOCK
    period = _commonest((t[_BLOCK:] - t[:-_BLOCK]) / _BLOCK)
    for _ in range(3):
        early = (t - period * rows)[: blocks * _BLOCK].reshape(blocks, _BLOCK).min(axis=1)
        period += _commonest(np.diff(early) / _BLOCK)
    return period


def _in_step(t: Array, period: float) -> float:
    """s, the interval near ``period`` at which stamps are in step, block by block; ``period`` where at none.

    The power of exp(2πi t / b) (the Schuster periodogram of events): lost samples leave it as it is.
    """
    size = min(_IN_STEP, len(t))
    blocks = t[: len(t) // size * size].reshape(-1, size)[:_BLOCKS]
    offsets = blocks - blocks[:, :1]
    trials = period * (1.0 + np.arange(-_TRIALS, _TRIALS + 1) / (4.0 * size))
    power = np.array([float((np.abs(np.exp(2j * np.pi / one * offsets).sum(axis=1)) ** 2).mean()) for one in trials])
    return float(trials[int(np.argmax(power))]) if power.max() > _MIN_POWER_RATIO * size else period


def _commonest(values: Array) -> float:
    """Mean of the shortest interval that holds a third of the values (P. Rousseeuw, J. Am. Stat. Assoc. 79, 1984: half
    of them; here two thirds of the blocks may hold a loss)."""
    ordered = np.sort(values)
    part = len(ordered) // 3 + 1
    first = int(np.argmin(ordered[part - 1 :] - ordered[: len(ordered) - part + 1]))
    return float(ordered[first : first + part].mean())


def _number(t: Array, period: float) -> NDArray[np.int64]:
    """(n,) numbers of the samples: where the level of stamps rises by an interval and stays, a sample was lost."""
    window = min(int(np.clip(round(_LEVEL_TIME / period), *_LEVEL_ROWS)), len(t) // 3)
    level = _level_ahead(t - t[0] - period * np.arange(len(t)), window) / period
    before = np.concatenate([np.full(window, level[0]), level[:-window]])
    lost = [0] * len(t)
    for row, risen in enumerate((level - before).tolist()):
        known = lost[row - 1] if row else 0
        more = risen - (known - (lost[row - window] if row >= window else 0))
        lost[row] = known + int(more + _ROUNDING) if more > 1.0 - _ROUNDING else known
    return np.arange(len(t), dtype=np.int64) + np.array(lost, dtype=np.int64)


def _level_ahead(values: Array, window: int) -> Array:
    """(n,) the ``_EARLY`` quantile of each value and those after it, ``window`` in all; of the last ones the same."""
    views = np.lib.stride_tricks.sliding_window_view(values, window)[:, :: max(1, window // _POINTS)]
    place = int(_EARLY * views.shape[1])
    parts = [np.partition(views[i : i + _PART], place, axis=1)[:, place] for i in range(0, len(views), _PART)]
    found = np.concatenate(parts)
    level: Array = np.concatenate([found, np.full(len(values) - len(found), found[-1])])
    return level


def _likeliest(grid: SampleGrid) -> NDArray[np.int64]:
    """(n,) the likeliest numbers: latencies of the density that the grid's have, losses as rare as they were found.

    The path of most likelihood through the number of samples lost so far, which only rises (A. Viterbi, IEEE Trans.
    Information Theory 13, 1967). It holds the numbers near those of the grid, at most ``_REACH`` away.
    """
    late = grid.late / grid.period
    if float(np.abs(late).max()) < 0.5:
        return grid.number
    low, high = float(late.min()) - _REACH - 1.0, float(late.max()) + _REACH + 1.0
    bins = int(np.clip((high - low) / _BIN, 8, 100_000))
    counts = np.histogram(late, bins, (low, high))[0] + 0.0
    counts = np.convolve(counts, [0.25, 0.5, 0.25], "same")
    cost = -np.log((counts + 0.5 / bins) / (len(late) + 0.5))
    shifts = np.arange(-_REACH, _REACH + 1)
    place = ((late[:, None] - shifts - low) * (bins / (high - low))).astype(np.intp)
    emission = cost[np.clip(place, 0, bins - 1)].tolist()
    rise = np.diff(grid.number, prepend=grid.number[0] - 1) - 1
    lost = -np.log((float((rise > 0).sum()) + 1.0) / (len(late) + 2.0))
    states = len(shifts)
    best = [0.0 if shift == 0 else lost for shift in shifts.tolist()]
    steps: list[bytes] = []
    for row, risen in enumerate(rise.tolist()):
        # state s means number + s - _REACH; before this row the lost ones were risen fewer
        coming, origin, least, at = [], [], np.inf, 0
        reached = 0
        for state in range(states):
            free = state + risen  # the state before, if nothing more was lost
            while reached < min(free, states):
                if best[reached] < least:
                    least, at = best[reached], reached
                reached += 1
            stay = best[free] if free < states else np.inf
            if stay <= least + lost:
                coming.append(stay)
                origin.append(free)
            else:
                coming.append(least + lost)
                origin.append(at)
        best = [one + two for one, two in zip(coming, emission[row], strict=True)]
        steps.append(bytes(origin))
    state = int(np.argmin(best))
    found = np.empty(len(late), dtype=np.int64)
    for row in range(len(late) - 1, -1, -1):
        found[row] = state
        state = steps[row][state]
    number: NDArray[np.int64] = grid.number + found - _REACH
    number -= number[0]
    return number


def _wander(x: Array, late: Array, interval: float) -> Array:
    """(n,) straight lines between knots, ``interval`` s apart, through ``late`` over ``x``: clipped least squares."""
    count = max(1, round(float(x[-1] - x[0]) / interval))
    place = (x - x[0]) * (count / float(x[-1] - x[0]))
    cell = np.minimum(place.astype(np.intp), count - 1)
    u = place - cell
    left, right = 1.0 - u, u
    diagonal = _sums(cell, left * left, count + 1) + _sums(cell + 1, right * right, count + 1)
    beside = _sums(cell, left * right, count)
    diagonal += 1e-9 * float(diagonal.max())
    values, fitted = late, np.zeros(len(late))
    for _ in range(_ROUNDS):
        side = _sums(cell, left * values, count + 1) + _sums(cell + 1, right * values, count + 1)
        knots = _solve(diagonal, beside, side)
        fitted = left * knots[cell] + right * knots[cell + 1]
        off = late - fitted
        middle = float(np.median(off))
        reach = _CLIP * 1.4826 * float(np.median(np.abs(off - middle)))
        values = fitted + np.clip(off, middle - reach, middle + reach)
    return fitted


def _sums(cell: NDArray[np.intp], weights: Array, count: int) -> Array:
    """(count,) sums of the weights in each cell."""
    found: Array = np.bincount(cell, weights, count).astype(np.float64)
    return found


def _solve(diagonal: Array, beside: Array, side: Array) -> Array:
    """Solves a symmetric tridiagonal system by elimination."""
    d, b = diagonal.tolist(), side.tolist()
    e = beside.tolist()
    for i in range(1, len(d)):
        factor = e[i - 1] / d[i - 1]
        d[i] -= factor * e[i - 1]
        b[i] -= factor * b[i - 1]
    b[-1] /= d[-1]
    for i in range(len(d) - 2, -1, -1):
        b[i] = (b[i] - e[i] * b[i + 1]) / d[i]
    return np.array(b)
