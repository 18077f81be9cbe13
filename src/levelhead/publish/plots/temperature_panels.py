"""Bias against temperature: means of blocks at rest and the curve through them, a panel for each sensor."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from levelhead.noise.assessment import NAMES as SENSORS
from levelhead.noise.model import NoiseModel
from levelhead.noise.temperature import TemperatureDrift
from levelhead.publish.plots import style
from levelhead.units import DEGREE, GRAVITY

if TYPE_CHECKING:
    from matplotlib.axes import Axes

UNITS = {"gyr": (1.0 / DEGREE, "°/s"), "acc": (1e3 / GRAVITY, "mg"), "mag": (1.0, "µT")}


def temperature_picture(model: NoiseModel, path: str | Path) -> None:
    """Draw the readings at rest against temperature, each axis less its value at the reference.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    there = {name: triad.drift for name, triad in model.triads.items() if triad.drift is not None}
    span = max(drift.span for drift in there.values())
    made = style.figure(5.2 * len(there) + 0.6, 4.4, f"Readings at rest over {span:.1f} K of temperature")
    for axes, (name, drift) in zip(made.subplots(1, len(there), squeeze=False)[0], there.items(), strict=True):
        _draw(axes, name, drift)
    style.save(made, path)


def _draw(axes: "Axes", name: str, drift: TemperatureDrift) -> None:
    scale, unit = UNITS[name]
    warmth = np.linspace(drift.low, drift.high, 100)
    curve = scale * (drift.bias(warmth) - drift.value[:, 0])
    for i in range(3):
        colour = style.AXES[i]
        seen = scale * (drift.blocks[:, i + 1] - drift.value[i, 0])
        axes.plot(drift.blocks[:, 0], seen, "o", markersize=2.8, color=colour, alpha=0.45, markeredgewidth=0)
        axes.plot(warmth, curve[:, i], color=colour, linewidth=1.6, label="xyz"[i])
    title = f"{SENSORS[name].capitalize()}, less its value at {drift.reference:g} °C"
    style.format_axes(axes, title, f"mean reading [{unit}]", "temperature [°C]")
    axes.legend(loc="best", frameon=False, fontsize=9, ncols=3)
