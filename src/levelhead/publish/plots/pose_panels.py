"""A calibration by poses: their directions, and the residual of each pose and turn, before and after."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from levelhead.calibrate.pose_calibration import PoseCalibration
from levelhead.publish.plots import style
from levelhead.recording import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MIN_SHARE = 1e-4  # of the largest value on a logarithmic axis


def pose_picture(found: PoseCalibration, path: str | Path) -> None:
    """Draw the sphere of directions, and the residuals of poses and turns.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    part = found.accelerometer
    title = (
        f"{len(found.force)} poses: the residual of |a| − g falls from {part.before:.2g} to {part.held_out:.2g} m/s²"
    )
    made = style.figure(13.0, 4.6, f"{title} where held out" if part.left_out else title)
    grid = made.subplots(1, 4, width_ratios=(1.0, 1.0, 1.25, 1.25))
    unit = found.force / np.linalg.norm(found.force, axis=1, keepdims=True)
    _half(grid[0], unit, 1.0, "Side up, z upwards")
    _half(grid[1], unit, -1.0, "Side up, z downwards")
    _pairs(grid[2], np.abs(found.lengths - found.gravity), "Poses", "| |a| − g | [m/s²]", "pose")
    if len(found.angles):
        _pairs(grid[3], np.degrees(found.angles), "Turns", "gravity misses the next pose by [°]", "turn")
    else:
        grid[3].set_visible(False)
    style.save(made, path)


def _half(axes: "Axes", unit: Array, sign: float, title: str) -> None:
    """One half of the sphere in an equal-area map (Lambert), its middle that pole."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    for share in (1.0, np.sqrt(1.0 - np.sqrt(0.5))):  # the rim, and 45° from the pole
        axes.plot(share * np.cos(angle), share * np.sin(angle), color="#BBBBBB", linewidth=1.0)
    here = sign * unit[:, 2] >= -1e-9
    x, y, z = unit[here].T
    scale = 1.0 / np.sqrt(1.0 + np.abs(z))
    axes.plot(x * scale, y * scale, "o", markersize=8, color=style.BLUE, alpha=0.75, markeredgecolor="white")
    for words, (at_x, at_y) in {"+x": (1.14, 0), "−x": (-1.14, 0), "+y": (0, 1.12), "−y": (0, -1.12)}.items():
        axes.text(at_x, at_y, words, ha="center", va="center", fontsize=9.5, color="#555555")
    axes.plot(0.0, 0.0, "+", color="#777777", markersize=8)
    axes.set_aspect("equal")
    axes.set_xlim(-1.3, 1.3)
    axes.set_ylim(-1.3, 1.3)
    axes.set_axis_off()
    axes.set_title(f"{title}: {int(here.sum())} poses", loc="left", fontsize=10.5)


def _pairs(axes: "Axes", values: Array, title: str, ylabel: str, xlabel: str) -> None:
    """Before and after of each, joined by a line."""
    values = np.maximum(values, MIN_SHARE)
    number = np.arange(1, len(values) + 1)
    axes.vlines(number, values.min(axis=1), values.max(axis=1), color="#CCCCCC", linewidth=1.2)
    for column, colour, label in ((0, style.VERMILION, "before"), (1, style.GREEN, "after")):
        axes.plot(number, values[:, column], "o", markersize=5, color=colour, label=label)
    axes.set_yscale("log")
    axes.set_ylim(top=4.0 * values.max())
    axes.legend(loc="upper right", frameon=False, fontsize=9, ncols=2, handletextpad=0.2)
    style.format_axes(axes, title, ylabel, xlabel)
