"""Logs larger than memory: Parquet and CSV of any length as recordings of some rows each.

``read`` finds columns, units and signs by looking at the whole log. Here they are found in its beginning, by the same
reader, and its ``Interpretation`` is applied to chunk after chunk. A log whose rows do not become samples one by one is
refused: one whose clock is repaired, or whose sensors stand on different rows.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError, require
from levelhead.open_types import JsonObject, Untyped
from levelhead.recording import Recording
from levelhead.sources.formats.text.delimited import TextTable
from levelhead.sources.hints import Hints, SuggestsCommand, check_options
from levelhead.sources.interpret import apply
from levelhead.sources.interpretation import Interpretation
from levelhead.sources.pipeline import Log, open_log
from levelhead.sources.table import ArrayTable, Column

HEAD = 200_000  # rows in which columns, units and signs are found
HEAD_BYTES = 32_000_000  # of text, in which they are found
ROWS = 250_000  # of a chunk
PARQUET = (".parquet", ".pq")
TEXT = (".csv", ".tsv", ".txt")
LONG_ROWS = 20_000_000  # from which a Parquet file is long
LONG_BYTES = 2_000_000_000  # from which text is long
EXACT = 2.0**53  # whole numbers up to it are floats
WHOLE = "levelhead.read reads it whole"


class NeedsWholeLog(LevelheadError):
    """A log that cannot be read in chunks; ``read`` may take it."""


class Chunks:
    """The recordings of one log, to be gone through once.

    Attributes:
        head: its beginning, as ``read`` gives it; its ``meta`` has the conclusions.
        fraction: share of the file that has been given.
    """

    def __init__(self, path: Path, rows: int, hints: Hints) -> None:
        self._path, self._rows, self._start = path, rows, 0
        self.fraction = 0.0
        with _head(path) as part:
            try:
                log = open_log(part, hints)
                self._found = _streamed(log, path)
                self.head = replace(apply(log.found, log.table), meta=log.found.meta() | {"source": str(path)})
                self._check(part)
            except SuggestsCommand as error:
                raise error.about(str(part), str(path)) from None
            except LevelheadError as error:
                raise type(error)(str(error).replace(str(part), str(path))) from None

    def _check(self, part: Path) -> None:
        """Makes sure that the rows of the beginning, read as those of a chunk, are the same samples."""
        for columns, _ in _blocks(part, self._names, len(self.head), self._exact):
            made = self._recording(columns, 0)
            pairs = [(getattr(made, name), getattr(self.head, name)) for name in ("t", "gyr", "acc", "mag")]
            if all(one is other or np.array_equal(one, other, equal_nan=True) for one, other in pairs):
                return
            break
        raise NeedsWholeLog(f"{part} cannot be read in chunks: its rows do not become samples one by one; {WHOLE}")

    def _recording(self, columns: JsonObject, start: int) -> Recording:
        """The rows from ``start`` on."""
        found = replace(self._found, clock=replace(self._found.clock, first_row=start))
        return apply(found, ArrayTable(str(self._path), columns))

    @property
    def _names(self) -> list[str]:
        """Of the columns that are read."""
        return list(dict.fromkeys(name for names in self._found.columns.values() for name in names))

    @property
    def _exact(self) -> frozenset[str]:
        """The columns that are whole numbers too large for floats."""
        clock = self._found.clock
        return frozenset(clock.columns if abs(clock.start) >= EXACT or clock.fraction else ())

    def begin_at(self, row: int) -> None:
        """Leaves the rows before that one out; in a Parquet file they are not read, in text they are."""
        self._start = row

    def __iter__(self) -> Iterator[Recording]:
        start = self._start
        last = -np.inf
        for columns, fraction in _blocks(self._path, self._names, self._rows, self._exact, start):
            try:
                chunk = self._recording(columns, start)
            except LevelheadError as error:
                raise LevelheadError(f"{self._path}, rows from {start}: {error}; {WHOLE}") from None
            if not chunk.t[0] > last:
                raise LevelheadError(f"{self._path}: time does not increase at row {start}; {WHOLE} and repairs it")
            last, start = float(chunk.t[-1]), start + len(chunk)
            yield chunk
            self.fraction = fraction


def _streamed(log: Log, path: Path) -> Interpretation:
    """The interpretation that holds for each row of a log by itself.

    Raises:
        NeedsWholeLog: it does not.
    """
    is_text = path.suffix.lower() in TEXT
    if not (log.is_plain and log.found.streamable and (not is_text or isinstance(log.table.table, TextTable))):
        raise NeedsWholeLog(f"{path} cannot be read in chunks: its rows do not become samples one by one; {WHOLE}")
    used = log.found.only({"t", "acc", "gravity", "gyr", "mag"} - log.found.unused)
    return replace(used, source=str(path))


def read_chunks(path: str | os.PathLike[str], rows: int | None = None, **hints: object) -> Chunks:
    """A long Parquet or CSV file as recordings of so many rows, which together have the bits of ``read``.

    Columns, units and signs are found in its beginning (``HEAD`` rows or ``HEAD_BYTES``); a reference orientation is
    left out. Needs pyarrow.

    Args:
        path: a Parquet file, or text with one delimiter.
        rows: of a recording; None: ``ROWS``.
        hints: as for ``read``.

    Raises:
        LevelheadError: as ``read``, and for a log that must be seen whole.

    >>> for track in fuse_chunks(read_chunks("year.parquet")): ...  # doctest: +SKIP
    """
    require("pyarrow", "reading in chunks", "formats")
    file = Path(path)
    if not file.is_file():
        raise LevelheadError(f"there is no file {file}; expected a Parquet or CSV file")
    rows = ROWS if rows is None else rows
    if rows < 1:
        raise LevelheadError(f"chunks of {rows} rows hold nothing; expected at least 1")
    if file.suffix.lower() not in (*PARQUET, *TEXT):
        raise LevelheadError(f"{file} cannot be read in chunks; expected one of {' '.join((*PARQUET, *TEXT))}")
    return Chunks(file, rows, check_options(hints))


def is_long(path: Path) -> bool:
    """Whether a log is better read in chunks."""
    suffix = path.suffix.lower()
    if suffix in TEXT:
        return path.is_file() and path.stat().st_size >= LONG_BYTES
    if suffix not in PARQUET or not path.is_file():
        return False
    try:
        import pyarrow.parquet as pq

        return int(pq.read_metadata(path).num_rows) >= LONG_ROWS
    except (ImportError, OSError, ValueError):
        return False  # the reader reports the error


@contextmanager
def _head(path: Path) -> Iterator[Path]:
    """The beginning of a log as a file of the same kind."""
    import tempfile  # which takes a while to import, and short logs need none

    with tempfile.TemporaryDirectory(prefix="levelhead-") as folder:
        part = Path(folder, path.name)
        if path.suffix.lower() in PARQUET:
            import pyarrow as pa
            import pyarrow.parquet as pq

            try:
                batches = pq.ParquetFile(path).iter_batches(HEAD)
                pq.write_table(pa.Table.from_batches([next(batches)]), part)
            except (OSError, ValueError, StopIteration) as error:
                raise LevelheadError(f"{path} is not a Parquet file, or it is damaged or empty") from error
        else:
            with path.open("rb") as file:
                text = file.read(HEAD_BYTES)
                if file.read(1):
                    text = text[: text.rfind(b"\n") + 1]
            part.write_bytes(text)
        yield part


def _blocks(
    path: Path, names: Sequence[str], rows: int, exact: frozenset[str], start: int = 0
) -> Iterator[tuple[dict[str, Column], float]]:
    """Columns of ``rows`` rows each (the last ones fewer) from row ``start`` on, and the share of the file that they
    end at.
    """
    parts = _parquet(path, start) if path.suffix.lower() in PARQUET else _text_from(path, names, exact, start)
    kept: dict[str, list[Column]] = {name: [] for name in names}
    count, fraction = 0, 0.0
    for columns, fraction in chain(parts, [({}, 1.0)]):
        if columns:
            missing = next((name for name in names if name not in columns), None)
            if missing is not None:
                raise NeedsWholeLog(f"{path}: column '{missing}' cannot be read in chunks; {WHOLE}")
            for name in names:
                kept[name].append(columns[name])
            count += len(columns[names[0]])
        while count >= rows or (not columns and count):
            joined: JsonObject = {name: np.concatenate(pieces) for name, pieces in kept.items()}
            yield {name: values[:rows] for name, values in joined.items()}, fraction
            kept = {name: [values[rows:]] for name, values in joined.items()}
            count = max(count - rows, 0)


def _parquet(path: Path, start: int) -> Iterator[tuple[JsonObject, float]]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    from levelhead.sources.formats.parquet import columns_of

    try:
        file = pq.ParquetFile(path, pre_buffer=False, buffer_size=1 << 20)
        first = done = 0
        while first < file.num_row_groups and done + file.metadata.row_group(first).num_rows <= start:
            done += file.metadata.row_group(first).num_rows
            first += 1
        for batch in file.iter_batches(ROWS, row_groups=range(first, file.num_row_groups)):
            rows = batch.slice(max(start - done, 0))
            done += batch.num_rows
            if rows.num_rows:
                share = done / max(file.metadata.num_rows, 1)
                yield columns_of(pa.Table.from_batches([rows]), str(path)), share
    except (pa.ArrowException, OSError) as error:
        raise LevelheadError(f"{path} is damaged: its row groups cannot be unpacked") from error


def _text_from(
    path: Path, names: Sequence[str], exact: frozenset[str], start: int
) -> Iterator[tuple[dict[str, Column], float]]:
    """The same from row ``start`` on."""
    done = 0
    for columns, fraction in _text(path, names, exact):
        count = len(columns[names[0]])
        if done + count > start:
            yield {name: values[max(start - done, 0) :] for name, values in columns.items()}, fraction
        done += count


def _text(path: Path, names: Sequence[str], exact: frozenset[str]) -> Iterator[tuple[dict[str, Column], float]]:
    import pyarrow as pa

    from levelhead.sources.formats.text.delimited import open_by_arrow
    from levelhead.sources.formats.text.layout import find_layout

    layout = find_layout(path)
    plain = not (layout.tail or layout.stamps or layout.torn) and layout.encoding.name == "utf-8"
    if not plain or layout.delimiter == " ":
        raise NeedsWholeLog(f"{path} cannot be read in chunks: it is not plain text of numbers; {WHOLE}")
    missing = [name for name in names if name not in layout.names]
    if missing:
        raise NeedsWholeLog(f"{path}: column '{missing[0]}' cannot be read in chunks; {WHOLE}")
    positions = {name: list(layout.names).index(name) for name in names}
    whole = frozenset(positions[name] for name in exact if name in positions) & layout.whole
    size = path.stat().st_size
    try:
        with pa.OSFile(str(path)) as file:
            reader: Untyped = open_by_arrow(file, layout, sorted(positions.values()), whole)
            for batch in reader:
                from levelhead.sources.formats.text.delimited import arrow_numbers

                table = pa.Table.from_batches([batch])
                yield {name: arrow_numbers(table.column(str(i))) for name, i in positions.items()}, file.tell() / size
    except (pa.ArrowException, OSError) as error:
        raise LevelheadError(f"{path} cannot be read in chunks: {error}; {WHOLE}") from None
