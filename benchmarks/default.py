"""How flat the choice of ``levelhead.filters.best`` and of ``Guard`` is: each number three times larger and smaller.

Mean tilt and total error in degrees over the recordings in the folders given (BROAD .mat, RepoIMU .csv), and over
simulated ones: four chips with a magnetometer, four motions, two specimens each, errors as in their data sheets. A
number that only one of the two columns likes would be tuned to it. Every filter with its own defaults comes last.
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
from levelhead.evaluate.score import root_mean_squares
from levelhead.filters.contract import param_table
from measure import options, show

CHIPS = ("MPU-6050", "BMI160", "LSM6DS3", "LSM6DSO32")
MOTIONS = ("hand", "walking", "drone", "robot")
FACTOR = 3.0
TABLES = ("Mean error, °", "Mean error by the guard's numbers, °", "Mean error of every filter as it comes, °")


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


def errors(recordings: Iterable[lh.Recording], params: Any, guard: lh.Guard | None) -> tuple[float, float]:
    """Mean tilt and mean total error, °."""
    tilts, totals = [], []
    for recording in recordings:
        total, tilt, _ = root_mean_squares(recording, lh.fuse(recording, params, guard=guard, engine="compiled"))
        tilts.append(tilt)
        totals.append(total)
    return statistics.fmean(tilts), statistics.fmean(totals)


def varied(numbers: Any) -> dict[str, Any]:
    """Label to the same numbers with one of them larger or smaller; a 0 stays what it is."""
    found = {}
    for name, factor in itertools.product(param_table(type(numbers)), (FACTOR, 1 / FACTOR)):
        value = getattr(numbers, name) * factor
        if value:
            found[f"{name} = {value:.3g}"] = numbers._replace(**{name: value})
    return found


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("folders", nargs="+", type=Path, help="folders with BROAD .mat and RepoIMU .csv")
    given = parser.parse_args()
    best, guard = filters.best(), lh.Guard()
    name = type(best).__name__
    cases: list[dict[str, tuple[Any, lh.Guard | None]]] = [
        {name: (best, guard)} | {label: (params, guard) for label, params in varied(best).items()},
        {"no guard": (best, None)} | {label: (best, other) for label, other in varied(guard).items()},
        {flt.name: (flt.params(), guard) for flt in filters.ALL},
    ]
    groups = {"real": real(given.folders), "simulated": simulated()}
    tables = []
    for title, choices in zip(TABLES, cases, strict=True):
        rows = []
        for label, (params, before) in choices.items():
            row: dict[str, Any] = {"filter": label}
            for group, recordings in groups.items():
                row[f"{group} tilt"], row[f"{group} total"] = errors(recordings, params, before)
            rows.append(row)
        tables.append(Table(title, {key: key for key in rows[0]}, rows, note=f"{name}() where no other is named."))
    show(tables, given.json)


if __name__ == "__main__":
    main()
