"""Allan deviations with their 95 % intervals, the fit, and the slope of each noise."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from levelhead.noise.allan import interval_of
from levelhead.noise.assessment import NAMES as SENSORS
from levelhead.noise.assessment import spell
from levelhead.noise.fit import FLICKER_SHARE, NAMES, shapes
from levelhead.noise.model import NoiseModel, TriadNoise
from levelhead.publish.plots import style
from levelhead.recording import Array
from levelhead.units import DEGREE, GRAVITY

if TYPE_CHECKING:
    from matplotlib.axes import Axes

UNITS = {"gyr": (1.0 / DEGREE, "°/s"), "acc": (1e3 / GRAVITY, "mg"), "mag": (1.0, "µT")}
ROOM = 3.0  # by which factor the axis reaches below the least deviation


def allan_picture(model: NoiseModel, path: str | Path) -> None:
    """Draw the Allan deviation of every axis, a panel for each sensor.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    triads = model.triads
    made = style.figure(5.2 * len(triads) + 0.6, 5.0, _finding(model))
    for axes, (name, triad) in zip(made.subplots(1, len(triads), squeeze=False)[0], triads.items(), strict=True):
        _draw(axes, name, triad)
    style.save(made, path)


def _finding(model: NoiseModel) -> str:
    gyr, acc = model.gyr.density / DEGREE, 1e6 * model.acc.density / GRAVITY
    return f"White noise {gyr:.2g} (°/s)/√Hz and {acc:.2g} µg/√Hz: Allan deviation from {spell(model.duration)} at rest"


def _draw(axes: "Axes", name: str, triad: TriadNoise) -> None:
    scale, unit = UNITS[name]
    for i, (curve, one) in enumerate(zip(triad.curves, triad.fits, strict=True)):
        low, high = interval_of(curve.deviation, one.freedom)
        colour = style.AXES[i]
        axes.fill_between(curve.tau, scale * low, scale * high, color=colour, alpha=0.13, linewidth=0)
        axes.plot(curve.tau, scale * curve.deviation, "o", markersize=2.8, color=colour, label="xyz"[i])
        squares = np.array([getattr(triad, part).value[i] ** 2 for part in NAMES])
        axes.plot(curve.tau, scale * np.sqrt(shapes(curve.tau) @ squares), color=colour, linewidth=1.3)
    axes.set_xscale("log")
    axes.set_yscale("log")
    tau = triad.curves[0].tau
    every = np.concatenate([curve.deviation for curve in triad.curves])
    axes.set_ylim(scale * every.min() / ROOM, scale * every.max() * 2.0)
    _slopes(axes, tau, triad, scale)
    style.format_axes(axes, SENSORS[name].capitalize(), f"Allan deviation [{unit}]", "averaging time τ [s]")
    axes.legend(loc="upper right", frameon=False, fontsize=9, ncols=3, handletextpad=0.2, columnspacing=1.0)


def _slopes(axes: "Axes", tau: Array, triad: TriadNoise, scale: float) -> None:
    """The parts of the fit as dashed lines (mean of the axes), those that show, each with its letter and slope."""
    n, b, k, q = (
        float(np.sqrt(np.mean(np.where(part.low > 0.0, part.value, 0.0) ** 2)))
        for part in (triad.white_noise_density, triad.bias_instability, triad.random_walk, triad.quantisation_noise)
    )
    parts = {
        "Q, slope −1": np.sqrt(3.0) * q / tau,
        "N, slope −½": n / np.sqrt(tau),
        "B, flat": np.full_like(tau, np.sqrt(FLICKER_SHARE) * b),
        "K, slope ½": k * np.sqrt(tau / 3.0),
    }
    bottom, top = axes.get_ylim()
    for words, line in parts.items():
        shown = (scale * line > bottom) & (scale * line < top)
        if not shown.any() or not line[0] > 0.0:
            continue
        axes.plot(tau[shown], scale * line[shown], "--", color=style.GREY, linewidth=1.0)
        at = np.flatnonzero(shown)[int(0.12 * shown.sum()) if words[0] in "QB" else int(0.9 * (shown.sum() - 1))]
        below = words[0] in "NQ"
        axes.annotate(
            words, (tau[at], scale * line[at]), xytext=(0, -9 if below else 4), textcoords="offset points",
            fontsize=8.5, color="#555555", ha="right" if below else "center", va="top" if below else "bottom",
        )  # fmt: skip
