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
    by_upper = np.stack([about_vertical(upper @ column, angle) for column in tangents(state.upper).T], axis=2)
    by_axes = np.concatenate([by_upper, -(lower @ tangents(state.lower))], axis=2)
    by_heading = np.stack([-turned[:, 1], turned[:, 0], np.zeros(len(angle))], axis=1)
    return Linearisation(turned - lower @ state.lower, by_axes, by_heading)
