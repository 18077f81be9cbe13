"""Rows of named cells, as JSON and databases hold them, as a table of columns."""

from collections.abc import Sequence, Set
from typing import Any

import numpy as np

from levelhead.open_types import JsonObject
from levelhead.sources.formats.text.cells import is_number
from levelhead.sources.formats.text.dates import is_stamp, nanoseconds
from levelhead.sources.table import ArrayTable


def table_of_rows(rows: Sequence[JsonObject], context: str, source: str, without: Set[str | None]) -> ArrayTable:
    """Flat objects as columns, but those ``without``: dates in ns, words as labels, numbers."""
    arrays: JsonObject = {}
    units: dict[int, str] = {}
    labels: JsonObject = {}
    for title in dict.fromkeys(title for row in rows for title in row if title not in without):
        column = [row.get(title) for row in rows]
        if isinstance(column[0], str) and is_stamp(column[0]):
            if (stamps := _stamps(column)) is not None:
                units[len(arrays)] = "ns"
                arrays[title] = stamps
        elif all(isinstance(cell, str) and not is_number(cell, False) for cell in column):
            labels[title] = np.array(column)
        else:
            values = to_numbers(column)
            if values.dtype.kind == "i" or not np.isnan(values).all():
                arrays[title] = values
    return ArrayTable(source, arrays, context=context, column_units=units, labels=labels)


def _stamps(column: Sequence[Any]) -> Any:
    """(n,) int64 nanoseconds; None if some cell is not a date."""
    try:
        return np.array([nanoseconds(str(cell)) for cell in column], dtype=np.int64)
    except ValueError:
        return None


def to_numbers(column: Sequence[Any]) -> Any:
    """(n,) int64 if all are whole numbers, else float64 with NaN for other values; numbers in quotes count."""
    texts = [item if not isinstance(item, str) else item.strip() for item in column]
    try:
        if all(map(_is_whole, texts)):
            return np.array([int(item) for item in texts], dtype=np.int64)
    except (OverflowError, ValueError):
        pass
    return np.array([_number(item) for item in texts])


def _is_whole(item: object) -> bool:
    if isinstance(item, str):
        return item.lstrip("+-").isdigit()
    return isinstance(item, int) and not isinstance(item, bool)


def _number(item: object) -> float:
    if isinstance(item, bool) or item is None:
        return np.nan
    if isinstance(item, int | float):
        return float(item)
    return float(item) if isinstance(item, str) and is_number(item, False) else np.nan
