"""Long tables: a row for each number, the name of what it is in one column, its stamp in another (InfluxDB, melt)."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from levelhead.sources.conclusion import Basis, Conclusion
from levelhead.sources.formats.text.cells import cells, is_comment, is_number, lines_of
from levelhead.sources.formats.text.dates import is_stamp, nanoseconds
from levelhead.sources.formats.text.encoding import Encoding
from levelhead.sources.names.column_name import understand
from levelhead.sources.table import ArrayTable

_LOOK = 400
_FEWEST = 6  # names: three axes of two sensors
_VALUES = ("value", "_value", "val", "reading", "data")


def melted_tables(path: Path, shown: str, content: Sequence[str], encoding: Encoding) -> list[ArrayTable]:
    """A column for each name, a row for each stamp; [] if the table is no long one. ``content``: the first lines."""
    for delimiter in ",;\t":
        head = [cell.strip().lower() for cell in cells(content[0], delimiter)] if content else []
        value = next((head.index(word) for word in _VALUES if word in head), None)
        if value is None:
            continue
        lines = lines_of(path.read_bytes()[encoding.skip :].decode(encoding.name, "replace"))
        rows = [[cell.strip() for cell in cells(line, delimiter)] for line in lines if line and not is_comment(line)]
        rows = [row for row in rows if len(row) == len(head) and is_number(row[value], False)]
        time = next((i for i, name in enumerate(head) if understand(name).role == "t"), None)
        name = _name_column(rows)
        if time is not None and name is not None:
            return [_pivot(shown, rows, time, name, value)]
    return []


def _name_column(rows: Sequence[Sequence[str]]) -> int | None:
    """The column whose words are the axes of a gyroscope and an accelerometer."""
    for k, column in enumerate(zip(*rows, strict=True)):
        words = Counter(column)
        known = [one for one in (understand(word) for word in list(words)[:_LOOK]) if one.axis]
        if len(words) < 0.5 * len(column) and {"gyr", "acc"} <= {one.role for one in known} and len(known) >= _FEWEST:
            return k
    return None


def _pivot(shown: str, rows: Sequence[Sequence[str]], time: int, name: int, value: int) -> ArrayTable:
    dated = is_stamp(rows[0][time])
    samples: dict[float, dict[str, float]] = {}
    for row in rows:
        try:
            stamp = nanoseconds(row[time]) if dated else int(row[time]) if row[time].isdigit() else float(row[time])
        except ValueError:
            continue
        samples.setdefault(stamp, {})[row[name]] = float(row[value])
    stamps = sorted(samples)
    arrays = {"time": np.array(stamps)}
    for word in dict.fromkeys(row[name] for row in rows):
        arrays[word] = np.array([samples[stamp].get(word, np.nan) for stamp in stamps])
    kind = Conclusion("file.kind", "long_table", "long table", Basis.HEADER)
    return ArrayTable(shown, arrays, conclusions=[kind], column_units={0: "ns"} if dated else {})
