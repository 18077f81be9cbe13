"""States of ``ESKF`` at the end of a run, with the covariance that the recording alone gives them.

The model of the filter takes the velocity of a body for white noise. A limb that swings, or a drone that leans into
its own acceleration, has another one. Such a motion moves the states with the density that is assumed for the
velocity, so a run with a larger density shows by how much.
"""

from typing import NamedTuple

import numpy as np

from levelhead.engine.batch import Batch
from levelhead.filters import ESKF
from levelhead.filters.eskf.calibration import covariance_of
from levelhead.filters.eskf.state import MEAN
from levelhead.guard import Guard
from levelhead.recording import Array, Recording

TIMES = 5.0  # by which the density of the velocity is larger in the second run
LEAST = 1e-3  # of the weight of the prior: the least that a recording shows
LINEAR = 0.3  # largest number of S for which the first order of the filter holds
MOVED = 2.0  # 1σ of the share that forces mimic, in changes of the states between the two densities


class Learned(NamedTuple):
    """States in their own units, (n,), and their covariance, (n, n)."""

    mean: Array
    covariance: Array

    def without_prior(self, sigma: Array) -> "Learned":
        """As the recording alone shows them; the prior was independent, of 1σ ``sigma`` (n,)."""
        weights, axes = np.linalg.eigh(np.linalg.inv(self.covariance / np.outer(sigma, sigma)))
        own = np.maximum(weights - 1.0, LEAST)  # never negative by rounding
        mean = axes @ (weights / own * (axes.T @ (self.mean / sigma)))
        return Learned(sigma * mean, (axes / own) @ axes.T * np.outer(sigma, sigma))

    def with_prior(self, sigma: Array) -> Array:
        """The numbers beside such a prior, (n,): a number that is not shown is near 0."""
        known = np.linalg.inv(self.covariance)
        made: Array = np.linalg.solve(known + np.diag(sigma**-2.0), known @ self.mean)
        return made


def learn(recording: Recording, params: ESKF, state: int, count: int) -> Learned:
    """``count`` states from ``state`` on, at the end of a run by the native engine.

    Raises:
        LevelheadError: there is no native engine.
    """
    batch = Batch(recording, params, Guard(), "native", None)
    batch.advance(len(recording))
    memory = batch.carry.run.state.memory
    return Learned(np.array(memory[MEAN + state : MEAN + state + count]), np.array(covariance_of(memory, state, count)))


def learn_beside_forces(recording: Recording, params: ESKF, state: int, count: int, sigma: Array) -> Learned | None:
    """The same without the prior of 1σ ``sigma``; by two runs, whose difference widens the covariance.

    None where a run ends without a number.

    Raises:
        LevelheadError: there is no native engine.
    """
    loose = params._replace(
        velocity_density=TIMES * params.velocity_density, max_velocity_density=TIMES * params.max_velocity_density
    )
    runs = [learn(recording, one, state, count) for one in (params, loose)]
    if not np.isfinite([one.mean for one in runs]).all():
        return None
    first, second = (one.without_prior(sigma) for one in runs)
    moved = MOVED * (first.mean - second.mean)
    return first._replace(covariance=first.covariance + np.outer(moved, moved))


def is_near(numbers: Array) -> bool:
    """Whether M = 1 − S is near enough to 1 for the first order of the filter; ``numbers`` are those of S."""
    return bool(np.abs(numbers).max() < LINEAR)
