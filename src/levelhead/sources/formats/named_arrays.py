"""From named arrays, as MATLAB, HDF5 and NumPy files hold them, to a table of columns."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.sources.names.column_name import understand
from levelhead.sources.table import ArrayTable

_RATES = {"samplingrate", "samplerate", "samplingfrequency", "samplefrequency", "rate", "fs", "freq", "frequency", "hz"}
_STEPS = {"dt", "sampleperiod", "samplingperiod", "ts", "sampletime", "deltat"}
_SAYS_UNIT = re.compile(r"`(?:imu_)?(gyr|acc|mag)` in (\S+?)[,;.)]?(?=\s|$)")
VECTOR_AXES = {3: "xyz", 4: "wxyz"}  # by the numbers of one reading
_MAX_COLUMNS = 64  # of a matrix


def tabulate(
    source: str, arrays: Mapping[str, NDArray[Any]], info: str = "", units: Mapping[str, str] | None = None,
    transposed: bool = False,
) -> ArrayTable:  # fmt: skip
    """Columns from arrays: (n, 3) ``imu_gyr`` becomes imu_gyr.x, imu_gyr.y, imu_gyr.z; (n, 4) w, x, y, z.

    (3, n) arrays are turned; ``transposed`` settles it where both would fit. A scalar called sampling_rate, fs, … is
    the rate in Hz, one called dt, … its inverse. ``info`` is a text that may hold "`imu_gyr` in rad/s", as BROAD's.

    Raises:
        LevelheadError: no arrays at all, or a rate that is none.
    """
    columns: dict[str, NDArray[Any]] = {}
    rate: float | None = None
    for name, raw in arrays.items():
        array = np.asarray(raw)
        if array.dtype.kind not in "iufb":
            continue
        if array.size == 1:
            rate = rate_of(source, name, float(array.reshape(-1)[0])) or rate
        elif array.ndim <= 2:
            columns |= _columns(name, array, (units or {}).get(name), transposed)
    if not columns:
        raise LevelheadError(f"{source} holds no arrays of numbers; expected such as gyr (n, 3), acc (n, 3) and t (n,)")
    return ArrayTable(source, columns, dict(_SAYS_UNIT.findall(info)), rate)


def with_rate(table: ArrayTable, rate: float | None) -> ArrayTable:
    """The table with a rate that stands beside it; stamps outrank it, since it may be of something else (a radio)."""
    is_timed = table.rate is not None or any(understand(name, table.context).role == "t" for name in table.names)
    return table if is_timed else replace(table, rate=rate)


def by_length(table: ArrayTable) -> list[ArrayTable]:
    """Tables of columns that are as long as each other; of several, those that hold sensors."""
    lengths = {len(array) for array in table.arrays.values()}
    if len(lengths) == 1:
        return [table]
    found = []
    for length in sorted(lengths, reverse=True):
        arrays = {name: array for name, array in table.arrays.items() if len(array) == length}
        roles = {name.role for name in map(understand, arrays) if name.axis}
        if roles & {"gyr", "acc", "mag"}:
            found.append(ArrayTable(table.source, arrays, table.units, table.rate, table.conclusions, ""))
            if {"gyr", "acc"} <= roles:
                return found[-1:]
    return found or [table]


def rate_of(source: str, name: str, value: float) -> float | None:
    """The rate in Hz that a scalar called sampling_rate, fs, dt, … gives; None for any other name.

    Raises:
        LevelheadError: it is not above 0.
    """
    key = re.sub(r"[^a-z]", "", name.rsplit("/", maxsplit=1)[-1].rsplit(".", maxsplit=1)[-1].lower())
    if key not in _RATES | _STEPS:
        return None
    if not (np.isfinite(value) and value > 0.0):
        raise LevelheadError(f"{source}: {name} is {value:g}; expected a number above 0")
    return value if key in _RATES else 1.0 / value


def _columns(name: str, array: NDArray[Any], unit: str | None, transposed: bool) -> dict[str, NDArray[Any]]:
    """The columns of one array, by their names."""
    suffix = f" [{unit}]" if unit else ""
    if array.ndim == 1 or 1 in array.shape:
        return {name + suffix: array.reshape(-1)}
    width = 4 if understand(f"{name}.w").role == "q" else 3
    if _has_samples_in_columns(array, width, transposed):
        array = array.T
    if array.shape[1] == 4 and width != 4 and len(array) > 4 and (np.diff(array[:, 0]) > 0).all():  # time, x, y, z
        axes = {f"{name}.{letter}{suffix}": array[:, i + 1] for i, letter in enumerate("xyz")}
        return {"time": array[:, 0], **axes}
    letters = VECTOR_AXES.get(array.shape[1])
    if letters is None:
        return {f"{name}[{i}]{suffix}": array[:, i] for i in range(min(array.shape[1], _MAX_COLUMNS))}
    return {f"{name}.{letter}{suffix}": array[:, i] for i, letter in enumerate(letters)}


def _has_samples_in_columns(array: NDArray[Any], width: int, transposed: bool) -> bool:
    """Whether each column of a matrix is a sample, of ``width`` numbers as far as its name shows."""
    rows, columns = array.shape
    if rows == width and (transposed or columns != width):
        return True
    return (columns not in VECTOR_AXES and rows in VECTOR_AXES) or (rows <= 12 and columns > 10 * rows)
