"""What the first lines of a text file say: delimiter, decimal sign, names of the columns, where the numbers begin."""

import csv
import os
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice

from levelhead.errors import LevelheadError

COMMENTS = ("#", "%", "//")
MISSING = frozenset({"", "nan", "null", "none", "na", "n/a", "-", "--"})  # in lower case
_HEAD = 1 << 18  # bytes that must hold the header
_LOOK = 100  # lines that are looked at
_SAMPLE = 40  # data lines that the delimiter is judged by


@dataclass(frozen=True)
class Layout:
    """How a text file is laid out.

    Attributes:
        delimiter: "," ";" tab, or " " for any run of white space.
        decimal_comma: whether numbers are written 9,81.
        names: one per column; "1", "2", … in a file without header.
        headless: whether the names are made up.
        first: how many physical lines stand before the first line of numbers.
        whole: positions of the columns whose first value is a whole number.
        torn: whether the end of a line stands before the header, as where somebody began to listen to a serial line.
    """

    delimiter: str
    decimal_comma: bool
    names: tuple[str, ...]
    headless: bool
    first: int
    whole: frozenset[int]
    torn: bool = False


def find_layout(path: str | os.PathLike[str]) -> Layout:
    """The layout of a text file.

    Raises:
        LevelheadError: empty, binary, not UTF-8, a header without numbers below it.
    """
    source = os.fspath(path)
    return layout_of(_first_lines(source), source)


def layout_of(lines: Sequence[str], source: str) -> Layout:
    """The layout of lines of text that come from ``source``; see ``find_layout``."""
    content = list(islice(((i, line) for i, line in enumerate(lines) if line.strip() and not is_comment(line)), _LOOK))
    if not content:
        raise LevelheadError(
            f"{source} holds no lines but {'comments' if any(lines) else 'blank ones'}; expected numbers"
        )
    delimiter = _delimiter([line for _, line in content])
    rows = [(i, cells(line, delimiter)) for i, line in content]
    comma = delimiter != "," and any(
        "," in cell and _is_number(cell, True) for _, row in rows[-_SAMPLE:] for cell in row
    )
    start = next((k for k, (_, row) in enumerate(rows) if _is_data(row, comma)), None)
    if start is None:
        raise LevelheadError(
            f"{source} has a header ({', '.join(rows[0][1][:4])}, …) but no line of numbers below it; "
            "expected one line per sample, separated by comma, semicolon or tab"
        )
    torn = start == 0 and _is_torn([row for _, row in rows[:3]], comma)
    start = 2 if torn else start
    first, row = rows[start]
    header = [cells_ for _, cells_ in rows[int(torn) : start]] or _commented_header(
        lines[:first], delimiter, len(_trimmed(row))
    )
    names = _names(header) if header else [str(i + 1) for i in range(len(_trimmed(row)))]
    while names and not names[-1].strip() and len(_trimmed(row)) < len(names):
        names.pop()
    whole = frozenset(i for i, cell in enumerate(row) if cell.strip().lstrip("+-").isdecimal())
    return Layout(delimiter, comma, tuple(names), not header, first, whole, torn)


def cells(line: str, delimiter: str) -> list[str]:
    """The cells of one line, quotes taken off."""
    if delimiter == " ":
        return line.split()
    if '"' in line:
        with suppress(csv.Error):
            return next(csv.reader([line], delimiter=delimiter), [])
    return line.split(delimiter)


def is_comment(line: str) -> bool:
    """A remark, or Excel's hint ``sep=;``."""
    return line.lstrip().startswith(COMMENTS) or line[:4].lower() == "sep="


def lines_of(text: str) -> list[str]:
    """Lines as a text editor counts them."""
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _first_lines(source: str) -> list[str]:
    with open(source, "rb") as file:
        head = file.read(_HEAD)
        cut = len(head) == _HEAD and bool(file.read(1))
    if not head.strip():
        raise LevelheadError(f"{source} is empty; expected a header and one line of numbers per sample")
    if cut:
        head = head[: max(head.rfind(b"\n"), head.rfind(b"\r")) + 1]
    if not head or b"\0" in head:
        raise LevelheadError(f"{source} is not a text file with columns; expected lines of numbers in UTF-8")
    return lines_of(decode(head.removeprefix(b"\xef\xbb\xbf"), source, 1))


def decode(raw: bytes, source: str, first_line: int) -> str:
    """UTF-8 or an error with the line; ``first_line`` is the number of the first line in ``raw``."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = first_line + len(lines_of(raw[: error.start].decode("utf-8", "replace"))) - 1
        raise LevelheadError(
            f"{source}, line {line}: byte 0x{raw[error.start]:02x} is not UTF-8 text; save the file as UTF-8"
        ) from None


def _delimiter(lines: Sequence[str]) -> str:
    """The first of tab, semicolon, comma that stands in nearly every line of the sample; else white space."""
    sample = lines[2:][-_SAMPLE:] or lines[-1:]
    for delimiter in "\t;,":
        if sum(delimiter in line for line in sample) > 0.9 * len(sample):
            return delimiter
    found = Counter(delimiter for line in lines for delimiter in "\t;," if delimiter in line)
    return found.most_common(1)[0][0] if found else " "


def _is_number(cell: str, comma: bool) -> bool:
    try:
        float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        return False
    return "_" not in cell


def _is_data(row: Sequence[str], comma: bool) -> bool:
    """Whether at least half of what stands in the line is numbers."""
    filled = [cell for cell in row if cell.strip().lower() not in MISSING]
    numbers = sum(_is_number(cell, comma) for cell in filled)
    return bool(row) and (2 * numbers >= len(filled) > 0 or (not filled and any(cell.strip() for cell in row)))


def _is_torn(rows: Sequence[Sequence[str]], comma: bool) -> bool:
    """Whether these are the end of a line of numbers, a header, and numbers below it."""
    if len(rows) < 3 or len(rows[1]) != len(rows[2]) or len(rows[0]) > len(rows[1]) or len(rows[1]) < 4:
        return False
    words = not any(_is_number(cell, comma) or cell.strip().lower() in MISSING for cell in rows[1])
    return words and _is_data(rows[2], comma)


def _trimmed(row: Sequence[str]) -> list[str]:
    """The row without blank cells at its end."""
    end = len(row)
    while end > 1 and not row[end - 1].strip():
        end -= 1
    return list(row[:end])


def _commented_header(lines: Sequence[str], delimiter: str, width: int) -> list[list[str]]:
    """The names in the last comment before the numbers (EuRoC, numpy.savetxt), if it has as many cells."""
    for line in reversed([line for line in lines if line.strip()]):
        row = _trimmed(cells(line.strip().lstrip("#%/ "), delimiter))
        if len(row) == width > 3 and not all(_is_number(cell, False) for cell in row):
            return [row]
        break
    return []


def _names(header: Sequence[Sequence[str]]) -> list[str]:
    """One name per column; of several header lines, group names spread over the blank cells behind them."""
    width = max(len(row) for row in header)
    parts: list[list[str]] = [[] for _ in range(width)]
    for depth, row in enumerate(header):
        group = ""
        for i in range(width):
            cell = row[i].strip() if i < len(row) else ""
            group = cell or (group if depth < len(header) - 1 and i < len(row) else "")
            if group:
                parts[i].append(group)
    if len(header) > 1:  # a group does not spread over columns that nothing stands under
        for i in range(width):
            if not any(i < len(row) and row[i].strip() for row in header):
                parts[i] = []
    return [" ".join(part) for part in parts]
