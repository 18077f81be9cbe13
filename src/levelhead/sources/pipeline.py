"""From a path to a recording: container, tables, streams, one recording."""

import difflib
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject
from levelhead.recording import Recording
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats import BY_SUFFIX, CONTAINERS, FORMATS, TEXT, Format, find_format
from levelhead.sources.formats.bids import find_motion, motion_tables
from levelhead.sources.formats.container import Member, members
from levelhead.sources.formats.conversion import find_cure
from levelhead.sources.formats.kitti import is_oxts, oxts_table
from levelhead.sources.hints import Hints, NeedsHints, check, check_options, merge_hints
from levelhead.sources.interpret import apply
from levelhead.sources.interpret import interpret as interpret_table
from levelhead.sources.interpretation import Interpretation
from levelhead.sources.place import column_place
from levelhead.sources.table import CachedTable, Table, add_conclusion, in_memory
from levelhead.track import Track

_ALIKE = 0.8  # of two names' letters in the same order, from which one may be meant by the other
_TRIES = 4  # hints that may be missing at once
_BAG = BY_SUFFIX[".bag"]
_READ = frozenset(BY_SUFFIX)


class Log(NamedTuple):
    """A log that is open.

    Attributes:
        table: its columns.
        found: their meaning.
        is_plain: whether the table is that of the file: nothing was divided, joined or merged.
    """

    table: CachedTable
    found: Interpretation
    is_plain: bool


def read_file(
    path: str | os.PathLike[str], hints: Hints, adjust: Callable[[Interpretation], Interpretation] | None = None
) -> Recording:
    """The recording in ``path``: a file, a folder or an archive. ``adjust`` may change the conclusions.

    Raises:
        LevelheadError: missing, empty, unreadable, or by its reader; where hints would settle it, the sentence
            ends with the command line that has been tried and works.
    """
    file = Path(path)
    with _reading(file, hints):
        own = _read_own_file(file, hints)
        if own is not None:
            return own
        log = _open(file, hints)
        return apply(log.found if adjust is None else adjust(log.found), log.table)


def interpret(
    path: str | os.PathLike[str],
    *,
    map: Mapping[str, Sequence[str] | str] | None = None,
    units: Mapping[str, str] | None = None,
    counts: Mapping[str, str] | None = None,
    rate: float | None = None,
    sensor: str | None = None,
    session: int | None = None,
) -> Interpretation:
    """The interpretation of a file by ``read``, as a value: columns, units, clock, signs, and the basis of each.

    Printed, it is a line for each conclusion and the command line that leaves nothing to guess. ``settled()`` gives the
    same hints as arguments of ``read``, which then gives the same recording.

    Args:
        path: the file, as for ``read``.
        map: as for ``read``, as are the others.
        units: as for ``read``.
        counts: as for ``read``.
        rate: as for ``read``.
        sensor: as for ``read``.
        session: as for ``read``.

    Raises:
        LevelheadError: as ``read``, and for a file that levelhead wrote, which needs no interpretation.

    >>> interpret("flight.csv").units  # doctest: +SKIP
    {'t': 'ms', 'acc': 'g', 'gyr': 'deg/s'}
    """
    file, hints = Path(path), check(map, units, counts, rate, sensor, session)
    with _reading(file, hints):
        if _read_own_file(file, hints) is not None:
            raise LevelheadError(f"{file} was written by levelhead, in SI units; there is nothing to interpret")
        return replace(_open(file, hints).found, source=str(file))


def open_log(path: str | os.PathLike[str], hints: Hints) -> Log:
    """The columns of a log, and their meaning.

    Raises:
        LevelheadError: as ``read_file``.
    """
    file = Path(path)
    with _reading(file, hints):
        check_there(file)
        return _open(file, hints)


def _open(file: Path, hints: Hints) -> Log:
    from levelhead.sources.join.merge import single_table

    tables, left = _open_tables(file, hints)
    table, left = single_table(str(file), tables, left)
    cached = CachedTable(table)
    found = replace(interpret_table(cached, left), hints=hints)
    if not any(one.about == "place" for one in found.conclusions) and (place := column_place(tables)) is not None:
        found = replace(found, conclusions=(*found.conclusions, place))
    return Log(cached, found, len(tables) == 1 and table is tables[0])


def try_hints(file: Path, hints: Hints, error: NeedsHints) -> JsonObject | None:
    """Hints with which the file was read, those of the error and the missing ones; None without success."""
    options = hints.options()
    for _ in range(_TRIES):
        options = merge_hints(options, error.suggested)
        try:
            with _reading(file):
                log = _open(file, check_options(options))
                apply(log.found, log.table)
        except NeedsHints as again:
            if again.suggested == error.suggested:
                return None
            error = again
            continue
        except LevelheadError:
            return None
        return options
    return None


@contextmanager
def _reading(file: Path, hints: Hints | None = None) -> Iterator[None]:
    """One sentence for whatever a damaged file may raise; with hints the command line that settles it."""
    try:
        with np.errstate(all="ignore"):  # numbers such as 1e308 may stand in any file
            yield
    except NeedsHints as error:
        if hints is None:
            raise
        part = Path(error.path) if error.path else file
        suggested = try_hints(part, hints, error)
        if suggested is None:
            raise LevelheadError(error.sentence) from None
        raise NeedsHints(error.sentence, str(part), **suggested) from None
    except (OSError, ValueError) as error:
        if isinstance(error, LevelheadError):
            raise
        raise LevelheadError(f"cannot read {file}: {_reason(error)}") from error
    except MemoryError:
        raise LevelheadError(f"cannot read {file}: it asks for more memory than there is") from None


def _reason(error: OSError | ValueError) -> str:
    """The system's reason for an error with a file, or a general one."""
    return getattr(error, "strerror", None) or "it is damaged, or its content is not of its suffix"


def _read_own_file(file: Path, hints: Hints) -> Recording | None:
    """Files that hold a recording as levelhead wrote it; None for all others."""
    check_there(file)
    if file.suffix.lower() == ".npz" and file.is_file():
        from levelhead.sources.formats.npz import read_own

        return read_own(file, hints)
    if file.suffix.lower() == ".mcap" and file.is_file() and _is_box(file):
        from levelhead.sources.formats.blackbox import box_recording

        if hints.given:
            raise LevelheadError(f"{file} describes its own content; map, units, counts and rate are for other files")
        return box_recording(file)
    return None


def own_attitudes(path: str | os.PathLike[str]) -> dict[str, Track]:
    """See ``levelhead.sources.attitudes``."""
    file = Path(path)
    check_there(file)
    if not file.is_file():
        return {}
    with _reading(file):
        if file.suffix.lower() == ".mcap" and _is_box(file):
            from levelhead.sources.formats.blackbox import box_attitude

            return box_attitude(file)
        with open(file, "rb") as opened:
            kind = find_format(file.suffix.lower(), opened.read(64))
        return {} if kind is None or kind.attitudes is None else dict(kind.attitudes(file))


def _open_tables(file: Path, hints: Hints) -> tuple[list[Table], Hints]:
    """The tables in a path, and the hints that are left for them."""
    check_there(file)
    if (file / "metadata.yaml").is_file() or (file.is_file() and BY_SUFFIX.get(file.suffix.lower()) is _BAG):
        from levelhead.sources.formats.rosbag import without_topics

        return list(_BAG.tables(file, str(file), hints)), without_topics(hints)
    if file.is_dir() and is_oxts(file):
        return [oxts_table(file)], hints
    if (motion := find_motion(file)) is not None:
        return list(motion_tables(motion)), hints
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


def list_recordings(file: Path) -> list[str]:
    """Names of the files in a zip or a folder that are recordings by themselves, without suffix."""
    from levelhead.sources.join.merge import sensors_of

    try:
        with np.errstate(all="ignore"):
            found, _ = _open_tables(file, Hints())
    except (LevelheadError, OSError, ValueError):
        return []
    return list(dict.fromkeys(table.context for table in found if {"gyr", "acc"} <= sensors_of(table)))


def _names(sensor: str, part: Member) -> bool:
    return sensor.lower() in part.name.lower()


def _member(part: Member, hints: Hints, alone: bool) -> list[Table]:
    """The tables of one file; beside others, a file that is not a table is left out."""
    from levelhead.sources.interpret.by_numbers import name_columns

    try:
        given = _format(part).tables(part.path, part.display_path, hints)
        found = [name_columns(table, hints) for table in given]
        if not alone:
            return [_beside_others(table, part.name) for table in found]
    except NeedsHints:
        raise
    except LevelheadError:
        if alone:
            raise
        return []
    return (
        found
        if part.path.exists() and part.display_path == str(part.path)
        else [in_memory(table, "") for table in found]
    )


def _beside_others(table: Table, name: str) -> Table:
    """A table with the name of its file, whose columns no hint can name by number: others are beside it."""
    own = in_memory(table, name)
    conclusions = [one._replace(confirm={}) if one.about == "columns" else one for one in own.conclusions]
    return replace(own, conclusions=conclusions)


def _format(part: Member) -> Format:
    suffix = part.path.suffix.lower()
    if BY_SUFFIX.get(suffix) is TEXT:
        return TEXT
    with open(part.path, "rb") as file:
        head = file.read(4096)
    known = find_format(suffix, head)
    if known is not None:
        return known
    if (cure := find_cure(suffix, head)) is not None:
        raise LevelheadError(f"{part.display_path} {cure}")
    if head and b"\0" not in head and sum(sign > 126 for sign in head) < 0.1 * len(head):
        return TEXT
    raise LevelheadError(
        f"{part.display_path} is not a recording that levelhead reads: it ends in '{part.path.suffix}'; "
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
    with _reading(file):
        found, _ = _open_tables(file, hints)
    if len(found) > 1:
        raise LevelheadError(f"{file} holds {len(found)} tables; name the file with the columns")
    return found[0]


def check_there(file: Path) -> None:
    """Raises LevelheadError where there is no file, or an empty one."""
    if not file.exists():
        raise LevelheadError(f"there is no file {file}{_neighbour(file)}")
    if file.is_file() and file.stat().st_size == 0:
        raise LevelheadError(f"{file} is empty; expected a recording")


def _is_box(file: Path) -> bool:
    """Whether an MCAP file is a node's black box and not a ROS bag, by its header, the first record."""
    with open(file, "rb") as stream:
        return b"ros" not in stream.read(64)


def _neighbour(file: Path) -> str:
    try:
        names = [entry.name for entry in file.parent.iterdir() if entry.is_file()]
    except OSError:
        return f": there is no folder {file.parent} that could be read"
    stems = {Path(name).stem.lower(): name for name in names}
    close = difflib.get_close_matches(file.stem.lower(), stems, n=1, cutoff=_ALIKE)
    return f"; did you mean '{stems[close[0]]}'?" if close else "; expected the path of a recording"
