"""Errors of all methods by group of recordings: who is good where."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

from levelhead.bench.accuracy import Accuracy
from levelhead.bench.methods import DEFAULT, OURS
from levelhead.evaluate.text_table import Cell
from levelhead.open_types import JsonObject
from levelhead.publish.plots import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FAMILIES = {
    OURS: style.BLUE,
    "vqf": style.VERMILION,
    "imufusion": style.PURPLE,
    "ahrs": style.GREEN,
    "riann": style.SKY,
}
SHAPES = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p", "h", "*", "d", "8")
LEADERS = {DEFAULT: "-", "vqf.VQF": "-"}  # drawn as lines through the groups
SPREAD = 0.74  # of the room of a group that its marks take


def accuracy_picture(result: Accuracy, path: str | Path) -> None:
    """Draw the mean error of every method in every group, and over all, on a logarithmic axis.

    Colours are packages, shapes their methods; the default and VQF are joined by lines. Within a group the methods
    stand side by side in the order of the legend.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    keys = [group.name for group in result.groups] + [f"all: {result.figure}"]
    made = style.figure(5.0 + 1.15 * len(keys), 7.0, _finding(result))
    axes = made.subplots()
    for i in range(0, len(keys), 2):
        axes.axvspan(i - 0.5, i + 0.5, color="#F4F4F4", linewidth=0, zorder=0)
    axes.axvline(len(keys) - 1.5, color="#666666", linewidth=1.0)
    rows = result.table
    for j, method in enumerate(result.methods):
        _marks(axes, result, j, [_degrees(rows[j][key]) for key in keys], method.name in LEADERS)
    mode = "with magnetometer" if result.with_mag else "without magnetometer"
    style.format_axes(
        axes, f"Mean over the recordings of each group, {mode}", f"RMS {result.figure} error [°], logarithmic"
    )
    axes.grid(False, axis="x")
    _plain_log_y(axes)
    counts = [sum(entry.group == group for entry in result.entries) for group in result.groups] + [len(result.main)]
    titles = [*(group.name.replace(" ", "\n", 1) for group in result.groups), "all"]
    axes.set_xticks(range(len(keys)), [f"{t}\n({n})" for t, n in zip(titles, counts, strict=True)], fontsize=9.5)
    axes.set_xlim(-0.5, len(keys) - 0.5)
    style.legend(axes)
    style.save(made, path)


def _degrees(value: Cell) -> float | None:
    """A figure of the table; None where there is none."""
    return value if isinstance(value, float) else None


def _finding(result: Accuracy) -> str:
    """The default's rank among the others, as a sentence."""
    errors = {row["method"]: row[f"all: {result.figure}"] for row in result.table}
    known = {name: value for name, value in errors.items() if isinstance(value, float)}
    if not known:
        return "No method has a figure"
    first = min(known, key=lambda name: known[name])
    words = f"{first} has the smallest mean {result.figure} error, {known[first]:.2f}°"
    return (
        words if DEFAULT not in known or first == DEFAULT else f"{words}; levelhead's default has {known[DEFAULT]:.2f}°"
    )


def _marks(axes: "Axes", result: Accuracy, j: int, values: list[float | None], leader: bool) -> None:
    method = result.methods[j]
    colour = FAMILIES.get(method.package, style.GREY)
    cousins = [one.name for one in result.methods if one.package == method.package]
    count = len(result.methods)
    shift = SPREAD * ((j + 0.5) / count - 0.5)
    points = [(i + shift, math.nan if value is None else value) for i, value in enumerate(values)]
    points.insert(-1, (points[-1][0], math.nan))  # no line leads from the groups to the overall figure
    look: JsonObject = {"linestyle": "", "markersize": 6.0, "alpha": 0.75, "markerfacecolor": "white"}
    if leader:
        look = {"linestyle": LEADERS[method.name], "linewidth": 1.6, "markersize": 7.0, "zorder": 4}
    label = method.name if any(value is not None for value in values) else f"{method.name} (no figure)"
    axes.plot(
        *zip(*points, strict=True),
        color=colour,
        marker=SHAPES[cousins.index(method.name) % len(SHAPES)],
        label=label,
        **look,
    )


def _plain_log_y(axes: "Axes") -> None:
    """0.5, 1, 2, 5 and so on at the ticks."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=30))
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
