"""Long signals as lines and bands: gaps stay gaps, wraps are not crossed, spikes survive the thinning."""

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BUCKETS = 1200  # about as many as there are pixels from left to right
STRETCH = 250_000  # samples that are in memory at a time for a picture
LONG_GAP = 10.0  # sample intervals without a sample after which a line is broken


class Groups(NamedTuple):
    """Consecutive finite samples that one bucket of pixels holds and no break divides.

    Attributes:
        rows: (m,) indices of the finite samples.
        starts: (k,) where in ``rows`` each group begins.
        broken: (k,) whether the line is broken before the group.
    """

    rows: NDArray[np.intp]
    starts: NDArray[np.intp]
    broken: NDArray[np.bool_]


def groups(t: Array, y: Array, period: float = 0.0, buckets: int = BUCKETS) -> Groups:
    """Groups of the samples (t, y); breaks are NaN, gaps in time and, on a circle of ``period``, jumps past half of it.

    With few samples every one is a group of its own.
    """
    rows = np.flatnonzero(np.isfinite(y))
    if len(rows) < 2:
        return Groups(rows, np.arange(len(rows)), np.zeros(len(rows), bool))
    steps = np.diff(t[rows])
    gap = (np.diff(rows) > 1) | (steps > LONG_GAP * np.median(steps))
    if period > 0.0:
        gap |= np.abs(np.diff(y[rows])) > 0.5 * period
    if len(rows) <= 3 * buckets:
        new = np.ones(len(gap), bool)
    else:
        new = gap | (np.diff(np.floor((t[rows] - t[0]) * (buckets / (t[-1] - t[0])))) > 0)
    starts = np.concatenate([[0], np.flatnonzero(new) + 1])
    return Groups(rows, starts, np.concatenate([[False], gap[new]]))


def envelope(t: Array, y: Array, period: float = 0.0, buckets: int = BUCKETS) -> tuple[Array, Array]:
    """A line that looks like (t, y) with at most about two points per bucket: the least and the greatest value of each.

    NaN in the result breaks the line.
    """
    found = groups(t, y, period, buckets)
    times, values = t[found.rows], y[found.rows]
    if len(found.starts) == len(times):
        return _break_curve(times, found.broken), _break_curve(values, found.broken)
    ends = np.concatenate([found.starts[1:], [len(times)]]) - 1
    low, high = np.minimum.reduceat(values, found.starts), np.maximum.reduceat(values, found.starts)
    rising = values[ends] >= values[found.starts]
    x = np.stack([times[found.starts], times[ends]], axis=1).reshape(-1)
    pair = np.stack([np.where(rising, low, high), np.where(rising, high, low)], axis=1).reshape(-1)
    broken = np.stack([found.broken, np.zeros_like(found.broken)], axis=1).reshape(-1)
    return _break_curve(x, broken), _break_curve(pair, broken)


def _break_curve(values: Array, before: NDArray[np.bool_]) -> Array:
    return np.insert(values, np.flatnonzero(before), np.nan)


def curve(axes: "Axes", t: Array, y: Array, period: float = 0.0, **style: Any) -> None:
    """Draw (t, y) as a line through its envelope."""
    axes.plot(*envelope(t, y, period), solid_joinstyle="round", **style)


def area(
    t: Array, centre: Array, half: Array, period: float = 0.0, buckets: int = BUCKETS
) -> tuple[Array, Array, Array]:
    """centre ± half as (x, low, high), broken by NaN where the line of ``centre`` is; empty if there is none."""
    found = groups(t, np.where(np.isfinite(half), centre, np.nan), period, buckets)
    if not len(found.rows):
        return (np.empty(0),) * 3
    low = np.minimum.reduceat((centre - half)[found.rows], found.starts)
    high = np.maximum.reduceat((centre + half)[found.rows], found.starts)
    x = t[found.rows][found.starts]
    x, low, high = (_break_curve(values, found.broken) for values in (x, low, high))
    return x, low, high


def stretches(t: Array) -> Iterator[tuple[slice, int]]:
    """Rows in stretches, with the buckets of each by its time; a stretch begins with the last row of the one before."""
    for first in range(0, max(len(t) - 1, 1), STRETCH):
        rows = slice(first, min(first + STRETCH + 1, len(t)))
        whole = len(t) <= STRETCH + 1
        share = 1.0 if whole else float((t[rows.stop - 1] - t[first]) / (t[-1] - t[0]))
        yield rows, max(round(BUCKETS * share), 1)


def join(parts: Sequence[tuple[Array, ...]], connected: list[bool]) -> tuple[Array, ...]:
    """Curves of stretches as one; broken where the row that two of them share has no value."""
    if len(parts) == 1:
        return parts[0]
    gap = np.full(1, np.nan)
    pieces = [
        part if good else tuple(np.append(one, gap) for one in part)
        for part, good in zip(parts, connected, strict=True)
    ]
    return tuple(np.concatenate(columns) for columns in zip(*pieces, strict=True))


def envelope_of(t: Array, values: Callable[[slice], Array]) -> tuple[Array, Array]:
    """``envelope`` of a signal that is computed stretch by stretch."""
    parts: list[tuple[Array, ...]] = []
    connected = []
    for rows, buckets in stretches(t):
        y = values(rows)
        parts.append(envelope(t[rows], y, buckets=buckets))
        connected.append(bool(np.isfinite(y[-1])))
    x, line = join(parts, connected)
    return x, line


def band(axes: "Axes", t: Array, centre: Array, half: Array, period: float = 0.0, **style: Any) -> None:
    """Draw centre ± half as an area."""
    outline = area(t, centre, half, period)
    if len(outline[0]):
        axes.fill_between(*outline, linewidth=0, **style)


def flagged_ranges(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of every unbroken run of True."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return list(zip(np.flatnonzero(edges == 1).tolist(), (np.flatnonzero(edges == -1) - 1).tolist(), strict=True))
