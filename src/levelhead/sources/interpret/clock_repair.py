"""Stamps that do not increase: repeated rows, bursts with one stamp, wrong single stamps, clocks that began again."""

from bisect import bisect_left
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.table import Column

_REPEATS = 0.9  # share of equal stamps whose rows repeat the row before, from which they are duplicates
_GLITCH_SHARE, _GLITCH_RUN = 0.02, 20  # wrong single stamps: of all rows, and rows in a row
_GAP = 4.0  # median intervals from which a step is a gap, across which no line is fitted
_BURST = 0.2  # of the mean interval, below which a sample follows at once: it came in the burst of the one before
_BURST_SHARE, _BURST_TIME = 0.5, 0.15  # of the samples do so at least, in this share of the time at most
_LARGEST_BURST, _FEWEST_BURSTS = 64, 10  # samples; more are a logger that pauses
_SIZES = (2.0**16, 2.0**24, 2.0**31, 2.0**32, 2.0**32 / 1e3, 2.0**32 / 1e6)  # of counters; the last two in ms and s
_MIXED = 0.05  # share of the rows by which jitter may put a stamp out of its order; a clock that begins again mixes all
_STEADY = 1.1  # times the jitter about the line: that about a moving mean must be less for the line not to be taken
_WANDER = 1.5  # s; a clock whose fraction of a second is not the second's own stays as near to a line


class Repair(NamedTuple):
    """Stamps that increase.

    Attributes:
        stamps: (m,) in the unit that they had.
        rows: which rows are kept; None: all.
        conclusions: the repairs; their facts lack the name of the column.
    """

    stamps: Column
    rows: NDArray[np.intp] | None = None
    conclusions: Sequence[Conclusion] = ()


def repair_stamps(stamps: Column, values: Array | None, session: int | None = None) -> Repair:
    """(n,) ``stamps`` as increasing ones; ``values`` (n, k) are the numbers beside them."""
    found: list[Conclusion] = []
    rows = np.arange(len(stamps))
    stamps, overflow = _count_on(stamps)
    if overflow:
        found.append(Conclusion("t.stamps", "overflow", "counted on", Basis.NUMBERS, {"size": overflow}))
        if (stamps[1:] > stamps[:-1]).all():
            return Repair(stamps, None, found)
    steps = np.diff(stamps)
    if (steps < 0).any():
        wrong = _outside(stamps)
        if 0 < len(wrong) <= _GLITCH_SHARE * len(stamps) and _longest_run(wrong) <= _GLITCH_RUN:
            right = np.setdiff1d(rows, wrong)
            first = stamps[0]
            filled = np.interp(rows, right, (stamps[right] - first).astype(np.float64))
            stamps = filled + float(first) if abs(float(first)) < 1e9 else _sum(first, filled)
            facts = {"first": int(wrong[0])}
            found.append(Conclusion("t.stamps", "out_of_order", len(wrong), Basis.NUMBERS, facts))
        elif (line := _fit_wandering_clock(stamps)) is not None:
            back = int((steps < 0).sum())
            away = float(np.abs(line - (stamps - stamps[0])).max())
            stamps = line + float(stamps[0])
            found.append(Conclusion("t.stamps", "wandering", back, Basis.NUMBERS, {"away": away}))
            return Repair(stamps, None, found)
        elif session is None and (clock := _fit_jitter(stamps)) is not None:
            jitter = float((stamps - stamps[0] - clock).std())
            back = int((steps < 0).sum())
            found.append(Conclusion("t.stamps", "jitter", back, Basis.NUMBERS, {"jitter": jitter}))
            return Repair(clock + float(stamps[0]), None, found)
        else:
            rows, chosen = _session(stamps, session)
            stamps, values = stamps[rows], None if values is None else values[rows]
            found.append(chosen)
    if values is not None and (marks := _marks(stamps, values)).any():
        rows, stamps, values = rows[~marks], stamps[~marks], values[~marks]
        found.append(Conclusion("t.rows", "marks", int(marks.sum()), Basis.NUMBERS))
    equal = np.flatnonzero(np.diff(stamps) == 0) + 1
    bursts = first_of_bursts(stamps)
    if bursts is not None:
        count = len(np.unique(bursts))
        stamps = _spread_groups(bursts)
        found.append(Conclusion("t.stamps", "bursts", count, Basis.NUMBERS, {"size": len(stamps) / count}))
    elif len(equal):
        same = values is not None and float((values[equal] == values[equal - 1]).all(axis=1).mean()) > _REPEATS
        if same:
            keep = np.setdiff1d(np.arange(len(stamps)), equal)
            rows, stamps = rows[keep], stamps[keep]
            found.append(Conclusion("t.rows", "repeated", len(equal), Basis.NUMBERS))
        else:
            stamps = _spread_groups(stamps)
            found.append(Conclusion("t.stamps", "equal", len(equal), Basis.NUMBERS))
    return Repair(stamps, None if len(rows) == len(steps) + 1 else rows, found)


def _marks(stamps: Column, values: Array) -> NDArray[np.bool_]:
    """(n,) whether a row holds no reading and shares its stamp with another: a mark of an event, not a sample."""
    equal = stamps[1:] == stamps[:-1]
    shared = np.concatenate([equal, [False]]) | np.concatenate([[False], equal])
    marks = np.zeros(len(stamps), bool)
    marks[shared] = np.isnan(values[shared]).all(axis=1)
    return marks


def _count_on(stamps: Column) -> tuple[Column, float]:
    """(stamps, size) of a counter that overflows, such as Arduino's micros() after 2^32; size 0: it does not."""
    steps = np.diff(stamps)
    back = np.flatnonzero(steps < 0)
    if not len(back) or not (steps > 0).any():
        return stamps, 0.0
    typical = float(np.median(steps[steps > 0]))
    for size in _SIZES:
        over = steps[back] + size  # the step, if the counter is that large
        if (over > 0.0).all() and (over < _GAP * typical).all() and float(stamps.max()) < size:
            turns = np.concatenate([[0], np.cumsum(steps < 0)])
            whole = stamps.dtype.kind == "i" and float(size).is_integer()
            return stamps + (turns * int(size) if whole else turns * float(size)), size
    return stamps, 0.0


def _sum(first: np.generic, offsets: Array) -> Column:
    """Stamps of whole nanoseconds stay whole."""
    if isinstance(first, np.integer):
        whole: Column = int(first) + np.rint(offsets).astype(np.int64)
        return whole
    return float(first) + offsets


def _outside(stamps: Column) -> NDArray[np.intp]:
    """The rows that the longest run of stamps that do not decrease leaves out (patience sorting)."""
    tails: list[float] = []
    at: list[int] = []
    before = np.full(len(stamps), -1, dtype=np.intp)
    for i, value in enumerate(stamps.tolist()):
        k = bisect_left(tails, value)
        while k < len(tails) and tails[k] == value:
            k += 1
        if k == len(tails):
            tails.append(value)
            at.append(i)
        else:
            tails[k], at[k] = value, i
        before[i] = at[k - 1] if k else -1
    inside = np.zeros(len(stamps), dtype=np.bool_)
    i = at[-1]
    while i >= 0:
        inside[i] = True
        i = int(before[i])
    return np.flatnonzero(~inside)


def _longest_run(rows: NDArray[np.intp]) -> int:
    breaks = np.flatnonzero(np.diff(rows) > 1)
    edges = np.concatenate([[-1], breaks, [len(rows) - 1]])
    return int(np.diff(edges).max())


def _fit_wandering_clock(stamps: Column) -> Array | None:
    """(n,) a straight line through stamps that step back and catch up again, from 0; None if they do not.

    The unit is not known here, so a step back must be small beside the whole and be made good by a step forward.
    """
    offsets = (stamps - stamps[0]).astype(np.float64)
    steps = np.diff(offsets)
    typical = float(np.median(steps[steps > 0]))
    back, leap = steps < 0, steps > _GAP * typical
    rows = np.arange(len(offsets))
    slope, start = np.polyfit(rows, offsets, 1)
    away = np.abs(offsets - (start + slope * rows)).max()
    largest = float(-steps[back].min())
    if slope <= 0 or back.sum() < 3 or leap.sum() < 0.5 * back.sum():
        return None
    if away > 2.0 * largest or away > 0.1 * float(offsets[-1] - offsets[0]):
        return None
    line: Array = slope * rows
    return line


def _fit_jitter(stamps: Column) -> Array | None:
    """(n,) the clock behind stamps that jitter by more than an interval, from 0; None if they do something else.

    Jitter mixes stamps with their neighbours only. The clock is a straight line through them, or where it is not even
    their moving mean, which a few lost samples or a drift do not disturb.
    """
    offsets = (stamps - stamps[0]).astype(np.float64)
    rows = np.arange(len(offsets))
    reach = int(np.abs(np.argsort(offsets, kind="stable") - rows).max())
    if reach > _MIXED * len(rows) or (np.diff(offsets) < 0).mean() < _GLITCH_SHARE:
        return None
    slope, start = np.polyfit(rows, offsets, 1)
    line: Array = start + slope * rows
    clock = _moving_line(offsets, 2 * reach + 1)
    if (offsets - line).std() < _STEADY * (offsets - clock).std():
        clock = line
    return clock if (np.diff(clock) > 0).all() else None


def _moving_line(values: Array, reach: int) -> Array:
    """(n,) the straight line through ``reach`` values on each side of every value, at that value; fewer at the ends."""
    rows = np.arange(len(values), dtype=np.float64)
    low = np.maximum(np.arange(len(values)) - reach, 0)
    high = np.minimum(np.arange(len(values)) + reach + 1, len(values))
    count = (high - low).astype(np.float64)

    def total(terms: Array) -> Array:
        sums = np.concatenate([[0.0], np.cumsum(terms)])
        made: Array = sums[high] - sums[low]
        return made

    x, y = total(rows) / count, total(values) / count
    slope = (total(rows * values) / count - x * y) / np.maximum(total(rows * rows) / count - x * x, 1e-12)
    made: Array = y + slope * (rows - x)
    return made


def _session(stamps: Column, wanted: int | None) -> tuple[NDArray[np.intp], Conclusion]:
    """(rows of one part, conclusion) of a clock that began again."""
    from levelhead.errors import LevelheadError

    starts = np.concatenate([[0], np.flatnonzero(np.diff(stamps) < 0) + 1, [len(stamps)]])
    sizes = np.diff(starts)
    if wanted is not None and not 1 <= wanted <= len(sizes):
        raise LevelheadError(f"there are {len(sizes)} sessions; there is no session {wanted}")
    k = int(np.argmax(sizes)) if wanted is None else wanted - 1
    reason, basis = ("longest", Basis.NUMBERS) if wanted is None else ("hint", Basis.HINT)
    facts = {"sizes": sizes.tolist(), "rows": starts[:-1].tolist()}
    chosen = Conclusion("t.session", reason, k + 1, basis, facts, {"session": k + 1})
    return np.arange(starts[k], starts[k + 1]), chosen


def first_of_bursts(stamps: Column) -> Column | None:
    """(n,) for each sample the first stamp of its burst; None: samples do not come in bursts.

    A radio or a serial port hands over some samples at once; a program that stamps them as it gets them writes steps
    of next to nothing, and one long step from burst to burst. A logger that pauses writes long stretches instead.
    """
    steps = np.diff((stamps - stamps[0]).astype(np.float64))
    if len(steps) == 0 or not (steps > 0).any():
        return None
    together = steps < _BURST * float(steps.mean())
    apart = steps[~together]
    if len(apart) < _FEWEST_BURSTS or together.mean() < _BURST_SHARE or not steps[together].any():
        return None
    low, high = np.percentile(apart, [25, 75])
    number = np.concatenate([[0], np.cumsum(~together)])
    if (
        high > 2.0 * low
        or steps[together].sum() > _BURST_TIME * steps.sum()
        or np.percentile(np.bincount(number), 90) > _LARGEST_BURST
    ):
        return None
    begin = np.concatenate([[0], np.flatnonzero(~together) + 1])
    first: Column = stamps[begin][number]
    return first


def _spread_groups(stamps: Column) -> Column:
    """Stamps that groups of samples share, spread by straight lines between gaps."""
    first = stamps[0]
    offsets = (stamps - first).astype(np.float64)
    begin = np.concatenate([[0], np.flatnonzero(np.diff(offsets) > 0) + 1])
    group = offsets[begin]
    if len(begin) < 3:
        return _sum(first, offsets + 1e-6 * np.arange(len(offsets)))
    step = float(np.median(np.diff(group)))
    rare = len(begin) > (1.0 - _MIXED) * len(offsets)  # most samples have a stamp of their own, which stays
    edges = np.concatenate([[0], np.flatnonzero(np.diff(group) > _GAP * step) + 1, [len(begin)]])
    spread = np.empty(len(offsets))
    last = -np.inf
    for a, b in pairwise(edges.tolist()):
        end = begin[b] if b < len(begin) else len(offsets)
        rows = np.arange(begin[a], end)
        if b - a >= 3 and not rare:
            slope, start = np.polyfit(begin[a:b], group[a:b], 1)
            line = start + slope * rows
            off = np.abs(line[begin[a:b] - begin[a]] - group[a:b]).max()
        else:
            off, slope, line = np.inf, 0.0, np.zeros(len(rows))
        if off > _WANDER * step or slope <= 0:
            line = _within(offsets[rows], begin[a:b] - begin[a], step)
        line = line + max(0.0, last + 1e-9 * step - line[0]) if len(line) else line
        spread[rows] = line
        last = line[-1]
    return _sum(first, spread)


def _within(offsets: Array, begin: NDArray[np.intp], step: float) -> Array:
    """Each group's samples evenly between its stamp and the next one."""
    size = np.diff(np.concatenate([begin, [len(offsets)]]))
    stamps = offsets[begin]
    room = np.minimum(np.diff(np.concatenate([stamps, [stamps[-1] + step]])), 2.0 * step)
    number = np.arange(len(offsets)) - np.repeat(begin, size)
    spread: Array = np.repeat(stamps, size) + number * np.repeat(room / size, size)
    return spread
