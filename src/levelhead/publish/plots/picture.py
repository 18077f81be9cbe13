"""A picture of panels over one axis of time, as data."""

from collections.abc import Iterator, Sequence
from itertools import repeat
from typing import NamedTuple

import numpy as np

from levelhead.recording import Array

QUARTER = 90.0  # degrees between two marks of an angle that turns far


class Line(NamedTuple):
    """Points joined by straight lines; NaN breaks it."""

    x: Array
    y: Array
    color: str
    width: float  # points
    label: str = ""
    dashed: bool = False


class Band(NamedTuple):
    """The area between two lines; NaN breaks it."""

    x: Array
    low: Array
    high: Array
    color: str
    alpha: float
    label: str = ""


class Bars(NamedTuple):
    """A row of bars, each from its start and so long, with words beside the row."""

    spans: Sequence[tuple[float, float]]
    color: str
    words: str


class Panel(NamedTuple):
    """The contents of one rectangle: marks from back to front, or rows of bars."""

    title: str
    ylabel: str
    marks: Sequence[Line | Band]
    limits: tuple[float, float] | None = None  # of y; None: those of the lines
    angle: bool = False  # degrees: marked at quarter turns where there are several
    rows: Sequence[Bars] = ()
    height: float = 1.0  # share among those in its column


class Picture(NamedTuple):
    """Panels over one axis of time, row by row in so many columns."""

    title: str
    panels: Sequence[Panel]
    limits: tuple[float, float]  # of x
    width: float  # inches
    height: float
    columns: int = 1
    xlabel: str = "time [s]"


def y_limits(panel: Panel) -> tuple[float, float]:
    """The part of the y axis that a panel shows."""
    if panel.limits is not None:
        return panel.limits
    ends = [end for mark in panel.marks for end in _ends(mark)]
    if not ends:
        return 0.0, 1.0
    low, high = min(ends), max(ends)
    room = 0.05 * (high - low) or 0.05 * abs(high) or 0.05
    return low - room, high + room


def _ends(mark: Line | Band) -> Iterator[float]:
    for values in (mark.y,) if isinstance(mark, Line) else (mark.low, mark.high):
        finite = values[np.isfinite(values)]
        if len(finite):
            yield from (float(finite.min()), float(finite.max()))


def ticks(low: float, high: float, most: int, angle: bool = False) -> tuple[Array, list[str]]:
    """At most so many round numbers between two, and how they are written."""
    if angle and 180.0 < high - low <= 900.0:
        step, digits = QUARTER, 0
    else:
        rough = (high - low) / max(most, 1)
        power = 10.0 ** np.floor(np.log10(rough))
        step = next((power * k for k in (1.0, 2.0, 2.5, 5.0) if power * k >= rough * (1.0 - 1e-9)), 10.0 * power)
        digits = next(k for k in range(20) if abs(round(step, k) - step) < 1e-6 * step)
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    at = step * np.arange(first, last + 1.0)
    at[np.abs(at) < 1e-9 * step] = 0.0
    texts = map(format, at.tolist(), repeat(f".{digits}f"))
    return at, [text.replace("-", "−") for text in texts]
