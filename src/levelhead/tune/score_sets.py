"""The errors of many parameter sets of one filter: side by side in lanes, or run by run on all cores."""

from collections.abc import Callable, Sequence

import numpy as np

from levelhead import filters
from levelhead.engine import fuse
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.parallel import engine_for_sets, lanes_are_faster
from levelhead.engine.threads import map_in_order
from levelhead.evaluate.score import root_mean_squares
from levelhead.filters.parameters import Params
from levelhead.guard import Guard
from levelhead.recording import Array, Recording
from levelhead.tune import lane_score

WORTH_COMPILING = 1_000_000  # samples times sets from which compiling lanes, some seconds once, is done sooner


def score_sets(
    recordings: Sequence[Recording],
    parameter_sets: Sequence[Params],
    guard: Guard | None,
    engine: str = "auto",
    progress: Callable[[float], None] | None = None,
) -> Array:
    """RMS of total, tilt and heading error in degrees: (recordings, sets, 3).

    Args:
        recordings: with truth.
        parameter_sets: of one filter.
        guard: as for ``fuse``; with another one than the default the sets are tried one by one.
        engine: as for ``fuse_parameter_sets``.
        progress: called with the fraction done, 0 to 1.
    """
    flt = filters.of(parameter_sets[0])
    samples = sum(map(len, recordings)) * len(parameter_sets)
    chosen = engine_for_sets(engine, samples, flt, guard is not None)
    worth = engine == "compiled" or samples >= WORTH_COMPILING
    if guard == DEFAULT_GUARD and chosen == "compiled" and worth and lanes_are_faster(flt, len(parameter_sets)):
        return _score_side_by_side(recordings, parameter_sets, progress)
    pairs = [(recording, params) for recording in recordings for params in parameter_sets]

    def work(pair: tuple[Recording, Params]) -> tuple[float, float, float]:
        recording, params = pair
        return root_mean_squares(recording, fuse(recording, params, guard=guard, engine=chosen))

    scores = []
    for score in map_in_order(work, pairs, 1 if chosen == "python" else None):
        scores.append(score)
        if progress is not None:
            progress(len(scores) / len(pairs))
    return np.array(scores).reshape(len(recordings), len(parameter_sets), 3)


def _score_side_by_side(
    recordings: Sequence[Recording],
    parameter_sets: Sequence[Params],
    progress: Callable[[float], None] | None,
) -> Array:
    flt, scores = filters.of(parameter_sets[0]), []
    for done, recording in enumerate(recordings):

        def report(part: float, done: int = done) -> None:
            if progress is not None:
                progress((done + part) / len(recordings))

        scores.append(lane_score.lane_root_mean_squares(recording, flt, parameter_sets, report))
    return np.array(scores)
