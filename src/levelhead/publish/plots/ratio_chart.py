"""Our errors against a peer's, a point per recording."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from levelhead.bench.ratios import MIN_ERROR, WORSE, Ratio, Ratios, geometric_mean
from levelhead.publish.plots import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLORS = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE, "#E69F00", "#56B4E9", "#666666", "#000000")
NAMED = 6  # recordings with a name beside their point, the worst


def ratio_picture(pairs: Sequence[Ratios], path: str | Path) -> None:
    """Draw a panel per pair on logarithmic axes: below the diagonal ours is better, dashed is 1.2 times the peer's.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    ratio = geometric_mean([one.value for one in pairs[0].recordings])
    title = f"{pairs[0].method}: {ratio:.2f} of {pairs[0].peer}'s error, geometric mean of {len(pairs[0].recordings)}"
    made = style.figure(6.5 * len(pairs), 6.5, title)
    for axes, pair in zip(made.subplots(1, len(pairs), squeeze=False)[0], pairs, strict=True):
        _panel(axes, pair)
    style.save(made, path)


def _panel(axes: "Axes", pair: Ratios) -> None:
    sets = list(dict.fromkeys(one.dataset for one in pair.recordings))
    for name, color in zip(sets, COLORS * len(sets), strict=False):
        chosen = [one for one in pair.recordings if one.dataset == name]
        x, y = zip(*(_point(one) for one in chosen), strict=True)
        axes.plot(x, y, "o", color=color, markersize=5, alpha=0.75, label=name, linestyle="none")
    ends = [min(min(_point(one)) for one in pair.recordings), max(max(_point(one)) for one in pair.recordings)]
    axes.plot(ends, ends, color="#666666", linewidth=1.0)
    axes.plot(ends, [WORSE * end for end in ends], color="#666666", linewidth=0.8, linestyle="--")
    for one in pair.worse[:NAMED]:
        axes.annotate(one.recording, _point(one), fontsize=7, xytext=(4, 2), textcoords="offset points")
    axes.set_xscale("log")
    axes.set_yscale("log")
    style.format_axes(axes, "", f"{pair.method}: error [°]", f"{pair.peer}: error [°]")
    style.legend(axes)


def _point(one: Ratio) -> tuple[float, float]:
    return max(one.peer, MIN_ERROR), max(one.ours, MIN_ERROR)
