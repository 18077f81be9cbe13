"""A long recording from file to file: seconds of each stage, the filter's share, and memory against the data's size.

Writes a CSV of random motion (time in s, angular rate in deg/s, specific force in g) into a temporary folder, then
reads, fuses and writes it in a process of its own per filter and output format.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.measure import once, options, show

from levelhead.bench.timing import Table

FLOAT = 8  # bytes
OUTPUTS = 11  # values a filter gives per sample: quaternion, bias, σ, health
STAGES = ("read", "memory", "fuse", "write")
FILTERS = ("default", "Kalman")
FORMATS = ("csv", "parquet")
BLOCK = 500_000  # rows written at a time


def write_log(path: Path, rows: int) -> None:
    """A CSV of that many rows: one block of motion, again and again on a running clock."""
    import numpy as np
    import pyarrow as pa
    import pyarrow.csv as pc

    from levelhead.bench.inputs import DT, imu_arrays
    from levelhead.units import GRAVITY

    n = min(rows, BLOCK)
    _, gyr, acc = imu_arrays(n)
    values = [*np.round(np.degrees(gyr), 4).T, *np.round(acc / GRAVITY, 5).T]
    names = ["Time (s)", *(f"Gyroscope {a} (deg/s)" for a in "XYZ"), *(f"Accelerometer {a} (g)" for a in "XYZ")]
    schema = pa.schema([(name, pa.float64()) for name in names])
    with pc.CSVWriter(path, schema) as writer:
        for start in range(0, rows, n):
            size = min(n, rows - start)
            t = np.round((start + np.arange(size)) * DT, 6)
            columns = [pa.array(np.ascontiguousarray(v[:size])) for v in (t, *values)]
            writer.write_table(pa.table(columns, schema=schema))


def peak() -> int:
    """Most bytes of memory that this process has held so far."""
    import resource

    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else 1024 * most


def pipeline(log: Path, out: Path, choice: str) -> dict[str, Any]:
    """Read, fuse, write; seconds and peak memory after each."""
    import numpy as np

    import levelhead as lh
    from levelhead.publish.writers import write_track

    found: dict[str, Any] = {"imports_b": peak()}

    def stage(name: str, work: Callable[[], Any]) -> Any:
        began = time.perf_counter()
        value = work()
        found[f"{name}_s"] = time.perf_counter() - began
        found[f"{name}_b"] = peak()
        return value

    recording = stage("read", lambda: lh.read(log))
    # Where a virtual machine gets its memory from the host at first touch, that can take longer than the filter.
    stage("memory", lambda: np.ones(OUTPUTS * len(recording)).size)
    track = stage("fuse", lambda: lh.fuse(recording, None if choice == "default" else choice))
    stage("write", lambda: write_track(track, out))
    arrays = [recording.t, recording.gyr, recording.acc, track.quat, track.bias, track.sigma]
    values = sum(array.size for array in arrays if array is not None) + len(track)  # and health
    return found | {"filter": track.name, "data_b": FLOAT * values, "output_b": out.stat().st_size}


def line(found: dict[str, Any], format_: str) -> dict[str, Any]:
    """One line of the table."""
    total = sum(found[f"{name}_s"] for name in STAGES)
    gib = {f"{name}_gib": found[f"{name}_b"] / 2**30 for name in ("data", "imports", "read", "fuse", "write")}
    seconds = {f"{name}_s": found[f"{name}_s"] for name in STAGES}
    return {"case": f"{found['filter']}, {format_}", **seconds, "total_s": total,
            "share": 100.0 * found["fuse_s"] / total, **gib,
            "peak_ratio": found["write_b"] / found["data_b"]}  # fmt: skip


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("--rows", type=int, default=10_000_000, help="rows of the log (default 10,000,000)")
    parser.add_argument("--folder", type=Path, help="where the files go for the time being (default: temporary)")
    parser.add_argument("--child", nargs="+", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child:
        log, *rest = given.child
        found = pipeline(Path(log), Path(rest[0]), rest[1]) if rest else write_log(Path(log), given.rows)
        print(json.dumps(found))
        return
    rows = []
    with tempfile.TemporaryDirectory(dir=given.folder) as name:
        log = Path(name) / "log.csv"
        me = [sys.executable, "-m", __spec__.name, "--rows", str(given.rows), "--child", str(log)]
        once(me)
        warm = Path(name) / "warm.csv"
        once([sys.executable, "-m", __spec__.name, "--rows", "100000", "--child", str(warm)])
        for choice in FILTERS:
            # so that no stage below compiles
            once([sys.executable, "-m", __spec__.name, "--child", str(warm), str(Path(name) / "warm.parquet"), choice])
            for format_ in FORMATS:
                out = Path(name) / f"orientation.{format_}"
                runs = [json.loads(once([*me, str(out), choice])[1].stdout) for _ in range(given.repeats)]
                rows.append(line(min(runs, key=lambda found: found["read_s"] + found["write_s"]), format_))
                out.unlink()
        size = log.stat().st_size
    columns = {
        "case": "filter, output", "read_s": "read s", "memory_s": "first touch s",
        "fuse_s": "fuse s", "write_s": "write s", "total_s": "total s",
        "share": "filter %", "data_gib": "data GiB", "read_gib": "peak: read", "fuse_gib": "fuse", "write_gib": "write",
        "peak_ratio": "peak/data",
    }  # fmt: skip
    note = (
        f"Log of {size / 2**20:,.0f} MiB. Data: float64 of time, rates, forces, orientation, bias, σ and health. "
        f"Peak: most memory held by the process until the end of the stage, of which imports are "
        f"{rows[0]['imports_gib']:.2f} GiB. First touch: of as much memory as the filter's "
        f"outputs take. Target: filter below 10 %."
    )
    show([Table(f"{given.rows:,} rows from file to file", columns, rows, note)], given.json)


if __name__ == "__main__":
    main()
