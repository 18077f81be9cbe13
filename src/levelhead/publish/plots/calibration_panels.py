"""Estimated errors of a sensor over time, each with ±2σ."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from levelhead.engine.calibration_history import CalibrationHistory
from levelhead.publish.plots import style
from levelhead.recording import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROOM = 3.0  # of the σ that a number has in the middle of the recording: how far the axis reaches beyond the curves


class Panel(NamedTuple):
    """One panel: a quantity, the places of its numbers row by row, their names, a factor to the unit."""

    title: str
    name: str
    places: tuple[int, ...]
    names: tuple[str, ...]
    factor: float
    unit: str


XYZ, THREE = (0, 1, 2), ("x", "y", "z")
PANELS = (
    Panel("Gyroscope bias", "gyr_bias", XYZ, THREE, float(np.degrees(1.0)), "°/s"),
    Panel("Gyroscope scale", "gyr_matrix", (0, 4, 8), THREE, 100.0, "%"),
    Panel("Gyroscope cross-axis, upper", "gyr_matrix", (1, 2, 5), ("xy", "xz", "yz"), 100.0, "%"),
    Panel("Gyroscope cross-axis, lower", "gyr_matrix", (3, 6, 7), ("yx", "zx", "zy"), 100.0, "%"),
    Panel("Accelerometer bias", "acc_bias", XYZ, THREE, 1.0, "m/s²"),
    Panel("Magnetometer offset", "mag_offset", XYZ, THREE, 1.0, "µT"),
    Panel("Magnetometer later than the gyroscope by", "mag_delay", (0,), ("delay",), 1e3, "ms"),
    Panel("Field of the place", "field", (0, 1), ("horizontal", "up"), 1.0, "µT"),
)


def calibration_picture(history: CalibrationHistory, path: str | Path) -> None:
    """Draw every estimated error of the sensor over time, with ±2σ, without those that were not estimated.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    panels = [panel for panel in PANELS if np.nanmax(_sigma(history, panel), initial=0.0) > 0.0]
    rows = (len(panels) + 1) // 2
    made = style.figure(12.0, 1.9 * rows + 0.9, _finding(history))
    grid = list(made.subplots(rows, 2, sharex=True, squeeze=False).reshape(-1))
    t = history.t - history.t[0]
    for panel, axes in zip(panels, grid, strict=False):
        _draw(axes, t, history, panel)
        style.legend(axes)
    for axes in grid[len(panels) :]:
        axes.set_visible(False)
    for axes in grid[max(len(panels) - 2, 0) : len(panels)]:
        axes.tick_params(labelbottom=True)
        axes.set_xlabel("time [s]", fontsize=9.5)
    style.save(made, path)


def _finding(history: CalibrationHistory) -> str:
    end = history.known[-1]
    known, asked = end.counts()
    return f"{known} of the sensor's {asked} errors are known from this motion"


def _sigma(history: CalibrationHistory, panel: Panel) -> Array:
    """(k, numbers) 1σ in the panel's unit; NaN where there is nothing."""
    return _numbers(history, panel, "sigma")


def _numbers(history: CalibrationHistory, panel: Panel, part: str) -> Array:
    course = history.series(panel.name, part)
    if course.ndim == 1:  # it was never there
        return np.full((len(course), len(panel.places)), np.nan)
    numbers: Array = panel.factor * course.reshape(len(course), -1)[:, list(panel.places)]
    return numbers


def _draw(axes: "Axes", t: Array, history: CalibrationHistory, panel: Panel) -> None:
    value, sigma = _numbers(history, panel, "value"), _sigma(history, panel)
    for i, name in enumerate(panel.names):
        if not np.nanmax(sigma[:, i], initial=0.0) > 0.0:
            continue
        said = f"{name} {value[-1, i]:.3g} ± {sigma[-1, i]:.1g}".replace("-", "−")
        low, high = value[:, i] - 2.0 * sigma[:, i], value[:, i] + 2.0 * sigma[:, i]
        axes.fill_between(t, low, high, color=style.AXES[i], alpha=0.16, linewidth=0)
        axes.plot(t, value[:, i], color=style.AXES[i], linewidth=1.5, label=said)
    middle = len(t) // 2
    room = ROOM * np.nanmax(sigma[middle:], initial=0.0) + 1e-12
    late = value[len(t) // 10 :]
    axes.set_ylim(np.nanmin(late) - room, np.nanmax(late) + room)
    style.format_axes(axes, f"{panel.title}, ±2σ", f"[{panel.unit}]")
