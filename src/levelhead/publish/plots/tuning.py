"""Pictures for tuning: the error over a parameter, and a gain that settles."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from levelhead.open_types import JsonObject
from levelhead.publish.plots import style
from levelhead.publish.plots.curves import curve
from levelhead.tune import Sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def sweep_picture(sweep: Sweep, path: str | Path) -> None:
    """Draw the error over the parameter: the minimum marked, the flat region (within 5 % of it) shaded.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    unit, of = (f" [{sweep.param.unit}]", f" {sweep.param.unit}") if sweep.param.unit else ("", "")
    value, error = sweep.minimum, float(sweep.scores[sweep.index])
    what = f"{value:g}{of}"
    made = style.figure(8.0, 4.8, f"{type(sweep.params).__name__} is best at {sweep.name} = {what}: {error:.4f}° RMS")
    axes = made.subplots()
    draw_sweep(axes, sweep)
    note = f"{sweep.param.doc[:1].upper()}{sweep.param.doc[1:]}"
    if sweep.edge:
        note = f"The minimum is the {sweep.edge} value tried: a better one may lie outside"
    style.format_axes(axes, note, f"RMS {sweep.metric} error [°]", f"{sweep.name}{unit}")
    made.legend(loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    style.save(made, path)


def draw_sweep(axes: "Axes", sweep: Sweep, chosen: float | None = None) -> None:
    """The error over a parameter, its minimum or else the value that was chosen, and the flat region."""
    of = f" {sweep.param.unit}" if sweep.param.unit else ""
    index = sweep.index if chosen is None else int(np.searchsorted(sweep.values, chosen))
    value, error = float(sweep.values[index]), float(sweep.scores[index])
    what = f"{value:g}{of}"
    low, high = (float(sweep.values[i]) for i in sweep.flat)
    if high > low:
        axes.axvspan(
            low, high, color=style.GREEN, alpha=0.13, linewidth=0, label=f"within 5 %: {low:g} to {high:g}{of}"
        )
    axes.plot(sweep.values, sweep.scores, color=style.BLUE, linewidth=1.6, marker="o", markersize=3.5)
    axes.plot(
        [value], [error], marker="o", markersize=9, color=style.VERMILION, linestyle="", label=f"minimum at {what}"
    )
    if sweep.param.log and sweep.values[0] > 0.0:
        style.plain_log(axes)
    axes.margins(x=0.03)
    axes.set_ylim(bottom=0.0)


def gain_picture(
    t: ArrayLike,
    gain: ArrayLike,
    index: int,
    path: str | Path,
    names: Sequence[str] = ("gain of the angle", "gain of the bias"),
) -> None:
    """Draw a Kalman gain over time and where it has converged (``levelhead.tune.find_convergence``).

    Args:
        t: (n,) seconds.
        gain: (n,) the gain; or (n, k), each divided by its own final value.
        index: sample from which it is converged.
        path: PNG, SVG or PDF.
        names: of the k gains.
    """
    stamps = np.asarray(t, dtype=float)
    values = np.atleast_2d(np.asarray(gain, dtype=float).T).T
    several = values.shape[1] > 1
    final = np.where(values[-1] == 0.0, 1.0, values[-1]) if several else np.ones(1)
    when = stamps[index] - stamps[0]
    made = style.figure(8.0, 4.4, f"The gain has converged after {when:.3g} s (sample {index:,})")
    axes = made.subplots()
    for i, column in enumerate(values.T / final[:, None]):
        curve(axes, stamps - stamps[0], column, label=names[i] if several else "gain", **style.filter_style(i))
        axes.axhspan(0.99 * column[-1], 1.01 * column[-1], color=style.GREEN, alpha=0.2, linewidth=0)
    look: JsonObject = {"color": style.BLACK, "linewidth": 1.0, "linestyle": "--"}
    axes.axvline(when, label=f"from {when:.3g} s on\nwithin 1 % of the end", **look)
    whole = stamps[-1] - stamps[0]
    axes.set_xlim(0.0, min(whole, max(4.0 * when, 0.1 * whole)))  # the rest is a straight line
    note = f"Final value {values[-1, 0]:.4g}" if not several else "Each gain over its final value"
    style.format_axes(
        axes,
        f"{note}; from then on the filter has, in effect, a fixed gain",
        "gain over its final value" if several else "gain",
        "time [s]",
    )
    style.legend(axes)
    style.save(made, path)
