"""Rows of plain numbers out of text by readers in C, to the bit as ``float`` and ``int`` do.

A long text of plain numbers is a JSON array but for its line ends, and msgspec's JSON reader is three times as fast as
NumPy's reader of text. The latter reads numbers that JSON does not allow: +1, .5, blank cells, words.
"""

import re
import warnings
from collections.abc import Collection

import numpy as np

from levelhead.open_types import Untyped
from levelhead.sources.formats.text.cells import MISSING
from levelhead.sources.table import Column

_KINDS = {"number": "f8", "whole": "i8", "skipped": "U1"}
_MISSING = "|".join(re.escape(word) for word in sorted(MISSING, reverse=True))
_LONG = 1 << 17  # characters from which msgspec is worth its import


def number_rows(
    text: str, delimiter: str, width: int, wanted: Collection[int], whole: Collection[int]
) -> dict[int, Column] | None:
    """The wanted columns of lines with ``width`` cells each; None if one of them is neither a number nor blank.

    Columns in ``whole`` become int64 where all of their cells are whole numbers, all others float64, blank cells NaN.
    """
    exact = frozenset(whole).intersection(wanted)
    if len(text) >= _LONG and (columns := _parse_json(text, delimiter, width, wanted, exact)) is not None:
        return columns
    named = ""
    for kept in dict.fromkeys((exact, frozenset[int]())):
        kinds = ["skipped" if i not in wanted else "whole" if i in kept else "number" for i in range(width)]
        found = _parse(text, delimiter, kinds)
        if found is None:
            named = named or _name_missing(text, delimiter)
            found = _parse(named, delimiter, kinds)
        if found is not None:
            return {i: np.ascontiguousarray(found[f"f{i}"]) for i in wanted}
    return None


def _parse_json(
    text: str, delimiter: str, width: int, wanted: Collection[int], exact: frozenset[int]
) -> dict[int, Column] | None:
    """The wanted columns by msgspec; None without it, or where a cell or a line is not plain JSON."""
    try:
        from msgspec import DecodeError, json
    except ImportError:  # in a browser
        return None
    if delimiter != "," and "," in text:
        return None
    text = text.rstrip("\n").replace(delimiter, ",")
    if not _is_plain_table(text, width):
        return None
    try:
        cells: list[int | float] = json.decode(f"[{text}]".replace("\n", ","), type=list[int | float])
        table = np.fromiter(cells, np.float64, len(cells)).reshape(-1, width)
    except (DecodeError, OverflowError):
        return None
    found: dict[int, Column] = {i: np.ascontiguousarray(table[:, i]) for i in wanted}
    return found | {i: whole for i in exact if (whole := _whole(cells[i::width])) is not None}


def _whole(cells: list[int | float]) -> Column | None:
    """The cells as int64; None if one of them is not whole, or too large."""
    if set(map(type, cells)) != {int}:
        return None
    try:
        return np.fromiter(cells, np.int64, len(cells))
    except OverflowError:
        return None


def _is_plain_table(text: str, width: int) -> bool:
    """Whether each line has ``width`` cells with a comma between them, and no cell is "-0": JSON has no whole −0."""
    characters = np.frombuffer(f",,{text},".encode(), np.uint8)
    ends = np.flatnonzero((characters == ord(",")) | (characters == ord("\n")))[2:]
    if len(ends) % width or (" " in text and "-0 " in text):
        return False
    last = (characters[ends[:-1]] == ord("\n")).nonzero()[0] + 1
    if not np.array_equal(last, np.arange(width, len(ends), width)):
        return False
    return not ((characters[ends - 1] == ord("0")) & (characters[ends - 2] == ord("-"))).any()


def _parse(text: str, delimiter: str, kinds: list[str]) -> Untyped:
    dtype = np.dtype([(f"f{i}", _KINDS[kind]) for i, kind in enumerate(kinds)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a fraction in a column of whole numbers; no line at all
        try:
            return np.loadtxt(text.split("\n"), dtype, comments=None, delimiter=delimiter, ndmin=1)
        except (ValueError, Warning):
            return None


def _name_missing(text: str, delimiter: str) -> str:
    """The text with NaN in the place of every blank cell and of every word for a missing number."""
    edge = re.escape(delimiter)
    blank = rf"(?:(?<=[{edge}\n])|\A) *(?:{_MISSING}) *(?=[{edge}\n]|\Z)"
    return re.sub(blank, "nan", text, flags=re.IGNORECASE)
