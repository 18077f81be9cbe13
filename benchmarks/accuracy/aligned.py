"""Errors that no constant rotation of earth or sensor explains, where both have axes of their own."""

from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.measure import options, read_reference, run_script, show

import levelhead as lh
from levelhead.bench import methods
from levelhead.bench.timing import Table
from levelhead.evaluate.align import align

METHODS = ("default", "smoother", "EKF", "Mahony", "Madgwick", "vqf.VQF", "vqf.offlineVQF")


def rest(recording: lh.Recording, quat: Any) -> float:
    """RMS angle in ° after the constant rotations on both sides that make it smallest; nothing shifted in time."""
    truth = recording.truth
    assert truth is not None
    found = align(recording.t, quat, recording.t, truth.quat, convention="same", simplest=False, shift=False)
    return round(found.after, 2)


def main() -> None:
    """Every recording given, every method."""
    parser = options(__doc__)
    parser.add_argument("recordings", nargs="+", type=Path, help="files with a reference, such as those of RepoIMU")
    given = parser.parse_args()
    columns = {"case": "method"} | {path.stem: f"{path.stem} [°]" for path in given.recordings}
    rows: list[dict[str, Any]] = [{"case": name} for name in METHODS]
    for path in given.recordings:
        recording = read_reference(path)
        for row in rows:
            row[path.stem] = rest(recording, np.asarray(methods.find_method(row["case"]).orientation(recording)))
    title = "What is left after the best constant rotations of earth and of sensor"
    show([Table(title, columns, rows, "")], given.json)


if __name__ == "__main__":
    run_script(main)
