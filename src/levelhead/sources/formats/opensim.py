"""OpenSim's storage files: orientations of several sensors (``.sto``) and joint angles (``.mot``)."""

import os
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array
from levelhead.track import Track

MAX_SKEW = 1e-2  # of a quaternion's length from 1


def read_sto(path: str | os.PathLike[str]) -> dict[str, Track]:
    """The track of each sensor in a file of orientations, by its column, such as ``femur_r_imu``.

    The file's earth frame is taken as ENU, z up, as OpenSense's sensors have it.

    Raises:
        LevelheadError: no storage file, no quaternions in it, a cell that is none, or stamps that do not increase.
    """
    head, names, rows = _storage(path)
    if head.get("datatype", "").lower() != "quaternion":
        found = head.get("datatype", "numbers")
        raise LevelheadError(f"{path} holds {found}; expected DataType=Quaternion, as OpenSense's orientations have")
    t = _numbers(path, names[0], [row[0] for row in rows])
    tracks = {}
    for i, name in enumerate(names[1:], 1):
        cells = [row[i].split(",") for row in rows]
        wrong = next((k for k, cell in enumerate(cells) if len(cell) != 4), None)
        if wrong is not None:
            raise LevelheadError(f"{path}: {name} is {rows[wrong][i]!r} at {t[wrong]:g} s; expected w,x,y,z")
        quat = np.stack([_numbers(path, name, [cell[k] for cell in cells]) for k in range(4)], axis=1)
        length = np.linalg.norm(quat, axis=1)
        if (off := np.abs(length - 1.0)).max() > MAX_SKEW:
            k = int(off.argmax())
            raise LevelheadError(f"{path}: {name} has length {length[k]:.3g} at {t[k]:g} s; expected a unit quaternion")
        tracks[name] = Track(t, quat / length[:, None])
    return tracks


def read_mot(path: str | os.PathLike[str]) -> tuple[Array, dict[str, Array]]:
    """Stamps (n,) in s, and the columns (n,) of a motion file; angles in degrees, whatever the file's unit.

    Raises:
        LevelheadError: not a storage file, a cell that is not a number, or stamps that do not increase.
    """
    head, names, rows = _storage(path)
    columns = [_numbers(path, name, [row[i] for row in rows]) for i, name in enumerate(names)]
    scale = 1.0 if head.get("indegrees", "no").lower() == "yes" else 180.0 / np.pi
    return columns[0], {name: scale * values for name, values in zip(names[1:], columns[1:], strict=True)}


def _storage(path: str | os.PathLike[str]) -> tuple[dict[str, str], list[str], list[list[str]]]:
    """The values of the head in lower case keys, the names of the columns, and the rows of cells."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise LevelheadError(f"cannot read {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        text = ""
    lines = text.splitlines()
    end = next((i for i, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None or len(lines) < end + 3:
        raise LevelheadError(f"{path} is not a storage file of OpenSim; expected a head, endheader, names and rows")
    pairs = (line.partition("=") for line in lines[:end])
    head = {key.strip().lower(): value.strip() for key, sign, value in pairs if sign}
    names = lines[end + 1].split()
    rows = [line.split() for line in lines[end + 2 :] if line.strip()]
    short = next((i for i, row in enumerate(rows) if len(row) != len(names)), None)
    if short is not None:
        raise LevelheadError(f"{path} has {len(rows[short])} cells in row {short + 1}; expected {len(names)}")
    return head, names, rows


def _numbers(path: str | os.PathLike[str], name: str, cells: list[str]) -> Array:
    """(n,) numbers of a column; those of the first column must increase."""
    try:
        values = np.array(cells, np.float64)
    except ValueError:
        raise LevelheadError(f"{path}: a cell of {name} is not a number") from None
    if not np.isfinite(values).all():
        raise LevelheadError(f"{path}: {name} has no finite number in row {int(np.argmin(np.isfinite(values))) + 1}")
    if name == "time" and (np.diff(values) <= 0.0).any():
        raise LevelheadError(f"{path}: the time steps back in row {int(np.argmax(np.diff(values) <= 0.0)) + 2}")
    return values
