"""Robust least squares with a prior, and the covariance of what was found."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from levelhead.recording import Array

ROBUST = 2.5  # σ from which a residual counts by its size and no more by its square (Huber)


class Solution(NamedTuple):
    """What was found.

    Attributes:
        value: (p,) parameters.
        covariance: (p, p) from the Jacobian, with the prior; larger where residuals are larger than their σ.
        scale: by how much they are, at least 1.
    """

    value: Array
    covariance: Array
    scale: float

    @property
    def sigma(self) -> Array:
        """(p,) 1σ."""
        return np.sqrt(np.diag(self.covariance))


def solve(residuals: Callable[[Array], Array], start: Array, prior: Array) -> Solution:
    """The parameters with the least robust sum of squares.

    Args:
        residuals: (p,) parameters -> (n,) residuals over their σ.
        start: (p,) where to begin; also the mean of the prior.
        prior: (p,) 1σ of each parameter before any measurement, so that there is a solution in any case.
    """
    from scipy.optimize import least_squares

    scale, value = 1.0, start
    for _ in range(2):

        def weigh(parameters: Array, by: float = scale) -> Array:
            return np.concatenate([residuals(parameters) / by, (parameters - start) / prior])

        found = least_squares(weigh, value, loss="huber", f_scale=ROBUST, x_scale=prior)
        value = found.x
        left = residuals(value)
        free = max(1, len(left) - len(start))
        robust = float(np.sqrt(np.minimum(left**2, (ROBUST * 1.5 * scale) ** 2).sum() / free))
        if len(left) <= len(start) or robust <= 1.0:
            break
        scale = robust
    return Solution(value, np.linalg.inv(found.jac.T @ found.jac), scale)
