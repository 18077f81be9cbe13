"""Whether σ is honest: RMS of error over σ, of tilt and of heading, on recordings with a reference.

1 is honest, more is overconfident. Heading is compared as it stands: what the reference is turned against magnetic
north counts as error. The last line is the RMS over all samples of all recordings, each recording with the same weight.
"""

from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.measure import options, read_reference, run_script, show

import levelhead as lh
from levelhead.bench import methods
from levelhead.bench.timing import Table
from levelhead.evaluate import evaluate

METHODS = {"default": "ESKF", "smoother": "smoother", "EKF": "EKF"}
PARTS = ("tilt", "heading")


def track_of(name: str, recording: lh.Recording) -> lh.Track:
    """A method's, with its σ."""
    method = methods.find_method(name)
    if name == methods.SMOOTHER:
        return lh.smooth(recording)
    return lh.fuse(recording, method.params, engine="compiled")


def main() -> None:
    """Every recording given, every method that has a σ."""
    parser = options(__doc__)
    parser.add_argument("recordings", nargs="+", type=Path, help="files with a reference, such as those of BROAD")
    given = parser.parse_args()
    columns = {"case": "recording"} | {
        f"{name} {part}": f"{label}: {part}" for name, label in METHODS.items() for part in PARTS
    }
    rows: list[dict[str, Any]] = []
    for path in given.recordings:
        recording = read_reference(path)
        row: dict[str, Any] = {"case": path.stem[:40]}
        for name in METHODS:
            score = evaluate(recording, track_of(name, recording))
            row[f"{name} tilt"], row[f"{name} heading"] = score.tilt_error_ratio, score.heading_error_ratio
        rows.append(row)
    last: dict[str, Any] = {"case": "all"}
    for key in list(columns)[1:]:
        known = [row[key] for row in rows if row[key] is not None]
        last[key] = float(np.sqrt(np.mean(np.square(known)))) if known else None
    show([Table("Error over σ", columns, [*rows, last])], given.json)


if __name__ == "__main__":
    run_script(main)
