"""MATLAB files up to version 7; version 7.3 is HDF5."""

import os
import struct
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError, require
from levelhead.open_types import JsonObject
from levelhead.sources.formats.hdf5 import hdf5
from levelhead.sources.formats.named_arrays import by_length, tabulate
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable

HDF5 = b"\x89HDF\r\n\x1a\n"
_REFERENCE = ("s0", "s1", "s2", "arr")  # fields of SciPy's result for an object
_HEADER = 128  # bytes
_PLAIN = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18))  # numbers and letters
_FLAGS, _MATRIX, _COMPRESSED = 6, 14, 15
_NESTING = frozenset((1, 2, 3, 16, 17))  # classes that hold matrices: cell, structure, object, function, opaque


def matlab(path: str | os.PathLike[str], display_path: str | None = None) -> ArrayTable:
    """The variables of a .mat file (v4 to v7) as columns; the fields of structures get a dot in their name.

    Raises:
        LevelheadError: truncated, damaged, or no MATLAB file at all.
    """
    require("scipy", "reading MATLAB files", "formats")
    import scipy.io

    source = display_path or os.fspath(path)
    try:
        check_tags(Path(path).read_bytes())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of names that objects share
            variables = scipy.io.loadmat(path)
    except MemoryError:
        raise
    except LevelheadError as error:
        raise LevelheadError(f"{source} is not a MATLAB file, or it is truncated or damaged ({error})") from None
    except Exception as error:  # scipy raises many kinds for a damaged file
        raise LevelheadError(f"{source} is not a MATLAB file, or it is truncated or damaged") from error
    arrays: JsonObject = {}
    texts: list[str] = []
    for name, value in variables.items():
        if not name.startswith("__") and value.dtype.names != _REFERENCE:
            _flatten(name, value, arrays, texts)
    if not any(value.dtype.kind in "biuf" for value in arrays.values()) and _holds_objects(variables):
        raise LevelheadError(
            f"{source} holds timetables or other MATLAB objects, which only MATLAB reads; export one there, such as "
            "AngularVelocity beside Acceleration: writetable(timetable2table(synchronize(Acceleration, "
            "AngularVelocity, 'first', 'linear')), 'log.csv')"
        )
    return tabulate(source, arrays, "\n".join(texts))


def _holds_objects(variables: JsonObject) -> bool:
    """Whether there are objects of classes: SciPy gives their references, not their numbers."""
    import scipy.io.matlab

    return any(isinstance(value, scipy.io.matlab.MatlabOpaque) for value in variables.values())


def _flatten(name: str, value: Any, arrays: JsonObject, texts: list[str]) -> None:
    if not isinstance(value, np.ndarray):
        return
    if value.dtype.kind == "U":
        texts.extend(str(text) for text in value.reshape(-1))
    elif value.dtype.names and value.size == 1:
        for field in value.dtype.names:
            _flatten(f"{name}.{field}", value.reshape(-1)[0][field], arrays, texts)
    elif value.dtype.names:
        arrays |= {f"{name}.{field}": rows for field in value.dtype.names if (rows := _stack(value[field])) is not None}
    elif not value.dtype.names:
        arrays[name] = value


def _stack(cells: NDArray[np.object_]) -> NDArray[np.number] | None:
    """(n, k) numbers of a field of n structures; None if it is not k numbers in each."""
    rows = [np.asarray(cell).reshape(-1) for cell in cells.reshape(-1)]
    if len({row.shape for row in rows}) != 1 or any(row.dtype.kind not in "iuf" for row in rows):
        return None
    return np.stack(rows)


def check_tags(raw: bytes) -> None:
    """Walks through all elements of a file of version 5 to 7 that are whole; a file that is cut off is left to SciPy.

    SciPy takes the type from the file for an index, and a damaged one ends the process (SciPy pull request 25829). The
    format: MAT-File Format, MathWorks, 2024, chapter 1. Each element is a tag of 8 bytes, type and size, and the data;
    up to four bytes of data stand in the tag itself. A matrix is a sequence of elements: flags, dimensions, name,
    contents.

    Raises:
        LevelheadError: an element has a type that does not exist, or not there.
    """
    order = {b"\0\1IM": "<", b"\1\0MI": ">"}.get(raw[124:_HEADER])  # version 1, and the order of bytes
    if order is not None:
        _walk(memoryview(raw)[_HEADER:], order, True)


def _walk(data: memoryview, order: str, nesting: bool) -> None:
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(order + "II", data, at)
        small = kind >> 16 != 0
        if small:
            kind, size = kind & 0xFFFF, kind >> 16
        begin = at + (4 if small else 8)
        if size > len(data) - begin:
            return
        _check(data[begin : begin + size], kind, order, nesting)
        at = at + 8 if small else begin + (size if kind == _COMPRESSED else (size + 7) // 8 * 8)


def _check(data: memoryview, kind: int, order: str, nesting: bool) -> None:
    if kind in _PLAIN:
        return
    if not nesting or kind not in (_MATRIX, _COMPRESSED):
        raise LevelheadError(f"data of type {kind}")
    if kind == _COMPRESSED:
        _walk(memoryview(zlib.decompress(data)), order, True)
    elif len(data) >= 12:
        first, _, flags = struct.unpack_from(order + "III", data)
        _walk(data, order, first == _FLAGS and flags & 0xFF in _NESTING)


def tables(path: Path, display_path: str, hints: Hints) -> list[ArrayTable]:
    """The tables of a .mat file, one for arrays of each length; version 7.3 is HDF5."""
    with open(path, "rb") as file:
        is_hdf5 = HDF5 in (file.read(8), file.seek(512) and file.read(8))
    return by_length(hdf5(path, display_path) if is_hdf5 else matlab(path, display_path))
