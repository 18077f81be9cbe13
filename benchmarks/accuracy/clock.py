"""What of every method's error is the clock of the reference: BROAD's is ahead of the gyroscopes.

Every method's orientation is held against the reference as it is, and one sample later, as if the reference had been
stamped so much later: in a turn of 500 °/s a millisecond is half a degree. Lag is the mean of what
``levelhead.evaluate`` finds in the recordings that move enough to tell. The last column is the RMS angle between a
method's vertical and that of offlineVQF, which shares nothing with ours but the sensors: where two agree better with
each other than with the reference, it is the reference that is off.
"""

import statistics
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.measure import options, read_references, run_script, show

import levelhead as lh
from levelhead.bench import methods
from levelhead.bench.timing import Table
from levelhead.evaluate import evaluate
from levelhead.evaluate.attitude_error import error_quaternion, split_error
from levelhead.evaluate.score import rms, scored_rows

METHODS = ("default", "smoother", "EKF", "Mahony", "Madgwick", "vqf.VQF", "vqf.offlineVQF")


def later(track: lh.Track, samples: int) -> lh.Track:
    """Every orientation at the stamp of an earlier sample."""
    moved = np.minimum(np.arange(len(track)) + samples, len(track) - 1)
    return lh.Track(track.t, track.quat[moved])


def tracked(name: str, recording: lh.Recording) -> lh.Track:
    """A method's orientation."""
    return lh.Track(recording.t, np.asarray(methods.find_method(name).orientation(recording)))


def row(name: str, recordings: list[lh.Recording], others: list[lh.Track]) -> dict[str, Any]:
    """Of one method: mean errors as they are and a sample later, the lag, how far its vertical is from another's."""
    found: dict[str, list[float]] = {}
    for recording, other in zip(recordings, others, strict=True):
        track = tracked(name, recording)
        assert recording.truth is not None
        apart = split_error(error_quaternion(track.quat, other.quat)).tilt[scored_rows(recording.truth)]
        found.setdefault("apart", []).append(float(np.degrees(rms(apart))))
        for samples in (0, 1):
            score = evaluate(recording, later(track, samples))
            found.setdefault(f"tilt_{samples}", []).append(score.tilt)
            found.setdefault(f"aligned_{samples}", []).append(score.total_aligned)
            if samples == 0 and score.lag is not None:
                found.setdefault("lag", []).append(score.lag)
    return {"case": name} | {key: statistics.fmean(values) for key, values in found.items()}


def main() -> None:
    """All recordings with a truth and a magnetometer in a folder."""
    parser = options(__doc__)
    parser.add_argument("folder", type=Path, help="recordings with a reference, such as BROAD's")
    given = parser.parse_args()
    recordings = [recording for _, recording in read_references([given.folder])]
    columns = {
        "case": "method",
        "tilt_0": "tilt [°]",
        "tilt_1": "tilt a sample later [°]",
        "aligned_0": "aligned [°]",
        "aligned_1": "aligned a sample later [°]",
        "lag": "lag [ms]",
        "apart": "tilt from offlineVQF's [°]",
    }
    others = [tracked("vqf.offlineVQF", recording) for recording in recordings]
    rows = [row(name, recordings, others) for name in METHODS]
    show([Table(f"{len(recordings)} recordings", columns, rows, "")], given.json)


if __name__ == "__main__":
    run_script(main)
