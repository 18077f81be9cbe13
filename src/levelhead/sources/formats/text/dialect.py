"""How a text file is laid out: delimiter, decimal sign, names of the columns, where the numbers begin."""

import os
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from levelhead.errors import LevelheadError
from levelhead.sources.conclusion import Conclusion
from levelhead.sources.formats.text.cells import (
    DELIMITERS,
    MISSING,
    cells,
    is_comment,
    is_data,
    is_decimal_comma,
    is_number,
    lines_of,
    trim,
)
from levelhead.sources.formats.text.dates import is_stamp
from levelhead.sources.formats.text.encoding import Encoding, find_encoding
from levelhead.sources.formats.text.header import (
    fit_names,
    header_cells,
    join_names,
    looks_like_header,
    number_twins,
    rate_in,
)

__all__ = ["MISSING", "Layout", "cells", "find_layout", "is_comment", "layout_of", "lines_of"]

HEAD = 1 << 18  # bytes that must hold preamble, header and the first lines of numbers
LOOK = 600  # lines that are looked at
DATA = 60  # of them, lines of numbers by which the delimiter is judged
FEW = 4  # cells, at most, that do not tell whether a column holds words
_END = re.compile(r"\W*end_?of_?header\W*|endheader", re.IGNORECASE)  # LabVIEW; OpenSim
LATE = 100  # lines of numbers, at most, that may stand above a header: a serial line that was joined too early


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
        tail: signs that end each line and are no cell ("1,2,3;").
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
    source = os.fspath(path)
    lines, encoding = first_lines(source)
    return layout_of(lines, source, encoding)


def first_lines(source: str) -> tuple[list[str], Encoding]:
    """The whole lines at the start of a file, and how they are encoded.

    Raises:
        LevelheadError: empty or binary.
    """
    with open(source, "rb") as file:
        head = file.read(HEAD)
        cut = len(head) == HEAD and bool(file.read(1))
    if not head.strip():
        raise LevelheadError(f"{source} is empty; expected a header and one line of numbers per sample")
    encoding = find_encoding(head, source)
    lines = lines_of(head[encoding.skip :].decode(encoding.name, "replace"))
    if cut:
        lines.pop()
    if not lines:
        raise LevelheadError(f"{source} is not a text file with columns; expected lines of numbers")
    return lines, encoding


def layout_of(lines: Sequence[str], source: str, encoding: Encoding | None = None) -> Layout:
    """The layout of lines of text that come from ``source``; see ``find_layout``."""
    ends = [i for i, line in enumerate(lines[:LOOK]) if _END.fullmatch(line.strip())]
    begin = ends[-1] + 1 if ends else 0
    content = [
        (i, line) for i, line in enumerate(lines[: 10 * LOOK]) if i >= begin and line.strip() and not is_comment(line)
    ][:LOOK]
    if not content:
        raise LevelheadError(
            f"{source} holds no lines but {'comments' if any(lines) else 'blank ones'}; expected numbers"
        )
    shape = _shape([line for _, line in content])
    if shape is None:
        shown = ", ".join(cells(content[0][1], _usual_delimiter(content[0][1]))[:4])
        raise LevelheadError(
            f"{source} has a header ({shown}, …) but no line of numbers below it; "
            "expected one line per sample, separated by comma, semicolon or tab"
        )
    delimiter, comma, tail, width = shape
    rows = [(i, cells(line.rstrip(tail) if tail else line, delimiter)) for i, line in content]
    numeric = [is_data(row, comma) for _, row in rows]
    wide = [_near(row, width) for _, row in rows]
    start = next((k for k in range(len(rows)) if numeric[k] and wide[k]), numeric.index(True))
    header_at, header = _header_above([line for _, line in content], delimiter, width, comma, start)
    torn = 0
    if not header:
        late = _late_header([line for _, line in content], numeric, wide, delimiter, width, comma, start)
        if late is not None:
            torn = sum(numeric[start:late])
            header_at, start = late, next(k for k in range(late, len(rows)) if numeric[k] and wide[k])
            header = [header_cells(content[late][1], delimiter, width) or []]
    elif any(numeric[:header_at]) and not any(wide[k] and numeric[k] for k in range(header_at)):
        torn = sum(numeric[:header_at])
    first, row = rows[start]
    if not header:
        header = _comment_names(lines[:first], delimiter, width, comma)
    below = [row for (_, row), data in zip(rows[start:], numeric[start:], strict=True) if data][:DATA]
    names = join_names(header, width) if header else [str(i + 1) for i in range(len(trim(row)))]
    while names and not names[-1].strip() and len(trim(row)) < len(names):
        names.pop()
    remark = None
    if header and all(len(row) == width for row in below):
        names, remark = fit_names(names, max(map(len, header)), below)
    names = number_twins(names) if header else names
    preamble = tuple(lines[: content[header_at][0]] if header else lines[:first])
    words = _word_columns(below, len(names), comma)
    whole = frozenset(i for i, cell in enumerate(row) if cell.strip().lstrip("+-").isdecimal())
    return Layout(
        delimiter, comma, tuple(names), not header, first, whole, torn, _stamp_columns(below, len(names)),
        words, rate_in(preamble), tail, encoding or Encoding("utf-8"), preamble,
        remark, frozenset(i for i in words if _changes([row[i] for row in below if i < len(row)])),
    )  # fmt: skip


def _changes(words: Sequence[str]) -> bool:
    """Whether a few words take turns."""
    turns = sum(a != b for a, b in pairwise(words))
    return len(words) > FEW and turns > 0.1 * len(words) and len(set(words)) <= 0.4 * len(words)


def _near(row: Sequence[str], width: int) -> bool:
    return len(trim(row)) <= width <= len(row) or len(row) == width


def _shape(lines: Sequence[str]) -> tuple[str, bool, str, int] | None:
    """(delimiter, decimal comma, signs at the end of lines, width) under which most lines are numbers; None: none is.

    The last lines count, since what stands above the numbers may have any shape.
    """
    sample = lines[-DATA:]
    best: tuple[tuple[float, int, int], tuple[str, bool, str, int]] | None = None
    tail = ";" if sum(line.rstrip().endswith(";") for line in sample) > 0.9 * len(sample) else ""
    for order, delimiter in enumerate(DELIMITERS):
        end = tail if delimiter != ";" else ""
        rows = [cells(line.rstrip(" " + end) if end else line, delimiter) for line in sample]
        comma = delimiter != "," and any(is_decimal_comma(cell) for row in rows for cell in row)
        data = [row for row in rows if is_data(row, comma) and (len(row) > 1 or len(rows) > 0)]
        if not data:
            continue
        width, count = Counter(len(row) for row in data).most_common(1)[0]
        if delimiter == " " and comma and all(len(trim(row)) == 1 for row in data):
            continue
        score = (count if width > 1 else 0.1 * count, -order, width)
        if best is None or score > best[0]:
            best = score, (delimiter, comma, end, width)
    if best is None:
        return None
    delimiter, comma, end, width = best[1]
    return delimiter, comma, end, width


def _usual_delimiter(line: str) -> str:
    found = Counter(delimiter for delimiter in "\t;," for _ in range(line.count(delimiter)))
    return found.most_common(1)[0][0] if found else " "


def _header_above(
    lines: Sequence[str], delimiter: str, width: int, comma: bool, start: int
) -> tuple[int, list[list[str]]]:
    """(position of its first line, rows) of the header right above the numbers; none: (start, [])."""
    rows: list[list[str]] = []
    at, other = start, ""  # another delimiter than that of the numbers, which the lowest line of the header has
    while at > 0 and len(rows) < 6:
        row = _header_row(lines[at - 1], delimiter, width, strict=bool(rows), other=other)
        if not looks_like_header(row, width, comma):
            break
        if not rows and delimiter == " ":
            other = next((one for one in "\t,;" if len(cells(lines[at - 1].strip(), one)) == width), "")
        rows.insert(0, row or [])
        at -= 1
    return at, rows


def _header_row(line: str, delimiter: str, width: int, strict: bool, other: str = "") -> list[str] | None:
    """The cells of a line above the numbers; a second or third line must have their delimiter, or the first's."""
    if strict and other:
        row = [cell.strip() for cell in cells(line.strip(), other)]
        return ["", *row] if len(row) == width - 1 else row if len(row) == width else None
    row = cells(re.sub(r"\s+(?=[\[(])", "", line) if delimiter == " " else line, delimiter)
    if len(row) == width or (width > 1 and len(trim(row)) <= width <= len(row)):
        return [cell.strip().strip("\"'").rstrip(":").strip() for cell in row]
    if width > 2 and not strict and len(row) in (width - 1, width + 1) and len(trim(row)) > 0.5 * width:
        return [cell.strip() for cell in row]
    return None if strict else header_cells(line, delimiter, width)


def _late_header(
    lines: Sequence[str], numeric: Sequence[bool], wide: Sequence[bool], delimiter: str, width: int, comma: bool,
    start: int,
) -> int | None:  # fmt: skip
    """Where a header stands below the first lines of numbers: somebody began to listen before it came."""
    for k in range(start + 1, min(len(lines) - 1, start + LATE)):
        if numeric[k] or not any(numeric[j] and wide[j] for j in range(k + 1, min(k + 3, len(lines)))):
            continue
        row = cells(lines[k], delimiter)
        if (
            len(row) == width > 3
            and looks_like_header(row, width, comma)
            and not any(c.strip().lower() in MISSING for c in row)
        ):
            return k
    return None


def _comment_names(lines: Sequence[str], delimiter: str, width: int, comma: bool) -> list[list[str]]:
    """The names in the last comment before the numbers that has as many cells (EuRoC, numpy.savetxt)."""
    for line in reversed([line for line in lines if line.strip() and is_comment(line)][-20:]):
        row = header_cells(line, delimiter, width) if width > 3 else None
        if row is not None and looks_like_header(row, width, comma):
            return [row]
    return []


def _word_columns(rows: Sequence[Sequence[str]], width: int, comma: bool) -> frozenset[int]:
    """The columns in which no cell is a number, a date or a clock time, and some cell is something."""
    found = set()
    for i in range(width):
        filled = [row[i] for row in rows if i < len(row) and row[i].strip().lower() not in MISSING]
        if len(filled) > FEW and not any(is_stamp(cell) or is_number(cell, comma) for cell in filled):
            found.add(i)
    return frozenset(found)


def _stamp_columns(rows: Sequence[Sequence[str]], width: int) -> frozenset[int]:
    """The columns in which nearly every cell is a date or a clock time."""
    found = set()
    for i in range(width):
        filled = [row[i] for row in rows if i < len(row) and row[i].strip().lower() not in MISSING]
        if filled and sum(is_stamp(cell) for cell in filled) > 0.9 * len(filled):
            found.add(i)
    return frozenset(found)
