"""SQLite, by Python's own module: each table of a database."""

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.sources.formats.text.dates import is_stamp, nanoseconds
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable, Column

_MIN_ROWS = 5  # of a table of samples
_KEYS = frozenset(("id", "_id", "rowid"))  # counters of rows


def tables(path: Path, display_path: str, hints: Hints) -> Sequence[ArrayTable]:
    """The tables of a database with columns of numbers.

    Raises:
        LevelheadError: no database, damaged, or without numbers.
    """
    try:
        import sqlite3
    except ImportError:
        raise LevelheadError(f"{display_path} is SQLite, and this Python was built without it") from None
    found = []
    try:
        with closing(sqlite3.connect(f"file:{quote(str(path))}?mode=ro&immutable=1", uri=True)) as database:
            names = [name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
            for name in names:
                rows = database.execute(f'SELECT * FROM "{name.replace(chr(34), 2 * chr(34))}"')
                titles = [column[0] for column in rows.description]
                found += _table(display_path, name, titles, rows.fetchall())
    except sqlite3.Error as error:
        raise LevelheadError(f"{display_path} is not an SQLite database, or it is damaged ({error})") from None
    if not found:
        raise LevelheadError(f"{display_path} holds no table with columns of numbers; expected a row per sample")
    return found


def _table(source: str, name: str, titles: Sequence[str], rows: Sequence[Sequence[object]]) -> list[ArrayTable]:
    """One table, or none."""
    if len(rows) < _MIN_ROWS:
        return []
    columns = {title: _column(cells) for title, cells in zip(titles, zip(*rows, strict=True), strict=True)}
    arrays = {title: column[0] for title, column in columns.items() if column and title.lower() not in _KEYS}
    units = {i: unit for i, title in enumerate(arrays) if (unit := (columns[title] or ("", ""))[1])}
    return [ArrayTable(source, arrays, context=name, column_units=units)] if arrays else []


def _column(cells: Sequence[object]) -> tuple[Column, str] | None:
    """Numbers, or dates in ns, with their unit; None for anything else."""
    if all(isinstance(cell, int) and not isinstance(cell, bool) for cell in cells):
        return np.array(cells, dtype=np.int64), ""
    if all(cell is None or isinstance(cell, int | float) for cell in cells):
        return np.array(cells, dtype=np.float64), ""
    if all(isinstance(cell, str) and is_stamp(cell) for cell in cells):
        return np.array([nanoseconds(str(cell)) for cell in cells], dtype=np.int64), "ns"
    return None
