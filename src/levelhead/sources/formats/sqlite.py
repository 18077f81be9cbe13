"""SQLite, by Python's own module: each table of a database."""

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

from levelhead.errors import LevelheadError
from levelhead.sources.formats.row_table import table_of_rows
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable

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
    found: list[ArrayTable] = []
    try:
        with closing(sqlite3.connect(f"file:{quote(str(path))}?mode=ro&immutable=1", uri=True)) as database:
            names = [name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
            for name in names:
                rows = database.execute(f'SELECT * FROM "{name.replace(chr(34), 2 * chr(34))}"')
                titles = [column[0] for column in rows.description]
                cells = [dict(zip(titles, row, strict=True)) for row in rows]
                found.append(table_of_rows(cells, name, display_path, _KEYS))
    except sqlite3.Error as error:
        raise LevelheadError(f"{display_path} is not an SQLite database, or it is damaged ({error})") from None
    found = [table for table in found if any(len(column) >= _MIN_ROWS for column in table.arrays.values())]
    if not found:
        raise LevelheadError(f"{display_path} holds no table with columns of numbers; expected a row per sample")
    return found
