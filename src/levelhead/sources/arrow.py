"""Reading big text files with pyarrow, which is imported only when it is of use."""

from collections.abc import Sequence

import numpy as np

from levelhead.open_types import Handle
from levelhead.sources.layout import Layout
from levelhead.sources.splitting import MISSING
from levelhead.sources.table import Column

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
    try:
        table = open_text(source, layout, wanted, exact, whole=True)
    except (pa.ArrowException, OSError):
        return None
    return {i: numbers(table.column(str(i))) for i in wanted}


def open_text(
    source: Handle, layout: Layout, wanted: Sequence[int], exact: frozenset[int], whole: bool = False
) -> Handle:
    """The columns at some positions of a text file as Arrow reads them, whole or batch by batch, by position.

    Raises:
        pyarrow.ArrowException: something in it is no number.
    """
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    types = {str(i): pa.int64() if i in exact else pa.float64() for i in wanted}
    read = pa_csv.read_csv if whole else pa_csv.open_csv
    return read(
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
