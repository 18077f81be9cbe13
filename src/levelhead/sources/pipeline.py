"""From a path to a recording: container, tables, streams, one recording."""

import os
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError, nearest
from levelhead.open_types import Fields
from levelhead.recording import Recording
from levelhead.sources.conclusion import Basis, Conclusion
from levelhead.sources.formats import BY_SUFFIX, CONTAINERS, FORMATS, TEXT, Format
from levelhead.sources.formats.container import Member, members
from levelhead.sources.formats.kitti import is_oxts, oxts_table
from levelhead.sources.hints import Hints, NeedsHints, check
from levelhead.sources.table import Table, add_conclusion, in_memory

_TRIES = 4  # hints that may be missing at once
_BAG = BY_SUFFIX[".bag"]
_READ = frozenset(BY_SUFFIX)


def read_file(path: str | os.PathLike[str], hints: Hints) -> Recording:
    """The recording in ``path``: a file, a folder or an archive.

    Raises:
        LevelheadError: missing, empty, unreadable, or what its reader says; where hints would settle it, the sentence
            ends with the command line that has been tried and works.
    """
    file = Path(path)
    try:
        return _read(file, hints)
    except NeedsHints as error:
        suggested = try_hints(file, hints, error)
        if suggested is None:
            raise LevelheadError(error.sentence) from None
        raise NeedsHints(error.sentence, str(file), **suggested) from None


def try_hints(file: Path, hints: Hints, error: NeedsHints) -> Fields | None:
    """Hints with which the file was read, those of the error and what it lacked beside them; None without success."""
    options = hints.options()
    for _ in range(_TRIES):
        for option, value in error.suggested.items():
            if isinstance(value, dict):
                other = "counts" if option == "units" else "units"
                options[other] = {k: v for k, v in options.get(other, {}).items() if k not in value}
                options[option] = {**options.get(option, {}), **value}
            else:
                options[option] = value
        try:
            known = check(
                **{name: options.get(name) for name in ("map", "units", "counts", "rate", "sensor", "session")}
            )
            _read(file, known)
        except NeedsHints as again:
            if again.suggested == error.suggested:
                return None
            error = again
            continue
        except LevelheadError:
            return None
        return options
    return None


def _read(file: Path, hints: Hints) -> Recording:
    from levelhead.sources.join.merge import recording_from_tables

    try:
        with np.errstate(all="ignore"):  # numbers such as 1e308 may stand in any file
            return _read_own_file(file, hints) or recording_from_tables(str(file), *_open_tables(file, hints))
    except (OSError, ValueError) as error:
        if isinstance(error, LevelheadError):
            raise
        raise LevelheadError(f"cannot read {file}: {_reason(error)}") from error
    except MemoryError:
        raise LevelheadError(f"cannot read {file}: it asks for more memory than there is") from None


def _reason(error: OSError | ValueError) -> str:
    """What the system says of a file, or what a number or a letter that no reader expects means."""
    return getattr(error, "strerror", None) or "it is damaged, or its content is not what its suffix says"


def _read_own_file(file: Path, hints: Hints) -> Recording | None:
    """Files that hold a recording as levelhead wrote it; None for all others."""
    _check_there(file)
    if file.suffix.lower() == ".npz" and file.is_file():
        from levelhead.sources.formats.npz import read_own

        return read_own(file, hints)
    if file.suffix.lower() == ".mcap" and file.is_file() and _is_box(file):
        from levelhead.sources.formats.blackbox import box_recording

        if hints.given:
            raise LevelheadError(f"{file} says itself what is in it; map, units, counts and rate are for other files")
        return box_recording(file)
    return None


def _open_tables(file: Path, hints: Hints) -> tuple[list[Table], Hints]:
    """The tables in a path, and the hints that are left for them."""
    _check_there(file)
    if (file / "metadata.yaml").is_file() or (file.is_file() and BY_SUFFIX.get(file.suffix.lower()) is _BAG):
        from levelhead.sources.formats.rosbag import without_topics

        return list(_BAG.tables(file, str(file), hints)), without_topics(hints)
    if file.is_dir() and is_oxts(file):
        return [oxts_table(file)], hints
    found: list[Table] = []
    with members(file, _READ) as every:
        empty = [part.name for part in every if part.path.stat().st_size == 0]
        parts = [part for part in every if part.path.stat().st_size > 0]
        wanted = [part for part in parts if hints.sensor is None or _names(hints.sensor, part)] or parts
        for part in wanted:
            found += _member(part, hints, alone=len(wanted) == 1)
    if not found:
        raise LevelheadError(f"{file} holds no file with columns of numbers")
    if empty:
        found[0] = add_conclusion(found[0], Conclusion("file.parts", "empty", ", ".join(empty), Basis.NUMBERS))
    return found, hints


def is_one_recording(folder: Path) -> bool:
    """Whether a folder holds the sensors of one recording in files of their own, or is a ROS 2 bag.

    A file with both gyroscope and accelerometer in it is a recording by itself.
    """
    from levelhead.sources.join.merge import join_tables, sensors_of
    from levelhead.sources.join.windows import unroll

    if (folder / "metadata.yaml").is_file():
        return True
    try:
        with np.errstate(all="ignore"):
            found, _ = _open_tables(folder, Hints())
            if len(found) < 2 or any({"gyr", "acc"} <= sensors_of(table) for table in found):
                return False
            parts = join_tables(str(folder), [unroll(table) for table in found])
    except (LevelheadError, OSError, ValueError):
        return False
    return any("gyr" in sensors_of(table) for table in parts)


def _names(sensor: str, part: Member) -> bool:
    return sensor.lower() in part.name.lower()


def _member(part: Member, hints: Hints, alone: bool) -> list[Table]:
    """The tables of one file; beside others, a file that is no table is left out."""
    try:
        found = list(_format(part).tables(part.path, part.shown, hints))
        if not alone:
            return [in_memory(table, part.name) for table in found]
    except NeedsHints:
        raise
    except LevelheadError:
        if alone:
            raise
        return []
    return found if part.path.exists() and part.shown == str(part.path) else [in_memory(table, "") for table in found]


def _format(part: Member) -> Format:
    known = BY_SUFFIX.get(part.path.suffix.lower())
    if known is not None:
        return known
    with open(part.path, "rb") as file:
        head = file.read(4096)
    if head and b"\0" not in head and sum(sign > 126 for sign in head) < 0.1 * len(head):
        return TEXT
    raise LevelheadError(
        f"{part.shown} is not a recording that levelhead reads: it ends in '{part.path.suffix}'; "
        f"expected one of {' '.join(suffix for one in FORMATS for suffix in one.suffixes)} {' '.join(CONTAINERS)}, "
        "or a folder"
    )


def open_table(path: str | os.PathLike[str], hints: Hints) -> Table:
    """The one table of a file, for its other columns.

    Raises:
        LevelheadError: missing, unreadable, or several tables.
    """
    file = Path(path)
    if file.suffix.lower() == ".mcap" and file.is_file() and _is_box(file):
        raise LevelheadError(f"{file} has no columns; levelhead.read and levelhead fuse take it whole")
    try:
        found, _ = _open_tables(file, hints)
    except (OSError, ValueError) as error:
        if isinstance(error, LevelheadError):
            raise
        raise LevelheadError(f"cannot read {file}: {_reason(error)}") from error
    if len(found) > 1:
        raise LevelheadError(f"{file} holds {len(found)} tables; name the file with the columns")
    return found[0]


def _check_there(file: Path) -> None:
    if not file.exists():
        raise LevelheadError(f"there is no file {file}{_neighbour(file)}")
    if file.is_file() and file.stat().st_size == 0:
        raise LevelheadError(f"{file} is empty; expected a recording")


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
