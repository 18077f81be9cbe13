"""Logs larger than memory: peak memory and processor time of ``levelhead fuse`` of Parquet in chunks, by its length.

    python benchmarks/chunks.py --rows 2000000 20000000 50000000

Each length runs in a process of its own, with a track as Parquet. Memory must not grow with the length. The disk needs
52 bytes a row for the log, 96 for what is done and 66 for the track: for 1000000000 rows 214 GB.
"""

import io
import json
import shutil
import sys
import tempfile
import time
from contextlib import redirect_stdout
from pathlib import Path

from levelhead.bench.timing import Table
from measure import once, options, show

BLOCK = 500_000  # rows written at a time
MB = 1e6


def write_log(path: Path, rows: int) -> None:
    """A Parquet file of that many rows: one block of motion, again and again on a running clock."""
    import numpy as np
    import pyarrow as pa
    import pyarrow.parquet as pq

    from levelhead.bench.inputs import DT, imu_arrays

    n = min(rows, BLOCK)
    _, gyr, acc = imu_arrays(n)
    names = ["t [s]", *(f"gyr_{a} [rad/s]" for a in "xyz"), *(f"acc_{a} [m/s^2]" for a in "xyz")]
    schema = pa.schema([(name, pa.float64()) for name in names])
    with pq.ParquetWriter(path, schema, use_dictionary=False) as writer:
        for start in range(0, rows, n):
            size = min(n, rows - start)
            t = (start + np.arange(size)) * DT
            columns = [pa.array(np.ascontiguousarray(v[:size])) for v in (t, *gyr.T, *acc.T)]
            writer.write_table(pa.table(columns, schema=schema))


def work(log: Path, out: Path) -> None:
    """One run; prints its figures."""
    from large import peak
    from levelhead.cli import main as levelhead
    from levelhead.sources import chunked

    chunked.LONG_ROWS = 0
    began = time.process_time()
    with redirect_stdout(io.StringIO()) as said:
        code = levelhead(["fuse", str(log), "-o", str(out), "--format", "parquet", "--no-plot"])
    assert code == 0 and "in chunks" in said.getvalue()
    print(json.dumps({"seconds": time.process_time() - began, "peak": peak() / MB}))


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("--rows", type=int, nargs="+", default=[2_000_000, 20_000_000], help="lengths")
    parser.add_argument("--work", nargs=2, type=Path, help="(one run of this script itself)")
    given = parser.parse_args()
    if given.work:
        work(*given.work)
        return
    lines = []
    with tempfile.TemporaryDirectory() as name:
        for rows in given.rows:
            log, out = Path(name, "log.parquet"), Path(name, "out")
            write_log(log, rows)
            _, done = once([sys.executable, __file__, "--work", str(log), str(out)])
            said = json.loads(done.stdout)
            track = sum(path.stat().st_size for path in out.iterdir()) / MB
            shutil.rmtree(out)
            lines.append({"rows": rows, "size": log.stat().st_size / MB, "track": track, "peak": said["peak"],
                          "seconds": said["seconds"], "ns": 1e9 * said["seconds"] / rows})  # fmt: skip
    columns = {
        "rows": "rows",
        "size": "log MB",
        "track": "track MB",
        "peak": "peak memory MB",
        "seconds": "CPU s",
        "ns": "CPU ns a row",
    }
    show([Table("Read, default filter, write, in chunks", columns, lines)], given.json)


if __name__ == "__main__":
    main()
