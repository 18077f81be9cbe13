"""The common style of all pictures: colours for colour-blind readers, light axes, sharp text."""

from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError, nearest
from levelhead.open_types import JsonObject

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# M. Okabe, K. Ito, Color Universal Design, 2008; yellow is left out: it cannot be read on white.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#8C8C8C"
FILTERS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)  # in the order of the rows; styles change after six
AXES = (VERMILION, GREEN, BLUE)  # x, y, z
TRUTH, ACCELEROMETER, GYROSCOPE = BLACK, SKY, ORANGE

DPI = 150
FORMATS = ("png", "svg", "pdf")


def filter_style(index: int) -> JsonObject:
    """Colour, line style and width of the filter in row ``index``; later ones are thinner, so that equal ones show."""
    dashes = ("-", "--", ":")[index // len(FILTERS) % 3]
    return {"color": FILTERS[index % len(FILTERS)], "linestyle": dashes, "linewidth": max(2.0 - 0.35 * index, 0.8)}


def figure(width: float, height: float, title: str = "") -> "Figure":
    """An empty figure, inches, with its finding as the title; no pyplot behind it.

    Raises:
        LevelheadError: matplotlib is not installed.
    """
    import logging

    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # where it keeps its caches is nothing to worry about
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise LevelheadError("pictures need matplotlib: pip install 'levelhead[plot]'") from None
    made = Figure(figsize=(width, height), dpi=DPI, layout="constrained", facecolor="white")
    made.get_layout_engine().set(h_pad=0.06, w_pad=0.08)  # type: ignore[union-attr,call-arg]
    if title:
        lines = fill(title, int(8.5 * width), break_long_words=False)  # 13 points bold: about 8.5 letters an inch
        made.suptitle(lines, x=0.01, ha="left", fontsize=13, fontweight="bold")
    return made


def format_axes(axes: "Axes", title: str = "", ylabel: str = "", xlabel: str = "") -> None:
    """Light grid, no box, title to the left."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color("#666666")
    axes.grid(True, color="#E4E4E4", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=9, color="#666666")
    axes.set_title(title, loc="left", fontsize=10.5)
    axes.set_ylabel(ylabel, fontsize=9.5)
    axes.set_xlabel(xlabel, fontsize=9.5)


def plain_log(axes: "Axes") -> None:
    """A logarithmic x axis with the labels 0.1, 0.2, 0.5, 1, not powers of ten."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axes.set_xscale("log")
    low, high = axes.get_xlim()
    steps = (1.0, 2.0, 5.0) if high / low < 3e3 else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=steps, numticks=30))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def degrees(axes: "Axes") -> None:
    """Ticks at quarter turns where a y axis in degrees spans more than half a turn."""
    from matplotlib.ticker import MultipleLocator

    low, high = axes.get_ylim()
    if 180.0 < high - low <= 900.0:
        axes.yaxis.set_major_locator(MultipleLocator(90.0))


def legend(axes: "Axes") -> None:
    """A legend to the right of the axes, where it hides nothing; lines in it are thick enough to see their colour."""
    handles, labels = axes.get_legend_handles_labels()
    if not handles:
        return
    box = axes.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.005, 1.02), frameon=False, fontsize=9)
    for line in box.get_lines():
        line.set_linewidth(2.2)
        line.set_alpha(1.0)


def save(made: "Figure", path: str | Path) -> None:
    """Write the figure, whole or not at all, in the format of the suffix.

    Raises:
        LevelheadError: another suffix, or a folder that is missing or cannot be written.
    """
    path = Path(path)
    kind = path.suffix.lower().lstrip(".")
    if kind not in FORMATS:
        raise LevelheadError(
            f"'{path.name}' is not a picture that levelhead writes; {nearest(kind or 'nothing', FORMATS)}"
        )
    with atomic_path(path) as temporary:
        made.savefig(temporary, format=kind, dpi=DPI)
