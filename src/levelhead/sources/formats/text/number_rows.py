"""Rows of plain numbers out of text by NumPy's reader in C, to the bit what ``float`` and ``int`` give."""

import re
import warnings
from collections.abc import Collection

import numpy as np

from levelhead.open_types import Untyped
from levelhead.sources.formats.text.cells import MISSING
from levelhead.sources.table import Column

_KINDS = {"number": "f8", "whole": "i8", "skipped": "U1"}
_MISSING = "|".join(re.escape(word) for word in sorted(MISSING, reverse=True))


def number_rows(
    text: str, delimiter: str, width: int, wanted: Collection[int], whole: Collection[int]
) -> dict[int, Column] | None:
    """The wanted columns of lines with ``width`` cells each; None if one of them is neither a number nor blank.

    Columns in ``whole`` become int64 where all of their cells are whole numbers, all others float64, blank cells NaN.
    """
    named = ""
    for exact in dict.fromkeys((frozenset(whole).intersection(wanted), frozenset[int]())):
        kinds = ["skipped" if i not in wanted else "whole" if i in exact else "number" for i in range(width)]
        found = _parse(text, delimiter, kinds)
        if found is None:
            named = named or _name_missing(text, delimiter)
            found = _parse(named, delimiter, kinds)
        if found is not None:
            return {i: np.ascontiguousarray(found[f"f{i}"]) for i in wanted}
    return None


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
