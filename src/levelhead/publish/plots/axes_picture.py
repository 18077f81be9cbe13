"""Pictures of axes: a sensor on its body, and the earth frames with the body's axes that go with them."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from levelhead.axis_map import AxisMap
from levelhead.earth_frame import FRAMES, EarthFrame
from levelhead.publish.plots import style
from levelhead.recording import Array
from levelhead.rotations import matrix

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D

BODY = np.array([1.2, 0.7, 0.14])  # half lengths of the drawn body
SENSOR = np.array([0.3, 0.24, 0.05])
BODY_AXES = ("x forward", "y left", "z up")
EDGES = tuple(
    (a, b)
    for a in np.ndindex(2, 2, 2)
    for b in np.ndindex(2, 2, 2)
    if sum(abs(i - j) for i, j in zip(a, b, strict=True)) == 1 and a < b
)


def mounting_picture(mounting: AxisMap, path: str | Path) -> None:
    """Draws a sensor on its body with the axes of both.

    Args:
        mounting: from the sensor's axes to the body's.
        path: of a PNG, SVG or PDF.

    Raises:
        LevelheadError: another suffix, or matplotlib is not installed.
    """
    rounded = "quaternion " + ", ".join(f"{number:.4f}" for number in mounting.quat)
    words = str(mounting) if mounting.is_permutation else rounded
    figure = style.figure(6.4, 4.6, f"The sensor on its body: {words}")
    axes = _scene(figure.add_subplot(1, 1, 1, projection="3d"))
    _box(axes, np.eye(3), BODY, style.GREY)
    _nose(axes)
    _arrows(axes, np.eye(3), 1.7, BODY_AXES, style.GREY, 1.2)
    _box(axes, mounting.matrix, SENSOR, style.BLACK)
    _arrows(axes, mounting.matrix, 0.85, ("sensor x", "sensor y", "sensor z"), style.AXES, 2.4)
    style.save(figure, path)


def frames_picture(path: str | Path) -> None:
    """Draws ENU, NED and NWU with the body's axes that go with each; the body points north.

    Args:
        path: of a PNG, SVG or PDF.

    Raises:
        LevelheadError: another suffix, or matplotlib is not installed.
    """
    figure = style.figure(11.0, 4.6, "Earth frames, and the axes of a body that heads north")
    for place, frame in enumerate(FRAMES.values()):
        axes = _scene(figure.add_subplot(1, len(FRAMES), place + 1, projection="3d"))
        axes.set_title(f"{frame.name}, body {'-'.join(frame.body)}", fontsize=9)
        _draw_frame(axes, frame)
    style.save(figure, path)


def _draw_frame(axes: "Axes3D", frame: EarthFrame) -> None:
    """The earth axes below, the body above; the drawing's x is east, y north, z up."""
    north = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # forward-left-up of a body that heads north
    body, earth = north @ matrix(frame.to_flu[None])[0], matrix(frame.to_enu[None])[0]
    place = np.array([0.0, 0.0, 0.8])
    _box(axes, north, 0.7 * BODY, style.GREY, place)
    named = tuple(f"{letter} {word}" for letter, word in zip("xyz", frame.body, strict=True))
    _arrows(axes, body, 1.1, named, style.AXES, 2.0, place)
    named = tuple(f"{letter} {word}" for letter, word in zip("xyz", frame.axes, strict=True))
    _arrows(axes, earth, 1.1, named, style.AXES, 1.2, np.array([0.0, 0.0, -1.4]))


def _scene(axes: "Axes3D") -> "Axes3D":
    axes.set_axis_off()
    axes.set_box_aspect((1, 1, 1), zoom=1.3)
    for limit in (axes.set_xlim, axes.set_ylim, axes.set_zlim):
        limit(-1.8, 1.8)
    axes.view_init(elev=24, azim=-60)
    return axes


def _box(axes: "Axes3D", rotation: Array, half: Array, colour: str, place: Array | None = None) -> None:
    """The edges of a box, turned."""
    centre = np.zeros(3) if place is None else place
    for ends in EDGES:
        line = np.array([centre + rotation @ (half * (2.0 * np.array(end) - 1.0)) for end in ends])
        axes.plot(*line.T, color=colour, linewidth=1.0)


def _nose(axes: "Axes3D") -> None:
    """A triangle at the front of the body."""
    x, y = BODY[:2]
    corners = np.array([[x, -y, 0.0], [x + 0.3, 0.0, 0.0], [x, y, 0.0]])
    axes.plot(*corners.T, color=style.GREY, linewidth=1.0)


def _arrows(
    axes: "Axes3D",
    rotation: Array,
    length: float,
    names: tuple[str, ...],
    colours: str | tuple[str, ...],
    width: float,
    place: Array | None = None,
) -> None:
    """Three axes with their names; the columns of the rotation are their directions."""
    centre = np.zeros(3) if place is None else place
    for i, name in enumerate(names):
        colour = colours if isinstance(colours, str) else colours[i]
        tip = length * rotation[:, i]
        axes.quiver(*centre, *tip, color=colour, linewidth=width, arrow_length_ratio=0.12)
        axes.text(*(centre + 1.12 * tip), name, color=colour, fontsize=8, ha="center", va="center")
