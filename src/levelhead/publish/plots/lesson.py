"""The lesson's picture: raw sensors, fused estimates, bias, and error with σ, over one time axis."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.evaluate import Comparison, Row
from levelhead.evaluate.score import rms, scored_rows
from levelhead.filters import AccelTilt, GyroIntegration
from levelhead.publish.plots import angles, style
from levelhead.publish.plots.curves import band, curve
from levelhead.recording import Array, Truth

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class PanelData(NamedTuple):
    """The data of the four panels: one Euler angle of the truth and of the filters, degrees."""

    comparison: Comparison
    truth: Truth
    axis: int  # 0 roll, 1 pitch, 2 yaw
    true: Array
    counted: NDArray[np.bool_]
    fused: list[Row]
    labels: list[str]

    @property
    def t(self) -> Array:
        """Seconds from the first sample."""
        seconds: Array = self.comparison.recording.t - self.comparison.recording.t[0]
        return seconds

    @property
    def angle(self) -> str:
        """roll, pitch or yaw."""
        return angles.NAMES[self.axis]

    def estimate(self, row: Row) -> Array:
        """The filter's angle; yaw without its constant offset where heading is relative."""
        course = row.track.euler()[:, self.axis]
        offset = row.score.heading_offset if row.score is not None else None
        return angles.wrap_degrees(course - offset) if self.axis == 2 and offset else course

    def error(self, estimate: Array) -> Array:
        """Estimate minus truth on the circle."""
        return angles.wrap_degrees(estimate - self.true)

    def rms(self, estimate: Array) -> float:
        """RMS error in degrees over the samples that count; NaN if there is none."""
        errors = self.error(estimate)[self.counted]
        errors = errors[np.isfinite(errors)]
        return rms(errors) if len(errors) else float("nan")


def lesson_picture(comparison: Comparison, path: str | Path) -> None:
    """Draw the comparison in four panels, for the Euler angle that moves most (the picture names it).

    1. accelerometer angle and integrated gyroscope against the truth
    2. every fused estimate against the truth
    3. estimated against true gyroscope bias about that axis
    4. errors, with the ±2σ band of the best filter that has one

    Raises:
        LevelheadError: no truth (``track_picture`` needs none), no matplotlib, or a path that cannot be written.
    """
    data = _panel_data(comparison)
    made = style.figure(11.0, 12.0, _finding(data))
    panels = made.subplots(4, 1, sharex=True)
    _raw(panels[0], data)
    _draw_estimate(panels[1], data)
    _bias(panels[2], data)
    _errors(panels[3], data)
    panels[3].set_xlabel("time [s]", fontsize=9.5)
    panels[3].set_xlim(data.t[0], data.t[-1])
    for axes in panels:
        style.legend(axes)
    for axes in panels[[0, 1, 3]]:
        style.degrees(axes)
    style.save(made, path)


def _panel_data(comparison: Comparison) -> PanelData:
    recording = comparison.recording
    if recording.truth is None:
        raise LevelheadError("the four panels need the true orientation; track_picture shows a recording without one")
    euler = angles.euler_of(recording.t, recording.truth.quat)
    axis = angles.most_active_axis(euler)
    baselines = (AccelTilt, GyroIntegration)
    fused = [row for row in comparison.rows if row.external or not isinstance(row.track.params, baselines)]
    fused = fused or list(comparison.rows)
    return PanelData(
        comparison, recording.truth, axis, euler[:, axis], scored_rows(recording.truth), fused, short_names(fused)
    )


def short_names(rows: list[Row]) -> list[str]:
    """Filter names without parameters where that is clear, else with them; contenders by their own."""
    kinds = [row.name if row.external else type(row.track.params).__name__ for row in rows]
    return [
        row.name if row.track.params is None or kinds.count(kind) > 1 else kind
        for row, kind in zip(rows, kinds, strict=True)
    ]


def _best(data: PanelData) -> tuple[str, float]:
    return min(
        zip(data.labels, (data.rms(data.estimate(row)) for row in data.fused), strict=True),
        key=lambda pair: pair[1],
    )


def _finding(data: PanelData) -> str:
    name, error = _best(data)
    return f"{name} follows {data.angle} to {error:.3g}° RMS"


def _truth(axes: "Axes", data: PanelData, **more: Any) -> None:
    look = {"color": style.TRUTH, "linewidth": 1.1, "label": "truth"} | more
    curve(axes, data.t, data.true, 360.0, **look)


def _raw(axes: "Axes", data: PanelData) -> None:
    recording = data.comparison.recording
    acc = angles.accelerometer_only(recording.acc)[:, data.axis]
    gyr = angles.gyroscope_only(recording)[:, data.axis]
    parts = []
    if np.isfinite(acc).any():
        error = data.rms(acc)
        parts.append(f"accelerometer {error:.3g}°")
        look = {"color": style.ACCELEROMETER, "linewidth": 0.6}
        curve(axes, data.t, acc, 360.0, label=f"accelerometer alone\n{error:.3g}° RMS", **look)
    error = data.rms(gyr)
    parts.append(f"integrated gyroscope {error:.3g}° RMS")
    straight = angles.unwrap(gyr)
    look = {"color": style.GYROSCOPE, "linewidth": 1.4}
    curve(axes, data.t, straight, 360.0, label=f"gyroscope integrated\n{error:.3g}° RMS", **look)
    _truth(axes, data)
    style.format_axes(axes, f"Raw sensors: {', '.join(parts)}", f"{data.angle} [°]")


def _draw_estimate(axes: "Axes", data: PanelData) -> None:
    _truth(axes, data, linewidth=2.4, color="#B0B0B0")
    for i, (row, label) in enumerate(zip(data.fused, data.labels, strict=True)):
        estimate = data.estimate(row)
        look = style.filter_style(i)
        curve(axes, data.t, estimate, 360.0, label=f"{label}\n{data.rms(estimate):.3g}° RMS", **look)
    name, error = _best(data)
    style.format_axes(axes, f"Fused: {name} is nearest to the truth, {error:.3g}° RMS", f"{data.angle} [°]")


def _bias(axes: "Axes", data: PanelData) -> None:
    title, axis = f"Gyroscope bias about {'xyz'[data.axis]}", data.axis
    true = data.truth.bias
    if true is not None:
        curve(axes, data.t, np.degrees(true[:, axis]), color="#B0B0B0", linewidth=2.4, label="truth")
    scores, courses = [], [] if true is None else [np.degrees(true[:, axis])]
    for i, (row, label) in enumerate(zip(data.fused, data.labels, strict=True)):
        if row.track.bias is None or not row.track.bias[:, axis].any():
            continue
        error = row.score.bias_axes[axis] if row.score is not None and row.score.bias_axes is not None else None
        words = "" if error is None else f"\n{error:.3g} °/s RMS"
        scores += [] if error is None else [(error, label)]
        look = style.filter_style(i)
        courses.append(np.degrees(row.track.bias[:, axis]))
        curve(axes, data.t, courses[-1], label=f"{label}{words}", **look)
    if courses:
        _focus(axes, courses)
    if scores:
        title += ": {1} estimates it to {0:.3g} °/s RMS".format(*min(scores))
    elif len(courses) == (true is not None):
        title += ": none of these filters estimates it"
    style.format_axes(axes, title, "bias [°/s]")


def _focus(axes: "Axes", courses: list[Array]) -> None:
    """Limits that leave out the wildest 1 % (the first seconds, before the estimate has settled)."""
    low = min(float(np.nanquantile(course, 0.01)) for course in courses)
    high = max(float(np.nanquantile(course, 0.99)) for course in courses)
    room = 0.15 * (high - low) + 1e-3
    axes.set_ylim(low - room, high + room)


def _errors(axes: "Axes", data: PanelData) -> None:
    title, limits = f"Error of {data.angle}", [1e-3]
    shown = _with_sigma(data)
    if shown is not None:
        i, sigma, inside = shown
        title += f": {100 * inside:.0f} % of {data.labels[i]}'s lies inside its ±2σ (expected: 95 %)"
        colour = style.filter_style(i)["color"]
        band(axes, data.t, 0.0 * sigma, 2.0 * sigma, color=colour, alpha=0.16, label=f"±2σ of {data.labels[i]}")
        limits.append(2.4 * float(np.nanmedian(sigma)))
    for i, (row, label) in enumerate(zip(data.fused, data.labels, strict=True)):
        error = data.error(data.estimate(row))
        look = style.filter_style(i)
        look["linewidth"] *= 0.6
        curve(axes, data.t, error, 360.0, label=label, **look)
        limits.append(1.3 * float(np.nanquantile(np.abs(error), 0.99)))
    axes.axhline(0.0, color="#444444", linewidth=0.7)
    axes.set_ylim(-max(limits), max(limits))
    style.format_axes(axes, title, f"{data.angle} error [°]")


def _with_sigma(data: PanelData) -> tuple[int, Array, float] | None:
    """Index, σ of the angle in degrees, and share of errors within 2σ, of the best filter that has a positive σ."""
    found = []
    for i, row in enumerate(data.fused):
        sigmas = angles.euler_sigma(row.track)
        if sigmas is None or not (sigmas[:, data.axis] > 0.0).any():
            continue
        estimate, sigma = data.estimate(row), sigmas[:, data.axis]
        inside = np.abs(data.error(estimate))[data.counted] <= 2.0 * sigma[data.counted]
        found.append((data.rms(estimate), i, sigma, float(inside.mean())))
    return min(found, key=lambda item: item[0])[1:] if found else None
