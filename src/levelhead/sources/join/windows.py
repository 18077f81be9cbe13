"""Files in which each row is a window of one axis, as data sets for learning machines have them."""

import numpy as np

from levelhead.recording import Array
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.names.column_name import understand
from levelhead.sources.table import ArrayTable, Table

_WIDTH = 16  # columns without names from which a row is a window
_SAME = 0.2  # share of rows that begin with the end of the row before, from which windows overlap


def unroll(table: Table) -> Table:
    """A table of windows as one column; any other table as it is."""
    names = list(table.names)
    role = understand(f"{table.context} {names[0]}" if names else "").role
    if len(names) < _WIDTH or not all(name.isdigit() for name in names) or not (understand(table.context).axis or role):
        return table
    columns = table.read(list(range(len(names))))
    rows = np.column_stack([columns[i] for i in range(len(names))]).astype(np.float64)
    overlap = _overlap(rows)
    kept = rows[:, : rows.shape[1] - overlap] if overlap else rows
    joined = Conclusion("rows", "windows", "joined", Basis.GUESS, {"width": rows.shape[1], "overlap": overlap})
    arrays = {table.context or "x": kept.reshape(-1)}
    return ArrayTable(table.source, arrays, conclusions=[joined], context=table.context)


def _overlap(rows: Array) -> int:
    """How many numbers at the end of a row are those at the start of the next one."""
    width = rows.shape[1]
    for size in (width // 2, width // 4, 3 * width // 4):
        same = np.abs(rows[:-1, width - size :] - rows[1:, :size]).max(axis=1) < 1e-9
        if len(same) and float(same.mean()) > _SAME:
            return int(size)
    return 0
