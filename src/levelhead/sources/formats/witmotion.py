"""WitMotion's binary protocol: packets of 11 bytes that begin with 0x55 and their kind, and end with a sum.

Kinds and scales are those of the protocol in WitMotion's manuals: 0x50 date and time, 0x51 acceleration (±16 g),
0x52 rates (±2000 deg/s), 0x54 magnetic field; 0x61 of the Bluetooth units holds both in 20 bytes, without a sum.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.recording import Array
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable, Column

_MARK, _SIZE, _BOTH, _BOTH_SIZE = 0x55, 11, 0x61, 20
_TIME, _ACC, _GYR, _MAG = 0x50, 0x51, 0x52, 0x54
_KINDS = range(0x50, 0x5B)
_SHARE = 0.8  # of the bytes that are in packets, from which it is such a file
_PER_G, _PER_DEGREE = 32768.0 / 16.0, 32768.0 / 2000.0
_NS = 1_000_000_000


def is_witmotion(head: bytes) -> bool:
    """Whether bytes are such packets, for the most part."""
    data = np.frombuffer(head, np.uint8)
    return _SIZE * len(_starts(data)) > _SHARE * len(data) or _BOTH_SIZE * len(_both(data)) > _SHARE * len(data)


def tables(path: Path, display_path: str, hints: Hints) -> Sequence[ArrayTable]:
    """The samples of a file: a sample begins with each packet of acceleration.

    Raises:
        LevelheadError: no packets with acceleration and rates.
    """
    data = np.frombuffer(path.read_bytes(), np.uint8)
    both = _both(data)
    if _BOTH_SIZE * len(both) > _SHARE * len(data):
        values = _shorts(data, both, 6)
        return [_table(display_path, {"acc": values[:, :3], "gyr": values[:, 3:]}, None)]
    starts = _starts(data)
    kinds = data[starts + 1]
    if not {_ACC, _GYR} <= set(kinds.tolist()):
        raise LevelheadError(f"{display_path} has no packets of WitMotion's with acceleration (0x51) and rates (0x52)")
    samples = np.cumsum(kinds == _ACC) - 1  # packets before the first acceleration are of no sample
    count = int(samples[-1]) + 1
    placed: dict[str, Array] = {}
    for role, kind in (("acc", _ACC), ("gyr", _GYR), ("mag", _MAG)):
        chosen = (kinds == kind) & (samples >= 0)
        if chosen.any():
            placed[role] = np.full((count, 3), np.nan)
            placed[role][samples[chosen]] = _shorts(data, starts[chosen], 3)
    clock = kinds == _TIME
    stamps = None
    if clock.sum() > 0.9 * count:
        of_sample = np.clip(np.searchsorted(np.flatnonzero(clock), np.flatnonzero(kinds == _ACC), "right") - 1, 0, None)
        stamps = _stamps(data, starts[clock])[of_sample]
    return [_table(display_path, placed, stamps)]


def _table(source: str, values: Mapping[str, Array], stamps: NDArray[np.int64] | None) -> ArrayTable:
    columns: dict[str, Column] = {} if stamps is None else {"t [ns]": stamps}
    scales = {"acc": (_PER_G, " [g]"), "gyr": (_PER_DEGREE, " [deg/s]"), "mag": (1.0, "")}
    for role, axes in values.items():
        per_unit, unit = scales[role]
        columns |= {f"{role}_{axis}{unit}": axes[:, i] / per_unit for i, axis in enumerate("xyz")}
    return ArrayTable(source, columns)


def _starts(data: NDArray[np.uint8]) -> NDArray[np.intp]:
    """Where packets begin whose sum is right."""
    if len(data) < _SIZE:
        return np.empty(0, np.intp)
    likely = np.flatnonzero(data[: 1 - _SIZE] == _MARK)
    likely = likely[np.isin(data[likely + 1], np.array(_KINDS))]
    packets = data[likely[:, None] + np.arange(_SIZE)]
    good: NDArray[np.intp] = likely[packets[:, :-1].sum(axis=1) % 256 == packets[:, -1]]
    return good


def _both(data: NDArray[np.uint8]) -> NDArray[np.intp]:
    """Where packets of 20 bytes begin; the next one follows each."""
    if len(data) < 2 * _BOTH_SIZE:
        return np.empty(0, np.intp)
    starts = np.flatnonzero((data[: 1 - _BOTH_SIZE] == _MARK) & (data[1 : 2 - _BOTH_SIZE] == _BOTH))
    followed = (starts + _BOTH_SIZE >= len(data) - 1) | np.isin(starts + _BOTH_SIZE, starts)
    kept: NDArray[np.intp] = starts[followed]
    return kept


def _shorts(data: NDArray[np.uint8], starts: NDArray[np.intp], count: int) -> Array:
    """(n, count) signed numbers of two bytes, low byte first, behind the two bytes of the head."""
    raw = np.ascontiguousarray(data[starts[:, None] + 2 + np.arange(2 * count)])
    values: Array = raw.view("<i2").astype(np.float64)
    return values


def _stamps(data: NDArray[np.uint8], starts: NDArray[np.intp]) -> NDArray[np.int64]:
    """(n,) ns since 1970 of packets with date and time."""
    packets = data[starts[:, None] + 2 + np.arange(8)].astype(np.int64)
    year, month, day, hour, minute, second = packets[:, :6].T
    months = (year + 30).astype("datetime64[Y]").astype("datetime64[M]") + (month - 1)  # years since 1970
    days = months.astype("datetime64[D]").astype(np.int64) + day - 1
    millis = packets[:, 6] + 256 * packets[:, 7]
    stamps: NDArray[np.int64] = (((days * 24 + hour) * 60 + minute) * 60 + second) * _NS + millis * (_NS // 1000)
    return stamps
