"""How flat the choice of ``levelhead.filters.best`` is: each of its numbers three times larger and smaller.

Mean tilt and total error in degrees over the recordings in the folders given (BROAD .mat, RepoIMU .csv), and over
simulated ones: four chips with a magnetometer, four motions, two specimens each, errors as in their data sheets. A
number that only one of the two columns likes would be tuned to it.
"""

import itertools
import statistics
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import levelhead as lh
from levelhead import filters
from levelhead.bench.survey import logs
from levelhead.bench.timing import Table
from levelhead.evaluate import evaluate
from measure import options, show

CHIPS = ("MPU-6050", "BMI160", "LSM6DS3", "LSM6DSO32")
MOTIONS = ("hand", "walking", "drone", "robot")
FACTOR = 3.0
VARIED = ("q_angle", "q_bias", "r_measure", "r_heading", "p_bias")


def simulated() -> list[lh.Recording]:
    """A minute at 100 Hz of every chip in every motion, twice."""
    cases = itertools.product(CHIPS, MOTIONS, (1, 2))
    return [lh.simulate.recording(chip, motion, seed=seed, mag="HMC5883L") for chip, motion, seed in cases]


def real(folders: list[Path]) -> list[lh.Recording]:
    """The recordings in the folders that have a truth."""
    found = []
    for path in logs(folders):
        recording = lh.read(path)
        if recording.truth is not None:
            found.append(recording)
    return found


def errors(recordings: Iterable[lh.Recording], params: Any) -> tuple[float, float]:
    """Mean tilt and mean total error, °."""
    scores = [evaluate(recording, lh.fuse(recording, params, engine="compiled")) for recording in recordings]
    return statistics.fmean(s.tilt for s in scores), statistics.fmean(s.total for s in scores)


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("folders", nargs="+", type=Path, help="folders with BROAD .mat and RepoIMU .csv")
    given = parser.parse_args()
    best = filters.best()
    choices: dict[str, Any] = {"best": best}
    for name, factor in itertools.product(VARIED, (FACTOR, 1 / FACTOR)):
        value = getattr(best, name) * factor
        choices[f"{name} = {value:.3g}"] = best._replace(**{name: value})
    choices |= {flt.name: flt.params() for flt in filters.ALL}
    groups = {"real": real(given.folders), "simulated": simulated()}
    rows = []
    for label, params in choices.items():
        row: dict[str, Any] = {"filter": label}
        for group, recordings in groups.items():
            row[f"{group} tilt"], row[f"{group} total"] = errors(recordings, params)
        rows.append(row)
    columns = {key: key for key in rows[0]}
    show([Table("Mean error, °", columns, rows, note=f"best: {best}; its other numbers one at a time.")], given.json)


if __name__ == "__main__":
    main()
