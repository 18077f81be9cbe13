"""The same filters on several recordings side by side: who holds up when it gets hard."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from levelhead.errors import LevelheadError
from levelhead.evaluate import Comparison
from levelhead.publish.plots import style
from levelhead.publish.plots.lesson import short_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def case_picture(
    cases: Mapping[str, Comparison], path: str | Path, metric: Literal["total", "tilt", "heading"] = "total"
) -> None:
    """Draw one panel per recording with each filter's RMS error, on one logarithmic axis, so that a factor is a length.

    Args:
        cases: name of the recording -> comparison; all of the same filters in the same order.
        path: PNG, SVG or PDF.
        metric: which error.

    Raises:
        LevelheadError: no truth, different filters, no matplotlib, or a path that cannot be written.
    """
    errors = {name: _errors(name, case, metric) for name, case in cases.items()}
    sizes = {len(values) for values in errors.values()}
    if len(sizes) != 1:
        raise LevelheadError("the cases hold different filters; expected the same ones in the same order for each")
    labels = short_names(list(next(iter(cases.values())).rows))
    best = {name: labels[min(range(len(values)), key=values.__getitem__)] for name, values in errors.items()}
    winners = set(best.values())
    title = (
        f"{winners.pop()} is best in every case"
        if len(winners) == 1 and len(cases) > 1
        else ", ".join(f"{name}: {winner} is best" for name, winner in best.items())
    )
    made = style.figure(3.0 + 3.6 * len(cases), 1.7 + 0.38 * len(labels), title)
    panels = made.subplots(1, len(cases), sharex=True, sharey=True, squeeze=False)[0]
    for axes, (name, values) in zip(panels, errors.items(), strict=True):
        _bars(axes, name, labels, values)
    for axes in panels:
        style.plain_log(axes)
        axes.set_xlabel(f"RMS {metric} error [°], logarithmic", fontsize=9.5)
    style.save(made, path)


def _errors(name: str, case: Comparison, metric: str) -> list[float]:
    scores = [row.score for row in case.rows]
    if any(score is None for score in scores):
        raise LevelheadError(f"'{name}' holds no true orientation, so there are no errors to draw")
    return [max(float(getattr(score, metric)), 1e-4) for score in scores]


def _bars(axes: "Axes", name: str, labels: list[str], values: list[float]) -> None:
    """A dot and its value per filter, from the best one's line outwards; the best filled."""
    least = min(values)
    for i, value in enumerate(values):
        colour = style.BLUE if value == least else style.GREY
        axes.plot([least, value], [i, i], color=colour, linewidth=2.0, alpha=0.5, solid_capstyle="butt")
        axes.plot([value], [i], marker="o", markersize=8, color=colour)
        weight = "bold" if value == least else "normal"
        axes.annotate(
            f"{value:.3g}°", (value, i), (9, 0), textcoords="offset points", va="center", fontsize=9, fontweight=weight
        )
    axes.margins(x=0.2)
    axes.set_yticks(range(len(labels)), labels, fontsize=9.5)
    axes.set_ylim(len(labels) - 0.4, -0.6)
    style.format_axes(axes, name)
    axes.grid(False, axis="y")
