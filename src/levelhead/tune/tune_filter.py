"""Find a filter's parameters for recordings: with truth, or without it by the smoother or the likelihood."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import get_args

import numpy as np

from levelhead import filters
from levelhead.engine import fuse
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.binding import check_engine
from levelhead.engine.threads import map_in_order
from levelhead.errors import LevelheadError, nearest
from levelhead.evaluate.score import root_mean_squares
from levelhead.filters.parameters import FilterChoice, Params
from levelhead.guard import Guard
from levelhead.recording import Array, Recording
from levelhead.track import Track
from levelhead.tune.error_bands import Bands, advice, error_bands
from levelhead.tune.left_out import FLOOR, STRETCHES, Fold, root_mean_square, stretch_scores
from levelhead.tune.minimise import minimise
from levelhead.tune.parameter_space import Space, space_of
from levelhead.tune.reference_orientation import Kind, Reference, references
from levelhead.tune.score_references import score_references
from levelhead.tune.sweep import Metric, Sweep, set_value
from levelhead.tune.tuning_result import TruthCheck, Tuning, mean_error

EACH = 80  # runs for each parameter searched
DIFFERENT = 1.01  # times the least error: a parameter that changes less stays as it was
CURVE = 13  # values of a parameter over its range, for the flatness of the minimum
PARTS = 4  # of a single log, each left out once
FOLDS = 5  # at most, of several logs

# logs, sets, stretches of each -> (logs, stretches, k, 3) total, tilt and heading error, °
Score = Callable[[Sequence[Reference], Sequence[Params], int], Array]
Split = tuple[str, list[Reference], list[Reference]]  # a part left out: its name, the logs searched, and those left out


def tune_filter(
    recordings: Recording | Sequence[Recording],
    params: FilterChoice,
    names: Sequence[str] = (),
    *,
    metric: Metric | None = None,
    goal: Kind | None = None,
    guard: Guard | None = DEFAULT_GUARD,
    engine: str = "auto",
    runs: int | None = None,
    seed: int = 0,
    cross_validate: bool = True,
    progress: Callable[[float], None] | None = None,
) -> Tuning:
    """Search the parameters of a filter for the smallest error over recordings.

    Args:
        recordings: one or several, which count alike (the geometric mean of their errors is minimised).
        params: the filter: Params object (the start of the search, and the values of the others), class or name.
        names: parameters to search, each perhaps with its range: "kp", "kp=0.01:10"; none: all that are usually tuned.
        metric: "total", "tilt" or "heading" RMS, the best constant heading removed; None: total where every recording
            has a truth that is the goal, or a magnetometer that the filter follows, else tilt.
        goal: "truth": the least error; "smoother": the least distance from the smoother's orientation; "likelihood": of
            the innovations (``innovations``); None: the truth where a recording has one, else the smoother.
        guard: as for ``fuse``.
        engine: as for ``fuse_parameter_sets``.
        runs: of the filter, for one search; None: 80 for each parameter.
        seed: of the search.
        cross_validate: search again without each log (of more than five: each fifth of them; of one: each quarter)
            and score the parts left out; without, the gain is that on the logs of the search.
        progress: called with the fraction done, 0 to 1.

    Raises:
        LevelheadError: nothing to tune, no such parameter, or a recording that cannot serve as a reference.
    """
    given = [recordings] if isinstance(recordings, Recording) else list(recordings)
    if not given:
        raise LevelheadError("there is no recording to tune on; give one at least")
    space = check_wishes(params, names, metric, goal, runs)
    kinds: list[Kind] = [goal or ("smoother" if one.truth is None else "truth") for one in given]
    heading = all(
        counts_heading(space.params, kind, one.mag is not None) for one, kind in zip(given, kinds, strict=True)
    )
    chosen: Metric = metric or ("total" if heading else "tilt")
    check_engine(engine)
    held = references(given, goal, chosen != "tilt", guard, engine)
    return search_references(
        space, chosen, held, given, guard=guard, engine=engine, runs=runs, seed=seed, cross_validate=cross_validate,
        progress=progress,
    )  # fmt: skip


def counts_heading(params: Params, kind: Kind, has_field: bool) -> bool:
    """Whether a reference of this kind shows heading: the truth does, else a field that the filter follows."""
    flt = filters.of(params)
    return ("gyr" in flt.uses and kind == "truth") or ("heading" in flt.estimates and has_field)


def check_wishes(
    params: FilterChoice, names: Sequence[str], metric: Metric | None, goal: Kind | None, runs: int | None
) -> Space:
    """The plan of ``tune_filter``'s search.

    Raises:
        LevelheadError: a wish that cannot be met.
    """
    if metric is not None and metric not in get_args(Metric):
        raise LevelheadError(f"'{metric}' is not an error to minimise; {nearest(metric, get_args(Metric))}")
    if goal is not None and goal not in get_args(Kind):
        raise LevelheadError(f"'{goal}' is not a goal; {nearest(goal, get_args(Kind))}")
    if goal == "likelihood" and metric == "heading":
        raise LevelheadError("the likelihood is that of tilt and heading together, or of tilt; expected total or tilt")
    if runs is not None and runs < 2:
        raise LevelheadError(f"{runs} runs are not a search; expected 2 or more, better {EACH} for each parameter")
    return space_of(filters.resolve(params), names)


def search_references(
    space: Space,
    metric: Metric,
    held: list[Reference],
    given: Sequence[Recording],
    *,
    guard: Guard | None,
    engine: str = "auto",
    runs: int | None = None,
    seed: int = 0,
    cross_validate: bool = True,
    progress: Callable[[float], None] | None = None,
    score: Score | None = None,
) -> Tuning:
    """``tune_filter`` over references that are made already; ``given`` are their recordings as they were.

    With ``score``, which may ask other processes, only the first reference needs its whole recording.
    """
    search = _Search(space, metric, guard, engine, runs or EACH * len(space.ranges), seed, progress, score)
    return search.run(given, held, _folds(held) if cross_validate else [])


class _Search:
    """The searches of one ``tune_filter``: over all recordings, and without each of its parts."""

    def __init__(
        self, space: Space, metric: Metric, guard: Guard | None, engine: str, runs: int, seed: int,
        progress: Callable[[float], None] | None, score: Score | None,
    ) -> None:  # fmt: skip
        self.space, self.metric, self.guard, self.engine = space, metric, guard, engine
        self.runs, self.seed, self._progress, self._score = runs, seed, progress, score
        self._column = get_args(Metric).index(metric)
        self._whole, self._done = 1, list[int]()  # runs of the filter: expected in all, and done by each search

    def run(self, given: Sequence[Recording], held: list[Reference], folds: Sequence[Split]) -> Tuning:
        """All of it."""
        searches = [held, *(train for _, train, _ in folds)]
        self._whole = self.runs * sum(map(len, searches))
        self._done = [0] * len(searches)
        (best, runs), *others = map_in_order(self._find, enumerate(searches))
        tested = [
            self._fold(name, test, found, len(held)) for (name, _, test), (found, _) in zip(folds, others, strict=True)
        ]
        before, after = self._errors(held, [self.space.params, best]).T
        first = held[0].recording
        bands = self._bands(first, self.space.params), self._bands(first, best)
        tried = {
            (one.name, factor): self._bands(first, set_value(best, one.name, value))
            for one in self.space.ranges
            for factor in (2.0, 0.5)
            if one.param.allows(value := factor * getattr(best, one.name)) and value != 0.0
        }
        curves = tuple(self._curve(held, best, k) for k in range(len(self.space.ranges)))
        check = self._check(given, held, best)
        return Tuning(
            self.space, best, self.metric, tuple(held), before, after, curves, tuple(tested), bands,
            tuple(advice(bands[1], tried)), check, self.guard, runs,
        )  # fmt: skip

    def _fold(self, name: str, test: Sequence[Reference], found: Params, logs: int) -> Fold:
        """The errors on the parts left out of ``logs`` logs."""
        sets = [self.space.params, found]
        count = math.ceil(STRETCHES / max(logs, PARTS))
        if self._score is not None:
            scores = self._score(test, sets, count)
        else:
            scores = np.array([stretch_scores(one, sets, count, self.guard, self.engine) for one in test])
        whole = root_mean_square(scores.swapaxes(0, 1))
        before, after = (mean_error(one) for one in whole[:, :, self._column].T)
        return Fold(name, before, after, scores.reshape(-1, *scores.shape[2:]))

    def _find(self, numbered: tuple[int, Sequence[Reference]]) -> tuple[Params, int]:
        """The best parameters for some recordings, and how many runs that took."""
        number, held = numbered

        def objective(points: Array) -> Array:
            errors = self._errors(held, [self.space.at(point) for point in points])
            found: Array = np.log(np.maximum(errors, FLOOR)).mean(axis=0)
            return found

        def report(runs: int) -> None:
            self._done[number] = runs * len(held)
            if self._progress is not None:
                self._progress(min(sum(self._done) / self._whole, 1.0))

        minimum = minimise(objective, self.space.start, self.runs, self.seed, report)
        return self._simplify(held, self.space.at(minimum.point)), minimum.runs

    def _simplify(self, held: Sequence[Reference], best: Params) -> Params:
        """The same with each parameter as it was at the start that does not matter."""
        limit = DIFFERENT * mean_error(self._errors(held, [best])[:, 0])
        while changed := [name for name in self.space.names if getattr(best, name) != getattr(self.space.params, name)]:
            tried = [set_value(best, name, getattr(self.space.params, name)) for name in changed]
            errors = [mean_error(one) for one in self._errors(held, tried).T]
            least = int(np.argmin(errors))
            if errors[least] > limit:
                break
            best = tried[least]
        return best

    def _scores(self, held: Sequence[Reference], sets: Sequence[Params]) -> Array:
        """(logs, k, 3) total, tilt and heading error of each set, °."""
        if self._score is not None:
            return self._score(held, sets, 1)[:, 0]
        return score_references(held, sets, self.guard, self.engine)

    def _errors(self, held: Sequence[Reference], sets: Sequence[Params]) -> Array:
        """(logs, k) the error that is minimised, °."""
        errors: Array = self._scores(held, sets)[:, :, self._column]
        return errors

    def _curve(self, held: Sequence[Reference], best: Params, index: int) -> Sweep:
        """The error over one parameter, the others at their best."""
        one = self.space.ranges[index]
        grid = {one.at(share) for share in np.linspace(0.0, 1.0, CURVE).tolist()}
        values = sorted(grid | {getattr(best, one.name), getattr(self.space.params, one.name)})
        scores = self._scores(held, [set_value(best, one.name, value) for value in values])
        total, tilt, heading = np.exp(np.log(np.maximum(scores, FLOOR)).mean(axis=0)).T
        return Sweep(best, one.name, one.param, np.array(values), total, tilt, heading, self.metric)

    def _bands(self, recording: Recording, params: Params) -> Bands:
        track = self._track(recording, params)
        return error_bands(recording, track, self.metric == "tilt")

    def _track(self, recording: Recording, params: Params) -> Track:
        return fuse(recording, params, guard=self.guard, engine=self.engine)

    def _check(self, given: Sequence[Recording], held: Sequence[Reference], best: Params) -> TruthCheck | None:
        """Errors against the truth of parameters found without it."""
        rows = []
        for recording, one in zip(given, held, strict=True):
            smoothed = one.smoothed
            if recording.truth is None or smoothed is None:
                continue
            apart = replace(recording, truth=replace(recording.truth, north=False))  # as the references are compared
            tracks = [smoothed, *(self._track(recording, params) for params in (self.space.params, best))]
            rows.append([root_mean_squares(apart, track)[self._column] for track in tracks])
        return TruthCheck(*np.array(rows).T) if rows else None


def _folds(held: Sequence[Reference]) -> list[Split]:
    """Each fold: its name, the searched parts, and the part left out."""
    if len(held) > 1:
        count = min(len(held), FOLDS)
        groups = [list(range(k, len(held), count)) for k in range(count)]
        return [
            (", ".join(held[i].name for i in group), [one for i, one in enumerate(held) if i not in group],
             [held[i] for i in group])
            for group in groups
        ]  # fmt: skip
    only = held[0]
    truth = only.recording.truth
    assert truth is not None
    count = int(np.count_nonzero(~np.isnan(truth.quat[:, 0])))
    ends = [count * k // PARTS for k in range(PARTS + 1)]
    parts = [slice(ends[k], ends[k + 1]) for k in range(PARTS)]
    return [(f"quarter {k + 1}", [only.part(rows, inside=False)], [only.alone(rows)]) for k, rows in enumerate(parts)]
