"""A log that counts as one larger than memory."""

from pathlib import Path

import pytest

import levelhead as lh
from levelhead.sources import chunked
from levelhead.sources.formats.csv_writer import write_csv

N = 1500


def write_long_log(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A Parquet file of ``N`` samples, and the limits that make it a long one."""
    import pyarrow.csv as pa_csv
    import pyarrow.parquet as pq

    write_csv(lh.simulate.recording("ICM-20948", "hand", duration=N / 100, rate=100.0), folder / "log.csv")
    table = pa_csv.read_csv(folder / "log.csv")
    kept = [name for name in table.column_names if not name.startswith("q")]
    pq.write_table(table.select(kept), folder / "log.parquet")
    monkeypatch.setattr(chunked, "LONG_ROWS", 1000)
    monkeypatch.setattr(chunked, "LONG_BYTES", 10_000)
    monkeypatch.setattr(chunked, "ROWS", 400)
    return folder / "log.parquet"
