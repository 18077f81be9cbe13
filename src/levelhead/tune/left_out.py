"""The errors on the parts of recordings that a search left out, and whether they show a gain.

A part is a whole recording, or a whole stretch of the only one, at whose first sample the filter starts anew. Its
errors are those of ``stretches``: the logarithm d of the ratio of errors, found over start, is a sample of the gain.
The interval of the mean of d is that of Student's t (Student, The probable error of a mean, Biometrika 6, 1908).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from levelhead.engine import fuse
from levelhead.evaluate.score import error_angles, rms, scored_rows
from levelhead.filters.parameters import Params
from levelhead.guard import Guard
from levelhead.recording import Array
from levelhead.tune.reference_orientation import Reference

FLOOR = 0.01  # °: smaller errors count as this one
STRETCHES = 12  # at least, over all parts
PROBABILITY = 0.975  # one-sided, of the interval
MAX_LOG_RATIO = 20.0  # of a log ratio: more is as bad
MEASURES = ("total", "tilt", "heading")


class Fold(NamedTuple):
    """A part that was left out.

    Attributes:
        name: of the part.
        before: its error with the parameters at the start, °.
        after: its error with those found without it, °.
        scores: (k, 2, 3) total, tilt and heading error of each stretch, before and after, °.
    """

    name: str
    before: float
    after: float
    scores: Array

    def log_ratios(self, column: int) -> Array:
        """(k,) log of after over before: of total (0), tilt (1) or heading (2)."""
        errors = np.log(np.maximum(self.scores[:, :, column], FLOOR))
        ratios: Array = errors[:, 1] - errors[:, 0]
        return ratios


def stretch_scores(
    held: Reference, sets: Sequence[Params], count: int, guard: Guard | None, engine: str = "auto"
) -> Array:
    """(count, k, 3) total, tilt and heading error of each parameter set in each of ``count`` stretches, °."""
    scores = np.empty((count, len(sets), 3))
    for k, params in enumerate(sets):
        track = fuse(held.recording, params, guard=guard, engine=engine)
        if held.innovations is not None:
            place = np.arange(len(held.innovations.rows)) * count // max(1, len(held.innovations.rows))
            scores[:, k] = [held.innovations.part(place == i).scales(track) for i in range(count)]
            continue
        assert held.recording.truth is not None
        parts = np.array_split(np.flatnonzero(scored_rows(held.recording.truth)), count)
        errors = error_angles(held.recording, track)
        scores[:, k] = [[math.degrees(rms(values[rows])) for values in errors] for rows in parts]
    return scores


def root_mean_square(scores: Array) -> Array:
    """(k, 3) errors over all stretches (count, k, 3), which are of one length."""
    found: Array = np.sqrt(np.mean(scores**2, axis=0))
    return found


class ErrorGain(NamedTuple):
    """The share of the error that is gone on the parts left out, and its interval of 95 %; below 0: a loss."""

    share: float
    low: float
    high: float


class ErrorLoss(NamedTuple):
    """A part that was left out, and its larger error: its name, the measure, and its error before and after, °."""

    part: str
    measure: str
    before: float
    after: float


def gain(folds: Sequence[Fold], column: int) -> ErrorGain:
    """The gain over all parts; its σ is the larger of that between stretches and that between parts.

    Stretches of one part are not independent of each other, and parts are few: neither σ alone is enough.
    """
    from scipy.special import stdtrit

    parts = [one.log_ratios(column) for one in folds]
    every = np.concatenate(parts)
    middle, degrees = float(every.mean()), len(every) - 1
    sigma = float(every.std(ddof=1)) / math.sqrt(len(every)) if degrees else math.inf
    if len(parts) > 1:
        sigma = max(sigma, float(np.std([one.mean() for one in parts], ddof=1)) / math.sqrt(len(parts)))
    reach = float(stdtrit(max(degrees, 1), PROBABILITY)) * sigma
    return ErrorGain(
        1.0 - math.exp(middle), 1.0 - math.exp(min(middle + reach, MAX_LOG_RATIO)), 1.0 - math.exp(middle - reach)
    )


def losses(folds: Sequence[Fold], columns: Sequence[int]) -> list[ErrorLoss]:
    """Parts on which one of the errors is worse by more than 1σ of its mean over stretches."""
    found = []
    for column in columns:
        scatter = float(np.concatenate([one.log_ratios(column) for one in folds]).std())
        for one in folds:
            ratios = one.log_ratios(column)
            noise = float(ratios.std(ddof=1)) / math.sqrt(len(ratios)) if len(ratios) > 1 else scatter
            if ratios.mean() > noise:
                before, after = root_mean_square(one.scores)[:, column].tolist()
                found.append(ErrorLoss(one.name, MEASURES[column], before, after))
    return found
