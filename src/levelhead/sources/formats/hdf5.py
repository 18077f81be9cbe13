"""HDF5, which MATLAB files of version 7.3 are too."""

import os
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject, Untyped
from levelhead.sources.formats.named_arrays import tabulate
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable


def hdf5(path: str | os.PathLike[str], display_path: str | None = None) -> ArrayTable:
    """The datasets of an HDF5 file as columns; an attribute "unit" or "units" counts.

    Raises:
        LevelheadError: h5py is not installed; truncated, damaged, or no HDF5 at all.
    """
    source = display_path or os.fspath(path)
    try:
        import h5py
    except ImportError:
        raise LevelheadError(f"{source} is HDF5; reading it needs h5py: pip install 'levelhead[formats]'") from None
    arrays: JsonObject = {}
    units: dict[str, str] = {}
    texts: list[str] = []
    made_by_matlab = False

    def visit(name: str, item: Untyped) -> None:
        nonlocal made_by_matlab
        if not isinstance(item, h5py.Dataset) or name.startswith("#") or item.ndim > 2 or item.dtype.kind not in "iufb":
            return
        matlab_class = _text(item.attrs.get("MATLAB_class"))
        made_by_matlab |= bool(matlab_class)
        if matlab_class == "char":
            texts.append("".join(chr(int(code)) for code in np.asarray(item[()]).T.reshape(-1)))
            return
        arrays[name] = item[()]
        if item.name.endswith("starting_time") and "rate" in item.attrs:  # NWB's TimeSeries
            arrays[name.removesuffix("starting_time") + "rate"] = np.array(float(item.attrs["rate"]))
        conversion = float(item.attrs.get("conversion", 1.0))
        if conversion != 1.0 and np.isfinite(conversion):
            arrays[name] = arrays[name] * conversion
        if unit := _text(item.attrs.get("units", item.attrs.get("unit"))):
            units[name] = unit

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
    except MemoryError:
        raise
    except Exception as error:  # h5py raises many kinds for a damaged file
        raise LevelheadError(f"{source} is not an HDF5 file, or it is truncated or damaged") from error
    return tabulate(source, arrays, "\n".join(texts), units, made_by_matlab)


def _text(value: Untyped) -> str:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return str(value) if isinstance(value, str) else ""


def tables(path: Path, display_path: str, hints: Hints) -> list[ArrayTable]:
    """The one table of an HDF5 file."""
    return [hdf5(path, display_path)]
