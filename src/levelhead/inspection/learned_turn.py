"""The matrix M between gyroscope and gravity as ``ESKF`` learns it: M = 1 − S.

The filter weighs the whole recording: forces average out over seconds, where a segment of ``turn_matrix`` stands for
itself. Its model takes the velocity of a body for white noise. A limb that swings, or a drone that leans into its own
acceleration, has another one. Such a motion moves M with the density that is assumed for the velocity, so a run with a
larger density shows by how much.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from levelhead.engine.batch import Batch
from levelhead.errors import LevelheadError
from levelhead.filters import ESKF
from levelhead.filters.eskf.calibration import covariance_of
from levelhead.filters.eskf.state import GYR_MATRIX, MEAN
from levelhead.guard import Guard
from levelhead.recording import Array, Recording

ROWS = 60_000  # samples, at most: some 0.1 s
START = 0.2  # 1σ of a number of S before a run
LINEAR = 0.3  # largest number of S for which the first order of the filter holds
USUAL = ESKF(scale_start=START, scale_walk=0.0)
TIMES = 5.0  # by which the density of the velocity is larger in the second run
MOVED = 2.0  # 1σ of what forces mimic, in changes of M between the two densities
LOOSE = USUAL._replace(
    velocity_density=TIMES * USUAL.velocity_density, max_velocity_density=TIMES * USUAL.max_velocity_density
)


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
        first = _run(plain, USUAL)
        if not first.is_near:
            return None
        known = np.eye(3) - first.mean.reshape(3, 3)
        better = replace(plain, gyr=plain.gyr @ known.T)
        runs = [_run(better, params) for params in (USUAL, LOOSE)]
    except LevelheadError:
        return None
    if not np.isfinite([one.mean for one in runs]).all():
        return None
    usual, loose = (one.without_prior() for one in runs)
    if not usual.is_near:
        return None
    moved = MOVED * (usual.mean - loose.mean)
    return LearnedTurn((np.eye(3) - usual.mean.reshape(3, 3)) @ known, usual.covariance + np.outer(moved, moved))


class _Learned(NamedTuple):
    """The nine numbers of S and their covariance."""

    mean: Array
    covariance: Array

    @property
    def is_near(self) -> bool:
        """Whether the first order of the filter holds."""
        return bool(np.abs(self.mean).max() < LINEAR)

    def without_prior(self) -> "_Learned":
        """As the recording alone shows them."""
        weights, axes = np.linalg.eigh(np.linalg.inv(self.covariance))
        own = np.maximum(weights - START**-2.0, 1.0)  # never negative by rounding
        return _Learned(axes @ (weights / own * (axes.T @ self.mean)), axes / own @ axes.T)


def _run(recording: Recording, params: ESKF) -> _Learned:
    """S at the end of a run."""
    batch = Batch(recording, params, Guard(), "native", None)
    batch.advance(len(recording))
    memory = batch.carry.run.state.memory
    return _Learned(
        np.array(memory[MEAN + GYR_MATRIX : MEAN + GYR_MATRIX + 9]),
        np.array(covariance_of(memory, GYR_MATRIX, 9)),
    )
