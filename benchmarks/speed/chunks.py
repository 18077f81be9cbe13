"""Logs larger than memory: peak memory and processor time of ``levelhead fuse`` of Parquet in chunks, by its length.

    python -m benchmarks.speed.chunks --rows 2000000 20000000 50000000
    python -m benchmarks.speed.chunks --rows 1000000000 --output-rate 10 --folder /large/disk
    python -m benchmarks.speed.chunks --groups 20 2000 20000

Each length runs in a process of its own, from a log of 100 Hz to a track as Parquet. Memory must not grow with the
length. What grows is the list of a Parquet file's row groups, of which the track has one for each 50 000 rows:
``--groups`` measures it with groups of 50 rows. The disk needs 8 bytes a row for the log, and for each row of the track
96 for what is done and up to 94 for the file.
"""

import io
import json
import shutil
import sys
import tempfile
import time
from contextlib import redirect_stdout
from pathlib import Path

from benchmarks.measure import once, options, show

from levelhead.bench.timing import Table

BLOCK = 500_000  # rows written at a time
MB = 1e6
GYR_LSB, ACC_LSB = 131, 16384  # counts for 1 °/s and for 1 g


def write_log(path: Path, rows: int) -> None:
    """A Parquet file of that many rows, as a logger keeps them: stamps in µs and counts of 16 bits.

    One block of motion, forth and back again and again, so that nothing jumps between two of them.
    """
    import numpy as np
    import pyarrow as pa
    import pyarrow.parquet as pq

    from levelhead.bench.inputs import DT, imu_arrays
    from levelhead.units import GRAVITY

    n = min(rows, BLOCK)
    _, gyr, acc = imu_arrays(n)
    counts = np.rint(np.hstack([np.degrees(gyr) * GYR_LSB, acc / GRAVITY * ACC_LSB])).astype(np.int16)
    back = counts[::-1] * np.array([-1, -1, -1, 1, 1, 1], np.int16)  # time reversed: rates change their sign
    names = [f"{sensor}_{axis}" for sensor in ("gyr", "acc") for axis in "xyz"]
    schema = pa.schema([("t [us]", pa.int64()), *((name, pa.int16()) for name in names)])
    encoding = dict.fromkeys(schema.names, "DELTA_BINARY_PACKED")
    with pq.ParquetWriter(path, schema, use_dictionary=False, column_encoding=encoding) as writer:
        for k, start in enumerate(range(0, rows, n)):
            size = min(n, rows - start)
            stamps = pa.array((start + np.arange(size)) * round(1e6 * DT))
            columns = [pa.array(np.ascontiguousarray(v[:size])) for v in (back if k % 2 else counts).T]
            writer.write_table(pa.table([stamps, *columns], schema=schema))


def work(log: Path, out: Path, output_rate: float | None) -> None:
    """One run; prints its figures."""
    from benchmarks.speed.large import peak

    from levelhead.cli import main as levelhead
    from levelhead.sources import chunked

    chunked.LONG_ROWS = 0
    words = ["fuse", str(log), "-o", str(out), "--format", "parquet", "--no-plot"]
    words += ["--counts", f"gyr={GYR_LSB}/deg/s", "--counts", f"acc={ACC_LSB}/g"]
    words += [] if output_rate is None else ["--output-rate", str(output_rate)]
    began = time.process_time()
    with redirect_stdout(io.StringIO()) as said:
        code = levelhead(words)
    assert code == 0 and "in chunks" in said.getvalue()
    print(json.dumps({"seconds": time.process_time() - began, "peak": peak() / MB}))


def write_groups(count: int, path: Path) -> None:
    """A track of that many row groups; prints the peak memory."""
    import numpy as np
    from benchmarks.speed.large import peak

    from levelhead.filters import ESKF
    from levelhead.publish import writers
    from levelhead.track import Track

    writers.CHUNK = rows = 50
    noise = np.random.default_rng(0).normal(size=(rows, 10))
    quat = noise[:, :4] / np.linalg.norm(noise[:, :4], axis=1)[:, None]
    track = Track(np.arange(rows) * 0.01, quat, noise[:, 4:7], noise[:, 7:], params=ESKF())
    writers.write_tracks((track for _ in range(count)), path)
    print(json.dumps({"groups": count, "size": path.stat().st_size / MB, "peak": peak() / MB}))


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("--rows", type=int, nargs="+", default=[2_000_000, 20_000_000], help="lengths")
    parser.add_argument("--output-rate", type=float, help="rows a second in the track (default: those of the log)")
    parser.add_argument("--folder", type=Path, help="where the files go for the time being (default: temporary)")
    parser.add_argument("--groups", type=int, nargs="+", help="numbers of row groups, in place of lengths")
    parser.add_argument("--write-groups", nargs=2, help="(one run of this script itself)")
    parser.add_argument("--work", nargs=2, type=Path, help="(one run of this script itself)")
    given = parser.parse_args()
    if given.write_groups:
        write_groups(int(given.write_groups[0]), Path(given.write_groups[1]))
        return
    if given.groups:
        lines = []
        with tempfile.TemporaryDirectory(dir=given.folder) as name:
            for count in given.groups:
                _, done = once(
                    [
                        sys.executable,
                        "-m",
                        __spec__.name,
                        "--write-groups",
                        str(count),
                        str(Path(name, "track.parquet")),
                    ]
                )
                lines.append(json.loads(done.stdout))
        titles = {"groups": "row groups", "size": "file MB", "peak": "peak memory MB"}
        show([Table("A track of so many row groups", titles, lines)], given.json)
        return
    if given.work:
        work(*given.work, given.output_rate)
        return
    lines = []
    with tempfile.TemporaryDirectory(dir=given.folder) as name:
        for rows in given.rows:
            log, out = Path(name, "log.parquet"), Path(name, "out")
            write_log(log, rows)
            asked = [] if given.output_rate is None else ["--output-rate", str(given.output_rate)]
            _, done = once([sys.executable, "-m", __spec__.name, "--work", str(log), str(out), *asked])
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
