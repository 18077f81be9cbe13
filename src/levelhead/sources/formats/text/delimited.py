"""Text files of numbers: CSV, TSV, semicolons with decimal commas, columns by white space."""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.open_types import Untyped
from levelhead.recording import Array
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.text.cells import MISSING, cells, is_comment, lines_of, unify
from levelhead.sources.formats.text.dates import NS, nanoseconds, over_midnight
from levelhead.sources.formats.text.file import TextFile
from levelhead.sources.formats.text.layout import Layout, layout_of
from levelhead.sources.formats.text.number_rows import number_rows
from levelhead.sources.table import Column

_GROUPED = re.compile(r"\s*[-+]?\d{1,3}(?:([,'’ \u00a0\u202f])\d{3})(?:\1\d{3})*(?:\.\d+)?\s*$")  # 1,000.5
_BLOCK = 1 << 19  # bytes read at a time: their lines stay in the processor's cache
BIG = 8 << 20  # bytes from which pyarrow is worth its import
TORN_SHARE = 0.01  # of the lines, at most, that may be torn and are left out
TORN_LAST = 20  # lines from which on a torn last one is usual: the power was cut
_NULLS = sorted(
    {form for word in MISSING for form in (word, word.upper(), word.capitalize())} | {"NaN"}
)  # as pyarrow wants them


def matches(file: TextFile) -> bool:
    """True: text of no other dialect is a table, or an error names the missing part."""
    return True


def tables(file: TextFile) -> Sequence["TextTable"]:
    """The table of a text with delimiters.

    Raises:
        LevelheadError: no line of numbers, or a header without numbers below it.
    """
    return [TextTable(file)]


class TextTable:
    """A text file with columns; its numbers are read when asked for. See ``Table``."""

    def __init__(self, file: TextFile) -> None:
        self.file = file
        self.source = file.display_path
        self.layout = layout_of(file.head, file.display_path, file.encoding)
        self.names = self.layout.names
        self.unnamed = self.layout.headless
        self.units: dict[str, str] = {}
        self.column_units = dict.fromkeys(self.layout.stamps, "ns")
        self.words = self.layout.words
        self.rate = self.layout.rate
        self.context = ""
        self.origin: tuple[str, ...] = self.layout.preamble[:20]
        self.conclusions: list[Conclusion] = []
        if self.layout.decimal_comma:
            self.conclusions.append(Conclusion("file.decimal", "comma", ",", Basis.NUMBERS))
        if self.layout.torn:
            self.conclusions.append(Conclusion("file.lines", "before_header", self.layout.torn, Basis.NUMBERS))
        self.conclusions += [one for one in (self.layout.remark, self.layout.encoding.conclusion) if one is not None]
        self._left_out: dict[int, str] = {}  # number of a line, and why

    def read(self, wanted: Sequence[int], exact: frozenset[int] = frozenset()) -> dict[int, Column]:
        """See ``Table``."""
        exact &= self.layout.whole
        plain = not (self.layout.tail or self.layout.stamps & set(wanted)) and self.layout.encoding.name == "utf-8"
        if plain and self.file.unwrapped is None and self.file.size > BIG:
            # Stamps that begin with "0" may have fractions later.
            for whole in dict.fromkeys((exact, frozenset[int]())):
                for read in BIG_READERS:
                    if (columns := read(str(self.file.path), self.layout, wanted, whole)) is not None:
                        return columns
        return self._read(wanted, exact)

    @cached_property
    def labels(self) -> Mapping[str, NDArray[np.str_]]:
        """The columns of a few words that alternate, name to (n,) words; {} for a large file, and for torn lines."""
        words = sorted(self.layout.alternating)
        if not words or self.file.size > BIG:
            return {}
        found: dict[int, list[str]] = {i: [] for i in words}
        for line, text in blocks(self.file, self.layout.first):
            rows = _Rows(self.source, self.layout, line, text)
            for i in words:
                found[i] += [cell.strip() for cell in rows.cells[i :: rows.width]]
        return {self.names[i]: np.array(column) for i, column in found.items()}

    def _read(self, wanted: Sequence[int], exact: frozenset[int]) -> dict[int, Column]:
        parts: dict[int, list[Column]] = {i: [] for i in wanted}
        torn: dict[int, str] = {}
        total = 0
        for line, text in blocks(self.file, self.layout.first):
            rows = _Rows(self.source, self.layout, line, text)
            columns = rows.columns(wanted, exact)
            keep = rows.keep()
            for i in wanted:
                parts[i].append(columns[i] if keep is None else columns[i][keep])
            torn |= rows.left_out()
            total += len(rows)
        self._check(torn, total)
        found: dict[int, Column] = {}
        for i in wanted:
            pieces = parts.pop(i)
            whole = all(part.dtype == np.int64 for part in pieces)
            found[i] = np.concatenate(pieces, dtype=np.int64) if whole else np.concatenate(pieces, dtype=np.float64)
            if i in self.layout.stamps and whole and len(found[i]) and found[i].max() < 86_400 * NS:
                found[i] = np.array(over_midnight(found[i].tolist()), dtype=np.int64)
        return found

    def _check(self, torn: dict[int, str], total: int) -> None:
        """Leaves out a few torn lines, with a note.

        Raises:
            LevelheadError: there are more than ``TORN_SHARE`` of them.
        """
        if torn:
            last = max(torn)
            others = len(torn) - (1 if total >= TORN_LAST and last == self._last_line else 0)
            if others > TORN_SHARE * total:
                raise LevelheadError(torn[min(torn)])
            if not self._left_out:
                first = torn[min(torn)].removeprefix(f"{self.source}, ").partition(";")[0]
                self.conclusions.append(Conclusion("file.lines", "torn", len(torn), Basis.NUMBERS, {"first": first}))
        self._left_out = torn

    @cached_property
    def _last_line(self) -> int:
        last = 0
        for line, text in blocks(self.file, self.layout.first):
            for offset, row in enumerate(text.split("\n")):
                if row.strip():
                    last = line + offset
        return last

    def where(self, row: int) -> str:
        """The line number of a row: reads the file once more, because only errors ask."""
        if self.file.unwrapped is not None:  # its lines are not those of the file
            return f"row {row}"
        for line, text in blocks(self.file, self.layout.first):
            for offset, content in enumerate(lines_of(text)):
                if content.strip() and not is_comment(content) and line + offset not in self._left_out:
                    if row == 0:
                        return f"line {line + offset}"
                    row -= 1
        return "the last line"


def blocks(file: TextFile, first: int) -> Iterator[tuple[int, str]]:
    """(number of its first line, text) for pieces of whole lines; the ``first`` lines of the file are left out."""
    line = 1
    for piece in _pieces(file):
        text = unify(piece)
        count = text.count("\n") + 1
        drop = max(0, first + 1 - line)
        if drop < count:
            yield line + drop, text.split("\n", drop)[-1]
        line += count


def _pieces(file: TextFile) -> Iterator[str]:
    """The text of a file in pieces of whole lines, each without its last line break."""
    if file.unwrapped is not None or file.encoding.name.startswith("utf-16"):
        yield file.text()
        return
    rest = b""
    with open(file.path, "rb") as stream:
        stream.seek(file.encoding.skip)
        while raw := stream.read(min(_BLOCK, file.end - stream.tell())):
            end = raw.rfind(b"\n")
            if end < 0:
                rest += raw
                continue
            yield (rest + raw[:end]).removesuffix(b"\r").decode(file.encoding.name, "replace")
            rest = raw[end + 1 :]
    yield rest.decode(file.encoding.name, "replace")


class _Rows:
    """The cells of one block of lines."""

    def __init__(self, source: str, layout: Layout, line: int, text: str) -> None:
        self.source, self.layout, self.line = source, layout, line
        self.width = len(layout.names)
        self.lines: Sequence[int] | None = None  # line numbers, when they are not simply consecutive
        self.torn: dict[int, str] = {}  # number of a line, and its fault
        self.bad: dict[int, tuple[int, str]] = {}  # row to column and cell
        if "\0" in text:
            at = line + text[: text.index("\0")].count("\n")
            raise LevelheadError(f"{source}, line {at}: a zero byte; expected text")
        self._text = text.replace(",", ".") if layout.decimal_comma else text
        self._plain = layout.delimiter != " " and not any(sign in text for sign in '#%/"=')
        self._has_underscore = "_" in text
        self._count: int | None = None  # of rows, where all of them are numbers

    def __len__(self) -> int:
        return len(self.cells) // max(1, self.width) if self._count is None else self._count

    @cached_property
    def cells(self) -> list[str]:
        """The text of all cells, line by line."""
        delimiter, tail = self.layout.delimiter, self.layout.tail
        rows = self._text.split("\n")
        if tail:
            rows = [row.rstrip(" " + tail) for row in rows]
        even = (
            self._plain
            and all(row.count(delimiter) == self.width - 1 for row in rows)
            and (self.width > 1 or all(rows))
        )
        return delimiter.join(rows).split(delimiter) if even else self._tidy(rows)

    def _tidy(self, rows: Sequence[str]) -> list[str]:
        """The cells of lines that need care: blank ones, comments, quotes, delimiters at the end."""
        kept: list[str] = []
        self.lines = numbers = []
        for offset, row in enumerate(rows):
            if not row.strip() or is_comment(row):
                continue
            found = cells(row, self.layout.delimiter)
            if len(found) != self.width:
                fitted = self._fit(found)
                if fitted is None:
                    self.torn[self.line + offset] = (
                        f"{self.source}, line {self.line + offset}: {len(found)} cells, but the "
                        f"{'first line' if self.layout.headless else 'header'} has {self.width}; "
                        "expected one for each column"
                    )
                    continue
                found = fitted
            kept += found
            numbers.append(self.line + offset)
        return kept

    def _fit(self, found: list[str]) -> list[str] | None:
        while len(found) > self.width and not found[-1].strip():
            found.pop()
        blank = len(self.layout.names) - 1
        while blank >= 0 and not self.layout.names[blank].strip():
            blank -= 1
        if blank < len(found) < self.width:  # a header that ends with delimiters
            found += [""] * (self.width - len(found))
        return found if len(found) == self.width else None

    def columns(self, wanted: Sequence[int], exact: frozenset[int]) -> dict[int, Column]:
        """Columns as (n,) float64, or int64 if they hold stamps, or whole numbers only and are in ``exact``."""
        stamps = self.layout.stamps.intersection(wanted)
        if self._plain and not self.layout.tail and not stamps and wanted:
            found = number_rows(self._text, self.layout.delimiter, self.width, wanted, exact)
            if found is not None:
                self._count = len(found[wanted[0]])
                return found
        return {i: self._column(i, i in exact) for i in wanted}

    def _column(self, i: int, whole: bool) -> Column:
        column = self.cells[i :: self.width]
        if i in self.layout.stamps:
            return self._stamps(i, column)
        if not self._has_underscore:
            try:
                if whole:
                    return np.fromiter(map(int, column), np.int64, len(column))
            except (ValueError, OverflowError):
                pass
            try:
                return np.fromiter(map(float, column), np.float64, len(column))
            except ValueError:
                pass
        return np.array([self._number(i, row, cell) for row, cell in enumerate(column)], np.float64)

    def _stamps(self, i: int, column: Sequence[str]) -> Column:
        found: Array = np.zeros(len(column))
        values = np.zeros(len(column), dtype=np.int64)
        for row, cell in enumerate(column):
            try:
                values[row] = nanoseconds(cell)
            except ValueError:
                found[row] = math.nan
                if cell.strip().lower() not in MISSING:
                    self.bad.setdefault(row, (i, cell.strip()))
        if np.isnan(found[self.keep() if self.bad else slice(None)]).any():
            return found + values
        return values

    def _number(self, i: int, row: int, cell: str) -> float:
        try:
            if "_" not in cell:
                return float(cell)
        except ValueError:
            if _GROUPED.match(cell):
                return float(re.sub(r"[,'’\s]", "", cell))
        if cell.strip().lower() not in MISSING:
            self.bad.setdefault(row, (i, cell.strip()))
        return math.nan

    def keep(self) -> "np.ndarray[tuple[int], np.dtype[np.bool_]] | None":
        """(n,) the rows whose cells are numbers; None if all are."""
        if not self.bad:
            return None
        keep = np.ones(len(self), dtype=np.bool_)
        keep[list(self.bad)] = False
        return keep

    def left_out(self) -> dict[int, str]:
        """Numbers of the lines that are torn or hold a cell that is not a number, each with the sentence."""
        found = dict(self.torn)
        for row, (i, cell) in self.bad.items():
            line = self.line + row if self.lines is None else self.lines[row]
            shown = cell if len(cell) <= 30 else cell[:27] + "..."
            found[line] = (
                f"{self.source}, line {line}, column '{self.layout.names[i]}': '{shown}' is not a number; "
                "expected a number, or a blank cell for a missing value"
            )
        return found


def read_by_arrow(
    source: str, layout: Layout, wanted: Sequence[int], exact: frozenset[int]
) -> dict[int, Column] | None:
    """Columns of a big text file; None when pyarrow is not there or does not like the file.

    Then ``TextTable`` reads it by itself: it reads unusual cells, and its errors name the cell.
    """
    try:
        import pyarrow as pa
    except ImportError:
        return None
    if layout.delimiter == " ":
        return None
    with open(source, "rb") as file:  # no more rows than that; unwritten pages take no memory
        room = 1 + sum(block.count(b"\n") + block.count(b"\r") for block in iter(lambda: file.read(_BLOCK), b""))
    found: dict[int, Column] = {}
    for i in wanted:
        found[i] = np.empty(room, np.int64) if i in exact else np.empty(room)
    rows = 0
    try:
        for batch in open_by_arrow(source, layout, wanted, exact):  # a whole table would be a second copy of everything
            for i in wanted:
                part = batch.column(str(i)).to_numpy(zero_copy_only=False)
                if part.dtype != found[i].dtype:  # a whole number is missing
                    found[i] = found[i].astype(np.float64)
                found[i][rows : rows + len(part)] = part
            rows += batch.num_rows
    except (pa.ArrowException, OSError):
        return None
    return {i: column[:rows] for i, column in found.items()}


# Readers of big plain files; the page in the browser has its own.
BIG_READERS: list[Callable[[str, Layout, Sequence[int], frozenset[int]], dict[int, Column] | None]] = [read_by_arrow]


def open_by_arrow(source: Untyped, layout: Layout, wanted: Sequence[int], exact: frozenset[int]) -> Untyped:
    """The columns at some positions of a text file as Arrow reads them, batch by batch, by position.

    Raises:
        pyarrow.ArrowException: something in it is not a number.
    """
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    types = {str(i): pa.int64() if i in exact else pa.float64() for i in wanted}
    return pa_csv.open_csv(
        source,
        pa_csv.ReadOptions(skip_rows=layout.first, column_names=[str(i) for i in range(len(layout.names))]),
        pa_csv.ParseOptions(delimiter=layout.delimiter),
        pa_csv.ConvertOptions(
            include_columns=list(types),
            column_types=types,
            null_values=_NULLS,
            decimal_point="," if layout.decimal_comma else ".",
        ),
    )


def arrow_numbers(column: Untyped) -> Column:
    """An Arrow column as (n,) float64 with NaN for null, or int64 if it is whole and complete."""
    values: Untyped = column.to_numpy()
    numbers: Column = values if values.dtype in (np.int64, np.float64) else values.astype(np.float64)
    return numbers
