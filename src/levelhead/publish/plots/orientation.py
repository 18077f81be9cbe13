"""One track without truth: angles with σ, bias, norms of rate and force, health."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from levelhead import filters
from levelhead.filters import health
from levelhead.publish.plots import angles, style
from levelhead.publish.plots.chart import draw
from levelhead.publish.plots.curves import area, envelope, envelope_of, flagged_ranges, join, stretches
from levelhead.publish.plots.picture import Band, Bars, Line, Panel, Picture
from levelhead.recording import Array, Recording
from levelhead.track import Track
from levelhead.units import GRAVITY

SOME = 20_000  # samples of a stretch whose σ decides how far the axis reaches


def track_picture(recording: Recording, track: Track, path: str | Path) -> None:
    """Draw roll, pitch and yaw with ±2σ over the accelerometer's own tilt, bias, sensor norms and health events.

    Raises:
        LevelheadError: nothing to draw with, or a path that cannot be written.
    """
    t = track.t - track.t[0]
    courses = _courses(recording, track)
    panels = [_angle(recording, track, name, course) for name, course in zip(angles.NAMES, courses, strict=True)]
    if track.bias is not None:
        panels.append(_bias(t, track.bias))
    panels.append(_norm(t, recording.gyr, float(np.degrees(1.0)), "angular rate |ω|", "°/s", style.GYROSCOPE))
    force = _norm(t, recording.acc, 1.0, "specific force |a|", "m/s²", style.ACCELEROMETER)
    level = Line(t[[0, -1]], np.full(2, GRAVITY), "#444444", 0.8, "1 g at rest", dashed=True)
    panels.append(force._replace(marks=[*force.marks, level]))
    events = _events(track)
    if events:
        panels.append(_timeline(t, events))
    ends = (float(t[0]), float(t[-1]) if len(t) > 1 else 1.0)
    height = 1.35 * sum(panel.height for panel in panels) + 1.0
    draw(Picture(_finding(track, courses), panels, ends, 11.0, height), path)


class Course(NamedTuple):
    """One Euler angle as it is drawn, in degrees: curves of few points whatever the length of the recording.

    Attributes:
        line: (x, y).
        alone: the same of the accelerometer's own angle; None where it has none.
        band: (x, low, high) of the angle with ±2σ; None without σ.
        ends: the least and the greatest value.
        sigma: σ at some samples; the last one is that of the last sample.
    """

    line: tuple[Array, Array]
    alone: tuple[Array, Array] | None
    band: tuple[Array, Array, Array] | None
    ends: tuple[float, float]
    sigma: Array


def _finding(track: Track, courses: list[Course]) -> str:
    troubled = bool(np.any(track.health & np.uint32(health.FAULTS)))
    roll, pitch, yaw = (max(abs(end) for end in course.ends) for course in courses)
    name = track.name if track.params is None else filters.title(track.params)
    words = f"{name}: roll up to {roll:.0f}°, pitch {pitch:.0f}°, yaw {yaw:.0f}°"
    return words + ("" if troubled else "; no sample was bad")


def _courses(recording: Recording, track: Track) -> list[Course]:
    """Roll, pitch and yaw, stretch by stretch: all at once they would take gigabytes of a long recording."""
    parts = [_courses_of(recording, track, rows, buckets) for rows, buckets in stretches(track.t)]
    return [_join_courses(list(one)) for one in zip(*parts, strict=True)]


def _courses_of(
    recording: Recording, track: Track, rows: slice, buckets: int
) -> list[tuple[Course, tuple[bool, bool]]]:
    """Courses of a stretch, each with whether its angle and that of the accelerometer have a value at the end."""
    sigma = None if track.sigma is None else track.sigma[rows]
    part = Track(track.t[rows], track.quat[rows], sigma=sigma)
    t, euler, sigmas = part.t - track.t[0], part.euler(), angles.euler_sigma(part)
    seen = angles.accelerometer_only(recording.acc[rows])
    found = []
    for i in range(len(angles.NAMES)):
        y, half = euler[:, i], np.zeros(0) if sigmas is None else sigmas[:, i]
        course = Course(
            envelope(t, y, 360.0, buckets),
            envelope(t, seen[:, i], 360.0, buckets),
            area(t, y, 2.0 * half, 360.0, buckets) if sigmas is not None else None,
            (float(np.nanmin(y)), float(np.nanmax(y))) if np.isfinite(y).any() else (np.nan, np.nan),
            half[:: -max(len(half) // SOME, 1)][::-1].copy(),
        )
        found.append((course, (bool(np.isfinite(y[-1])), bool(np.isfinite(seen[-1, i])))))
    return found


def _join_courses(parts: list[tuple[Course, tuple[bool, bool]]]) -> Course:
    """The whole course from those of stretches."""
    courses, here, there = [one for one, _ in parts], [good for _, (good, _) in parts], [good for _, (_, good) in parts]
    sigma = np.concatenate([one.sigma for one in courses])
    x, y = join([one.line for one in courses], here)
    seen_x, seen_y = join([one.alone for one in courses if one.alone is not None], there)
    band = None
    if (sigma > 0.0).any():
        at, low, high = join([one.band for one in courses if one.band is not None], here)
        band = at, low, high
    alone = (seen_x, seen_y) if np.isfinite(seen_y).any() else None
    lows, highs = zip(*(one.ends for one in courses), strict=True)
    return Course((x, y), alone, band, (float(np.nanmin(lows)), float(np.nanmax(highs))), sigma)


def _angle(recording: Recording, track: Track, name: str, course: Course) -> Panel:
    marks: list[Line | Band] = []
    title = name.capitalize()
    if course.alone is not None:
        marks.append(Line(*course.alone, "#C8C8C8", 0.6, "accelerometer alone"))
    if course.band is not None:
        marks.append(Band(*course.band, style.BLUE, 0.2, "±2σ"))
    marks.append(Line(*course.line, style.BLUE, 1.2, name))
    if name == "yaw":
        north = "magnetic" if track.declination is None else "true"
        if track.relative:
            title += ", relative to the start" + ("" if recording.mag is not None else " (no magnetometer)")
        else:
            title += f", from {north} north"
    if course.band is not None:
        title += f"; σ {course.sigma[-1]:.3g}° at the end"
    return Panel(title, f"{name} [°]", marks, _limits(course), angle=True, height=2.0)


def _limits(course: Course) -> tuple[float, float]:
    """Room for the line, and for its band as far as that does not dwarf the line."""
    low, high = course.ends
    room = 0.08 * (high - low) + 1.0
    if course.band is not None:
        room += min(2.0 * float(np.nanquantile(course.sigma, 0.95)), max(high - low, 10.0))
    return max(low - room, -195.0), min(high + room, 195.0)


def _bias(t: Array, bias: Array) -> Panel:
    marks = []
    for i, name in enumerate("xyz"):
        course = bias[:, i]
        value = f"{np.degrees(course[-1]):.3g} °/s".replace("-", "−") if course.any() else "not estimated"
        x, line = envelope_of(t, lambda rows, course=course: np.degrees(course[rows]))  # type: ignore[misc]
        marks.append(Line(x, line, style.AXES[i], 2.0 - 0.4 * i, f"{name}: {value}"))
    return Panel("Gyroscope bias (in the legend: at the end)", "bias [°/s]", marks, height=1.2)


def _norm(t: Array, values: Array, factor: float, what: str, unit: str, colour: str) -> Panel:
    x, norm = envelope_of(t, lambda rows: np.linalg.norm(factor * values[rows], axis=1))
    peak = f", up to {np.nanmax(norm):.3g} {unit}" if np.isfinite(norm).any() else ": none"
    return Panel(f"{what.capitalize()}{peak}", f"[{unit}]", [Line(x, norm, colour, 0.8)])


class HealthEvent(NamedTuple):
    """Meaning of a health bit, whether it is a fault, and the runs of samples that have it."""

    words: str
    fault: bool
    spans: list[tuple[int, int]]


def _events(track: Track) -> list[HealthEvent]:
    """Every health bit that occurs, faults first."""
    found = []
    for bit, words in sorted(health.NAMES.items(), key=lambda item: not item[0] & health.FAULTS):
        flags = (track.health & np.uint32(bit)) != 0
        if flags.any():
            found.append(HealthEvent(words, bool(bit & health.FAULTS), flagged_ranges(flags)))
    return found


def _timeline(t: Array, events: list[HealthEvent]) -> Panel:
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
