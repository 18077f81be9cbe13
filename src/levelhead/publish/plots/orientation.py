"""One track without truth: angles with σ, bias, norms of rate and force, health."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from levelhead.filters import health
from levelhead.publish.plots import angles, style
from levelhead.publish.plots.curves import band, curve, runs
from levelhead.recording import Array, Recording
from levelhead.track import Track
from levelhead.units import GRAVITY

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def track_picture(recording: Recording, track: Track, path: str | Path) -> None:
    """Draw roll, pitch and yaw with ±2σ over the accelerometer's own tilt, bias, sensor norms and health events.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    t = track.t - track.t[0]
    heights = [2.0, 2.0, 2.0]
    heights += [1.2] if track.bias is not None else []
    heights += [1.0, 1.0]
    events = _events(track)
    heights += [0.22 * len(events) + 0.15] if events else []
    made = style.figure(11.0, 1.35 * sum(heights) + 1.0, _finding(track))
    panels = list(made.subplots(len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights}))
    _angles(panels[:3], recording, track)
    rest = panels[3:]
    if track.bias is not None:
        _bias(rest.pop(0), t, track.bias)
    _norm(rest[0], t, np.degrees(recording.gyr), "angular rate |ω|", "°/s", style.GYROSCOPE)
    _norm(rest[1], t, recording.acc, "specific force |a|", "m/s²", style.ACCELEROMETER)
    rest[1].axhline(GRAVITY, color="#444444", linewidth=0.8, linestyle="--", label="1 g at rest")
    if events:
        _timeline(rest[2], t, events)
    panels[-1].set_xlabel("time [s]", fontsize=9.5)
    panels[-1].set_xlim(t[0], t[-1] if len(t) > 1 else 1.0)
    for axes in panels[: 5 + (track.bias is not None)]:
        style.legend(axes)
    style.save(made, path)


def _finding(track: Track) -> str:
    troubled = bool(np.any(track.health & np.uint32(health.FAULTS)))
    roll, pitch, yaw = np.nanmax(np.abs(track.euler()), axis=0)
    words = f"{track.name}: roll up to {roll:.0f}°, pitch {pitch:.0f}°, yaw {yaw:.0f}°"
    return words + ("" if troubled else "; no sample was bad")


def _angles(panels: list["Axes"], recording: Recording, track: Track) -> None:
    t = track.t - track.t[0]
    euler, sigma = track.euler(), angles.euler_sigma(track)
    alone = angles.accelerometer_only(recording)
    for i, axes in enumerate(panels):
        name = angles.NAMES[i]
        if np.isfinite(alone[:, i]).any():
            curve(axes, t, alone[:, i], 360.0, color="#C8C8C8", linewidth=0.6, label="accelerometer alone")
        doubt = None if sigma is None or not (sigma[:, i] > 0.0).any() else sigma[:, i]
        if doubt is not None:
            band(axes, t, euler[:, i], 2.0 * doubt, 360.0, color=style.BLUE, alpha=0.2, label="±2σ")
        curve(axes, t, euler[:, i], 360.0, color=style.BLUE, linewidth=1.2, label=name)
        axes.set_ylim(*_limits(euler[:, i], doubt))
        style.degrees(axes)
        title = name.capitalize()
        if name == "yaw":
            north = "magnetic" if track.declination is None else "true"
            title += (
                f", from {north} north" if recording.mag is not None else ", relative to the start (no magnetometer)"
            )
        if doubt is not None:
            title += f"; σ {doubt[-1]:.3g}° at the end"
        style.format_axes(axes, title, f"{name} [°]")


def _limits(course: Array, sigma: Array | None) -> tuple[float, float]:
    """Room for the line, and for its band as far as that does not dwarf the line."""
    low, high = float(np.nanmin(course)), float(np.nanmax(course))
    room = 0.08 * (high - low) + 1.0
    if sigma is not None:
        room += min(2.0 * float(np.nanquantile(sigma, 0.95)), max(high - low, 10.0))
    return max(low - room, -195.0), min(high + room, 195.0)


def _bias(axes: "Axes", t: Array, bias: Array) -> None:
    for i, name in enumerate("xyz"):
        course = np.degrees(bias[:, i])
        value = f"{course[-1]:.3g} °/s".replace("-", "−") if course.any() else "not estimated"
        curve(axes, t, course, color=style.AXES[i], linewidth=2.0 - 0.4 * i, label=f"{name}: {value}")
    style.format_axes(axes, "Gyroscope bias (in the legend: at the end)", "bias [°/s]")


def _norm(axes: "Axes", t: Array, values: Array, what: str, unit: str, colour: str) -> None:
    norm = np.linalg.norm(values, axis=1)
    curve(axes, t, norm, color=colour, linewidth=0.8)
    peak = f", up to {np.nanmax(norm):.3g} {unit}" if np.isfinite(norm).any() else ": none"
    style.format_axes(axes, f"{what.capitalize()}{peak}", f"[{unit}]")


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


def _timeline(axes: "Axes", t: Array, events: list[Event]) -> None:
    """A row for each kind of event, a bar for each time it lasted; the shortest ones are still visible."""
    least = (t[-1] - t[0]) / 600.0
    for level, event in enumerate(events):
        bars: list[tuple[float, float]] = []
        for first, last in event.spans:
            start, end = float(t[first]), float(max(t[last], t[first] + least))
            if bars and start <= bars[-1][0] + bars[-1][1]:
                bars[-1] = (bars[-1][0], max(end - bars[-1][0], bars[-1][1]))
            else:
                bars.append((start, end - start))
        colour = style.VERMILION if event.fault else style.GREEN
        axes.broken_barh(bars, (level - 0.3, 0.6), color=colour, linewidth=0)
    style.format_axes(axes, "Health: red, when something was wrong; green, at rest")
    axes.set_yticks(range(len(events)), [event.words for event in events], fontsize=9)
    axes.yaxis.tick_right()
    axes.set_ylim(len(events) - 0.4, -0.6)
