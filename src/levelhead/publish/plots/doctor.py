"""One picture of a log: sensors over time with rest, gaps and findings marked, spectra with their lines, directions."""

from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from levelhead.inspection.findings import Finding, Report
from levelhead.inspection.spectrum import lines, spectrum
from levelhead.publish.plots.style import AXES, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, figure, format_axes, save
from levelhead.recording import Array, Recording, median
from levelhead.signals.rest import rest_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLUMNS = 1500  # of a panel: longer recordings are drawn as bands from least to most
_POINTS = 5000  # of the sphere
_GAP = 5.0  # median intervals
_MAX_FINDINGS = 12  # findings that are listed
_COLOURS = {"broken": VERMILION, "warning": ORANGE, "note": GREY}
_UNITS = {"gyr": ("gyroscope", "deg/s", 180.0 / np.pi), "acc": ("accelerometer", "m/s²", 1.0)}


def doctor_picture(report: Report, path: str | Path) -> None:
    """Draws a report whose log could be read; PNG, SVG or PDF.

    Raises:
        LevelheadError: matplotlib is not installed, or the path cannot be written.
    """
    recording = report.recording
    assert recording is not None
    made = figure(13.0, 9.0, f"{Path(report.source).name}: {report.verdict}")
    grid = made.add_gridspec(3, 2, width_ratios=(2.3, 1.0))
    series = [(name, unit, factor * getattr(recording, role)) for role, (name, unit, factor) in _UNITS.items()]
    if recording.mag is not None:
        series.append(("magnetometer", "" if "mag_unit" in recording.meta else "µT", recording.mag))
    marked = [one for one in report.findings if one.rows is not None]
    for row, (name, unit, values) in enumerate(series):
        axes = made.add_subplot(grid[row, 0])
        _background(axes, recording)
        _series(axes, recording.t, values)
        _marks(axes, recording, marked, labels=row == 0)
        format_axes(axes, f"{name}, {unit}" if unit else name, "", "s" if row == len(series) - 1 else "")
        axes.set_xlim(float(recording.t[0]), float(recording.t[-1]))
    if len(series) < 3:
        _findings(made.add_subplot(grid[2, 0]), report, wide=True)
    right = grid[:, 1].subgridspec(
        3 if len(series) < 3 else 4, 1, height_ratios=(1, 1, 1.3, 1.2)[: 3 + len(series) // 3]
    )
    for row, role in enumerate(_UNITS):
        draw_spectrum(made.add_subplot(right[row]), recording, role)
    _sphere(made.add_subplot(right[2]), recording.acc)
    if len(series) == 3:
        _findings(made.add_subplot(right[3]), report, wide=False)
    save(made, path)


def _series(axes: "Axes", t: Array, values: Array) -> None:
    size = len(t) // _COLUMNS
    for column, colour, name in zip(values.T, AXES, "xyz", strict=True):
        if size < 3:
            axes.plot(t, column, color=colour, linewidth=0.9, label=name)
            continue
        parts = column[: len(t) // size * size].reshape(-1, size)
        with np.errstate(all="ignore"):
            low, high = np.nan_to_num(np.nanmin(parts, axis=1)), np.nan_to_num(np.nanmax(parts, axis=1))
        middle = t[: len(t) // size * size].reshape(-1, size)[:, 0]
        axes.fill_between(middle, low, high, color=colour, linewidth=0.4, alpha=0.75, label=name)
    axes.legend(
        loc="upper right", ncols=3, fontsize=8, frameon=True, framealpha=0.8, edgecolor="none", handlelength=1.0
    )


def _background(axes: "Axes", recording: Recording) -> None:
    """Rest in green, gaps in grey."""
    still = np.concatenate([[0], rest_rows(recording).astype(int), [0]])
    starts, ends = (np.flatnonzero(sign * np.diff(still) > 0).tolist() for sign in (1, -1))
    for a, b in zip(starts, ends, strict=True):
        axes.axvspan(recording.t[a], recording.t[min(b, len(recording) - 1)], color=GREEN, alpha=0.12, linewidth=0)
    steps = np.diff(recording.t)
    for row in np.flatnonzero(steps > _GAP * median(steps))[:200].tolist():
        axes.axvspan(recording.t[row], recording.t[row + 1], color=GREY, alpha=0.35, linewidth=0)


def _marks(axes: "Axes", recording: Recording, marked: list[Finding], labels: bool) -> None:
    """A dashed line where a finding begins, its name on top."""
    for depth, one in enumerate(marked):
        assert one.rows is not None
        at = float(recording.t[min(one.rows[0], len(recording) - 1)])
        axes.axvline(at, color=_COLOURS[one.severity], linewidth=1.3, dashes=(4, 3))
        if labels:
            right = at > 0.8 * recording.t[-1] + 0.2 * recording.t[0]
            axes.annotate(
                one.name, (at, 0.97 - 0.09 * (depth % 5)), xycoords=("data", "axes fraction"),
                xytext=(-4 if right else 4, 0),
                textcoords="offset points", ha="right" if right else "left", va="top", fontsize=8, color="#333333",
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0},
            )  # fmt: skip


def draw_spectrum(axes: "Axes", recording: Recording, role: str) -> None:
    """The square root of the density over frequency, lines named."""
    name, unit, factor = _UNITS[role]
    colour = ORANGE if role == "gyr" else BLUE
    found = spectrum(np.asarray(getattr(recording, role)), recording.rate)
    format_axes(axes, f"spectrum: {name}, {unit}/√Hz", "", "Hz")
    if found is None:
        axes.text(0.5, 0.5, "too short", transform=axes.transAxes, ha="center", color=GREY)
        return
    root = factor * np.sqrt(np.maximum(found.density[1:], 1e-20))
    axes.loglog(found.frequency[1:], root, color=colour, linewidth=1.2)
    for one in lines(found, 0.02 if role == "acc" else np.radians(0.1))[:3]:
        height = float(root[int(np.argmin(np.abs(found.frequency[1:] - one.frequency)))])
        axes.annotate(
            f"{one.frequency:.0f} Hz", (one.frequency, height), xytext=(0, 5), textcoords="offset points",
            ha="center", fontsize=8,
        )  # fmt: skip
    axes.margins(y=0.12)


def _sphere(axes: "Axes", acc: Array) -> None:
    """Directions of the specific force, in the equal-area projections of both halves of the sphere."""
    length = np.linalg.norm(acc, axis=1)
    known = np.isfinite(length) & (length > 0)
    unit = (acc[known] / length[known, None])[:: max(1, int(known.sum()) // _POINTS)]
    circle = np.linspace(0.0, 2.0 * np.pi, 200)
    for sign, middle, name, colour in ((1.0, -1.1, "z up", BLUE), (-1.0, 1.1, "z down", VERMILION)):
        half = unit[sign * unit[:, 2] >= 0.0]
        scale = 1.0 / np.sqrt(1.0 + np.abs(half[:, 2]))  # Lambert's projection, the rim at 1
        axes.fill(middle + np.cos(circle), np.sin(circle), facecolor="#F6F6F6", edgecolor="#BBBBBB", linewidth=0.8)
        inner = np.sqrt(1.0 - np.cos(np.pi / 4.0))
        axes.plot(middle + inner * np.cos(circle), inner * np.sin(circle), color="#D5D5D5", linewidth=0.7)
        axes.plot(
            middle + half[:, 0] * scale, half[:, 1] * scale, ".", markersize=2.0, alpha=0.5, color=colour,
            markeredgewidth=0,
        )  # fmt: skip
        axes.text(middle, -1.16, name, ha="center", va="top", fontsize=9)
    axes.set_aspect("equal")
    axes.set_xlim(-2.2, 2.2)
    axes.set_ylim(-1.4, 1.08)
    axes.axis("off")
    axes.set_title("directions of the specific force (rings: 45°)", loc="left", fontsize=10.5)


def _findings(axes: "Axes", report: Report, wide: bool) -> None:
    """The findings as a list, the worst first."""
    axes.axis("off")
    axes.set_title("findings", loc="left", fontsize=10.5)
    shown = [*report.findings[: _MAX_FINDINGS if wide else 9]]
    at = 0.98
    for one in shown:
        words = fill(one.what if wide else one.name.replace("_", " "), 105 if wide else 44)
        count = words.count("\n") + 1
        axes.plot(
            [0.006],
            [at - 0.025],
            "o",
            markersize=6,
            color=_COLOURS[one.severity],
            transform=axes.transAxes,
            clip_on=False,
        )
        axes.text(0.022 if wide else 0.04, at, words, va="top", fontsize=8.5, transform=axes.transAxes)
        at -= 0.085 * count if wide else 0.105
        if at < 0.05:
            break
    if not shown:
        axes.text(0.02, at, "nothing found", va="top", fontsize=9, color=SKY, transform=axes.transAxes)
