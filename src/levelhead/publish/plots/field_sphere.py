"""A magnetometer's readings around the sphere on which they ought to lie, before and after a calibration."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from levelhead.calibrate.field_calibration import FieldCalibration
from levelhead.calibrate.pose_calibration import digits
from levelhead.publish.plots import style
from levelhead.recording import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PLANES = ((0, 1), (0, 2), (1, 2))


def sphere_picture(found: FieldCalibration, path: str | Path) -> None:
    """Draw the readings in three planes as read and as corrected, and the directions from which the field came.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    part = found.heading
    made = style.figure(
        13.0, 7.4,
        f"Heading by the field is off by {digits(part.before)}° as read and {digits(part.held_out)}° with the "
        "calibration, where held out",
    )  # fmt: skip
    grid = made.subplots(2, 4)
    for row, (values, colour, title) in enumerate(
        ((found.readings, style.VERMILION, "as read"), (found.corrected, style.GREEN, "corrected"))
    ):
        for column, (i, j) in enumerate(PLANES):
            _plane(grid[row, column], values[:, [i, j]], found.strength, colour)
            style.format_axes(grid[row, column], title, f"{'xyz'[j]} [µT]", f"{'xyz'[i]} [µT]")
    unit = found.corrected / np.linalg.norm(found.corrected, axis=1, keepdims=True)
    _half(grid[0, 3], unit, 1.0, f"The field's side, +z ({100.0 * found.coverage:.0f} % of all)")
    _half(grid[1, 3], unit, -1.0, "The field's side, −z")
    style.save(made, path)


def _plane(axes: "Axes", values: Array, strength: float, colour: str) -> None:
    """Readings, and the circle of a sensor without errors."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(strength * np.cos(angle), strength * np.sin(angle), color=style.GREY, linewidth=1.2)
    axes.plot(*values.T, ".", markersize=3, color=colour, alpha=0.6)
    axes.plot(0.0, 0.0, "+", color="black", markersize=9)
    axes.set_aspect("equal", adjustable="datalim")


def _half(axes: "Axes", unit: Array, sign: float, title: str) -> None:
    """One half of the sphere of directions in an equal-area map (Lambert), its middle that pole."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    for share in (1.0, np.sqrt(1.0 - np.sqrt(0.5))):  # the rim, and 45° from the pole
        axes.plot(share * np.cos(angle), share * np.sin(angle), color="#BBBBBB", linewidth=1.0)
    x, y, z = unit[sign * unit[:, 2] >= 0.0].T
    scale = 1.0 / np.sqrt(1.0 + np.abs(z))
    axes.plot(x * scale, y * scale, ".", markersize=4, color=style.BLUE, alpha=0.6)
    for words, (at_x, at_y) in {"+x": (1.14, 0), "−x": (-1.14, 0), "+y": (0, 1.12), "−y": (0, -1.12)}.items():
        axes.text(at_x, at_y, words, ha="center", va="center", fontsize=9.5, color="#555555")
    axes.set_aspect("equal")
    axes.set_xlim(-1.3, 1.3)
    axes.set_ylim(-1.3, 1.3)
    axes.set_axis_off()
    axes.set_title(title, loc="left", fontsize=10.5)
