"""Reading with pyarrow: big text files, and Parquet. The only place that imports it, and only when it is of use."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import Fields, Handle
from levelhead.sources.hints import Hints
from levelhead.sources.layout import Layout
from levelhead.sources.splitting import MISSING
from levelhead.sources.table import ArrayTable, Column

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


def parquet(path: str | os.PathLike[str]) -> ArrayTable:
    """The columns of a Parquet file; structures become columns with a dot in their name.

    Raises:
        LevelheadError: pyarrow is not installed; damaged file; no numbers in it.
    """
    source = os.fspath(path)
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise LevelheadError(
            f"{source} is Parquet; reading it needs pyarrow: pip install 'levelhead[formats]'"
        ) from None
    try:
        table = pq.ParquetFile(path).read()
    except (pa.ArrowException, OSError, ValueError) as error:
        raise LevelheadError(f"{source} is not a Parquet file or it is damaged ({_line(error)})") from None
    arrays = columns_of(table, source)
    if not arrays or not table.num_rows:
        raise LevelheadError(
            f"{source} holds no {'rows' if arrays else 'columns of numbers'}; expected one row per sample"
        )
    return ArrayTable(source, arrays)


def columns_of(table: Handle, source: str) -> Fields:
    """The columns of numbers in an Arrow table as arrays, by name; structures become columns with a dot in their name.

    Raises:
        LevelheadError: two columns with one name.
    """
    import pyarrow as pa

    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    arrays: Fields = {}
    for field, column in zip(table.schema, table.columns, strict=True):
        name, values = field.name, column
        if pa.types.is_timestamp(field.type) or pa.types.is_duration(field.type):
            name, values = f"{name} [{field.type.unit}]", column.cast(pa.int64())
        if pa.types.is_integer(values.type) or pa.types.is_floating(values.type) or pa.types.is_boolean(values.type):
            if name in arrays:
                raise LevelheadError(f"{source}: two columns are named {name}; rename one of them")
            arrays[name] = np.asarray(values.cast(pa.float64()) if values.null_count else values.to_numpy())
    return arrays


def _line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:120]


def tables(path: Path, shown: str, hints: Hints) -> list[ArrayTable]:
    """The one table of a Parquet file."""
    return [parquet(path)]
