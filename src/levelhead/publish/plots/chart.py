"""A picture of panels over one axis of time, as data: who writes PNG draws it by Pillow, SVG and PDF by matplotlib.

matplotlib takes 0.6 s to be imported and as long again for seven panels, more than all the rest of ``levelhead fuse``;
``raster`` draws the same panels in a tenth of that.
"""

from collections.abc import Iterator, Sequence
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from levelhead.publish.plots import style
from levelhead.recording import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
    """What is drawn into one rectangle: marks from back to front, or rows of bars."""

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


def draw(picture: Picture, path: str | Path) -> None:
    """Write the picture, whole or not at all, in the format that the suffix says.

    Raises:
        LevelheadError: nothing to draw with, another suffix, or a folder that is missing or cannot be written.
    """
    if Path(path).suffix.lower() == ".png":
        from levelhead.publish.plots.raster import write_png

        write_png(picture, Path(path))
    else:
        _draw_vectors(picture, path)


def _draw_vectors(picture: Picture, path: str | Path) -> None:
    made = style.figure(picture.width, picture.height, picture.title)
    rows = -(-len(picture.panels) // picture.columns)
    heights = [panel.height for panel in picture.panels[:: picture.columns]]
    grid = made.subplots(
        rows, picture.columns, sharex=True, squeeze=False, gridspec_kw={"height_ratios": heights}
    ).reshape(-1)
    for panel, axes in zip(picture.panels, grid, strict=False):
        _fill(axes, panel)
        axes.set_xlim(*picture.limits)
        style.legend(axes)
    for axes in grid[len(picture.panels) :]:
        axes.set_visible(False)
    for axes in grid[max(len(picture.panels) - picture.columns, 0) : len(picture.panels)]:
        axes.tick_params(labelbottom=True)
        axes.set_xlabel(picture.xlabel, fontsize=9.5)
    style.save(made, path)


def _fill(axes: "Axes", panel: Panel) -> None:
    for mark in panel.marks:
        label = mark.label or None
        if isinstance(mark, Line):
            dashes = "--" if mark.dashed else "-"
            axes.plot(mark.x, mark.y, color=mark.color, linewidth=mark.width, linestyle=dashes, label=label)
        else:
            axes.fill_between(mark.x, mark.low, mark.high, color=mark.color, alpha=mark.alpha, linewidth=0, label=label)
    for level, row in enumerate(panel.rows):
        axes.broken_barh(row.spans, (level - 0.3, 0.6), color=row.color, linewidth=0)
    style.format_axes(axes, panel.title, panel.ylabel)
    if panel.rows:
        axes.set_yticks(range(len(panel.rows)), [row.words for row in panel.rows], fontsize=9)
        axes.yaxis.tick_right()
        axes.set_ylim(len(panel.rows) - 0.4, -0.6)
        return
    axes.set_ylim(*y_limits(panel))
    if panel.angle:
        style.degrees(axes)


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
