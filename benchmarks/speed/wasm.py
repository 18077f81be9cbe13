"""The exported filter as a module for WebAssembly, beside Python and C: size, time of a sample, and the bits.

``python -m benchmarks.speed.wasm RECORDING [--samples 100000]``: the recording, again and again until there are so many
samples, in node, by one call for all rows and by one for each; in Python's batch; and in the exported C (gcc -O2). The
answers of all four are compared bit by bit. Needs node, and clang with lld.
"""

import gzip
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.measure import options, run_script, show
from benchmarks.speed.exported import attitude_run
from tests.reference.c_library import doubles
from tests.reference.node import run_in_node

import levelhead as lh
from levelhead import filters
from levelhead.bench.datasets import load_recording
from levelhead.bench.timing import Case, Table, time_interleaved
from levelhead.export import ExportConfig, write_package
from levelhead.filters.parameters import Params

NAMES = ("Mahony", "EKF", "ESKF")
COLUMNS = {
    "case": "filter",
    "size": "module [bytes]",
    "compressed": "gzip -9 [bytes]",
    "rows": "updateRows [ns]",
    "live": "update and quaternion [ns]",
    "python": "lh.fuse [ns]",
    "c": "C [ns]",
    "bits": "bits of Python",
}


def repeat(recording: lh.Recording, samples: int) -> lh.Recording:
    """The same motion again and again, with stamps that go on."""
    times = -(-samples // len(recording))
    step = recording.t[-1] - recording.t[0] + float(np.median(np.diff(recording.t)))
    t = np.concatenate([recording.t + step * k for k in range(times)])[:samples]
    gyr, acc = (np.tile(array, (times, 1))[:samples] for array in (recording.gyr, recording.acc))
    mag = None if recording.mag is None else np.tile(recording.mag, (times, 1))[:samples]
    return lh.Recording(t, gyr, acc, mag)


def measure(params: Params, recording: lh.Recording, repeats: int) -> dict[str, Any]:
    """One row."""
    config, n = ExportConfig(params), len(recording)
    run = attitude_run(config)
    inputs = [np.ascontiguousarray(array) for array in (recording.t, recording.gyr, recording.acc)]
    field = None if recording.mag is None else np.ascontiguousarray(recording.mag)
    quat, bias = np.empty((n, 4)), np.empty((n, 3))
    at = [*map(doubles, inputs), None if field is None else doubles(field), doubles(quat), doubles(bias)]
    in_python, in_c = time_interleaved(
        [Case("Python", lambda: lh.fuse(recording, params), n), Case("C", lambda: run(None, n, *at), n)], repeats
    )
    track = lh.fuse(recording, params)
    with tempfile.TemporaryDirectory() as made:
        write_package(config, Path(made))
        package = Path(made) / config.name.replace("_", "-")
        found = run_in_node(package, recording, repeats)
        module = (package / f"{config.name}.wasm").read_bytes()
    answers = (found.track["quaternion"], found.track["live"], quat)
    same = all(np.array_equal(one, track.quat) for one in answers)
    return {
        "case": filters.of(params).name,
        "size": len(module),
        "compressed": len(gzip.compress(module, 9)),
        "rows": round(found.nanoseconds["rows"]),
        "live": round(found.nanoseconds["live"]),
        "python": round(in_python.least),
        "c": round(in_c.least),
        "bits": "the same" if same else "DIFFERENT",
    }


def main() -> None:
    """The table."""
    parser = options(__doc__, repeats=3)
    parser.add_argument("recording", type=Path, metavar="RECORDING")
    parser.add_argument("--samples", type=int, default=100_000)
    given = parser.parse_args()
    recording = repeat(load_recording(given.recording, with_mag=True), given.samples)
    rows = [measure(filters.find(name).params(), recording, given.repeats) for name in NAMES]
    show([Table(f"WebAssembly, {given.samples:,} samples of {given.recording.stem}", COLUMNS, rows)], given.json)


if __name__ == "__main__":
    run_script(main)
