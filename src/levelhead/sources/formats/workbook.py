"""Excel and OpenDocument workbooks, as phyphox exports them: one sheet for each sensor."""

from collections.abc import Sequence
from datetime import date, datetime, time, timedelta
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject, Untyped
from levelhead.sources.formats.text.header import join_names, looks_like_header, rate_in
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable

_MAX_HEAD = 60  # rows that may stand above the numbers


def tables(path: Path, display_path: str, hints: Hints) -> Sequence[ArrayTable]:
    """One table for each sheet that holds columns of numbers.

    Raises:
        LevelheadError: python-calamine is not installed, the file is damaged, or no sheet has numbers.
    """
    try:
        from python_calamine import CalamineWorkbook
    except ImportError:
        raise LevelheadError(
            f"{display_path} is a workbook; reading it needs python-calamine: pip install 'levelhead[formats]'"
        ) from None
    found = []
    try:
        with CalamineWorkbook.from_path(str(path)) as book:
            for name in book.sheet_names:
                if (table := _table(book.get_sheet_by_name(name).to_python(), name, display_path)) is not None:
                    found.append(table)
    except Exception as error:  # calamine raises many kinds for a damaged file
        raise LevelheadError(f"{display_path} is not a workbook, or it is damaged") from error
    if not found:
        raise LevelheadError(
            f"{display_path} has no sheet with columns of numbers; expected a header and one row per sample"
        )
    return found


def _table(rows: list[list[Untyped]], sheet: str, display_path: str) -> ArrayTable | None:
    """The columns of numbers in a sheet; None if there are none."""
    start = next((i for i, row in enumerate(rows[:_MAX_HEAD]) if _numbers(row) > 0.5 * len(row)), None)
    if start is None or len(rows) - start < 2:
        return None
    above = [[str(cell) for cell in row] for row in rows[:start]]
    names = _take_names(above, len(rows[start]))
    arrays: JsonObject = {}
    units: dict[int, str] = {}
    for i, name in enumerate(names):
        column = [row[i] if i < len(row) else "" for row in rows[start:]]
        title = name if name and name not in arrays else f"{name or 'column'} ({i + 1})"
        if isinstance(column[0], datetime | date | time | timedelta):
            arrays[title] = np.array([_nanoseconds(cell) for cell in column])
            units[i] = "ns"
        else:
            arrays[title] = np.array([_number(cell) for cell in column])
    rate = rate_in([" ".join(row) for row in above])
    return ArrayTable(f"{display_path}, sheet '{sheet}'", arrays, rate=rate, context=sheet, column_units=units)


def _take_names(above: list[list[str]], width: int) -> list[str]:
    """The names of the columns; the rows of the header are taken off the end of the rows above the numbers."""
    header: list[list[str]] = []
    while above and looks_like_header(above[-1], width, False):
        header.insert(0, above.pop())
    return join_names(header, width) if header else [str(i + 1) for i in range(width)]


def _numbers(row: Sequence[Untyped]) -> int:
    return sum(isinstance(cell, int | float | datetime | time) and not isinstance(cell, bool) for cell in row)


def _number(cell: Untyped) -> float:
    if isinstance(cell, int | float) and not isinstance(cell, bool):
        return float(cell)
    try:
        return float(str(cell))
    except ValueError:
        return np.nan


def _nanoseconds(cell: Untyped) -> float:
    if isinstance(cell, datetime):
        return (cell - datetime(1970, 1, 1)) / timedelta(microseconds=1) * 1e3
    if isinstance(cell, time):
        return (((cell.hour * 60 + cell.minute) * 60 + cell.second) * 1e6 + cell.microsecond) * 1e3
    if isinstance(cell, timedelta):
        return cell / timedelta(microseconds=1) * 1e3
    return np.nan
