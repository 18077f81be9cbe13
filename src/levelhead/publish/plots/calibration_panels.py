"""Estimated errors of a sensor over time, each with ±2σ."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from levelhead.engine.calibration_history import CalibrationHistory
from levelhead.publish.plots import style
from levelhead.publish.plots.chart import draw
from levelhead.publish.plots.picture import Band, Line, Panel, Picture
from levelhead.recording import Array

ROOM = 3.0  # of the σ that a number has in the middle of the recording: how far the axis reaches beyond the curves


class NumberGroup(NamedTuple):
    """One panel: a quantity, the places of its numbers row by row, their names, a factor to the unit."""

    title: str
    name: str
    places: tuple[int, ...]
    names: tuple[str, ...]
    factor: float
    unit: str


XYZ, THREE = (0, 1, 2), ("x", "y", "z")
PANELS = (
    NumberGroup("Gyroscope bias", "gyr_bias", XYZ, THREE, float(np.degrees(1.0)), "°/s"),
    NumberGroup("Gyroscope scale", "gyr_matrix", (0, 4, 8), THREE, 100.0, "%"),
    NumberGroup("Gyroscope cross-axis, upper", "gyr_matrix", (1, 2, 5), ("xy", "xz", "yz"), 100.0, "%"),
    NumberGroup("Gyroscope cross-axis, lower", "gyr_matrix", (3, 6, 7), ("yx", "zx", "zy"), 100.0, "%"),
    NumberGroup("Accelerometer bias", "acc_bias", XYZ, THREE, 1.0, "m/s²"),
    NumberGroup("Magnetometer offset", "mag_offset", XYZ, THREE, 1.0, "µT"),
    NumberGroup("Magnetometer later than the gyroscope by", "mag_delay", (0,), ("delay",), 1e3, "ms"),
    NumberGroup("Field of the place", "field", (0, 1), ("horizontal", "up"), 1.0, "µT"),
)


def calibration_picture(history: CalibrationHistory, path: str | Path) -> None:
    """Draw every estimated error of the sensor over time, with ±2σ, without those that were not estimated.

    Raises:
        LevelheadError: nothing to draw with, or a path that cannot be written.
    """
    groups = [group for group in PANELS if np.nanmax(_sigma(history, group), initial=0.0) > 0.0]
    t = history.t - history.t[0]
    ends = (float(t[0]), float(t[-1]) if len(t) > 1 else 1.0)
    rows = (len(groups) + 1) // 2
    panels = [_panel(t, history, group) for group in groups]
    draw(Picture(_finding(history), panels, ends, 12.0, 1.9 * rows + 0.9, columns=2), path)


def _finding(history: CalibrationHistory) -> str:
    end = history.known[-1]
    known, asked = end.counts()
    return f"{known} of the sensor's {asked} errors are known from this motion"


def _sigma(history: CalibrationHistory, group: NumberGroup) -> Array:
    """(k, numbers) 1σ in the panel's unit; NaN where there is nothing."""
    return _numbers(history, group, "sigma")


def _numbers(history: CalibrationHistory, group: NumberGroup, part: str) -> Array:
    course = history.series(group.name, part)
    if course.ndim == 1:  # it was never there
        return np.full((len(course), len(group.places)), np.nan)
    numbers: Array = group.factor * course.reshape(len(course), -1)[:, list(group.places)]
    return numbers


def _panel(t: Array, history: CalibrationHistory, group: NumberGroup) -> Panel:
    value, sigma = _numbers(history, group, "value"), _sigma(history, group)
    bands: list[Line | Band] = []
    lines: list[Line | Band] = []
    for i, name in enumerate(group.names):
        if not np.nanmax(sigma[:, i], initial=0.0) > 0.0:
            continue
        said = f"{name} {value[-1, i]:.3g} ± {float(f'{sigma[-1, i]:.1g}'):g}".replace("-", "−")
        low, high = value[:, i] - 2.0 * sigma[:, i], value[:, i] + 2.0 * sigma[:, i]
        bands.append(Band(t, low, high, style.AXES[i], 0.16))
        lines.append(Line(t, value[:, i], style.AXES[i], 1.5, said))
    middle = len(t) // 2
    room = float(ROOM * np.nanmax(sigma[middle:], initial=0.0) + 1e-12)
    late = value[len(t) // 10 :]
    limits = (float(np.nanmin(late)) - room, float(np.nanmax(late)) + room)
    return Panel(f"{group.title}, ±2σ", f"[{group.unit}]", [*bands, *lines], limits)
