"""Logs larger than memory: Parquet and CSV of any length as recordings of some rows each.

``read`` finds columns, units and signs by looking at the whole log. Here they are found in its beginning, by the same
reader, and the rule that it followed (one factor for each sensor, one for the stamps) is derived from what it gave and
checked on each of these rows, to the bit. A log that no such rule describes is refused: one whose clock is repaired,
whose sensors stand on different rows, or whose accelerometer is put together from parts.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np

from levelhead import units
from levelhead.errors import LevelheadError, require
from levelhead.open_types import Fields, Handle
from levelhead.recording import Array, Recording
from levelhead.sources.table import Column

HEAD = 200_000  # rows in which columns, units and signs are found
HEAD_BYTES = 32_000_000  # of text, in which they are found
ROWS = 250_000  # of a chunk
PARQUET = (".parquet", ".pq")
TEXT = (".csv", ".tsv", ".txt")
LONG_ROWS = 20_000_000  # from which a Parquet file is long
LONG_BYTES = 2_000_000_000  # from which text is long
EXACT = 2.0**53  # whole numbers up to it are floats
WHOLE = "levelhead.read takes it whole"


class NeedsWholeLog(LevelheadError):
    """A log that cannot be read in chunks; ``read`` may take it."""


@dataclass(frozen=True)
class Rule:
    """How the numbers of a log become a recording.

    Attributes:
        columns: role to the names of its columns.
        factors: role ("gyr", "acc", "mag") to what its numbers are multiplied by.
        first: what is subtracted from stamps.
        divisor: what stamps are divided by; 0: they are multiplied by ``factor``.
        factor: of stamps.
        rate: samples a second of a log without stamps; 0: it has some.
    """

    columns: dict[str, list[str]]
    factors: dict[str, float]
    first: float | int = 0
    divisor: float = 0.0
    factor: float = 1.0
    rate: float = 0.0

    def times(self, stamps: Column | None, start: int, count: int) -> Array:
        """Seconds of ``count`` rows from row ``start`` on."""
        if stamps is None:
            return np.arange(start, start + count) / self.rate
        values = (stamps - self.first).astype(np.float64)
        return values / self.divisor if self.divisor else values * self.factor

    def recording(self, columns: Fields, start: int, meta: Fields) -> Recording:
        """The rows from ``start`` on."""
        count = len(next(iter(columns.values())))
        stamps = columns[self.columns["t"][0]] if "t" in self.columns else None
        parts: dict[str, Array | None] = {"mag": None}
        for role, factor in self.factors.items():
            parts[role] = np.stack([columns[name].astype(np.float64) for name in self.columns[role]], axis=1) * factor
        return Recording(self.times(stamps, start, count), meta=meta, **parts)  # type: ignore[arg-type]


class Chunks:
    """The recordings of one log, to be gone through once.

    Attributes:
        head: its beginning, as ``read`` gives it; its ``meta`` has what was concluded.
        fraction: share of the file that has been given.
    """

    def __init__(self, path: Path, rows: int, hints: Fields) -> None:
        self._path, self._rows, self._start = path, rows, 0
        self.fraction = 0.0
        with _head(path) as part:
            from levelhead.sources import read

            try:
                self.head = read(part, **hints)
                self._rule = _find_rule(part, self.head, hints.get("rate"))
            except LevelheadError as error:
                raise type(error)(str(error).replace(str(part), str(path))) from None
        self._meta: Fields = {**self.head.meta, "source": str(path)}

    def begin_at(self, row: int) -> None:
        """Leaves the rows before that one out; in a Parquet file they are not read, in text they are."""
        self._start = row

    def __iter__(self) -> Iterator[Recording]:
        names = [name for role in ("t", *self._rule.factors) for name in self._rule.columns.get(role, ())]
        start = self._start
        last = -np.inf
        for columns, fraction in _blocks(self._path, names, self._rows, self._exact(), start):
            try:
                chunk = self._rule.recording(columns, start, self._meta)
            except LevelheadError as error:
                raise LevelheadError(f"{self._path}, rows from {start}: {error}; {WHOLE}") from None
            if not chunk.t[0] > last:
                raise LevelheadError(f"{self._path}: time does not increase at row {start}; {WHOLE} and repairs it")
            last, start = float(chunk.t[-1]), start + len(chunk)
            yield chunk
            self.fraction = fraction

    def _exact(self) -> frozenset[str]:
        """The columns that are whole numbers too large for floats."""
        return frozenset(self._rule.columns["t"] if abs(self._rule.first) >= EXACT else ())


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
    return Chunks(file, rows, dict(hints))


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
        return False  # the reader says what is wrong with it


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


def _find_rule(path: Path, head: Recording, rate: float | None) -> Rule:
    """The rule by which the beginning of a log became a recording, checked on all of its rows.

    Raises:
        LevelheadError: there is none.
    """
    names: dict[str, list[str]] = {role: list(found) for role, found in head.meta["columns"].items()}
    roles = [role for role in ("gyr", "acc", "mag") if getattr(head, role) is not None]
    wanted = [name for role in ("t", *roles) for name in names.get(role, ())]
    joined = _whole(path, wanted, frozenset())
    if "t" in names and abs(joined[names["t"][0]][0]) >= EXACT:
        joined = _whole(path, wanted, frozenset(names["t"]))
    factors = {}
    for role in roles:
        values = np.stack([joined[name].astype(np.float64) for name in names[role]], axis=1)
        factors[role] = _factor(values, getattr(head, role))
    candidates = _clocks(names, factors, head, joined, rate)
    for rule in candidates:
        if None in factors.values() or len(joined[wanted[0]]) != len(head):
            break
        try:
            made = rule.recording(joined, 0, {})
        except LevelheadError:  # its clock was repaired
            break
        pairs = [(made.t, head.t), *((getattr(made, role), getattr(head, role)) for role in roles)]
        if all(np.array_equal(one, other, equal_nan=True) for one, other in pairs):
            return rule
    raise NeedsWholeLog(
        f"{path} cannot be read in chunks: its rows do not become samples by one factor for each sensor; {WHOLE}"
    )


def _whole(path: Path, names: Sequence[str], exact: frozenset[str]) -> Fields:
    taken = [columns for columns, _ in _blocks(path, names, ROWS, exact)]
    return {name: np.concatenate([columns[name] for columns in taken]) for name in names}


def _clocks(
    names: dict[str, list[str]], factors: Fields, head: Recording, raw: Fields, rate: float | None
) -> list[Rule]:
    """The rules that differ in their clock only."""
    if "t" not in names:
        guess = 1.0 / float(head.t[1]) if len(head) > 1 else 1.0
        return [Rule(names, factors, rate=one) for one in (rate, guess, round(guess, 9)) if one]
    stamps = raw[names["t"][0]]
    first = stamps[0].item() if "t0" in head.meta else 0
    factor = units.find_factor("time", str(head.meta["units"]["t"])) or _factor(
        (stamps - first).astype(np.float64)[:, None], head.t[:, None]
    )
    if not factor:
        return []
    inverse = Rule(names, factors, first, divisor=float(round(1.0 / factor))) if factor < 1.0 else None
    return [*([inverse] if inverse else []), Rule(names, factors, first, factor=factor)]


def _factor(raw: Array, made: Array) -> float | None:
    """f with raw · f = made, to the bit; None: there is none."""
    if raw.shape != made.shape:
        return None
    known = np.flatnonzero(np.isfinite(raw.ravel()) & (raw.ravel() != 0.0))
    if len(known) == 0:
        return 1.0
    near = [float(made.ravel()[known[0]] / raw.ravel()[known[0]])]
    for _ in range(2):
        near = [near[0], *near, near[-1]]
        near[0], near[-1] = np.nextafter(near[0], -np.inf), np.nextafter(near[-1], np.inf)
    return next((float(f) for f in near if np.array_equal(raw * f, made, equal_nan=True)), None)


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
            joined: Fields = {name: np.concatenate(pieces) for name, pieces in kept.items()}
            yield {name: values[:rows] for name, values in joined.items()}, fraction
            kept = {name: [values[rows:]] for name, values in joined.items()}
            count = max(count - rows, 0)


def _parquet(path: Path, start: int) -> Iterator[tuple[Fields, float]]:
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

    from levelhead.sources.formats.text.arrow import open_text
    from levelhead.sources.formats.text.dialect import find_layout

    layout = find_layout(path)
    plain = not (layout.tail or layout.stamps or layout.torn) and layout.encoding.name == "utf-8"
    if not plain or layout.delimiter == " ":
        raise NeedsWholeLog(f"{path} cannot be read in chunks: it is no plain text of numbers; {WHOLE}")
    positions = {name: list(layout.names).index(name) for name in names if name in layout.names}
    whole = frozenset(positions[name] for name in exact if name in positions) & layout.whole
    size = path.stat().st_size
    try:
        with pa.OSFile(str(path)) as file:
            reader: Handle = open_text(file, layout, sorted(positions.values()), whole)
            for batch in reader:
                from levelhead.sources.formats.text.arrow import numbers

                table = pa.Table.from_batches([batch])
                yield {name: numbers(table.column(str(i))) for name, i in positions.items()}, file.tell() / size
    except (pa.ArrowException, OSError) as error:
        raise LevelheadError(f"{path} cannot be read in chunks: {error}; {WHOLE}") from None
