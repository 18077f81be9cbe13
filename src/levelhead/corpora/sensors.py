"""Which recordings are of the same sensor, and in which order of time."""

import csv
import re
from collections.abc import Callable, Sequence

from levelhead.corpora.job import Job
from levelhead.corpora.places import Source, local_copy
from levelhead.errors import LevelheadError
from levelhead.open_types import ReadOnlyJson

COLUMN = "column:"
PARQUET = (".parquet", ".pq")
TEXT = (".csv", ".tsv", ".txt")
Key = tuple[tuple[int, float, str], ...]


def assign_sensors(job: Job, sources: Sequence[Source], storage: ReadOnlyJson) -> tuple[list[Source], dict[str, str]]:
    """The recordings, those of a sensor in order of time, and name -> sensor; all for themselves where none is asked.

    Raises:
        LevelheadError: a pattern that is none or fits no name, or a column that a file does not have.
    """
    if not job.sensor:
        return list(sources), {}
    sensor_of = _reader("sensor", job.sensor, storage)
    time_of = _reader("order of time", job.order, storage) if job.order else lambda source: source.name
    sensors = {source.name: sensor_of(source) for source in sources}
    if not any(sensors.values()):
        raise LevelheadError(
            f"no name of a recording fits '{job.sensor}'; the first is {sources[0].name}: expected a pattern with one "
            "group, such as '(unit[0-9]+)/', or column:NAME"
        )
    keys = {source.name: (natural(time_of(source)), natural(source.name)) for source in sources}
    return sorted(sources, key=lambda source: keys[source.name]), sensors


def natural(text: str) -> Key:
    """A key by which "run 9" comes before "run 10", and 2026-01-31 before 2026-02-01."""
    try:
        return ((0, float(text), ""),)
    except ValueError:
        return tuple(
            (0, float(part), "") if part.isdigit() else (1, 0.0, part) for part in re.split(r"(\d+)", text) if part
        )


def _reader(what: str, wanted: str, storage: ReadOnlyJson) -> Callable[[Source], str]:
    """A function that gives a recording's sensor or time as text; "" where its name does not fit."""
    if wanted.startswith(COLUMN):
        column = wanted.removeprefix(COLUMN).strip()
        return lambda source: _first_value(source, column, storage)
    try:
        pattern = re.compile(wanted)
    except re.error as error:
        raise LevelheadError(f"the {what} '{wanted}' is not a regular expression: {error}") from None
    if pattern.groups != 1:
        raise LevelheadError(
            f"the {what} '{wanted}' has {pattern.groups} groups; expected one in parentheses, such as '(unit[0-9]+)/'"
        )

    def read(source: Source) -> str:
        found = pattern.search(source.name)
        return found[1] or "" if found else ""

    return read


def _first_value(source: Source, column: str, storage: ReadOnlyJson) -> str:
    """The first value of a column, as text; a Parquet file's metadata count as columns."""
    suffix = "." + source.url.rpartition(".")[2].lower()
    if suffix not in (*PARQUET, *TEXT):
        raise LevelheadError(
            f"{source.url}: {COLUMN}{column} is read from Parquet and CSV; expected a pattern of names for other files"
        )
    try:
        with local_copy(source, storage) as path:
            if suffix in PARQUET:
                import pyarrow.parquet as pq

                file = pq.ParquetFile(path)
                metadata = file.schema_arrow.metadata or {}
                if column.encode() in metadata:
                    return str(metadata[column.encode()].decode())
                if column in file.schema_arrow.names:
                    values = next(file.iter_batches(1, columns=[column]))
                    return str(values.column(0)[0].as_py())
            else:
                with path.open(encoding="utf-8", errors="replace", newline="") as text:
                    head = text.readline()
                    rows = csv.DictReader([head, text.readline()], delimiter="\t" if "\t" in head else ",")
                    if column in (rows.fieldnames or ()):
                        return str(next(rows)[column]).strip()
    except (OSError, ValueError, StopIteration):
        return ""  # its row will have the reason
    raise LevelheadError(f"{source.url} has no column {column} for its sensors or its time")
