"""BIDS motion: a table without header, ``*_motion.tsv``, whose columns ``*_channels.tsv`` beside it describes.

By the Brain Imaging Data Structure, 1.9, "Motion": channels.tsv has a row for each column with name, component, type
(ACCEL, GYRO, MAGN, ORNT, LATENCY, …), tracked_point, units and sampling_frequency.
"""

import csv
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject
from levelhead.sources.table import ArrayTable

_TYPES = {"ACCEL": "acc", "GYRO": "gyr", "MAGN": "mag", "LATENCY": "t"}
_END, _CHANNELS = "_motion.tsv", "_channels.tsv"
_ABSENT = "n/a"


def find_motion(path: Path) -> Path | None:
    """The table of a BIDS motion recording: a file, or the only one in a folder; None if there is none."""
    if path.is_dir():
        found = sorted(path.rglob(f"*{_END}"))
        return found[0] if len(found) == 1 and _channels(found[0]).is_file() else None
    return path if path.name.endswith(_END) and _channels(path).is_file() else None


def _channels(path: Path) -> Path:
    return path.with_name(path.name.removesuffix(_END) + _CHANNELS)


def motion_tables(path: Path) -> list[ArrayTable]:
    """A table for each tracked point.

    Raises:
        LevelheadError: the two files do not fit.
    """
    with open(_channels(path), encoding="utf-8", newline="") as file:
        channels = list(csv.DictReader(file, delimiter="\t"))
    try:
        rows = np.genfromtxt(path, delimiter="\t", missing_values=_ABSENT, ndmin=2)
    except ValueError as error:
        raise LevelheadError(f"{path} is not a table of numbers, as BIDS motion wants it ({error})") from None
    if rows.shape[1] != len(channels):
        raise LevelheadError(
            f"{path} has {rows.shape[1]} columns and {_channels(path).name} describes {len(channels)}; expected as many"
        )
    points = list(dict.fromkeys(str(one.get("tracked_point", _ABSENT)) for one in channels))
    made = []
    for point in points:
        columns: JsonObject = {}
        rates = set()
        for k, one in enumerate(channels):
            role = _TYPES.get(str(one.get("type", "")).upper())
            if role is None or (role != "t" and one.get("tracked_point", _ABSENT) != point):
                continue
            unit = str(one.get("units") or _ABSENT)
            suffix = "" if unit == _ABSENT else f" [{unit}]"
            name = "t" if role == "t" else f"{role}_{str(one.get('component', '')).lower()}"
            columns[name + suffix] = rows[:, k]
            rates.add(str(one.get("sampling_frequency", _ABSENT)))
        if len(columns) > 2:
            made.append(ArrayTable(str(path), columns, rate=_rate(rates), context="" if point == _ABSENT else point))
    if not made:
        raise LevelheadError(f"{path} has no channels of type ACCEL and GYRO; expected an inertial sensor's")
    return made


def _rate(rates: set[str]) -> float | None:
    try:
        rate = float(next(iter(rates))) if len(rates) == 1 else 0.0
    except ValueError:
        return None
    return rate if rate > 0.0 else None
