"""The least value of a function of a few numbers from 0 to 1: first by a population, then by a simplex.

Differential evolution (R. Storn, K. Price, J. Global Optimization 11, 1997) finds the valley and asks for a whole
generation at a time; the simplex (J. A. Nelder, R. Mead, The Computer Journal 7, 1965) goes down in it. Both are
SciPy's. docs/explanation/tuning-accuracy.md has the numbers of runs beside Optuna's.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from levelhead.errors import require
from levelhead.recording import Array

POPULATION = 16  # at least; more for many parameters
SHARE = 0.5  # of the runs for differential evolution, the rest for the simplex
EDGE = 0.12  # of the range: first edges of the simplex
MIN_CHANGE = 2e-4  # a change of the logarithm of an error that no longer matters

Objective = Callable[[Array], Array]  # (k, n) points -> (k,) values


class Minimum(NamedTuple):
    """The best point (n,), its value, and how many points were tried."""

    point: Array
    value: float
    runs: int


class _Counted:
    """An objective that keeps its best point, and stops a search that has used up its runs."""

    def __init__(self, objective: Objective, progress: Callable[[int], None]) -> None:
        self._objective, self._progress = objective, progress
        self.best, self.value, self.runs = np.empty(0), np.inf, 0

    def __call__(self, points: Array) -> Array:
        points = np.clip(points, 0.0, 1.0)
        values = self._objective(points)
        self.runs += len(points)
        k = int(np.argmin(values))
        if values[k] < self.value:
            self.best, self.value = points[k].copy(), float(values[k])
        self._progress(self.runs)
        return values


def minimise(
    objective: Objective, start: Array, runs: int, seed: int = 0, progress: Callable[[int], None] | None = None
) -> Minimum:
    """The least value that about so many runs find, beginning with ``start`` (n,) and a Sobol sequence.

    Raises:
        LevelheadError: SciPy is not installed.
    """
    require("scipy", "tuning", "scipy")
    from scipy import optimize
    from scipy.stats import qmc

    counted, n = _Counted(objective, progress or (lambda runs: None)), len(start)
    size = max(POPULATION, 1 << int(np.ceil(np.log2(2 * n))))
    size = min(size, 64)
    first = qmc.Sobol(n, rng=seed).random(size)
    first[0] = start
    generations = max(int(SHARE * runs) // size - 1, 0)
    optimize.differential_evolution(
        lambda points: counted(points.T),
        [(0.0, 1.0)] * n,
        init=first,
        maxiter=generations,
        tol=0.0,
        atol=MIN_CHANGE,
        vectorized=True,
        updating="deferred",
        polish=False,
        rng=seed,
    )
    centre = counted.best
    corners = np.vstack([centre, centre + EDGE * np.diag(np.where(centre > 0.5, -1.0, 1.0))])
    optimize.minimize(
        lambda point: float(counted(point[None])[0]),
        centre,
        method="Nelder-Mead",
        bounds=[(0.0, 1.0)] * n,
        options={
            "initial_simplex": corners, "maxfev": max(runs - counted.runs, n + 1), "xatol": 0.01, "fatol": MIN_CHANGE,
        },
    )  # fmt: skip
    return Minimum(counted.best, counted.value, counted.runs)
