"""What the verdict of ``tune`` is worth: parameters found on half of a recording, scored on its other half.

    python -m benchmarks.accuracy.tune_halves $LEVELHEAD_DATA [--most 30] [--filters Mahony EKF ESKF] [--goal smoother]

Of each data set at most as many recordings are taken that there are ``--most`` in all. The first half is searched,
with the truth or the smoother; the other half, which the search has not seen, is run from its own first sample and
scored against the truth: total error, where the recording has a magnetometer or the goal is the truth, else tilt.
A "Take" whose error there is above the default's by 3 % was wrong.
"""

import json
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from benchmarks.accuracy.tune_without_truth import prepare
from benchmarks.measure import options, run_script, show

import levelhead as lh
from levelhead.bench.groups import group_of
from levelhead.bench.survey import survey
from levelhead.bench.timing import Table
from levelhead.evaluate.score import root_mean_squares
from levelhead.publish.progress import progress

WORSE = 1.03  # times the default's error: a verdict that misled


class Half(NamedTuple):
    """A search on the first half of a recording, and RMS errors on the second half in degrees.

    Attributes:
        dataset, log, filter: which.
        took: whether the verdict was to take what was found.
        before: (3,) total, tilt and heading error of the default.
        after: (3,) of the parameters found.
        column: of the error that was minimised.
        verdict: the first line.
        facts: of the search, for ``--json``.
    """

    dataset: str
    log: str
    filter: str
    took: bool
    before: tuple[float, float, float]
    after: tuple[float, float, float]
    column: int
    verdict: str
    facts: dict[str, Any]

    @property
    def ratio(self) -> float:
        """Of the error that was minimised, found over default."""
        return self.after[self.column] / self.before[self.column]


def judge(recording: lh.Recording, dataset: str, log: str, name: str, goal: Any, runs: int | None) -> Half:
    """One search, and its result on the other half."""
    half = len(recording) // 2
    found = lh.tune_filter(recording[:half], name, goal=goal, runs=runs)
    other = recording[half:]
    before, after = (root_mean_squares(other, lh.fuse(other, one)) for one in (found.space.params, found.best))
    column = ("total", "tilt", "heading").index(found.metric)
    return Half(dataset, log, name, found.worth, before, after, column, found.verdict()[0], found.to_dict())


def pick(places: list[Path], most: int) -> list[tuple[str, Path]]:
    """(data set, file) of at most ``most`` recordings, evenly over the sets."""
    by_set: dict[str, list[Path]] = {}
    for entry in survey(places, True)[0]:
        by_set.setdefault(group_of(entry.path).dataset, []).append(entry.path)
    each = max(1, -(-most // max(1, len(by_set))))
    taken = []
    for dataset, files in sorted(by_set.items()):
        count = min(len(files), each)
        taken += [(dataset, files[k * len(files) // count]) for k in range(count)]
    return taken[:most]


def table(halves: list[Half]) -> Table:
    """A row for each filter."""
    columns = {
        "filter": "filter", "count": "halves", "took": "Take", "worse": "of these worse by 3 %",
        "gain": "error of these, found over default", "worst": "worst", "kept": "found over default where it keeps",
    }  # fmt: skip
    rows: list[dict[str, Any]] = []
    for name in [*dict.fromkeys(one.filter for one in halves), "all"]:
        mine = [one for one in halves if name in (one.filter, "all")]
        took, kept = [one.ratio for one in mine if one.took], [one.ratio for one in mine if not one.took]
        rows.append(
            {
                "filter": name, "count": len(mine), "took": len(took),
                "worse": sum(ratio > WORSE for ratio in took),
                "gain": float(np.exp(np.mean(np.log(took)))) if took else None,
                "worst": max(took, default=None),
                "kept": float(np.exp(np.mean(np.log(kept)))) if kept else None,
            }
        )  # fmt: skip
    return Table("Parameters found on half of a recording, on its other half", columns, rows, "Geometric means.")


def main() -> None:
    """The table."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("places", nargs="+", type=Path)
    parser.add_argument("--filters", nargs="+", default=["Mahony", "EKF", "ESKF"])
    parser.add_argument("--goal", choices=("truth", "smoother"), help="of the search; the truth by default")
    parser.add_argument("--most", type=int, default=30, help="recordings")
    parser.add_argument("--seconds", type=float, default=240.0, help="of each recording")
    parser.add_argument("--runs", type=int, help="of one search; 80 for each parameter by default")
    parser.add_argument("--details", type=Path, help="JSON file for each search's numbers")
    given = parser.parse_args()
    halves, refused = list[Half](), Counter[str]()
    taken = pick(given.places, given.most)
    with progress("tuning") as report:
        for done, (dataset, path) in enumerate(taken):
            recording = prepare(path, given.seconds)
            for name in given.filters:
                try:
                    halves.append(judge(recording, dataset, path.name, name, given.goal, given.runs))
                except lh.LevelheadError as error:
                    refused[str(error)] += 1
                    continue
                one = halves[-1]
                print(f"{dataset}/{one.log} {name}: {one.ratio:.3f} {one.verdict}", flush=True)
            report((done + 1) / len(taken))
    for sentence in refused:
        print(f"refused: {sentence}")
    if given.details:
        given.details.write_text(json.dumps([one._asdict() for one in halves]))
    show([table(halves)], given.json)


if __name__ == "__main__":
    run_script(main)
