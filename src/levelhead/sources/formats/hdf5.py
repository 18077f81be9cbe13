"""HDF5, which MATLAB files of version 7.3 are too."""

import os
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject, Untyped
from levelhead.sources.formats.named_arrays import rate_of, tabulate, with_rate
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable


def hdf5(path: str | os.PathLike[str], display_path: str | None = None) -> ArrayTable:
    """The datasets of an HDF5 file as columns; an attribute "unit" or "units" counts, and a rate of a group.

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
    items: dict[str, list[str]] = {}
    rates: set[float] = set()  # of the groups; of several none
    made_by_matlab = False

    def visit(name: str, item: Untyped) -> None:
        nonlocal made_by_matlab
        if not isinstance(item, h5py.Dataset):
            rates.update(_rates(source, item.attrs))
            return
        if item.dtype.names and item.ndim == 1:  # a table, as PyTables writes them
            arrays.update(
                {field if field not in arrays else f"{name}/{field}": item[field] for field in item.dtype.names}
            )
            return
        if name.endswith("_items") and item.dtype.kind in "SO":  # names beside a matrix: pandas
            items[name.removesuffix("_items")] = [_text(one) for one in item[()].tolist()]
        if name.startswith("#") or item.ndim > 2 or item.dtype.kind not in "iufb":
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
            rates |= _rates(source, file.attrs)
            file.visititems(visit)
    except MemoryError:
        raise
    except Exception as error:  # h5py raises many kinds for a damaged file
        raise LevelheadError(f"{source} is not an HDF5 file, or it is truncated or damaged") from error
    for block, names in items.items():
        if (matrix := arrays.get(f"{block}_values")) is not None and matrix.shape[1:] == (len(names),):
            arrays |= {name: matrix[:, i] for i, name in enumerate(names)}
            del arrays[f"{block}_values"]
    table = tabulate(source, arrays, "\n".join(texts), units, made_by_matlab)
    return with_rate(table, rates.pop() if len(rates) == 1 else None)


def _rates(source: str, attributes: Untyped) -> set[float]:
    """The rates in Hz among the attributes of a group."""
    found = {name: np.asarray(value) for name, value in attributes.items()}
    plain = {name: value.item() for name, value in found.items() if value.size == 1 and value.dtype.kind in "iuf"}
    rates = (rate_of(source, name, value) for name, value in plain.items() if value > 0.0)
    return {rate for rate in rates if rate is not None}


def _text(value: Untyped) -> str:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return str(value) if isinstance(value, str) else ""


def tables(path: Path, display_path: str, hints: Hints) -> list[ArrayTable]:
    """The one table of an HDF5 file."""
    return [hdf5(path, display_path)]
