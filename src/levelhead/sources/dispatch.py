"""Which reader takes which file."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from levelhead.errors import LevelheadError, nearest
from levelhead.recording import Recording
from levelhead.sources.hints import Hints
from levelhead.sources.table import Table

_HDF5 = b"\x89HDF\r\n\x1a\n"
_BINARY = {_HDF5: "HDF5 (.h5)", b"PK\x03\x04": "a ZIP archive (.npz, .xlsx)", b"PAR1": "Parquet (.parquet)"}
_BINARY |= {b"\x1f\x8b": "compressed with gzip", b"MATLAB 5.0": "MATLAB (.mat)", b"\x93NUMPY": "NumPy (.npy)"}


def _text(path: Path, hints: Hints) -> Table:
    from levelhead.sources.json_lines import json_lines, looks_like_json
    from levelhead.sources.text import TextTable

    if looks_like_json(path):
        return json_lines(path)
    head = _head(path)
    for signature, what in _BINARY.items():
        if head.startswith(signature):
            raise LevelheadError(
                f"{path} is named like text but is {what}; expected lines of numbers, or the right suffix"
            )
    table = TextTable(path)
    if table.layout.headless and not {"gyr", "acc"} <= set(hints.map):
        raise LevelheadError(
            f"{path} has no header that names its {len(table.names)} columns; expected hints such as "
            "map t=1 gyr=2,3,4 acc=5,6,7 (columns by number)"
        )
    return table


def _matlab(path: Path, hints: Hints) -> Table:
    with open(path, "rb") as file:
        hdf5 = _HDF5 in (file.read(8), file.seek(512) and file.read(8))
    if hdf5:
        return _hdf5(path, hints)
    from levelhead.sources.matlab import matlab

    return matlab(path)


def _hdf5(path: Path, hints: Hints) -> Table:
    from levelhead.sources.hdf5 import hdf5

    return hdf5(path)


def _npz(path: Path, hints: Hints) -> Table:
    from levelhead.sources.npz import table

    return table(path)


def _parquet(path: Path, hints: Hints) -> Table:
    from levelhead.sources.arrow import parquet

    return parquet(path)


def _bag(path: Path, hints: Hints) -> Table:
    from levelhead.sources.rosbag import bag

    return bag(path, hints)


def _json(path: Path, hints: Hints) -> Table:
    from levelhead.sources.json_lines import json_lines

    return json_lines(path)


def _mcap(path: Path, hints: Hints) -> Table:
    raise LevelheadError(f"{path} has no columns; levelhead.read and levelhead fuse take it whole")


READERS: dict[str, Callable[[Path, Hints], Table]] = {
    **dict.fromkeys((".csv", ".tsv", ".txt", ".log", ".dat"), _text),
    ".mat": _matlab,
    **dict.fromkeys((".h5", ".hdf5"), _hdf5),
    ".npz": _npz,
    **dict.fromkeys((".parquet", ".pq"), _parquet),
    **dict.fromkeys((".bag", ".db3"), _bag),
    **dict.fromkeys((".jsonl", ".ndjson"), _json),
    ".mcap": _mcap,
}


Reader = Callable[[Path, Hints], Table]
_Made = TypeVar("_Made")


def read_file(path: str | os.PathLike[str], hints: Hints) -> Recording:
    """The recording in ``path``, by the reader that its suffix asks for.

    Raises:
        LevelheadError: see ``opened``.
    """
    from levelhead.sources.assemble import assemble

    def made(file: Path, reader: Reader) -> Recording:
        if reader is _npz:
            from levelhead.sources.npz import read

            return read(file, hints)
        if reader is _mcap and not _is_box(file):
            reader = _bag
        if reader is _bag:
            from levelhead.sources.rosbag import without_topics

            return assemble(_bag(file, hints), without_topics(hints))
        if reader is _mcap:
            from levelhead.sources.blackbox import box_recording

            if hints.given:
                raise LevelheadError(f"{file} says itself what is in it; map, units, lsb and rate are for other files")
            return box_recording(file)
        return assemble(reader(file, hints), hints)

    return opened(path, made)


def opened(path: str | os.PathLike[str], use: Callable[[Path, Reader], _Made]) -> _Made:
    """What ``use`` makes of a file and the reader that its suffix asks for.

    Raises:
        LevelheadError: missing, a folder, empty, unreadable, unknown suffix, or what its reader says.
    """
    file = Path(path)
    try:
        if (file / "metadata.yaml").is_file():
            return use(file, _bag)
        if file.is_dir():
            raise LevelheadError(f"{file} is a folder; expected a file with a recording, or the folder of a ROS 2 bag")
        if not file.exists():
            raise LevelheadError(f"there is no file {file}{_neighbour(file)}")
        if file.stat().st_size == 0:
            raise LevelheadError(f"{file} is empty; expected a recording")
        reader = READERS.get(file.suffix.lower())
        if reader is None:
            raise LevelheadError(
                f"{file} is not a recording that levelhead reads: it ends in '{file.suffix}'; "
                f"expected one of {' '.join(READERS)}"
            )
        return use(file, reader)
    except (OSError, ValueError) as error:
        if isinstance(error, LevelheadError):
            raise
        raise LevelheadError(f"cannot read {file}: {getattr(error, 'strerror', None) or error}") from None
    except MemoryError:
        raise LevelheadError(f"cannot read {file}: it asks for more memory than there is") from None


def _is_box(file: Path) -> bool:
    """Whether an MCAP file is a node's black box and no ROS bag: its header, the first record, says so."""
    with open(file, "rb") as stream:
        return b"ros" not in stream.read(64)


def _neighbour(file: Path) -> str:
    try:
        names = [entry.name for entry in file.parent.iterdir() if entry.is_file()]
    except OSError:
        return f": there is no folder {file.parent} that could be read"
    hint = nearest(file.name, names)
    return f"; {hint}" if hint.startswith("did you mean") else "; expected the path of a recording"


def _head(path: Path) -> bytes:
    with open(path, "rb") as file:
        return file.read(16)
