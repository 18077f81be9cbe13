"""One picture of an explanation: the track over time, with the evidence of each symptom."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from levelhead.filters import health
from levelhead.inspection import symptoms
from levelhead.inspection.evidence import RunEvidence
from levelhead.inspection.explain import Explanation
from levelhead.inspection.symptom import Symptom
from levelhead.publish.plots import style
from levelhead.publish.plots.doctor import draw_spectrum
from levelhead.recording import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS = 3000  # points of a line: longer ones are drawn as the largest of each part
WRAP = 170  # letters of a line of words
SIDE = 0.65  # of the width, beyond which a label is to the left
BITS = (
    ("gyroscope missing", health.GYR_MISSING),
    ("gyroscope clipped", health.GYR_SATURATED),
    ("gyroscope stuck", health.GYR_STUCK),
    ("gap", health.GAP),
    ("accelerometer missing", health.ACC_MISSING),
    ("magnetometer missing", health.MAG_MISSING),
    ("magnetometer refused", health.MAG_REJECTED),
    ("new field learned", health.MAG_LEARNED),
    ("turn not measured", health.TURN_MISSED),
    ("near vertical", health.NEAR_VERTICAL),
    ("at rest", health.AT_REST),
)


def explanation_picture(found: Explanation, path: str | Path) -> None:
    """Draws the evidence over time, the symptoms marked and in words; for jitter also the gyroscope's spectrum.

    Raises:
        LevelheadError: matplotlib is not installed, or the path cannot be written.
    """
    evidence, shown = found.evidence, found.symptoms
    kinds = {kind.name: kind for kind in symptoms.ALL}
    names = ", ".join(dict.fromkeys(one.name for one in shown)) or "no symptom"
    lines = [fill(f"{number}: {one}", WRAP) for number, one in enumerate(shown, 1)]
    spectra = list(dict.fromkeys(kinds[one.name].spectrum for one in shown if kinds[one.name].spectrum))
    text = 0.2 * sum(one.count("\n") + 1.4 for one in lines)
    heights = [1.8, 1.6, 1.6, 1.6, *(1.8 for _ in spectra), *([text] if lines else [])]
    made = style.figure(12.0, sum(heights) + 2.2, f"{Path(found.source).name}, {found.track.name}: {names}")
    grid = made.subplots(len(heights), 1, height_ratios=heights)
    for axes, draw in zip(grid[:4], (_distance, _corrections, _gyroscope, _health), strict=True):
        draw(axes, evidence)
        axes.set_xlim(0.0, float(evidence.t[-1]))
        _marks(axes, shown, labels=axes is grid[0])
    grid[3].set_xlabel("s", fontsize=9.5)
    for axes, sensor in zip(grid[4:], spectra, strict=False):
        draw_spectrum(axes, evidence.recording, sensor)
    if lines:
        grid[-1].axis("off")
        grid[-1].text(0.0, 1.0, "\n".join(lines), va="top", fontsize=9, transform=grid[-1].transAxes)
    style.save(made, path)


def _line(axes: "Axes", t: Array, values: Array, colour: str, label: str) -> None:
    """A line that keeps the largest value of each part."""
    size = max(1, len(t) // COLUMNS)
    count = len(t) // size
    with np.errstate(all="ignore"):
        top = np.nan_to_num(values[: count * size]).reshape(count, size).max(axis=1)
    axes.plot(t[: count * size : size], top, color=colour, linewidth=1.1, label=label)


def _distance(axes: "Axes", evidence: RunEvidence) -> None:
    style.format_axes(axes, "away from the smoother, °: a jump is a step, a lag is there while it turns")
    if "gyr" in evidence.uses:
        _line(axes, evidence.t, np.degrees(np.abs(evidence.difference.heading)), style.ORANGE, "heading")
    _line(axes, evidence.t, np.degrees(evidence.difference.tilt), style.BLUE, "tilt")
    axes.legend(loc="upper right", ncols=2, fontsize=8, frameon=False)


def _corrections(axes: "Axes", evidence: RunEvidence) -> None:
    style.format_axes(axes, "turns of the filter beside the gyroscope, summed, °; dashed: its σ of heading")
    _line(axes, evidence.t, np.degrees(np.linalg.norm(evidence.corrections, axis=1)), style.GREEN, "corrections")
    if evidence.track.sigma_heading is not None:
        axes.plot(evidence.t, np.degrees(evidence.track.sigma_heading), color=style.BLACK, linewidth=1.0, dashes=(4, 3))


def _gyroscope(axes: "Axes", evidence: RunEvidence) -> None:
    style.format_axes(axes, "gyroscope, largest axis, °/s")
    _line(axes, evidence.t, np.degrees(np.abs(evidence.recording.gyr).max(axis=1)), style.GYROSCOPE, "gyroscope")


def _health(axes: "Axes", evidence: RunEvidence) -> None:
    """A bar for each stretch in which a health bit is set; bits that never are have no row."""
    rows = [(name, bit) for name, bit in BITS if evidence.runs(bit)]
    style.format_axes(axes, "health bits that were set" if rows else "health bits: none was set")
    for row, (_, bit) in enumerate(rows):
        stretches = evidence.runs(bit)
        least = float(evidence.t[-1]) / 400.0  # a single sample is seen too
        spans = [(float(evidence.t[a]), max(float(evidence.t[b - 1] - evidence.t[a]), least)) for a, b in stretches]
        axes.broken_barh(spans, (row - 0.35, 0.7), color=style.GREEN if bit == health.AT_REST else style.VERMILION)
    axes.set_yticks(range(len(rows)), [name for name, _ in rows])
    axes.set_ylim(max(len(rows), 1) - 0.4, -0.6)


def _marks(axes: "Axes", shown: Sequence[Symptom], labels: bool) -> None:
    """A dashed line where a symptom is largest."""
    colours = {kind.name: kind.colour for kind in symptoms.ALL}
    for number, one in enumerate(shown, 1):
        if one.at is None:
            continue
        axes.axvline(one.at, color=colours[one.name], linewidth=1.3, dashes=(4, 3))
        if labels:
            left = one.at > SIDE * axes.get_xlim()[1]
            axes.annotate(
                f"{number} {one.cause}", (one.at, 0.95 - 0.12 * ((number - 1) % 4)), xycoords=("data", "axes fraction"),
                xytext=(-4 if left else 4, 0), textcoords="offset points", ha="right" if left else "left", va="top",
                fontsize=8, bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
            )  # fmt: skip
