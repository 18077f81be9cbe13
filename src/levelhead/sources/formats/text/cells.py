"""Lines of text as cells, and the kind of a cell: a number, a stamp, missing, a word."""

import csv
import math
import re
from collections.abc import Sequence
from contextlib import suppress

from levelhead.sources.formats.text.dates import is_stamp

COMMENTS = ("#", "%", "//")
MISSING = frozenset({"", "nan", "null", "none", "na", "n/a", "-", "--", "+nan", "-nan", "nan(ind)", "-nan(ind)"})
DELIMITERS = "\t;,| "
_HEX = re.compile(r"0[xX][0-9a-fA-F]+$")
_FORTRAN = re.compile(r"(\.\d*)D([-+]\d{2,3})(?![-\w])")
_DECIMAL_COMMA = re.compile(r"\s*[-+]?\d+,\d+(?:[eE][-+]?\d+)?\s*$")


def cells(line: str, delimiter: str) -> list[str]:
    """The cells of one line, quotes taken off; a blank delimiter means any run of white space."""
    if delimiter == " ":
        return line.split()
    if '"' in line:
        with suppress(csv.Error):
            return next(csv.reader([line], delimiter=delimiter), [])
    return line.split(delimiter)


def trim(row: Sequence[str]) -> list[str]:
    """The row without blank cells at its end."""
    end = len(row)
    while end > 1 and not row[end - 1].strip():
        end -= 1
    return list(row[:end])


def is_comment(line: str) -> bool:
    """A remark, or Excel's hint ``sep=;``."""
    return line.lstrip().startswith(COMMENTS) or line[:4].lower() == "sep="


def lines_of(text: str) -> list[str]:
    """Lines as a text editor counts them."""
    return unify(text).split("\n")


def unify(text: str) -> str:
    """The text with one kind of line break, of minus (U+2212 in the numbers of the north of Europe), and of exponent
    (Fortran writes 1.0D+00)."""
    text = text.replace("\u2212", "-") if "\u2212" in text else text
    if "D+" in text or "D-" in text:
        text = _FORTRAN.sub(r"\1E\2", text)
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def is_number(cell: str, comma: bool) -> bool:
    """Whether a cell is a finite or infinite number; missing ones are none."""
    try:
        value = float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        return False
    return "_" not in cell and not math.isnan(value)


def is_decimal_comma(cell: str) -> bool:
    """Whether a cell is a number such as 9,81."""
    return _DECIMAL_COMMA.match(cell) is not None


def is_data(row: Sequence[str], comma: bool) -> bool:
    """Whether at least half of the line is numbers, stamps or hexadecimal words."""
    filled = [cell for cell in row if cell.strip().lower() not in MISSING]
    known = sum(is_number(cell, comma) or _HEX.match(cell.strip()) is not None or is_stamp(cell) for cell in filled)
    numbers = sum(is_number(cell, comma) for cell in filled)
    if not filled:
        return len(row) > 1
    return 2 * known >= len(filled) and (numbers > 0 or known > 1)
