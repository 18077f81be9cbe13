"""C3D, the file of motion capture, by ezc3d: markers as the orientation of a rigid body, analog channels as a table.

ROTATION groups are not read: ezc3d 1.7.2 refuses the file with one that it has written itself.
"""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError, nearest
from levelhead.open_types import Untyped
from levelhead.recording import Array
from levelhead.rotations import from_matrix, nearest_rotation
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable
from levelhead.track import Track

LEAST_WIDTH = 0.05  # of the extent of a body's markers: the least distance from one line
AXES = {"X": 0, "Y": 1, "Z": 2}


def read_c3d(path: str | os.PathLike[str], markers: Sequence[str]) -> Track:
    """The orientation of a rigid body of markers in a C3D file.

    It is the rotation that fits the markers best (W. Kabsch, Acta Crystallographica A32, 1976) from the first frame
    that has all of them, where it is near the identity; σ follows from the misfit. Frames without all of them are left
    out. POINT:Y_SCREEN names the axis that is up; without it z is.

    Args:
        path: the file.
        markers: the labels of three or more.

    Raises:
        LevelheadError: ezc3d is not installed, no C3D file, a marker that it lacks, or markers on a line.
    """
    file, source = _open(path), os.fspath(path)
    points, known = _places(file, markers, source)
    t = np.flatnonzero(known) / float(file["parameters"]["POINT"]["RATE"]["value"][0])
    places = (points[known] - points[known].mean(axis=1, keepdims=True)) @ _to_z_up(file).T
    shape = places[0]
    width = np.linalg.svd(shape, compute_uv=False)
    if width[1] < LEAST_WIDTH * width[0]:
        raise LevelheadError(f"{source}: {', '.join(markers)} lie on one line, which does not show a rotation")
    for _ in range(2):  # by the shape of one frame, then by that of all
        rotation = np.array([nearest_rotation(profile) for profile in places.swapaxes(1, 2) @ shape])
        shape = (places @ rotation).mean(axis=0)
    misfit = places - shape @ rotation.swapaxes(1, 2)
    noise = np.sum(misfit**2) / max(1, (len(t) - 1) * (3 * len(markers) - 6))
    inertia = np.sum(places**2, axis=(1, 2))[:, None, None] * np.eye(3) - places.swapaxes(1, 2) @ places
    sigma = np.sqrt(noise * np.diagonal(np.linalg.inv(inertia), axis1=1, axis2=2))
    quat = np.array([from_matrix(one) for one in rotation])
    return Track(t, quat, sigma=sigma, relative=False)


def tables(path: Path, display_path: str, hints: Hints) -> list[ArrayTable]:
    """The analog channels, which hold an IMU in some laboratories.

    Raises:
        LevelheadError: ezc3d is not installed, no C3D file, or one without analog channels.
    """
    file = _open(path)
    group, values = file["parameters"]["ANALOG"], file["data"]["analogs"][0]
    names, units = (list(group.get(key, {"value": ()})["value"]) for key in ("LABELS", "UNITS"))
    if not values.size:
        raise LevelheadError(
            f"{display_path} has {len(_labels(file))} markers and no analog channels, which could be those of an IMU; "
            "`levelhead joint` takes the markers of a rigid body: FILE.c3d:MARKER,MARKER,MARKER"
        )
    columns = {}
    for i, channel in enumerate(values):
        name = names[i].strip() if i < len(names) else f"analog{i + 1}"
        unit = units[i].strip() if i < len(units) else ""
        columns[f"{name} [{unit}]" if unit else name] = channel
    return [ArrayTable(display_path, columns, rate=float(group["RATE"]["value"][0]))]


def _open(path: str | os.PathLike[str]) -> Untyped:
    try:
        from ezc3d import c3d
    except ImportError:
        raise LevelheadError(f"{path} is C3D; reading it needs ezc3d: pip install 'levelhead[c3d]'") from None
    if not Path(path).is_file():
        raise LevelheadError(f"cannot read {path}: no such file")
    try:
        return c3d(os.fspath(path))
    except (OSError, RuntimeError, ValueError, IndexError, KeyError) as error:
        raise LevelheadError(f"{path} is not a C3D file, or it is damaged ({error})") from None


def _labels(file: Untyped) -> list[str]:
    group = file["parameters"]["POINT"]
    more = [f"LABELS{k}" for k in range(2, 10) if f"LABELS{k}" in group]  # beyond 255 markers
    return [label.strip() for key in ("LABELS", *more) for label in group[key]["value"]]


def _to_z_up(file: Untyped) -> Array:
    """(3, 3) from the laboratory's axes to axes whose z is up."""
    screen = file["parameters"]["POINT"].get("Y_SCREEN", {"value": ()})["value"]
    word = str(screen[0]).strip().upper() if len(screen) else "+Z"
    axis, sign = AXES.get(word[-1:], 2), -1.0 if word.startswith("-") else 1.0
    up = sign * np.eye(3)[axis]
    ahead = np.eye(3)[(axis + 1) % 3]
    return np.stack([ahead, np.cross(up, ahead), up])


def _places(file: Untyped, markers: Sequence[str], source: str) -> tuple[Array, NDArray[np.bool_]]:
    """(n, m, 3) places of the markers in every frame, and (n,) whether a frame has all of them."""
    labels = _labels(file)
    for name in markers:
        if name not in labels:
            raise LevelheadError(f"{source} has no marker {name!r}; {nearest(name, labels)}")
    if len(set(markers)) < 3:
        raise LevelheadError(f"{source}: {', '.join(markers)} is not a rigid body; expected three markers or more")
    rows = [labels.index(name) for name in markers]
    points = np.ascontiguousarray(file["data"]["points"][:3, rows].transpose(2, 1, 0), np.float64)
    known = np.isfinite(points).all(axis=(1, 2)) & (file["data"]["meta_points"]["residuals"][0, rows] >= 0.0).all(
        axis=0
    )
    if not known.any():
        raise LevelheadError(f"{source}: no frame has all of {', '.join(markers)}")
    return points, known
