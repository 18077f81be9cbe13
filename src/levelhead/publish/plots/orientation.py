"""One track without truth: angles with σ, bias, norms of rate and force, health."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from levelhead.filters import health
from levelhead.publish.plots import angles, style
from levelhead.publish.plots.chart import Band, Bars, Line, Panel, Picture, draw
from levelhead.publish.plots.curves import area, envelope, runs
from levelhead.recording import Array, Recording
from levelhead.track import Track
from levelhead.units import GRAVITY


def track_picture(recording: Recording, track: Track, path: str | Path) -> None:
    """Draw roll, pitch and yaw with ±2σ over the accelerometer's own tilt, bias, sensor norms and health events.

    Raises:
        LevelheadError: nothing to draw with, or a path that cannot be written.
    """
    t = track.t - track.t[0]
    panels = _angles(recording, track)
    if track.bias is not None:
        panels.append(_bias(t, track.bias))
    panels.append(_norm(t, np.degrees(recording.gyr), "angular rate |ω|", "°/s", style.GYROSCOPE))
    force = _norm(t, recording.acc, "specific force |a|", "m/s²", style.ACCELEROMETER)
    level = Line(t[[0, -1]], np.full(2, GRAVITY), "#444444", 0.8, "1 g at rest", dashed=True)
    panels.append(force._replace(marks=[*force.marks, level]))
    events = _events(track)
    if events:
        panels.append(_timeline(t, events))
    ends = (float(t[0]), float(t[-1]) if len(t) > 1 else 1.0)
    height = 1.35 * sum(panel.height for panel in panels) + 1.0
    draw(Picture(_finding(track), panels, ends, 11.0, height), path)


def _finding(track: Track) -> str:
    troubled = bool(np.any(track.health & np.uint32(health.FAULTS)))
    roll, pitch, yaw = np.nanmax(np.abs(track.euler()), axis=0)
    words = f"{track.name}: roll up to {roll:.0f}°, pitch {pitch:.0f}°, yaw {yaw:.0f}°"
    return words + ("" if troubled else "; no sample was bad")


def _angles(recording: Recording, track: Track) -> list[Panel]:
    t = track.t - track.t[0]
    euler, sigma = track.euler(), angles.euler_sigma(track)
    alone = angles.accelerometer_only(recording)
    panels = []
    for i, name in enumerate(angles.NAMES):
        marks: list[Line | Band] = []
        if np.isfinite(alone[:, i]).any():
            marks.append(Line(*envelope(t, alone[:, i], 360.0), "#C8C8C8", 0.6, "accelerometer alone"))
        doubt = None if sigma is None or not (sigma[:, i] > 0.0).any() else sigma[:, i]
        if doubt is not None:
            marks.append(Band(*area(t, euler[:, i], 2.0 * doubt, 360.0), style.BLUE, 0.2, "±2σ"))
        marks.append(Line(*envelope(t, euler[:, i], 360.0), style.BLUE, 1.2, name))
        title = name.capitalize()
        if name == "yaw":
            north = "magnetic" if track.declination is None else "true"
            title += (
                f", from {north} north" if recording.mag is not None else ", relative to the start (no magnetometer)"
            )
        if doubt is not None:
            title += f"; σ {doubt[-1]:.3g}° at the end"
        limits = _limits(euler[:, i], doubt)
        panels.append(Panel(title, f"{name} [°]", marks, limits, angle=True, height=2.0))
    return panels


def _limits(course: Array, sigma: Array | None) -> tuple[float, float]:
    """Room for the line, and for its band as far as that does not dwarf the line."""
    low, high = float(np.nanmin(course)), float(np.nanmax(course))
    room = 0.08 * (high - low) + 1.0
    if sigma is not None:
        room += min(2.0 * float(np.nanquantile(sigma, 0.95)), max(high - low, 10.0))
    return max(low - room, -195.0), min(high + room, 195.0)


def _bias(t: Array, bias: Array) -> Panel:
    marks = []
    for i, name in enumerate("xyz"):
        course = np.degrees(bias[:, i])
        value = f"{course[-1]:.3g} °/s".replace("-", "−") if course.any() else "not estimated"
        marks.append(Line(*envelope(t, course), style.AXES[i], 2.0 - 0.4 * i, f"{name}: {value}"))
    return Panel("Gyroscope bias (in the legend: at the end)", "bias [°/s]", marks, height=1.2)


def _norm(t: Array, values: Array, what: str, unit: str, colour: str) -> Panel:
    norm = np.linalg.norm(values, axis=1)
    peak = f", up to {np.nanmax(norm):.3g} {unit}" if np.isfinite(norm).any() else ": none"
    return Panel(f"{what.capitalize()}{peak}", f"[{unit}]", [Line(*envelope(t, norm), colour, 0.8)])


class Event(NamedTuple):
    """Meaning of a health bit, whether it is a fault, and the runs of samples that have it."""

    words: str
    fault: bool
    spans: list[tuple[int, int]]


def _events(track: Track) -> list[Event]:
    """Every health bit that occurs, faults first."""
    found = []
    for bit, words in sorted(health.NAMES.items(), key=lambda item: not item[0] & health.FAULTS):
        flags = (track.health & np.uint32(bit)) != 0
        if flags.any():
            found.append(Event(words, bool(bit & health.FAULTS), runs(flags)))
    return found


def _timeline(t: Array, events: list[Event]) -> Panel:
    """A row for each kind of event, a bar for each time it lasted; the shortest ones are still visible."""
    least = float(t[-1] - t[0]) / 600.0
    rows = []
    for event in events:
        bars: list[tuple[float, float]] = []
        for first, last in event.spans:
            start, end = float(t[first]), float(max(t[last], t[first] + least))
            if bars and start <= bars[-1][0] + bars[-1][1]:
                bars[-1] = (bars[-1][0], max(end - bars[-1][0], bars[-1][1]))
            else:
                bars.append((start, end - start))
        rows.append(Bars(bars, style.VERMILION if event.fault else style.GREEN, event.words))
    title = "Health: red, when something was wrong; green, at rest"
    return Panel(title, "", [], rows=rows, height=0.22 * len(events) + 0.15)
