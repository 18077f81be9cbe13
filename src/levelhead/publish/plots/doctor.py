"""One picture of a log: its sensors over time with the findings marked, their spectra, the directions of gravity."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from levelhead.inspection.findings import Report
from levelhead.publish.plots.style import figure, format_axes, save
from levelhead.recording import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POINTS = 6000  # that a panel draws, at most
_COLOURS = ("#B3452C", "#3C7D3C", "#2F5D9B")


def doctor_picture(report: Report, path: str | Path) -> None:
    """Draws a report whose log could be read; PNG, SVG or PDF.

    Raises:
        LevelheadError: matplotlib is not installed, or the path cannot be written.
    """
    recording = report.recording
    assert recording is not None
    made = figure(11.0, 8.0, report.verdict)
    grid: Any = made.add_gridspec(3, 3, width_ratios=(2.2, 2.2, 1.6))
    panels = [("gyroscope", "deg/s", np.degrees(recording.gyr)), ("accelerometer", "m/s²", recording.acc)]
    if recording.mag is not None:
        panels.append(("magnetometer", "µT", recording.mag))
    for row, (name, unit, values) in enumerate(panels):
        axes = made.add_subplot(grid[row, :2])
        _draw(axes, recording.t, values)
        format_axes(axes, name, unit, "s" if row == len(panels) - 1 else "")
        for one in report.findings:
            if one.rows is not None:
                axes.axvline(
                    recording.t[min(one.rows[0], len(recording) - 1)], color="#888888", linewidth=1.2, dashes=(4, 3)
                )
    _spectra(made.add_subplot(grid[0, 2]), report)
    _sphere(made.add_subplot(grid[1, 2]), recording.acc)
    text = made.add_subplot(grid[2, 2])
    text.axis("off")
    lines = [f"{one.severity}: {one.name}" for one in report.findings[:12]] or ["nothing found"]
    text.text(0.0, 1.0, "\n".join(lines), va="top", fontsize=8.5, family="monospace")
    save(made, path)


def _draw(axes: "Axes", t: Array, values: Array) -> None:
    step = max(1, len(t) // _POINTS)
    for column, colour in zip(values.T, _COLOURS, strict=True):
        axes.plot(t[::step], column[::step], color=colour, linewidth=0.8)


def _spectra(axes: "Axes", report: Report) -> None:
    """Power over frequency of the length of the specific force and of the rate."""
    recording = report.recording
    assert recording is not None
    for name, values, colour in (("acc", recording.acc, _COLOURS[2]), ("gyr", recording.gyr, _COLOURS[0])):
        length = np.linalg.norm(np.nan_to_num(values), axis=1)
        size = min(len(length), 4096)
        if size < 64 or not recording.rate:
            continue
        pieces = length[: len(length) // size * size].reshape(-1, size)
        pieces = (pieces - pieces.mean(axis=1, keepdims=True)) * np.hanning(size)
        power = (np.abs(np.fft.rfft(pieces, axis=1)) ** 2).mean(axis=0)
        axes.loglog(
            np.fft.rfftfreq(size, 1.0 / recording.rate)[1:], power[1:] + 1e-12, color=colour, linewidth=0.8, label=name
        )
    format_axes(axes, "spectra of the lengths", "", "Hz")


def _sphere(axes: "Axes", acc: Array) -> None:
    """Directions of the specific force, seen from above and below the sensor's xy plane."""
    length = np.linalg.norm(acc, axis=1)
    known = np.isfinite(length) & (length > 0)
    unit = (acc[known] / length[known, None])[:: max(1, int(known.sum()) // _POINTS)]
    top = unit[:, 2] >= 0
    axes.plot(unit[top, 0], unit[top, 1], ".", markersize=1.5, color=_COLOURS[2])
    axes.plot(unit[~top, 0], unit[~top, 1], ".", markersize=1.5, color=_COLOURS[0])
    axes.set_aspect("equal")
    axes.set_xlim(-1.05, 1.05)
    axes.set_ylim(-1.05, 1.05)
    format_axes(axes, "directions of gravity (blue: z up)", "y", "x")
