"""How `levelhead tune` searches: runs that SciPy's and Optuna's methods need, and how fast the runs are.

    python benchmarks/tune_search.py [LOG]

First table: for each method the excess over the least error that any of them found, after ``--budgets`` runs of the
filter, the median of three seeds. Methods: `minimise` of levelhead (differential evolution, then Nelder-Mead), SciPy's
differential evolution with three sizes of population, its DIRECT, Optuna's TPE and CMA-ES. Second table: seconds for
a parameter set by what a user would write (`evaluate(recording, fuse(recording, params))`), by the native engine on all
cores with the thinned truth of `tune`, and by 64 lanes.
"""

import math
import statistics
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

import levelhead as lh
from levelhead import filters
from levelhead.bench.datasets import load_recording
from levelhead.bench.timing import Table
from levelhead.evaluate import evaluate
from levelhead.evaluate.score import root_mean_squares
from levelhead.recording import Array
from levelhead.tune import lane_score
from levelhead.tune.minimise import minimise
from levelhead.tune.parameter_space import Space, space_of
from levelhead.tune.reference_orientation import references
from levelhead.tune.score_sets import score_sets
from levelhead.tune.tuning_result import FLOOR
from measure import options, run_script, show

SEEDS = (0, 1, 2)
EACH = 200  # sets of the table of times


class Enough(Exception):
    """The budget is used up."""


class Counted:
    """The logarithm of the error, and the least of it after each run."""

    def __init__(self, space: Space, recording: lh.Recording, budget: int) -> None:
        self._space, self._recording, self._budget = space, recording, budget
        self.values: list[float] = []

    def __call__(self, points: Array) -> Array:
        """Of (k, n) points."""
        sets = [self._space.at(point) for point in np.clip(points, 0.0, 1.0)]
        values: Array = np.log(np.maximum(score_sets([self._recording], sets, lh.Guard())[0, :, 0], FLOOR))
        self.values += values.tolist()
        if len(self.values) >= self._budget:
            raise Enough
        return values

    def one(self, point: Array) -> float:
        """Of one point."""
        return float(self(np.asarray(point)[None])[0])


Search = Callable[[Counted, Space, int, int], object]


def evolution(size: int) -> Search:
    """SciPy's differential evolution with so many points in a generation."""
    from scipy import optimize
    from scipy.stats import qmc

    def run(counted: Counted, space: Space, seed: int, _: int) -> object:
        first = qmc.Sobol(len(space.ranges), rng=seed).random(size)
        first[0] = space.start
        return optimize.differential_evolution(
            lambda points: counted(points.T), [(0.0, 1.0)] * len(space.ranges), init=first, maxiter=10_000, tol=0.0,
            vectorized=True, updating="deferred", polish=False, rng=seed,
        )  # fmt: skip

    return run


def own(counted: Counted, space: Space, seed: int, budget: int) -> object:
    """What `levelhead tune` does."""
    return minimise(counted, space.start, budget, seed)


def direct(counted: Counted, space: Space, _: int, budget: int) -> object:
    """SciPy's DIRECT, which knows no seed."""
    from scipy import optimize

    return optimize.direct(counted.one, [(0.0, 1.0)] * len(space.ranges), maxfun=budget)


def optuna(name: str) -> Search:
    """A sampler of Optuna's."""
    import optuna as library

    library.logging.set_verbosity(library.logging.ERROR)

    def run(counted: Counted, space: Space, seed: int, budget: int) -> object:
        study = library.create_study(sampler=getattr(library.samplers, name)(seed=seed))
        study.enqueue_trial(dict(zip(space.names, space.start.tolist(), strict=True)))

        def error(trial: Any) -> float:
            return counted.one(np.array([trial.suggest_float(one, 0.0, 1.0) for one in space.names]))

        return study.optimize(error, n_trials=budget)

    return run


def least_after(search: Search, space: Space, recording: lh.Recording, seed: int, budget: int) -> Array:
    """(budget,) the least value after each run."""
    counted = Counted(space, recording, budget)
    with suppress(Enough):
        search(counted, space, seed, budget)
    values = (counted.values + [math.inf] * budget)[:budget]
    return np.minimum.accumulate(np.array(values))


def runs_table(recording: lh.Recording, names: list[str], budgets: list[int]) -> Table:
    """The excess of each method after each budget, in percent."""
    searches: dict[str, Search] = {
        "levelhead's minimise": own, "SciPy DE, 16": evolution(16), "SciPy DE, 64": evolution(64),
        "SciPy DIRECT": direct, "Optuna TPE": optuna("TPESampler"), "Optuna CMA-ES": optuna("CmaEsSampler"),
    }  # fmt: skip
    rows = []
    for name in names:
        space = space_of(filters.find(name).params())
        last = max(budgets)
        curves = {  # levelhead's divides its runs into two stages, so each budget is a search of its own
            label: {
                budget: [least_after(search, space, recording, seed, budget)[-1] for seed in SEEDS]
                for budget in budgets
            }
            if search is own
            else {
                budget: [curve[budget - 1] for curve in whole]
                for whole in [[least_after(search, space, recording, seed, last) for seed in SEEDS]]
                for budget in budgets
            }
            for label, search in searches.items()
        }
        best = min(value for one in curves.values() for values in one.values() for value in values)
        for label, one in curves.items():
            row: dict[str, Any] = {"filter": f"{name}, {len(space.ranges)} parameters", "method": label}
            for budget, values in one.items():
                row[str(budget)] = f"{100.0 * (math.exp(statistics.median(values) - best) - 1.0):.1f} %"
            rows.append(row)
    columns = {"filter": "filter", "method": "method"} | {str(one): f"after {one} runs" for one in budgets}
    return Table("Excess over the least error found", columns, rows, "Median of three seeds.")


def seconds_table(recording: lh.Recording, held: lh.Recording, name: str) -> Table:
    """ms for a parameter set by each way."""
    flt = filters.find(name)
    space = space_of(flt.params())
    points = np.random.default_rng(1).random((EACH, len(space.ranges)))
    sets = [space.at(point) for point in points]
    lane_score.lane_root_mean_squares(held, flt, sets[:64])  # compiled before it is timed

    def naive() -> int:
        for params in sets[: EACH // 10]:
            evaluate(recording, lh.fuse(recording, params))
        return EACH // 10

    def lean() -> int:
        for params in sets[: EACH // 10]:
            root_mean_squares(recording, lh.fuse(recording, params))
        return EACH // 10

    def native() -> int:
        score_sets([held], sets, lh.Guard())
        return EACH

    def in_lanes() -> int:
        lane_score.lane_root_mean_squares(held, flt, sets[:64])
        return 64

    rows = []
    ways: dict[str, Callable[[], int]] = {
        "evaluate(fuse(…)), one by one": naive, "the same, errors alone": lean, "native engine, all cores": native,
        "64 lanes, one core": in_lanes,
    }  # fmt: skip
    for label, work in ways.items():
        each = []
        for _ in range(3):
            began = time.perf_counter()
            count = work()
            each.append(1e3 * (time.perf_counter() - began) / count)
        rows.append({"way": label, "ms": min(each), "ratio": rows[0]["ms"] / min(each) if rows else 1.0})
    began = time.perf_counter()
    found = lh.tune_filter(recording, name)
    whole = time.perf_counter() - began
    rows.append({"way": f"tune_filter, all of it: {found.runs} runs a search, 4 searches [s]", "ms": whole})
    columns = {"way": "way", "ms": "ms for a set", "ratio": "times as fast"}
    return Table(f"{name}, {recording.duration:.0f} s at {recording.rate:.0f} Hz", columns, rows, "Least of three.")


def main() -> None:
    """Both tables."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("log", nargs="?", type=Path, help="with truth; without one, a simulated two minutes")
    parser.add_argument("--filters", nargs="+", default=["Mahony", "Kalman", "EKF"])
    parser.add_argument("--budgets", nargs="+", type=int, default=[100, 200, 400])
    given = parser.parse_args()
    warnings.filterwarnings("ignore")  # Optuna's, of parts that may change
    if given.log is None:
        recording = lh.simulate.recording("MPU-6050", "hand", duration=120.0, rate=200.0, mag="HMC5883L", seed=1)
    else:
        recording = load_recording(given.log, True)
    recording = recording[: round(120.0 * recording.rate)]
    held = references([recording], "truth", True, lh.Guard())[0].recording
    tables = [seconds_table(recording, held, given.filters[0]), runs_table(held, given.filters, given.budgets)]
    show(tables, given.json)


if __name__ == "__main__":
    run_script(main)
