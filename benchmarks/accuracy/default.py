"""How flat the choice of ``levelhead.filters.default`` and of ``Guard`` is: each number three times larger and smaller.

Mean tilt and total error in degrees over the recordings in the folders given (BROAD .mat, RepoIMU .csv), and over
simulated ones: four chips with a magnetometer, four motions, two specimens each, errors as in their data sheets. A
number that only one of the two columns likes would be tuned to it. Every filter with its own defaults comes after that.

Cross-validation comes last: for each kind of recording and each chip, every number of the default is chosen anew (as
it is, three times larger or smaller) by the mean logarithm of the total error on all others; then the choice and the
default meet on the sets left out. Were the defaults tuned to these recordings, a choice made without some would do
worse there.
"""

import itertools
import math
import statistics
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.measure import options, read_references, run_script, show

import levelhead as lh
from levelhead import filters
from levelhead.bench.groups import group_of
from levelhead.bench.timing import Table
from levelhead.evaluate.score import root_mean_squares
from levelhead.filters.parameters import param_table

CHIPS = ("MPU-6050", "BMI160", "LSM6DS3", "LSM6DSO32")
MOTIONS = ("hand", "walking", "drone", "robot")
FACTOR = 3.0
TABLES = ("Mean error, °", "Mean error by the guard's numbers, °", "Mean error of every filter as it comes, °")


class Case(NamedTuple):
    """A recording and what it is left out with."""

    group: str
    recording: lh.Recording


def simulate_recording() -> list[Case]:
    """A minute at 100 Hz of every chip in every motion, twice."""
    cases = itertools.product(CHIPS, MOTIONS, (1, 2))
    return [Case(chip, lh.simulate.recording(chip, motion, seed=seed, mag="HMC5883L")) for chip, motion, seed in cases]


def real(folders: list[Path]) -> list[Case]:
    """The recordings in the folders that have a truth."""
    return [Case(group_of(path).name, recording) for path, recording in read_references(folders)]


class Errors(NamedTuple):
    """Tilt and total error, °, of one recording."""

    tilt: float
    total: float


def errors(case: Case, params: Any, guard: lh.Guard | None) -> Errors:
    """Of one recording."""
    total, tilt, _ = root_mean_squares(case.recording, lh.fuse(case.recording, params, guard=guard, engine="compiled"))
    return Errors(tilt, total)


def varied(numbers: Any) -> dict[str, Any]:
    """Label to the same numbers with one of them larger or smaller; a 0 stays what it is."""
    found = {}
    for name, factor in itertools.product(param_table(type(numbers)), (FACTOR, 1 / FACTOR)):
        value = getattr(numbers, name) * factor
        if value:
            found[f"{name} = {value:.3g}"] = numbers._replace(**{name: value})
    return found


def table(title: str, choices: dict[str, tuple[Any, lh.Guard | None]], sets: dict[str, list[Case]], note: str) -> Table:
    """Mean errors of every choice on every set."""
    rows = []
    for label, (params, guard) in choices.items():
        row: dict[str, Any] = {"filter": label}
        for name, cases in sets.items():
            each = [errors(case, params, guard) for case in cases]
            row[f"{name} tilt"] = statistics.fmean(one.tilt for one in each)
            row[f"{name} total"] = statistics.fmean(one.total for one in each)
        rows.append(row)
    return Table(title, {key: key for key in rows[0]}, rows, note)


def chosen(best: Any, choices: dict[str, Any], logarithms: dict[str, dict[str, float]], without: str) -> Any:
    """Every number at the value that was the best on all groups but one, each tried alone."""
    means = {label: statistics.fmean(by[group] for group in by if group != without) for label, by in logarithms.items()}
    taken = best
    for name in param_table(type(best)):
        tried = ["", *(label for label in choices if label.startswith(f"{name} = "))]
        label = min(tried, key=means.__getitem__)
        if label:
            taken = taken._replace(**{name: getattr(choices[label], name)})
    return taken


def cross_validated(best: Any, cases: list[Case], guard: lh.Guard) -> Table:
    """What the choice made without a group does on it."""
    choices = varied(best)
    groups = list(dict.fromkeys(case.group for case in cases))

    def logarithm(params: Any, group: str) -> float:
        return statistics.fmean(math.log(errors(case, params, guard).total) for case in cases if case.group == group)

    logarithms = {
        label: {group: logarithm(params, group) for group in groups} for label, params in ({"": best} | choices).items()
    }
    rows = []
    for group in groups:
        taken = chosen(best, choices, logarithms, group)
        own = [case for case in cases if case.group == group]
        row: dict[str, Any] = {"left out": group}
        for label, params in (("default", best), ("chosen", taken)):
            each = [errors(case, params, guard) for case in own]
            row[f"{label}: tilt"] = statistics.fmean(one.tilt for one in each)
            row[f"{label}: total"] = statistics.fmean(one.total for one in each)
        changed = [name for name in param_table(type(best)) if getattr(best, name) != getattr(taken, name)]
        row["changed"] = ", ".join(f"{name} {getattr(taken, name):.3g}" for name in changed) or "nothing"
        rows.append(row)
    return Table("Cross-validation, °", {key: key for key in rows[0]}, rows, "Each group by numbers chosen without it.")


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("folders", nargs="+", type=Path, help="folders with BROAD .mat and RepoIMU .csv")
    given = parser.parse_args()
    best, guard = filters.default(), lh.Guard()
    name = type(best).__name__
    cases: list[dict[str, tuple[Any, lh.Guard | None]]] = [
        {name: (best, guard)} | {label: (params, guard) for label, params in varied(best).items()},
        {"no guard": (best, None)} | {label: (best, other) for label, other in varied(guard).items()},
        {flt.name: (flt.params(), guard) for flt in filters.ALL},
    ]
    sets = {"real": real(given.folders), "simulated": simulate_recording()}
    note = f"{name}() where no other is named."
    tables = [table(title, choices, sets, note) for title, choices in zip(TABLES, cases, strict=True)]
    tables.append(cross_validated(best, [case for each in sets.values() for case in each], guard))
    show(tables, given.json)


if __name__ == "__main__":
    run_script(main)
