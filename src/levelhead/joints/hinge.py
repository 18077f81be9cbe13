"""A joint of one axis, such as a knee: both sensors agree on its direction at every instant.

With R, S, j, k and δ as in ``axes_fit``,

    e(t) = Rz(δ) R j − S k = 0                                                                                  (1)

**Start.** With a constant δ, Σ|e|² is smallest for the first pair of singular vectors of C(δ) = mean(Rᵀ Rz(δ)ᵀ S), and
the largest singular value is 1 where (1) holds. The three values also state the motion: all are 1 where the joint is
stiff. δ is the best of a grid.

While the axis stays level, −k and δ + 180° are as good. The fit starts from both; (4) helps where there are readings.
"""

import numpy as np

from levelhead.joints.axes_fit import (
    HEADING_GRID,
    AxesFit,
    AxesState,
    Linearisation,
    about_vertical,
    fit_axes,
    tangents,
    thin,
)
from levelhead.joints.centre import Cost
from levelhead.recording import Array

MEDIAN = 1.386  # of χ² of two freedoms


def fit_hinge(t: Array, upper: Array, lower: Array, cost_of_heading: Cost | None = None) -> AxesFit:
    """Axis and relative heading from (n, 3, 3) rotations, sensor to earth, at the stamps ``t`` (s)."""
    rows = thin(t)
    start, spread = _start(upper[rows], lower[rows])
    other = start._replace(lower=-start.lower, heading=start.heading + np.pi)
    fit, _ = fit_axes(t, upper, lower, [start, other], _linearise, MEDIAN, cost_of_heading)
    sign = np.sign(fit.upper[np.argmax(np.abs(fit.upper))])
    return fit._replace(upper=sign * fit.upper, lower=sign * fit.lower, spread=spread)


def _start(upper: Array, lower: Array) -> tuple[AxesState, float]:
    """The best state of a constant δ, and the spread (rad) of the relative rotation."""
    best = (-1.0, AxesState(np.zeros(3), np.zeros(3), 0.0, np.zeros(())), 0.0)
    for angle in HEADING_GRID:
        c, s = np.cos(angle), np.sin(angle)
        back = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        left, values, right = np.linalg.svd(np.einsum("nji,jk,nkl->il", upper, back, lower) / len(upper))
        if values[0] > best[0]:
            best = (float(values[0]), AxesState(left[:, 0], right[0], 0.0, np.asarray(angle)), float(values[1]))
    return best[1], float(np.arccos(np.clip(best[2], -1.0, 1.0)))


def _linearise(upper: Array, lower: Array, state: AxesState, angle: Array) -> Linearisation:
    """(1) and its derivatives."""
    turned = about_vertical(upper @ state.upper, angle)
    by_upper = about_vertical(upper @ tangents(state.upper), angle)
    by_axes = np.concatenate([by_upper, -(lower @ tangents(state.lower))], axis=2)
    by_heading = np.stack([-turned[:, 1], turned[:, 0], np.zeros(len(angle))], axis=1)
    return Linearisation(turned - lower @ state.lower, by_axes, by_heading)


def hinge_angle(fit: AxesFit, upper: Array, lower: Array) -> Array:
    """(n,) rad, continuous: by how much the lower segment is turned about the axis in the upper one.

    A vector across the axis in the lower sensor is turned into the upper sensor, and its angle about the axis there is
    taken; (n, 3, 3) rotations, sensor to earth. The constant is arbitrary.
    """
    across = about_vertical(lower @ tangents(fit.lower)[:, 0], -fit.heading)
    in_upper = np.einsum("nji,nj->ni", upper, across)
    first, second = (in_upper @ tangents(fit.upper)).T
    angle: Array = np.unwrap(np.arctan2(second, first))
    return angle


def hinge_sigma(fit: AxesFit, lower: Array, tilt_variance: Array) -> Array:
    """(n,) rad, 1σ of the angle.

    With a the direction of the axis in the earth frame, errors of tilt count by its horizontal part and that of the
    relative heading by its vertical part: σ² = (a_x² + a_y²) σ_tilt² + a_z² σ_δ².

    Args:
        fit: the hinge.
        lower: (n, 3, 3) rotations of the lower sensor.
        tilt_variance: (n,) rad² about one horizontal axis, the sum of both sensors'.
    """
    axis = lower @ fit.lower
    level = axis[:, 0] ** 2 + axis[:, 1] ** 2
    sigma: Array = np.sqrt(level * tilt_variance + axis[:, 2] ** 2 * fit.sigma_heading**2)
    return sigma
