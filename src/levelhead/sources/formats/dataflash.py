"""ArduPilot's DataFlash log, binary: messages that FMT messages describe.

The format is described in the ArduPilot development guide ("Log format"): each message begins with 0xA3 0x95 and its
type; type 128 gives type, length, name, format letters and names of another one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.rotations import from_angles
from levelhead.sources.conclusions import Conclusion
from levelhead.sources.formats.attitude import attitude_track
from levelhead.sources.hints import Hints
from levelhead.sources.place import satellite_place
from levelhead.sources.table import ArrayTable
from levelhead.track import Track

_MARK, _FMT, _FMT_LENGTH = b"\xa3\x95", 128, 89
_TYPES = {
    "b": "<i1", "B": "<u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "f": "<f4", "d": "<f8", "g": "<f2",
    "c": "<i2", "C": "<u2", "e": "<i4", "E": "<u4", "L": "<i4", "M": "<u1", "q": "<i8", "Q": "<u8",
    "n": "S4", "N": "S16", "Z": "S64", "a": "S64",
}  # fmt: skip
GPS_EPOCH, WEEK = 315_964_800.0, 604_800.0  # s: 1980-01-06 since 1970
_HUNDREDTHS = frozenset("cCeE")
_UNITS = {"Gyr": "rad/s", "Acc": "m/s²", "Mag": "mG"}
_SENSORS = ("IMU", "MAG", "GYR", "ACC")


def tables(path: Path, display_path: str, hints: Hints) -> Sequence[ArrayTable]:
    """One table for each inertial unit and each compass.

    Raises:
        LevelheadError: no DataFlash log, or without IMU messages.
    """
    raw = path.read_bytes()
    if _MARK + bytes([_FMT]) not in raw[:4096]:
        raise LevelheadError(
            f"{display_path} is not a DataFlash log of ArduPilot: it does not begin with an FMT message"
        )
    kinds, starts = _scan(raw)
    found = []
    for number, (name, dtype, letters) in kinds.items():
        if name.startswith(_SENSORS) and (places := starts.get(number)):
            found += _tables(display_path, name, _rows(raw, places, dtype), letters)
    if not found:
        raise LevelheadError(f"{display_path} has no IMU messages; expected a log with LOG_BITMASK's IMU bit set")
    for number, (name, dtype, letters) in kinds.items():
        if name == "GPS" and (places := starts.get(number)):
            place = _place(_columns(_rows(raw, places, dtype), letters))
            if place is not None:
                found[0] = replace(found[0], conclusions=[*found[0].conclusions, place])
    return found


def _place(columns: Mapping[str, NDArray[Any]]) -> Conclusion | None:
    """The place by GPS messages: 1e-7 degrees, m, and GPS weeks with ms in them."""
    if not {"Lat", "Lng"} <= columns.keys():
        return None
    unix = None
    if {"GMS", "GWk"} <= columns.keys():
        unix = float((GPS_EPOCH + WEEK * columns["GWk"].astype(np.float64) + 1e-3 * columns["GMS"]).max())
    lat, lng = (columns[name].astype(np.float64) for name in ("Lat", "Lng"))
    return satellite_place(lat, lng, columns.get("Alt"), unix, "GPS messages")


def attitudes(path: Path) -> dict[str, Track]:
    """The autopilot's own orientation, of its ATT messages: forward-right-down in north-east-down."""
    raw = path.read_bytes()
    kinds, starts = _scan(raw)
    found = {}
    for number, (name, dtype, letters) in kinds.items():
        if name == "ATT" and {"TimeUS", "Roll", "Pitch", "Yaw"} <= set(dtype.names or ()) and number in starts:
            columns = _columns(_rows(raw, starts[number], dtype), letters)
            angles = (np.radians(columns[axis].astype(np.float64)) for axis in ("Roll", "Pitch", "Yaw"))
            found[name] = attitude_track(1e-6 * columns["TimeUS"].astype(np.float64), from_angles(*angles))
    return found


def _rows(raw: bytes, places: Sequence[int], dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """The messages of one type."""
    return np.frombuffer(b"".join(raw[place + 3 : place + 3 + dtype.itemsize] for place in places), dtype)


def _scan(raw: bytes) -> tuple[dict[int, tuple[str, np.dtype[np.void], str]], dict[int, list[int]]]:
    """The FMT messages, and where the messages of each type begin; torn ones are skipped."""
    kinds: dict[int, tuple[str, np.dtype[np.void], str]] = {}
    lengths = {_FMT: _FMT_LENGTH}
    starts: dict[int, list[int]] = {}
    at = 0
    while (at := raw.find(_MARK, at)) >= 0 and at + 3 <= len(raw):
        kind = raw[at + 2]
        length = lengths.get(kind)
        if length is None or at + length > len(raw):
            at += 2
            continue
        if kind == _FMT:
            number, size = raw[at + 3], raw[at + 4]
            name, letters, columns = (
                part.split(b"\0")[0].decode("ascii", "replace")
                for part in (raw[at + 5 : at + 9], raw[at + 9 : at + 25], raw[at + 25 : at + 89])
            )
            titles = columns.split(",")
            if len(titles) == len(letters) and all(letter in _TYPES for letter in letters):
                dtype = np.dtype([(title, _TYPES[letter]) for title, letter in zip(titles, letters, strict=True)])
                if dtype.itemsize + 3 == size:
                    kinds[number], lengths[number] = (name, dtype, letters), size
        else:
            starts.setdefault(kind, []).append(at)
        at += length
    return kinds, starts


def _columns(rows: NDArray[np.void], letters: str) -> dict[str, NDArray[np.number]]:
    """Columns of numbers by their names, with units where these are known."""
    columns = {}
    for title, letter in zip(rows.dtype.names or (), letters, strict=True):
        if rows[title].dtype.kind in "iuf":
            unit = _UNITS.get(title[:3])
            values = rows[title].astype(np.float64) / 100.0 if letter in _HUNDREDTHS else rows[title]
            columns[f"{title} [{unit}]" if unit and title[3:] in ("X", "Y", "Z") else title] = values
    return columns


def _tables(display_path: str, name: str, rows: NDArray[np.void], letters: str) -> list[ArrayTable]:
    columns = _columns(rows, letters)
    if "I" in columns and len(np.unique(columns["I"])) > 1:
        return [
            ArrayTable(
                display_path,
                {title: column[columns["I"] == i] for title, column in columns.items()},
                context=f"{name} {i}",
            )
            for i in np.unique(columns["I"])
        ]
    return [ArrayTable(display_path, columns, context=name)]
