"""Reading big text files with pyarrow, which is imported only when it is of use."""

from collections.abc import Sequence

import numpy as np

from levelhead.open_types import Handle
from levelhead.sources.formats.text.cells import MISSING
from levelhead.sources.formats.text.dialect import Layout
from levelhead.sources.table import Column

_BLOCK = 1 << 22  # bytes read at a time
_NULLS = sorted({form for word in MISSING for form in (word, word.upper(), word.capitalize())} | {"NaN"})


def read_text(source: str, layout: Layout, wanted: Sequence[int], exact: frozenset[int]) -> dict[int, Column] | None:
    """Columns of a big text file; None when pyarrow is not there or does not like the file.

    Then the reader in ``sources.text`` takes over: it reads what is unusual, and says what is wrong.
    """
    try:
        import pyarrow as pa
    except ImportError:
        return None
    if layout.delimiter == " ":
        return None
    with open(source, "rb") as file:  # no more rows than that; what is not written takes no memory
        room = 1 + sum(block.count(b"\n") + block.count(b"\r") for block in iter(lambda: file.read(_BLOCK), b""))
    found: dict[int, Column] = {}
    for i in wanted:
        found[i] = np.empty(room, np.int64) if i in exact else np.empty(room)
    rows = 0
    try:
        for batch in open_text(source, layout, wanted, exact):  # a whole table would be a second copy of everything
            for i in wanted:
                part = batch.column(str(i)).to_numpy(zero_copy_only=False)
                if part.dtype != found[i].dtype:  # a whole number is missing
                    found[i] = found[i].astype(np.float64)
                found[i][rows : rows + len(part)] = part
            rows += batch.num_rows
    except (pa.ArrowException, OSError):
        return None
    return {i: column[:rows] for i, column in found.items()}


def open_text(source: Handle, layout: Layout, wanted: Sequence[int], exact: frozenset[int]) -> Handle:
    """The columns at some positions of a text file as Arrow reads them, batch by batch, by position.

    Raises:
        pyarrow.ArrowException: something in it is no number.
    """
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    types = {str(i): pa.int64() if i in exact else pa.float64() for i in wanted}
    return pa_csv.open_csv(
        source,
        pa_csv.ReadOptions(skip_rows=layout.first, column_names=[str(i) for i in range(len(layout.names))]),
        pa_csv.ParseOptions(delimiter=layout.delimiter),
        pa_csv.ConvertOptions(
            include_columns=list(types),
            column_types=types,
            null_values=_NULLS,
            decimal_point="," if layout.decimal_comma else ".",
        ),
    )


def numbers(column: Handle) -> Column:
    """An Arrow column as (n,) float64 with NaN for null, or int64 if it is whole and complete."""
    values: Handle = column.to_numpy()
    numbers: Column = values if values.dtype in (np.int64, np.float64) else values.astype(np.float64)
    return numbers
