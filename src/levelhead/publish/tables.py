"""Columns of numbers as CSV or Parquet."""

from collections.abc import Mapping
from pathlib import Path

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.recording import Array


def write_table(columns: Mapping[str, Array], path: Path, suffix: str) -> None:
    """Writes columns of one length; a missing value is NaN, a blank cell in CSV.

    Raises:
        LevelheadError: the file cannot be written, or pyarrow is not installed.
    """
    if suffix == ".parquet":
        try:
            import pyarrow as arrow
            from pyarrow import parquet
        except ImportError:
            raise LevelheadError("Parquet needs pyarrow: pip install 'levelhead[formats]'") from None
        with atomic_path(path) as temporary:
            parquet.write_table(arrow.table(dict(columns)), temporary)
        return
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(columns) + "\n")
        for row in zip(*(values.tolist() for values in columns.values()), strict=True):
            file.write(",".join("" if value != value else repr(value) for value in row) + "\n")
