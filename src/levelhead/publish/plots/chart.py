"""Draws a ``Picture``: PNG by Pillow, SVG and PDF by matplotlib.

matplotlib takes 0.6 s to be imported and as long again for seven panels, more than all the rest of ``levelhead fuse``;
``raster`` draws the same panels in a tenth of that.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from levelhead.publish.plots import style
from levelhead.publish.plots.picture import Line, Panel, Picture, y_limits

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw(picture: Picture, path: str | Path) -> None:
    """Write the picture, whole or not at all, in the format of the suffix.

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
