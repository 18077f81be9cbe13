"""The folder of results: a manifest, part files of rows, tracks. Every file appears whole or not at all.

    corpus.json          the request: a run of another one is refused
    rows/part-….parquet  rows as they came; together one Parquet dataset
    tracks/NAME.parquet  a track for each recording, where they are asked for
    report.html          and its pictures

A run that ends writes all parts anew as one, sorted by recording and method. One that was killed leaves parts: a
recording's rows stand in one part, so it is done or it is not. Where a recording was run again, the later part counts.
"""

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from levelhead.atomic import atomic_path, lock_folder
from levelhead.corpora.job import Job
from levelhead.corpora.places import MANIFEST
from levelhead.corpora.row_layout import schema
from levelhead.corpora.work import ResultsError
from levelhead.errors import LevelheadError, require
from levelhead.open_types import JsonObject, ReadOnlyJson, Untyped

ROWS, TRACKS = "rows", "tracks"
FORMAT = "levelhead corpus 1"
SMALL: ReadOnlyJson = {"compression": "zstd"}  # the file that stays
# A part of some rows and 133 columns, which takes a third of the processor time so: it is read once more, and removed.
QUICK: ReadOnlyJson = {"compression": "snappy", "use_dictionary": False, "write_statistics": False}
KEY = ("recording", "stamp", "prior", "transient")


class Done(NamedTuple):
    """The results of a recording that was run."""

    stamp: str
    prior: str  # digest of the calibration that it started with
    calibration: str  # as JSON; "" if it gave none or that was not asked for


class Results:
    """A folder of results that is being written.

    Raises:
        LevelheadError: it holds results of something else, another run is writing into it, or it cannot be written.
    """

    def __init__(self, folder: Path, job: Job) -> None:
        require("pyarrow", "a corpus", "corpus")
        self.folder, self._job = folder, job
        self._schema = schema(job.verb, job.facts)
        self._waiting: list[JsonObject] = []
        self._check_manifest()
        self._next = 1 + max((_number(path) for path in self._parts()), default=-1)

    @property
    def tracks(self) -> str:
        """Folder for tracks; "" where none are asked for."""
        return str(self.folder.resolve() / TRACKS) if self._job.tracks else ""

    def _parts(self) -> list[Path]:
        return list_parts(self.folder)

    def _check_manifest(self) -> None:
        path = self.folder / MANIFEST
        wanted = json.loads(json.dumps({"format": FORMAT} | self._job.facts, default=str))
        if path.exists():
            found = read_manifest(self.folder)
            if found != wanted:
                raise LevelheadError(
                    f"{self.folder} holds results of {_difference(found, wanted)}; they stay as they are: name another "
                    "folder"
                )
            return
        with _writing(self.folder):
            (self.folder / ROWS).mkdir(parents=True, exist_ok=True)
            with atomic_path(path) as temporary:
                temporary.write_text(json.dumps(wanted, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Keeps other runs out of the folder; the lock ends with the process, however that ends."""
        with lock_folder(self.folder):
            yield

    def done(self) -> dict[str, Done]:
        """Name -> its row, for the recordings that need no new run if they are unchanged."""
        columns = [*KEY, *(("calibration",) if self._job.sensor else ())]
        found: dict[str, Done] = {}
        for path in self._parts():
            for row in _read(path, columns).to_pylist():
                if row["transient"]:
                    found.pop(row["recording"], None)
                else:
                    found[row["recording"]] = Done(row["stamp"], row["prior"], row.get("calibration") or "")
        return found

    def add(self, rows: Iterable[JsonObject]) -> None:
        """Rows for the next part."""
        self._waiting += rows

    def flush(self) -> None:
        """Writes the waiting rows as a part.

        Raises:
            LevelheadError: the disk is full, or the folder cannot be written; earlier parts stay.
        """
        if not self._waiting:
            return
        import pyarrow as pa

        self._write(pa.Table.from_pylist(self._waiting, self._schema), QUICK)
        self._waiting = []

    def finish(self, names: Iterable[str], is_gone: Callable[[str], bool]) -> Untyped:
        """Writes all parts anew as one, sorted, and gives the rows of the recordings with these names.

        Of other recordings, ``is_gone`` decides by the URL whether they are no longer there; their rows stay,
        marked, and are given too.
        """
        import pyarrow as pa
        import pyarrow.compute as pc

        self.flush()
        before = self._parts()
        table = read_rows(self.folder, self._schema)
        listed = set(names)
        gone = [
            name not in listed and is_gone(url)
            for name, url in zip(table["recording"].to_pylist(), table["url"].to_pylist(), strict=True)
        ]
        marks = pa.array(gone, pa.bool_())
        table = table.set_column(table.column_names.index("gone"), self._schema.field("gone"), marks)
        if len(before) > 1 or (before and not _read(before[0]).equals(table)):
            self._write(table)
            for path in before:
                with suppress(OSError):
                    path.unlink()
        return table.filter(pc.or_(pc.is_in(table["recording"], pa.array(sorted(listed), pa.string())), marks))

    def _write(self, table: Untyped, how: ReadOnlyJson = SMALL) -> None:
        import pyarrow.parquet as pq

        target = self.folder / ROWS / f"part-{self._next:06d}.parquet"
        with _writing(self.folder), atomic_path(target) as temporary:
            pq.write_table(table, temporary, **how)
        self._next += 1


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, LevelheadError) as error:
        words = (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
        raise ResultsError(f"{folder}: {words}; earlier rows stay, and the same command goes on from there") from None


def list_parts(folder: Path) -> list[Path]:
    """The part files, in the order in which they were written."""
    return sorted(folder.joinpath(ROWS).glob("part-*.parquet"))


def _number(path: Path) -> int:
    return int(path.stem.removeprefix("part-"))


def read_manifest(folder: Path) -> JsonObject:
    """The job of the results in a folder.

    Raises:
        LevelheadError: it holds none.
    """
    path = folder / MANIFEST
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if found["format"] != FORMAT:
            raise LevelheadError(f"{path} has the format '{found['format']}'; this version reads '{FORMAT}'")
    except OSError as error:
        raise LevelheadError(f"{folder} holds no results of levelhead corpus ({MANIFEST}: {error.strerror})") from None
    except (ValueError, KeyError, TypeError) as error:
        if isinstance(error, LevelheadError):
            raise
        raise LevelheadError(f"{path} is damaged; expected the file that levelhead corpus wrote") from None
    return dict(found)


def read_job(folder: Path) -> Job:
    """The job of the results in a folder, ready to be run again.

    Raises:
        LevelheadError: it holds none.
    """
    return Job.from_facts(read_manifest(folder))


def _difference(found: JsonObject, wanted: JsonObject) -> str:
    """The first thing that differs, in words: of dictionaries their first entry that differs, of methods the names."""
    path: list[str] = []
    verbs = found.get("verb"), wanted.get("verb")
    one: object = found
    other: object = wanted
    while isinstance(one, dict) and isinstance(other, dict):
        if path == ["methods"] and set(one) != set(other):
            one, other = ", ".join(one), ", ".join(other)
            break
        path.append(next(key for key in {**other, **one} if one.get(key) != other.get(key)))
        one, other = one.get(path[-1]), other.get(path[-1])
    if path == ["verb"]:
        return f"'{one}', not of '{other}'"
    name = " ".join(path)
    return f"{verbs[0]} with {name} {_words(one)}, not of {verbs[1]} with {name} {_words(other)}"


def _words(value: object) -> str:
    if value is None:
        return "none"
    return value if isinstance(value, str) and value else json.dumps(value, ensure_ascii=False)[:200]


def _read(path: Path, columns: list[str] | None = None) -> Untyped:
    import pyarrow.parquet as pq

    try:
        return pq.ParquetFile(path).read(columns)
    except (OSError, ValueError) as error:
        raise LevelheadError(f"{path} is damaged; remove it, and the same command makes it anew") from error


def read_rows(folder: Path, layout: Untyped | None = None) -> Untyped:
    """All rows in a folder of results as a ``pyarrow.Table``, by recording and method; of a recording that was run
    twice those of the later run.
    """
    require("pyarrow", "a corpus", "corpus")
    import pyarrow as pa

    if layout is None:
        facts = read_manifest(folder)
        facts.pop("format")
        layout = schema(facts["verb"], facts)
    paths = list_parts(folder)
    latest: dict[str, int] = {}
    tables = []
    for i, path in enumerate(paths):
        tables.append(_read(path))
        latest |= dict.fromkeys(tables[-1]["recording"].to_pylist(), i)
    kept = [
        table.filter(pa.array([latest[name] == i for name in table["recording"].to_pylist()], pa.bool_()))
        for i, table in enumerate(tables)
    ]
    whole = pa.concat_tables(kept) if kept else layout.empty_table()
    order = [(name, "ascending") for name in ("recording", "method")]
    return whole.replace_schema_metadata(layout.metadata).sort_by(order)
