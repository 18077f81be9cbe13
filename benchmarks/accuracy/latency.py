"""How much later the reference of a recording is than its gyroscope: `python -m benchmarks.accuracy.latency DIR`.

The driver integrates the mean of two readings, so an orientation belongs to the stamp of the later one. A reference
whose clock is late by τ sees the estimate ahead by ω τ. The regression of the error on the rate, both without their
means over a second, gives τ.
"""

import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

from levelhead.bench.datasets import load_recording
from levelhead.bench.survey import survey
from levelhead.engine.smoothing import smooth
from levelhead.publish.progress import progress
from levelhead.recording import Array, Recording
from levelhead.rotations import conjugate, product

MAX_ERROR = 0.3  # of a component of the quaternion: larger errors are other faults


def lateness(recording: Recording) -> float:
    """s by which the reference is later than the gyroscope."""
    assert recording.truth is not None
    track = smooth(Recording(recording.t, recording.gyr, recording.acc))
    known = np.isfinite(recording.truth.quat).all(axis=1) & np.isfinite(recording.gyr).all(axis=1)
    reference = np.where(known[:, None], recording.truth.quat, [1.0, 0.0, 0.0, 0.0])
    error = product(conjugate(reference), track.quat)
    error = 2.0 * error[:, 1:] * np.sign(error[:, :1])
    rate = np.nan_to_num(recording.gyr)
    second = max(round(1.0 / float(np.median(np.diff(recording.t)))), 1)
    window = np.ones(second) / second
    error, rate = (values - np.stack([np.convolve(column, window, "same") for column in values.T], axis=1)
                   for values in (error, rate))  # fmt: skip
    inside: Array = np.convolve(known.astype(float), window, "same") > 0.999
    rows = known & inside & (np.linalg.norm(error, axis=1) < MAX_ERROR)
    return float(np.sum(error[rows] * rate[rows]) / np.sum(rate[rows] ** 2))


def main(folder: Path) -> None:
    """Prints a row for each data set."""
    entries, _ = survey([folder], True)
    found = defaultdict(list)
    with progress("recordings") as report:
        for done, entry in enumerate(entries):
            found[entry.group.dataset].append((lateness(load_recording(entry.path, True)), entry.rate))
            report((done + 1) / len(entries))
    print(
        "| data set | recordings | rate, Hz | reference later by, ms (median) | in intervals |\n|---|--:|--:|--:|--:|"
    )
    for name, rows in found.items():
        late, rate = (float(value) for value in np.median(rows, axis=0))
        print(f"| {name} | {len(rows)} | {rate:.0f} | {1e3 * late:.1f} | {late * rate:.2f} |")


if __name__ == "__main__":
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        sys.exit("usage: python -m benchmarks.accuracy.latency DIR, a folder of recordings with a reference")
    main(Path(sys.argv[1]))
