"""A search of parameters: the error over each of them, and the gain on the logs that were left out."""

from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from levelhead import filters
from levelhead.publish.plots import style
from levelhead.publish.plots.tuning import draw_sweep
from levelhead.tune import Tuning

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS = 4
WIDE = 200.0  # highest over lowest value from which a small panel has room for powers of ten only


def tuning_picture(found: Tuning, path: str | Path) -> None:
    """Draw the error over each parameter searched, and bars of the errors on the logs that were left out.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    count = len(found.curves) + bool(found.folds)
    rows = ceil(count / COLUMNS)
    columns = ceil(count / rows)
    from matplotlib.ticker import LogLocator

    verdict = found.verdict()[0]
    made = style.figure(3.6 * columns, 3.1 * rows + 0.7, f"{verdict[:1].upper()}{verdict[1:]}")
    grid = made.subplots(rows, columns, squeeze=False).reshape(-1)
    top = 1.15 * max(float(np.max(curve.scores)) for curve in found.curves)
    least = min(float(np.min(curve.scores)) for curve in found.curves)
    for axes, curve in zip(grid, found.curves, strict=False):
        before, after = (float(getattr(one, curve.name)) for one in (found.space.params, found.best))
        draw_sweep(axes, curve, after)
        axes.axvline(before, color=style.GREY, linestyle="--", linewidth=1.2, label="before")
        if curve.param.log and curve.values[0] == 0.0:
            axes.set_xscale("symlog", linthresh=float(curve.values[1]))
        elif curve.param.log and curve.values[-1] > WIDE * curve.values[0]:
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0,), numticks=30))
        axes.set_ylim(0.0, min(top, 4.0 * least))
        unit = f" [{curve.param.unit}]" if curve.param.unit else ""
        change = f"{before:g} (dashed) → {after:g}" if after != before else f"{before:g} as before"
        style.format_axes(axes, f"{curve.name}: {change}", f"{found.measure} [° RMS]", f"{curve.name}{unit}")
    if found.folds:
        _draw_folds(grid[len(found.curves)], found)
    for axes in grid[count:]:
        axes.set_visible(False)
    style.save(made, path)


def _draw_folds(axes: "Axes", found: Tuning) -> None:
    """The error on each part that was left out, before and after."""
    at = np.arange(len(found.folds))
    axes.bar(at - 0.2, [one.before for one in found.folds], 0.38, color=style.GREY, label="before")
    axes.bar(at + 0.2, [one.after for one in found.folds], 0.38, color=style.BLUE, label="found without it")
    axes.set_xticks(at, [str(k + 1) for k in at])
    parts = "log" if len(found.references) > 1 else "quarter"
    name = filters.of(found.best).name
    style.format_axes(axes, f"{name}: each {parts} left out once", f"{found.measure} [° RMS]", f"{parts} left out")
    axes.set_ylim(0.0, 1.3 * max(max(one.before, one.after) for one in found.folds))
    axes.legend(loc="upper right", frameon=False, fontsize=8.5)
