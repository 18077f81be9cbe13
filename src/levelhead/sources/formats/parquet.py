"""Parquet, Feather and Arrow's own files, by pyarrow."""

import os
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject, Untyped
from levelhead.sources.formats.named_arrays import VECTOR_AXES
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable

ARROW = (".feather", ".arrow")


def parquet(path: str | os.PathLike[str], display_path: str | None = None) -> ArrayTable:
    """The columns of a file of Arrow or Parquet; those of structures and vectors have a dot in their name.

    Raises:
        LevelheadError: pyarrow is not installed; damaged file; no numbers in it.
    """
    source = display_path or os.fspath(path)
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
        from pyarrow import feather
    except ImportError:
        raise LevelheadError(
            f"{source} is Parquet or Arrow; reading it needs pyarrow: pip install 'levelhead[formats]'"
        ) from None
    try:
        is_arrow = Path(source).suffix.lower() in ARROW
        table = feather.read_table(path) if is_arrow else pq.ParquetFile(path).read()
    except (pa.ArrowException, OSError, ValueError) as error:
        raise LevelheadError(
            f"{source} is not {'an Arrow' if is_arrow else 'a Parquet'} file or it is damaged"
        ) from error
    arrays, rows = columns_of(table, source), table.num_rows
    del table
    pa.default_memory_pool().release_unused()
    if not arrays or not rows:
        raise LevelheadError(
            f"{source} holds no {'rows' if arrays else 'columns of numbers'}; expected one row per sample"
        )
    return ArrayTable(source, arrays)


def columns_of(table: Untyped, source: str) -> JsonObject:
    """The columns of numbers in an Arrow table as arrays, by name; structures become columns with a dot in their name.

    Raises:
        LevelheadError: two columns with one name.
    """
    import pyarrow as pa

    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    arrays: JsonObject = {}
    for field, column in zip(table.schema, table.columns, strict=True):
        found = _numbers_of(field.name, column)
        if twice := arrays.keys() & found.keys():
            raise LevelheadError(f"{source}: two columns are named {min(twice)}; rename one of them")
        arrays |= found
    return arrays


def _numbers_of(name: str, column: Untyped) -> JsonObject:
    """The numbers of a column by name: one for plain numbers and stamps, one for each axis of vectors, else none."""
    import pyarrow as pa

    if pa.types.is_timestamp(column.type) or pa.types.is_duration(column.type):
        name, column = f"{name} [{column.type.unit}]", column.cast(pa.int64())
    kind = column.type
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
        return {name: np.asarray(column.cast(pa.float64()) if column.null_count else column.to_numpy())}
    if (vectors := _vectors(column)) is None:
        return {}
    return {f"{name}.{axis}": vectors[:, k] for k, axis in enumerate(VECTOR_AXES[vectors.shape[1]])}


def _vectors(column: Untyped) -> Untyped:
    """(n, 3) or (n, 4) numbers of a column of lists; None for any other column."""
    import pyarrow as pa
    import pyarrow.compute as pc

    kind = column.type
    is_list = pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)
    if not is_list or not (pa.types.is_floating(kind.value_type) or pa.types.is_integer(kind.value_type)):
        return None
    flat = column.combine_chunks().flatten().to_numpy(zero_copy_only=False)
    size = len(flat) // max(len(column), 1)
    lengths = {size} if pa.types.is_fixed_size_list(kind) else set(pc.list_value_length(column).unique().to_pylist())
    return flat.reshape(-1, size) if lengths == {size} and size in VECTOR_AXES else None


def tables(path: Path, display_path: str, hints: Hints) -> list[ArrayTable]:
    """The one table of such a file."""
    return [parquet(path, display_path)]
