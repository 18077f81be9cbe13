"""How a text table is laid out: delimiter, decimal sign, names of the columns, where the numbers begin."""

import os
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice, pairwise
from typing import NamedTuple

from levelhead.errors import LevelheadError
from levelhead.sources.conclusions import Conclusion
from levelhead.sources.formats.text.cells import (
    DELIMITERS,
    MISSING,
    cells,
    is_comment,
    is_data,
    is_decimal_comma,
    is_number,
    trim,
)
from levelhead.sources.formats.text.dates import is_stamp
from levelhead.sources.formats.text.encoding import Encoding
from levelhead.sources.formats.text.file import open_text
from levelhead.sources.formats.text.header import (
    fit_names,
    header_cells,
    join_names,
    looks_like_header,
    number_twins,
    rate_in,
)

_MAX_LINES = 600  # that are looked at
_MAX_DATA = 60  # of them, lines of numbers by which the delimiter is judged
_MIN_WORDS = 5  # cells that show whether a column holds words
_MAX_LATE = 100  # lines of numbers that may stand above a header: a serial line that was joined too early
_MIN_SHORT = 6  # names of a header that names only the first columns
_MAX_HEADER = 6  # lines of a header
_MAX_COMMENTS = 20  # comments above the numbers among which the names are looked for
_END = re.compile(r"\W*end_?of_?header\W*|endheader", re.IGNORECASE)  # LabVIEW; OpenSim


@dataclass(frozen=True)
class Layout:
    """How a text file is laid out.

    Attributes:
        delimiter: "," ";" tab, "|", or " " for any run of white space.
        decimal_comma: whether numbers are written 9,81.
        names: one per column; "1", "2", … in a file without header.
        headless: whether the names are made up.
        first: how many physical lines stand before the first line of numbers.
        whole: positions of the columns whose first value is a whole number.
        torn: how many lines of numbers stand before the header and belong to nothing.
        stamps: positions of the columns that hold dates or clock times.
        words: positions of the columns that hold neither numbers nor stamps.
        rate: samples a second, if the lines above the header give it.
        tail: signs that end each line and are not a cell ("1,2,3;").
        encoding: how the bytes are text.
        preamble: the lines above the header.
        alternating: positions of the columns of words that change from line to line.
        remark: set where the header has one name more or less than the lines below it have cells.
    """

    delimiter: str
    decimal_comma: bool
    names: tuple[str, ...]
    headless: bool
    first: int
    whole: frozenset[int]
    torn: int = 0
    stamps: frozenset[int] = frozenset()
    words: frozenset[int] = frozenset()
    rate: float | None = None
    tail: str = ""
    encoding: Encoding = field(default_factory=lambda: Encoding("utf-8"))
    preamble: tuple[str, ...] = ()
    remark: Conclusion | None = None
    alternating: frozenset[int] = frozenset()


def find_layout(path: str | os.PathLike[str]) -> Layout:
    """The layout of a text file.

    Raises:
        LevelheadError: empty, binary, a header without numbers below it.
    """
    file = open_text(path)
    return layout_of(file.head, file.display_path, file.encoding)


class Shape(NamedTuple):
    """The shape of most lines of numbers.

    Attributes:
        delimiter: as in ``Layout``.
        comma: whether the decimal sign is a comma.
        tail: signs that end each line and are not a cell.
        width: cells in a line.
    """

    delimiter: str
    comma: bool
    tail: str
    width: int

    def cells(self, line: str) -> list[str]:
        """The cells of a line of numbers."""
        return cells(line.rstrip(self.tail) if self.tail else line, self.delimiter)


class Header(NamedTuple):
    """The header: its first line among those with content, the first line of numbers, its rows, and the signs that it
    cuts off.

    Without a header ``rows`` is empty; ``torn`` counts the lines of numbers above it, which belong to nothing.
    """

    at: int
    start: int
    rows: list[list[str]]
    torn: int = 0


class _Sample:
    """The lines of a file that show its layout; each is looked at when it is asked for, which few are."""

    def __init__(self, content: Sequence[tuple[int, str]], shape: Shape) -> None:
        self.shape = shape
        self.numbers = [number for number, _ in content]  # of the lines in the file, from 0
        self.lines = [line for _, line in content]
        self._rows: dict[int, list[str]] = {}
        self._numeric: dict[int, bool] = {}

    def row(self, k: int) -> list[str]:
        """The cells of line ``k``."""
        if k not in self._rows:
            self._rows[k] = self.shape.cells(self.lines[k])
        return self._rows[k]

    def is_numeric(self, k: int) -> bool:
        """Whether line ``k`` holds numbers."""
        if k not in self._numeric:
            self._numeric[k] = is_data(self.row(k), self.shape.comma)
        return self._numeric[k]

    def is_data(self, k: int) -> bool:
        """Whether line ``k`` holds numbers, and as many as most lines do."""
        return self.is_numeric(k) and _near(self.row(k), self.shape.width)

    @cached_property
    def start(self) -> int:
        """The first line of data."""
        lines = range(len(self.lines))
        data = [*islice(filter(self.is_data, lines), 1), *islice(filter(self.is_numeric, lines), 1)]
        return next(iter(data), 0)

    def count_numeric(self, begin: int, end: int) -> int:
        """How many of some lines hold numbers."""
        return sum(map(self.is_numeric, range(begin, end)))


def layout_of(lines: Sequence[str], source: str, encoding: Encoding | None = None) -> Layout:
    """The layout of lines of text that come from ``source``; see ``find_layout``."""
    content = _content(lines, source)
    shape = _shape([line for _, line in content])
    if shape is None:
        shown = ", ".join(cells(content[0][1], _usual_delimiter(content[0][1]))[:4])
        raise LevelheadError(
            f"{source} has a header ({shown}, …) but no line of numbers below it; "
            "expected one line per sample, separated by comma, semicolon or tab"
        )
    sample = _Sample(content, shape)
    header = _find_header(sample)
    first, row = sample.numbers[header.start], sample.row(header.start)
    preamble = tuple(lines[: sample.numbers[header.at]])
    if not header.rows:
        header = header._replace(rows=_comment_names(lines[:first], shape))
    data = filter(sample.is_numeric, range(header.start, len(sample.lines)))
    below = [sample.row(k) for k in islice(data, _MAX_DATA)]
    names, remark = _names(header.rows, row, below, shape.width)
    words = _word_columns(below, len(names), shape.comma)
    return Layout(
        delimiter=shape.delimiter,
        decimal_comma=shape.comma,
        names=tuple(names),
        headless=not header.rows,
        first=first,
        whole=frozenset(i for i, cell in enumerate(row) if cell.strip().lstrip("+-").isdecimal()),
        torn=header.torn,
        stamps=_stamp_columns(below, len(names)),
        words=words,
        rate=rate_in(preamble),
        tail=shape.tail,
        encoding=encoding or Encoding("utf-8"),
        preamble=preamble,
        remark=remark,
        alternating=frozenset(i for i in words if _alternates([row[i] for row in below if i < len(row)])),
    )


def _content(lines: Sequence[str], source: str) -> list[tuple[int, str]]:
    """The first lines that are neither blank nor comments, behind a mark that ends the header; each with its number.

    Raises:
        LevelheadError: there are none.
    """
    ends = [i for i, line in enumerate(lines[:_MAX_LINES]) if _END.fullmatch(line.strip())]
    begin = ends[-1] + 1 if ends else 0
    filled = (
        (i, line)
        for i, line in enumerate(lines[: 10 * _MAX_LINES])
        if i >= begin and line.strip() and not is_comment(line)
    )
    content = list(islice(filled, _MAX_LINES))
    if not content:
        raise LevelheadError(
            f"{source} holds no lines but {'comments' if any(lines) else 'blank ones'}; expected numbers"
        )
    return content


def _find_header(sample: _Sample) -> Header:
    """The header right above the numbers, or further down where somebody began to listen before it came."""
    at, rows = _header_above(sample)
    if not rows:
        return _late_header(sample) or Header(at, sample.start, rows)
    torn = sample.count_numeric(0, at)
    if torn and not any(map(sample.is_data, range(at))):
        return Header(at, sample.start, rows, torn)
    return Header(at, sample.start, rows)


def _names(
    header: Sequence[Sequence[str]], row: Sequence[str], below: Sequence[Sequence[str]], width: int
) -> tuple[list[str], Conclusion | None]:
    """(names of the columns, remark) from the rows of a header; ``row`` is the first line of numbers."""
    used = len(trim(row))
    names = join_names(header, width) if header else [str(i + 1) for i in range(used)]
    while names and not names[-1].strip() and used < len(names):
        names.pop()
    if not header:
        return names, None
    remark = None
    if all(len(row) == width for row in below):
        names, remark = fit_names(names, max(map(len, header)), below)
    return number_twins(names), remark


def _alternates(words: Sequence[str]) -> bool:
    """Whether a few words take turns."""
    changes = sum(a != b for a, b in pairwise(words))
    return len(words) >= _MIN_WORDS and changes > 0.1 * len(words) and len(set(words)) <= 0.4 * len(words)


def _near(row: Sequence[str], width: int) -> bool:
    return len(trim(row)) <= width <= len(row) or len(row) == width


def _shape(lines: Sequence[str]) -> Shape | None:
    """The shape under which most lines are numbers; None: none is.

    The last lines count, since the lines above the numbers may have any shape.
    """
    sample = lines[-_MAX_DATA:]
    tail = ";" if sum(line.rstrip().endswith(";") for line in sample) > 0.9 * len(sample) else ""
    best: tuple[tuple[float, int, int], Shape] | None = None
    for order, delimiter in enumerate(DELIMITERS):
        rated = _rate_delimiter(sample, delimiter, tail if delimiter != ";" else "")
        if rated is None:
            continue
        count, shape = rated
        score = (count if shape.width > 1 else 0.1 * count, -order, shape.width)
        if best is None or score > best[0]:
            best = score, shape
    return None if best is None else best[1]


def _rate_delimiter(lines: Sequence[str], delimiter: str, tail: str) -> tuple[int, Shape] | None:
    """(lines of numbers of the usual width, their shape) under one delimiter; None: there are no numbers."""
    rows = [cells(line.rstrip(" " + tail) if tail else line, delimiter) for line in lines]
    comma = delimiter != "," and any(is_decimal_comma(cell) for row in rows for cell in row)
    data = [row for row in rows if is_data(row, comma)]
    if not data or (delimiter == " " and comma and all(len(trim(row)) == 1 for row in data)):
        return None
    width, count = Counter(map(len, data)).most_common(1)[0]
    return count, Shape(delimiter, comma, tail, width)


def _usual_delimiter(line: str) -> str:
    counts = Counter(delimiter for delimiter in "\t;," for _ in range(line.count(delimiter)))
    return counts.most_common(1)[0][0] if counts else " "


def _header_above(sample: _Sample) -> tuple[int, list[list[str]]]:
    """(position of its first line, rows) of the header right above the numbers; none: (start, [])."""
    delimiter, width = sample.shape.delimiter, sample.shape.width
    rows: list[list[str]] = []
    at, other = sample.start, ""  # another delimiter than that of the numbers, which the lowest line of the header has
    while at > 0 and len(rows) < _MAX_HEADER:
        line = sample.lines[at - 1]
        row = _upper_row(line, sample.shape, other) if rows else _header_row(line, sample.shape)
        if not looks_like_header(row, width, sample.shape.comma):
            break
        if not rows and delimiter == " ":
            other = next((sign for sign in "\t,;" if len(cells(line.strip(), sign)) == width), "")
        rows.insert(0, row or [])
        at -= 1
    return at, rows


def _header_row(line: str, shape: Shape) -> list[str] | None:
    """The cells of the line right above the numbers, which may have one cell more or less, or another delimiter."""
    delimiter, width = shape.delimiter, shape.width
    row = _header_cells(line, shape)
    if _fills(row, width):
        return [_clean(cell) for cell in row]
    if width > 2 and len(row) in (width - 1, width + 1) and len(trim(row)) > 0.5 * width:
        return [cell.strip() for cell in row]
    if _MIN_SHORT <= len(trim(row)) == len(row) < width and len(set(row)) == len(row):
        return [cell.strip() for cell in row]
    return header_cells(line, delimiter, width)


def _upper_row(line: str, shape: Shape, other: str) -> list[str] | None:
    """The cells of a second or third line of the header, with the delimiter of the numbers or of the lowest line."""
    width = shape.width
    if other:
        row = [cell.strip() for cell in cells(line.strip(), other)]
        return ["", *row] if len(row) == width - 1 else row if len(row) == width else None
    row = _header_cells(line, shape)
    return [_clean(cell) for cell in row] if _fills(row, width) else None


def _header_cells(line: str, shape: Shape) -> list[str]:
    """The cells of a line by the delimiter of the numbers; blanks before a bracket are not a delimiter."""
    return cells(re.sub(r"\s+(?=[\[(])", "", line) if shape.delimiter == " " else line, shape.delimiter)


def _fills(row: Sequence[str], width: int) -> bool:
    return len(row) == width or (width > 1 and len(trim(row)) <= width <= len(row))


def _clean(cell: str) -> str:
    return cell.strip().strip("\"'").rstrip(":").strip()


def _late_header(sample: _Sample) -> Header | None:
    """The header below the first lines of numbers: somebody began to listen before it came; None: there is none."""
    width, count = sample.shape.width, len(sample.lines)
    for k in range(sample.start + 1, min(count - 1, sample.start + _MAX_LATE)):
        if sample.is_numeric(k) or not any(map(sample.is_data, range(k + 1, min(k + 3, count)))):
            continue
        row = cells(sample.lines[k], sample.shape.delimiter)
        words = looks_like_header(row, width, sample.shape.comma)
        if len(row) == width > 3 and words and not any(cell.strip().lower() in MISSING for cell in row):
            start = next(j for j in range(k, count) if sample.is_data(j))
            rows = [header_cells(sample.lines[k], sample.shape.delimiter, width) or []]
            return Header(k, start, rows, sample.count_numeric(sample.start, k))
    return None


def _comment_names(lines: Sequence[str], shape: Shape) -> list[list[str]]:
    """The names in the last comment before the numbers that has as many cells (EuRoC, numpy.savetxt)."""
    comments = [line for line in lines if line.strip() and is_comment(line)]
    for line in reversed(comments[-_MAX_COMMENTS:]):
        row = header_cells(line, shape.delimiter, shape.width) if shape.width > 3 else None
        if row is not None and looks_like_header(row, shape.width, shape.comma):
            return [row]
    return []


def _word_columns(rows: Sequence[Sequence[str]], width: int, comma: bool) -> frozenset[int]:
    """The columns in which no cell is a number, a date or a clock time, and some cell is something."""
    found = set()
    for i in range(width):
        filled = _filled(rows, i)
        if len(filled) >= _MIN_WORDS and not any(is_stamp(cell) or is_number(cell, comma) for cell in filled):
            found.add(i)
    return frozenset(found)


def _stamp_columns(rows: Sequence[Sequence[str]], width: int) -> frozenset[int]:
    """The columns in which nearly every cell is a date or a clock time."""
    found = set()
    for i in range(width):
        filled = _filled(rows, i)
        if filled and sum(map(is_stamp, filled)) > 0.9 * len(filled):
            found.add(i)
    return frozenset(found)


def _filled(rows: Sequence[Sequence[str]], i: int) -> list[str]:
    """The cells of column ``i`` that hold a value."""
    return [row[i] for row in rows if i < len(row) and row[i].strip().lower() not in MISSING]
