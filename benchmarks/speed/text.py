"""Text below 8 MB, which is read without pyarrow: MB a second of the table's columns, and of the whole recording.

A plain CSV of stamps, rates and forces with six decimals, beside numpy.loadtxt and one thread of pyarrow's reader, in
turn. CPU time of one thread. All three give the same bits.
"""

import os
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pyarrow.csv as arrow
from benchmarks.measure import options, show

import levelhead as lh
from levelhead.bench.inputs import imu_arrays
from levelhead.bench.timing import Case, Table, time_interleaved
from levelhead.sources.formats.text.delimited import TextTable
from levelhead.sources.formats.text.file import open_text

HEADER = "t,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z"
ROW_BYTES = 68  # about
SIZES = (1, 2, 4, 7)  # MB


def write(path: Path, megabytes: float) -> None:
    """A plain CSV of about that size."""
    t, gyr, acc = imu_arrays(round(megabytes * 1e6 / ROW_BYTES))
    np.savetxt(
        path, np.column_stack([t, gyr.reshape(-1, 3), acc.reshape(-1, 3)]), "%.6f", ",", header=HEADER, comments=""
    )


def by_levelhead(path: Path) -> np.ndarray:
    """The columns as ``levelhead.read`` reads them."""
    return np.stack(list(TextTable(open_text(path)).read(range(7)).values()))


def by_numpy(path: Path) -> np.ndarray:
    """The same by NumPy."""
    return np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2).T


def by_arrow(path: Path) -> np.ndarray:
    """The same by pyarrow."""
    table = arrow.read_csv(path, arrow.ReadOptions(use_threads=False))
    return np.stack([column.to_numpy() for column in table.columns])


def row(path: Path, repeats: int) -> dict[str, float | bool | str]:
    """The rates of one file."""
    size = path.stat().st_size
    readers = {"columns": by_levelhead, "loadtxt": by_numpy, "arrow": by_arrow, "recording": lh.read}
    cases = [Case(name, lambda read=read: read(path), size) for name, read in readers.items()]
    timings = {timing.name: timing for timing in time_interleaved(cases, repeats)}
    rates: dict[str, float | bool | str] = {name: 1e3 / timing.least for name, timing in timings.items()}
    first = by_levelhead(path).tobytes()
    return {
        "size": size / 1e6,
        **rates,
        "share": timings["arrow"].over(timings["columns"]),
        "same": first == by_numpy(path).tobytes() == by_arrow(path).tobytes(),
    }


def main() -> None:
    """Print the table."""
    given = options(__doc__).parse_args()
    columns = {
        "size": "MB", "columns": "levelhead's columns MB/s", "loadtxt": "numpy.loadtxt MB/s", "arrow": "pyarrow MB/s",
        "share": "columns over pyarrow", "recording": "levelhead.read MB/s", "same": "same bits",
    }  # fmt: skip
    table = Table("Plain CSV, one thread", columns)
    with tempfile.TemporaryDirectory() as folder:
        for megabytes in SIZES:
            path = Path(folder, f"{megabytes}.csv")
            write(path, megabytes)
            table.rows.append(row(path, given.repeats))
    show([table], given.json)


if __name__ == "__main__":
    main()
