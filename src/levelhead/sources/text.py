"""Text files of numbers: CSV, TSV, semicolons with decimal commas."""

import math
import os
from collections.abc import Iterator, Sequence

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array
from levelhead.sources.layout import MISSING, Layout, cells, decode, find_layout, is_comment, lines_of
from levelhead.sources.table import Column

_BLOCK = 1 << 22  # bytes read at a time
BIG = 8 << 20  # bytes from which pyarrow is worth its import


class TextTable:
    """A text file with columns; its numbers are read when asked for. See ``Table``."""

    rate = None

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.source = os.fspath(path)
        self.layout = find_layout(path)
        self.names = self.layout.names
        self.units: dict[str, str] = {}
        self.notes: list[str] = ["numbers are written with a decimal comma"] if self.layout.decimal_comma else []
        if self.layout.torn:
            self.notes.append("before the header stands the end of a line; it was left out")

    def read(self, wanted: Sequence[int], exact: int | None = None) -> dict[int, Column]:
        """See ``Table``."""
        exact = exact if exact in self.layout.whole else None
        if os.path.getsize(self.source) > BIG:
            from levelhead.sources.arrow import read_text

            for whole in dict.fromkeys((exact, None)):  # stamps that begin with "0" may still have fractions later
                if (columns := read_text(self.source, self.layout, wanted, whole)) is not None:
                    return columns
        return self._read(wanted, exact)

    def _read(self, wanted: Sequence[int], exact: int | None) -> dict[int, Column]:
        parts: dict[int, list[Column]] = {i: [] for i in wanted}
        for line, text in blocks(self.source, self.layout.first):
            rows = _Rows(self.source, self.layout, line, text)
            for i in wanted:
                parts[i].append(rows.whole(i) if i == exact else rows.numbers(i))
            rows.complain()
        columns: dict[int, Column] = {}
        for i in wanted:
            whole = all(part.dtype == np.int64 for part in parts[i])
            pieces = parts.pop(i)
            columns[i] = np.concatenate(pieces, dtype=np.int64) if whole else np.concatenate(pieces, dtype=np.float64)
        return columns

    def where(self, row: int) -> str:
        """The line number of a row: reads the file once more, because only errors ask."""
        for line, text in blocks(self.source, self.layout.first):
            for offset, content in enumerate(lines_of(text)):
                if content.strip() and not is_comment(content):
                    if row == 0:
                        return f"line {line + offset}"
                    row -= 1
        return "the last line"


def blocks(source: str, skip: int) -> Iterator[tuple[int, str]]:
    """(number of its first line, text) for pieces of whole lines, from the line after the first ``skip`` ones."""
    line, rest = 1, b""
    with open(source, "rb") as file:
        while True:
            raw = file.read(_BLOCK)
            if line == 1 and not rest:
                raw = raw.removeprefix(b"\xef\xbb\xbf")
            end = raw.rfind(b"\n") + 1 if raw else 0
            if raw and not end:
                rest += raw
                continue
            text = decode(rest + raw[:end], source, line)
            rest = raw[end:]
            lines = lines_of(text)
            count = len(lines) - 1 if raw else len(lines)
            drop = max(0, skip + 1 - line)
            if drop < count:
                yield line + drop, "\n".join(lines[drop:count])
            line += count
            if not raw:
                return


class _Rows:
    """The cells of one block of lines."""

    def __init__(self, source: str, layout: Layout, line: int, text: str) -> None:
        self.source, self.layout, self.line = source, layout, line
        self.width = len(layout.names)
        self.lines: Sequence[int] | None = None  # line numbers, when they are not simply consecutive
        self.bad: dict[int, tuple[int, str]] = {}
        if "\0" in text:
            at = line + text[: text.index("\0")].count("\n")
            raise LevelheadError(f"{source}, line {at}: a zero byte stands there; expected text")
        if layout.decimal_comma:
            text = text.replace(",", ".")
        rows = text.split("\n")
        delimiter = layout.delimiter
        plain = delimiter != " " and not any(sign in text for sign in '#%/"') and "sep=" not in text
        if plain and all(row.count(delimiter) == self.width - 1 for row in rows) and (self.width > 1 or all(rows)):
            self.cells = delimiter.join(rows).split(delimiter)
        else:
            self.cells = self._tidy(rows)
        self.odd = "_" in text

    def _tidy(self, rows: Sequence[str]) -> list[str]:
        """The cells of lines that need care: blank ones, comments, quotes, delimiters at the end."""
        kept: list[str] = []
        self.lines = numbers = []
        for offset, row in enumerate(rows):
            if not row.strip() or is_comment(row):
                continue
            found = cells(row, self.layout.delimiter)
            if len(found) != self.width:
                found = self._fit(found, self.line + offset)
            kept += found
            numbers.append(self.line + offset)
        return kept

    def _fit(self, found: list[str], line: int) -> list[str]:
        while len(found) > self.width and not found[-1].strip():
            found.pop()
        blank = len(self.layout.names) - 1
        while blank >= 0 and not self.layout.names[blank].strip():
            blank -= 1
        if blank < len(found) < self.width:  # a header that ends with delimiters
            found += [""] * (self.width - len(found))
        if len(found) != self.width:
            raise LevelheadError(
                f"{self.source}, line {line}: {len(found)} cells, but the "
                f"{'first line' if self.layout.headless else 'header'} has {self.width}; expected one for each column"
            )
        return found

    def numbers(self, i: int) -> Array:
        """Column ``i`` as (n,) float64."""
        column = self.cells[i :: self.width]
        if not self.odd:
            try:
                return np.fromiter(map(float, column), np.float64, len(column))
            except ValueError:
                pass
        return np.array([self._number(i, row, cell) for row, cell in enumerate(column)], np.float64)

    def whole(self, i: int) -> Column:
        """Column ``i`` as (n,) int64 if it holds whole numbers only, else as float64."""
        column = self.cells[i :: self.width]
        if not self.odd:
            try:
                return np.fromiter(map(int, column), np.int64, len(column))
            except (ValueError, OverflowError):
                pass
        return self.numbers(i)

    def _number(self, i: int, row: int, cell: str) -> float:
        try:
            if "_" not in cell:
                return float(cell)
        except ValueError:
            pass
        if cell.strip().lower() not in MISSING:
            self.bad.setdefault(row, (i, cell.strip()))
        return math.nan

    def complain(self) -> None:
        """Raise ``LevelheadError`` for the first cell that is no number."""
        if self.bad:
            row = min(self.bad)
            i, cell = self.bad[row]
            line = self.line + row if self.lines is None else self.lines[row]
            shown = cell if len(cell) <= 30 else cell[:27] + "..."
            raise LevelheadError(
                f"{self.source}, line {line}, column '{self.layout.names[i]}': '{shown}' is not a number; "
                "expected a number, or a blank cell for a missing value"
            )
