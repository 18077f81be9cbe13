"""The matrix M between gyroscope and gravity as ``ESKF`` learns it: M = 1 − S.

The filter weighs the whole recording: forces average out over seconds, where a segment of ``turn_matrix`` stands for
itself.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.filters import ESKF
from levelhead.filters.eskf.state import GYR_MATRIX
from levelhead.inspection.learned import is_near, learn, learn_beside_forces
from levelhead.recording import Array, Recording

ROWS = 60_000  # samples, at most: some 0.1 s
START = 0.2  # 1σ of a number of S before a run
WIDE = ESKF(scale_start=START, scale_walk=0.0)


class LearnedTurn(NamedTuple):
    """M, (3, 3), and the covariance of its nine numbers, (9, 9)."""

    matrix: Array
    covariance: Array


def learn_turn(recording: Recording) -> LearnedTurn | None:
    """M of gyroscope and accelerometer, from the start of a recording.

    A first run finds M roughly, K. The two runs that differ in density start from it: M = (1 − S) K. The covariance is
    that of S: K is near 1. None where M is too far from 1 for the filter, and where there is no native engine: the
    others would take longer than the rest of the inspection.
    """
    plain = replace(recording[:ROWS], mag=None)
    try:
        first = learn(plain, WIDE, GYR_MATRIX, 9).mean
        if not is_near(first):
            return None
        known = np.eye(3) - first.reshape(3, 3)
        found = learn_beside_forces(replace(plain, gyr=plain.gyr @ known.T), WIDE, GYR_MATRIX, 9, np.full(9, START))
    except LevelheadError:
        return None
    if found is None:
        return None
    matrix = (np.eye(3) - found.mean.reshape(3, 3)) @ known
    whole = found._replace(mean=(np.eye(3) - matrix).ravel())
    return LearnedTurn(matrix, found.covariance) if is_near(whole.with_prior(np.full(9, START))) else None
