"""What single precision costs in error: every exported filter as float and as double on recordings with a reference."""

from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.measure import options, read_reference, run_script, show
from benchmarks.speed.exported import attitude_run
from tests.reference.c_library import doubles

import levelhead as lh
from levelhead import filters
from levelhead.bench.timing import Table
from levelhead.evaluate import evaluate
from levelhead.export import ExportConfig

COLUMNS = {
    "case": "filter",
    "double": "tilt, double [°]",
    "float": "tilt, float [°]",
    "change": "change [%]",
    "apart": "largest angle between both [°]",
}


def fused(config: ExportConfig, recording: lh.Recording) -> lh.Track:
    """A recording through the exported filter."""
    n = len(recording)
    inputs = [np.ascontiguousarray(array) for array in (recording.t, recording.gyr, recording.acc)]
    field = None if recording.mag is None else np.ascontiguousarray(recording.mag)
    quat, bias = np.empty((n, 4)), np.empty((n, 3))
    run = attitude_run(config)
    run(None, n, *map(doubles, inputs), None if field is None else doubles(field), doubles(quat), doubles(bias))
    return lh.Track(recording.t, quat)


def row(flt: Any, recording: lh.Recording) -> dict[str, Any]:
    """One filter on one recording."""
    double, single = (fused(ExportConfig(flt.params(), real=real), recording) for real in ("double", "float"))
    right, off = (evaluate(recording, track).tilt for track in (double, single))
    apart = np.degrees((double.as_rotation() * single.as_rotation().inv()).magnitude()).max()
    return {
        "case": flt.name,
        "double": round(right, 4),
        "float": round(off, 4),
        "change": round(100.0 * (off / right - 1.0), 4),
        "apart": round(float(apart), 4),
    }


def main() -> None:
    """Every recording given."""
    parser = options(__doc__)
    parser.add_argument("recordings", nargs="+", type=Path, help="files with a reference, such as those of BROAD")
    given = parser.parse_args()
    tables = []
    for path in given.recordings:
        recording = read_reference(path)
        rows = [row(flt, recording) for flt in filters.ALL]
        tables.append(Table(f"{path.stem}, {len(recording):,} samples", COLUMNS, rows, "Guard included."))
    show(tables, given.json)


if __name__ == "__main__":
    run_script(main)
