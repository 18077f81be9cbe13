"""MATLAB files up to version 7; version 7.3 is HDF5."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from levelhead.errors import LevelheadError, require
from levelhead.open_types import Fields
from levelhead.sources.formats.hdf5 import hdf5
from levelhead.sources.formats.matlab_tags import check_tags
from levelhead.sources.formats.named_arrays import by_length, tabulate
from levelhead.sources.hints import Hints
from levelhead.sources.names.column_name import understand
from levelhead.sources.table import ArrayTable

HDF5 = b"\x89HDF\r\n\x1a\n"


def matlab(path: str | os.PathLike[str], shown: str | None = None) -> ArrayTable:
    """The variables of a .mat file (v4 to v7) as columns; the fields of structures get a dot in their name.

    Raises:
        LevelheadError: truncated, damaged, or no MATLAB file at all.
    """
    require("scipy", "reading MATLAB files", "formats")
    import scipy.io

    source = shown or os.fspath(path)
    try:
        check_tags(Path(path).read_bytes())
        variables = scipy.io.loadmat(path)
    except MemoryError:
        raise
    except LevelheadError as error:
        raise LevelheadError(f"{source} is not a MATLAB file, or it is truncated or damaged ({error})") from None
    except Exception as error:  # scipy raises many kinds for a damaged file
        raise LevelheadError(f"{source} is not a MATLAB file, or it is truncated or damaged") from error
    arrays: Fields = {}
    texts: list[str] = []
    for name, value in variables.items():
        if not name.startswith("__"):
            _flatten(name, value, arrays, texts)
    return tabulate(source, arrays, "\n".join(texts))


def _flatten(name: str, value: Any, arrays: Fields, texts: list[str]) -> None:
    if not isinstance(value, np.ndarray):
        return
    if value.dtype.kind == "U":
        texts.extend(str(text) for text in value.reshape(-1))
    elif value.dtype.names and value.size == 1:
        for field in value.dtype.names:
            _flatten(f"{name}.{field}", value.reshape(-1)[0][field], arrays, texts)
    elif not value.dtype.names:
        arrays[name] = value


def tables(path: Path, shown: str, hints: Hints) -> list[ArrayTable]:
    """The one table of a .mat file; version 7.3 is HDF5."""
    with open(path, "rb") as file:
        is_hdf5 = HDF5 in (file.read(8), file.seek(512) and file.read(8))
    table = hdf5(path, shown) if is_hdf5 else matlab(path, shown)
    known = [understand(name) for name in table.names]
    unnamed = [i for i, name in enumerate(table.names) if name.endswith("]") and "[" in name and not known[i].role]
    times = [i for i, name in enumerate(known) if name.role == "t"]
    if len(unnamed) == 6 and len(times) == 1 and not {"gyr", "acc"} & {name.role for name in known} and not hints.map:
        from levelhead.sources.interpret.converter_counts import with_sensors

        return [with_sensors(table, unnamed, times[0]) or table]
    return list(by_length(table))
