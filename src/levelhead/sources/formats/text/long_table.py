"""Long tables: a row for each number, its name in one column, its stamp in another (InfluxDB, melt)."""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.text.cells import cells, is_comment, is_number
from levelhead.sources.formats.text.dates import is_stamp, nanoseconds
from levelhead.sources.formats.text.file import TextFile
from levelhead.sources.names.column_name import understand
from levelhead.sources.table import ArrayTable

_MAX_NAMES = 400  # that are looked at
_MIN_AXES = 6  # three axes of two sensors
_VALUES = ("value", "_value", "val", "reading", "data")
Rows = list[list[str]]


class LongHeader(NamedTuple):
    """How the header of a long table is laid out: delimiter, cells, and the positions of two of them."""

    delimiter: str
    width: int
    time: int
    value: int


def matches(file: TextFile) -> bool:
    """Whether the header has a stamp and a value."""
    return _header(file) is not None


def tables(file: TextFile) -> Sequence[ArrayTable]:
    """A column for each name, a row for each stamp; [] if no column names the axes of two sensors."""
    header = _header(file)
    assert header is not None  # the file matches
    rows = _rows(file.lines(), header)
    name = _name_column(rows)
    return [] if name is None else [_pivot(file.display_path, rows, header, name)]


def _header(file: TextFile) -> LongHeader | None:
    """The header by the first line; None if it has no stamp or no value."""
    for delimiter in ",;\t":
        head = [cell.strip().lower() for cell in cells(file.content[0], delimiter)] if file.content else []
        value = next((head.index(word) for word in _VALUES if word in head), None)
        time = next((i for i, name in enumerate(head) if understand(name).role == "t"), None)
        if value is not None and time is not None:
            return LongHeader(delimiter, len(head), time, value)
    return None


def _rows(lines: Sequence[str], header: LongHeader) -> Rows:
    """The rows of all cells whose value is a number."""
    rows = [[cell.strip() for cell in cells(line, header.delimiter)] for line in lines if line and not is_comment(line)]
    return [row for row in rows if len(row) == header.width and is_number(row[header.value], False)]


def _name_column(rows: Rows) -> int | None:
    """The column whose words are the axes of a gyroscope and an accelerometer."""
    for k, column in enumerate(zip(*rows, strict=True)):
        words = Counter(column)
        axes = [name for name in map(understand, list(words)[:_MAX_NAMES]) if name.axis]
        if len(words) < 0.5 * len(column) and {"gyr", "acc"} <= {name.role for name in axes} and len(axes) >= _MIN_AXES:
            return k
    return None


def _pivot(source: str, rows: Rows, header: LongHeader, name: int) -> ArrayTable:
    """The numbers of one stamp side by side."""
    dated = is_stamp(rows[0][header.time])
    samples: dict[float, dict[str, float]] = {}
    for row in rows:
        try:
            stamp = _stamp(row[header.time], dated)
        except ValueError:
            continue
        samples.setdefault(stamp, {})[row[name]] = float(row[header.value])
    stamps = sorted(samples)
    arrays = {"time": np.array(stamps)}
    for word in dict.fromkeys(row[name] for row in rows):
        arrays[word] = np.array([samples[stamp].get(word, np.nan) for stamp in stamps])
    kind = Conclusion("file.kind", "long_table", "long table", Basis.HEADER)
    return ArrayTable(source, arrays, conclusions=[kind], column_units={0: "ns"} if dated else {})


def _stamp(cell: str, dated: bool) -> float:
    if dated:
        return nanoseconds(cell)
    return int(cell) if cell.isdigit() else float(cell)
