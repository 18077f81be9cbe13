"""A joint of two axes, such as an elbow: one axis is fixed to the upper segment, the other to the lower one.

With j the first axis in the upper sensor and k the second one in the lower sensor, R, S and δ as in ``axes_fit``, the
angle between both axes is constant by the joint's build (D. Laidig, P. Müller, T. Seel, Current Directions in
Biomedical Engineering 3(2), 2017):

    e(t) = arcsin((Rz(δ) R j) · (S k)) − β = 0                                                                  (2)

**Start.** For a constant δ and a given j, the variance of sin β over cos² β is smallest for a k of a generalised
eigenvalue problem: with r = Sᵀ Rz(δ) R j, kᵀ cov(r) k over kᵀ (1 − r̄ r̄ᵀ) k. (Without cos² β two axes that are one
would always be best, because the sine does not change there.) j and δ are the best of a grid.
"""

import numpy as np
from numpy.typing import NDArray

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
from levelhead.recording import Array

START_ROWS = 2_000  # of the search
DIRECTIONS = 400  # of j, half a sphere
STARTS = 8
MEDIAN = 0.455  # of χ² of one freedom
LEAST_COSINE = 0.05  # of β: nearer to ±90° both axes are one
WIDEST = np.radians(60.0)  # β of a start


def fit_two_axes(t: Array, upper: Array, lower: Array) -> AxesFit:
    """Both axes and the relative heading from (n, 3, 3) rotations, sensor to earth, at the stamps ``t`` (s)."""
    rows = thin(t)
    fit, relative = fit_axes(t, upper, lower, _starts(upper[rows], lower[rows]), _linearise, MEDIAN)
    middle = np.linalg.svd(relative.mean(axis=0))[1][1]
    j, k = (axis * np.sign(axis[np.argmax(np.abs(axis))]) for axis in (fit.upper, fit.lower))
    return fit._replace(upper=j, lower=k, spread=float(np.arccos(np.clip(middle, -1.0, 1.0))))


def _starts(upper: Array, lower: Array) -> list[AxesState]:
    """The best states of a grid over δ and j."""
    rows = slice(None, None, -(-len(upper) // START_ROWS))
    directions = _half_sphere(DIRECTIONS)
    found: list[tuple[float, AxesState]] = []
    for angle in HEADING_GRID:
        turned = about_vertical(upper[rows], np.full(len(upper[rows]), angle))
        relative = np.einsum("nji,njk->nik", turned, lower[rows])  # lower sensor to upper sensor
        mean = relative.mean(axis=0)
        fourth = np.einsum("nab,ncd->abcd", relative, relative) / len(relative)
        fourth -= np.einsum("ab,cd->abcd", mean, mean)
        scatter = np.einsum("abcd,ma,mc->mbd", fourth, directions, directions)
        root = _inverse_root(directions @ mean)
        values, vectors = np.linalg.eigh(root @ scatter @ root)
        axes = np.einsum("mab,mb->ma", root, vectors[:, :, 0])
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        constants = np.arcsin(np.clip(np.sum(directions @ mean * axes, axis=1), -1.0, 1.0))
        scores = np.where(np.abs(constants) < WIDEST, values[:, 0], np.inf)
        best = int(np.argmin(scores))
        start = AxesState(directions[best], axes[best], float(constants[best]), np.asarray(angle))
        found.append((float(scores[best]), start))
    found.sort(key=lambda one: one[0])
    return [state for _, state in found[:STARTS]]


def _inverse_root(mean: Array) -> Array:
    """(m, 3, 3) (1 − r̄ r̄ᵀ)^(−1/2) of (m, 3) vectors no longer than 1."""
    square = np.sum(mean**2, axis=1)
    stretch = 1.0 / np.sqrt(np.maximum(1.0 - square, LEAST_COSINE**2)) - 1.0
    outer = mean[:, :, None] * mean[:, None, :]
    root: Array = np.eye(3) + (stretch / np.maximum(square, 1e-12))[:, None, None] * outer
    return root


def _half_sphere(count: int) -> Array:
    """(count, 3) unit vectors spread evenly over half a sphere by the golden angle."""
    z = (np.arange(count) + 0.5) / count
    angle = np.pi * (3.0 - 5.0**0.5) * np.arange(count)
    level = np.sqrt(1.0 - z * z)
    return np.stack([level * np.cos(angle), level * np.sin(angle), z], axis=1)


def _linearise(upper: Array, lower: Array, state: AxesState, angle: Array) -> Linearisation:
    """(2) and its derivatives."""
    first, second = about_vertical(upper @ state.upper, angle), lower @ state.lower
    sine = np.clip(np.sum(first * second, axis=1), -1.0, 1.0)
    by_upper = [np.sum(about_vertical(upper @ column, angle) * second, axis=1) for column in tangents(state.upper).T]
    by_lower = [np.sum(first * (lower @ column), axis=1) for column in tangents(state.lower).T]
    by_sine: NDArray[np.float64] = 1.0 / np.maximum(np.sqrt(1.0 - sine**2), LEAST_COSINE)
    by_axes = np.stack([*by_upper, *by_lower, -1.0 / by_sine], axis=1) * by_sine[:, None]
    by_heading = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) * by_sine
    return Linearisation((np.arcsin(sine) - state.constant)[:, None], by_axes[:, None, :], by_heading[:, None])
