"""What parameters lose that were found without truth, by the smoother or the likelihood, against those found with it.

    python -m benchmarks.accuracy.tune_without_truth $LEVELHEAD_DATA

For each data set and filter: all parameters that are tuned unasked are searched over at most ``--most`` recordings of
the set (evenly picked, the first ``--seconds`` of each), with each of three goals: the truth, the smoother, and the
likelihood of the innovations. All are scored against the truth on these recordings, with ``--elsewhere`` on as many
others of the set: total error where there are magnetometers, else tilt, geometric mean. The truth is first turned by
the constant rotation between its body and the sensor, and a constant heading is removed: no parameter could mend
either.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.measure import options, run_script, show

import levelhead as lh
from levelhead import filters
from levelhead.bench.datasets import load_recording
from levelhead.bench.groups import group_of
from levelhead.bench.ratios import geometric_mean
from levelhead.bench.reference import align_sensor
from levelhead.bench.survey import survey
from levelhead.bench.timing import Table
from levelhead.evaluate.score import root_mean_squares
from levelhead.publish.progress import progress
from levelhead.tune.score_sets import score_sets

GOALS = ("truth", "smoother", "likelihood")


class Result(NamedTuple):
    """Of one set and filter: errors against the truth in degrees."""

    dataset: str
    filter: str
    logs: int
    default: float
    with_truth: float
    by_smoother: float
    by_likelihood: float
    smoother: float


def prepare(path: Path, seconds: float) -> lh.Recording:
    """The beginning of a recording, its truth turned into the sensor's frame, noted at every sample."""
    recording = load_recording(path, True)
    recording = recording[: round(seconds * recording.rate)]
    frame = align_sensor(recording)
    if frame is None or recording.truth is None:
        return recording
    return replace(recording, truth=replace(recording.truth, quat=frame.turn(recording.truth.quat), north=False))


def usable(recording: lh.Recording) -> bool:
    """Whether it may be tuned on, with truth and without."""
    try:
        for kind in ("truth", "smoother"):
            lh.tune_filter(recording, lh.Madgwick(), ["beta"], goal=kind, runs=2, cross_validate=False)
    except lh.LevelheadError as error:
        print(f"left out: {error}")
        return False
    return True


def compare(
    dataset: str,
    name: str,
    logs: list[lh.Recording],
    scored: list[lh.Recording],
    parameters: list[str],
    runs: int | None,
) -> Result:
    """The three searches over ``logs``, and their errors on ``scored``."""
    found: dict[str, Any] = {
        kind: lh.tune_filter(logs, name, parameters, goal=kind, runs=runs, cross_validate=False) for kind in GOALS
    }
    metric = found["truth"].metric
    column = ("total", "tilt", "heading").index(metric)
    sets = [filters.find(name).params(), found["truth"].best, found["smoother"].best, found["likelihood"].best]
    errors = score_sets(scored, sets, lh.Guard())[:, :, column]
    smoother = geometric_mean([root_mean_squares(log, lh.smooth(log))[column] for log in scored])
    return Result(dataset, name, len(scored), *(geometric_mean(one) for one in errors.T.tolist()), smoother)


def loss(ratio: float) -> str:
    """By how much a ratio of errors is above 1, in percent."""
    return f"{100.0 * (ratio - 1.0):+.1f} %"


def table(results: list[Result]) -> Table:
    """A row for each set and filter, and one for each filter over all."""
    columns = {
        "set": "data set", "filter": "filter", "logs": "logs", "default": "default °", "truth": "found with truth °",
        "by_smoother": "by the smoother °", "smoother_loss": "loss", "by_likelihood": "by the likelihood °",
        "likelihood_loss": "loss", "smoother": "the smoother itself °",
    }  # fmt: skip
    rows: list[dict[str, Any]] = []
    for one in results:
        rows.append(
            {
                "set": one.dataset, "filter": one.filter, "logs": one.logs, "default": one.default,
                "truth": one.with_truth, "by_smoother": one.by_smoother, "by_likelihood": one.by_likelihood,
                "smoother": one.smoother, "smoother_loss": loss(one.by_smoother / one.with_truth),
                "likelihood_loss": loss(one.by_likelihood / one.with_truth),
            }
        )  # fmt: skip
    for name in dict.fromkeys(one.filter for one in results):
        mine = [one for one in results if one.filter == name]
        names = ("default", "truth", "by_smoother", "by_likelihood", "smoother")
        mean = dict(zip(names, (geometric_mean([one[k] for one in mine]) for k in range(3, 8)), strict=True))
        losses = {f"{by}_loss": loss(mean[f"by_{by}"] / mean["truth"]) for by in ("smoother", "likelihood")}
        rows.append(mean | losses | {"set": "all", "filter": name, "logs": sum(one.logs for one in mine)})
    return Table("Errors against the truth, and what is lost without it", columns, rows, "Geometric means.")


def main() -> None:
    """The table."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("places", nargs="+", type=Path)
    parser.add_argument("--filters", nargs="+", default=["Mahony", "Madgwick", "Complementary", "EKF"])
    parser.add_argument("--parameters", nargs="+", default=[], help="to search, of one filter")
    parser.add_argument("--elsewhere", action="store_true", help="score on recordings that were not searched")
    parser.add_argument("--most", type=int, default=4, help="recordings of a data set")
    parser.add_argument("--seconds", type=float, default=120.0, help="of each recording")
    parser.add_argument("--runs", type=int, help="of one search; 80 for each parameter by default")
    given = parser.parse_args()
    by_set: dict[str, list[Path]] = {}
    for entry in survey(given.places, True)[0]:
        by_set.setdefault(group_of(entry.path).dataset, []).append(entry.path)
    results = []
    with progress("tuning") as report:
        for done, (dataset, files) in enumerate(sorted(by_set.items())):
            count = min(len(files), given.most)
            picked = [files[k * len(files) // count] for k in range(count)]
            logs = [log for log in (prepare(path, given.seconds) for path in picked) if usable(log)]
            others = [path for path in files if path not in picked]
            count = min(len(others), given.most)
            apart = [others[k * len(others) // count] for k in range(count)]
            scored = [prepare(path, given.seconds) for path in apart] if given.elsewhere else logs
            scored = [log for log in scored if log.truth is not None]
            for name in given.filters if logs and scored else ():
                results.append(compare(dataset, name, logs, scored, given.parameters, given.runs))
                print(*results[-1], flush=True)
            report((done + 1) / len(by_set))
    show([table(results)], given.json)


if __name__ == "__main__":
    run_script(main)
