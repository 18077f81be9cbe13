"""Robust least squares with a prior, and the covariance of the estimate."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from levelhead.recording import Array

ROBUST = 2.5  # σ from which a residual counts by its size and no more by its square (Huber)
DOUBT_WEIGHT = 0.3  # measurements that the scale of the residuals before any is worth


class Solution(NamedTuple):
    """The result of the fit.

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


def solve(residuals: Callable[[Array], Array], start: Array, prior: Array, doubt: float = 1.0) -> Solution:
    """The parameters with the least robust sum of squares.

    The scale s of the residuals is found with them. It has an inverse gamma prior of ``DOUBT_WEIGHT`` measurements with
    the scale ``doubt``: s² = (Σ r² + w d²)/(n − p + w), where p is the number of parameters that are determined.

    Args:
        residuals: (p,) parameters -> (n,) residuals over their σ.
        start: (p,) where to begin; also the mean of the prior.
        prior: (p,) 1σ of each parameter before any measurement, so that there is a solution in any case.
        doubt: scale of the residuals before any measurement.
    """
    from scipy.optimize import least_squares

    scale, value = max(1.0, doubt), start
    covariance = np.diag(prior**2)
    for _ in range(3):

        def weigh(parameters: Array, by: float = scale) -> Array:
            return np.concatenate([residuals(parameters) / by, (parameters - start) / prior])

        found = least_squares(weigh, value, loss="huber", f_scale=ROBUST, x_scale=prior)
        value, covariance = found.x, np.linalg.inv(found.jac.T @ found.jac)
        left = residuals(value)
        free = max(0.0, len(left) - float((1.0 - np.diag(covariance) / prior**2).sum()))
        total = float(np.minimum(left**2, (ROBUST * 1.5 * scale) ** 2).sum())
        last, scale = scale, max(1.0, float(np.sqrt((total + DOUBT_WEIGHT * doubt**2) / (free + DOUBT_WEIGHT))))
        if abs(scale - last) < 0.1 * last:
            break
    return Solution(value, covariance, scale)
