"""A ground station's log of MAVLink (.tlog): a time of 8 bytes, µs since 1970, before each message.

Only the readings of an IMU are taken, of the best kind of message that there is, and the autopilot's own attitude.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array
from levelhead.rotations import from_angles
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.attitude import attitude_track
from levelhead.sources.formats.mavlink_codec import (
    ATTITUDE,
    ATTITUDE_QUATERNION,
    HIGHRES_IMU,
    RAW_IMU,
    SCALED_IMU,
    V1,
    V2,
    frame_at,
)
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable
from levelhead.track import Track
from levelhead.units import GRAVITY

STAMP = 8  # bytes
NAMES = {HIGHRES_IMU: "HIGHRES_IMU", SCALED_IMU: "SCALED_IMU", RAW_IMU: "RAW_IMU"}  # the best one first
MILLI = {"gyr": 1e-3, "acc": 1e-3 * GRAVITY, "mag": 0.1}  # mrad/s, mG, mgauss
FINE = {"gyr": 1.0, "acc": 1.0, "mag": 100.0}  # rad/s, m/s², gauss
UNITS = {"gyr": "rad/s", "acc": "m/s²", "mag": "µT"}
Source = tuple[int, int, int]  # message, system, component


def tables(path: Path, display_path: str, hints: Hints) -> Sequence[ArrayTable]:
    """One table for each sender of the best kind of message.

    Raises:
        LevelheadError: no log of MAVLink, or without readings of an IMU.
    """
    found = _read(path)
    kind = next((number for number in NAMES if any(source[0] == number for source in found)), None)
    if kind is None:
        raise LevelheadError(
            f"{display_path} holds no HIGHRES_IMU, SCALED_IMU or RAW_IMU; expected a .tlog with one of them"
        )
    return [
        ArrayTable(
            display_path, _columns(kind, rows), context=f"{NAMES[kind]} of {system}.{component}",
            conclusions=[Conclusion("frame", "ulog", "x forward, z down", Basis.HEADER, {"topic": NAMES[kind]})],
        )
        for (number, system, component), rows in found.items()
        if number == kind
    ]  # fmt: skip


def _columns(kind: int, rows: Mapping[str, Array]) -> dict[str, Array]:
    columns = {"time [s]": _seconds(rows)}
    for sensor, scale in (FINE if kind == HIGHRES_IMU else MILLI).items():
        word = "gyro" if sensor == "gyr" else sensor
        values = {axis: scale * rows[f"{axis}{word}"] for axis in "xyz"}
        if sensor != "mag" or any(one.any() for one in values.values()):
            columns |= {f"{sensor}_{axis} [{UNITS[sensor]}]": one for axis, one in values.items()}
    return columns


def attitudes(path: Path) -> dict[str, Track]:
    """The autopilot's own orientation, forward-right-down in north-east-down, by the name of its message."""
    found = {}
    for (number, system, component), rows in _read(path).items():
        where = f"of {system}.{component}"
        if number == ATTITUDE_QUATERNION:
            quat = np.stack([rows[f"q{i}"] for i in (1, 2, 3, 4)], axis=1)
            found[f"ATTITUDE_QUATERNION {where}"] = attitude_track(_seconds(rows), quat)
        elif number == ATTITUDE:
            quat = from_angles(rows["roll"], rows["pitch"], rows["yaw"])
            found[f"ATTITUDE {where}"] = attitude_track(_seconds(rows), quat)
    return found


def _seconds(rows: Mapping[str, Array]) -> Array:
    """By the autopilot's clock."""
    return 1e-3 * rows["time_boot_ms"] if "time_boot_ms" in rows else 1e-6 * rows["time_usec"]


def _read(path: Path) -> dict[Source, dict[str, Array]]:
    """The fields of the messages that are wanted; bytes outside of messages are passed over."""
    data = path.read_bytes()
    wanted = {*NAMES, ATTITUDE, ATTITUDE_QUATERNION}
    rows: dict[Source, list[dict[str, float]]] = defaultdict(list)
    at = STAMP
    while at < len(data):
        end, message = frame_at(data, at)
        if message is not None and message.number in wanted:
            rows[message.number, message.system, message.component].append(message.fields)
        if end == 0 or (end + STAMP < len(data) and data[end + STAMP] not in (V1, V2)):
            at += 1  # damage
        else:
            at = end + STAMP
    return {
        source: {name: np.array([row[name] for row in some], np.float64) for name in some[0]}
        for source, some in rows.items()
    }
