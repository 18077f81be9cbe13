"""A joint of two axes, such as an elbow: one axis is fixed to the upper segment, the other to the lower one.

With j the first axis in the upper sensor and k the second one in the lower sensor, R, S and δ as in ``hinge``, the
angle between both axes stays what the joint's build makes it (D. Laidig, P. Müller, T. Seel, Current Directions in
Biomedical Engineering 3(2), 2017):

    e(t) = (Rz(δ) R j) · (S k) − sin β = 0                                                                      (2)

**Start.** For a constant δ and a given j, the best k is the direction in which Sᵀ Rz(δ) R j varies least: an
eigenvector of its covariance, which is quadratic in j. j and δ are the best of a grid.

**Refinement.** As in ``hinge``: Gauss-Newton over j, k (two angles each), sin β and δ at knots.
"""

import numpy as np

from levelhead.joints.hinge import (
    CAUCHY,
    CONVERGED,
    CORRELATION,
    HEADING_GRID,
    ITERATIONS,
    MAX_ROWS,
    MIN_RESIDUAL,
    HingeFit,
    Knots,
    about_vertical,
    add_walk,
    interpolate_heading,
    knots_between,
    tangents,
    turn_axis,
)
from levelhead.recording import Array

START_ROWS = 2_000  # of the search
DIRECTIONS = 400  # of j, half a sphere
STARTS = 8
PARAMETERS = 5  # before the knots


def fit_two_axes(t: Array, upper: Array, lower: Array) -> HingeFit:
    """Both axes and the relative heading from (n, 3, 3) rotations, sensor to earth, at the stamps ``t`` (s)."""
    rows = slice(None, None, -(-len(t) // MAX_ROWS))
    when, first, second = t[rows], upper[rows], lower[rows]
    knots = knots_between(when, when[0], when[-1])
    fits = [_refine(when, first, second, start, knots) for start in _starts(first, second)]
    _, j, k, _, heading, covariance, residual = min(fits, key=lambda fit: fit[0])
    j, k = (axis * np.sign(axis[np.argmax(np.abs(axis))]) for axis in (j, k))
    values, variance = interpolate_heading(knots_between(t, when[0], when[-1]), heading, covariance[5:, 5:])
    relative = np.einsum("nji,njk->nik", about_vertical_frames(first, np.interp(when, t, values)), second)
    middle = np.linalg.svd(relative.mean(axis=0))[1]
    return HingeFit(
        upper=j,
        lower=k,
        sigma_upper=float(np.sqrt(covariance[0, 0] + covariance[1, 1])),
        sigma_lower=float(np.sqrt(covariance[2, 2] + covariance[3, 3])),
        heading=values,
        sigma_heading=np.sqrt(variance),
        residual=residual,
        spread=float(np.arccos(np.clip(middle[0], -1.0, 1.0))),
    )


def about_vertical_frames(frames: Array, angle: Array) -> Array:
    """(n, 3, 3) rotations, sensor to earth, turned by (n,) angles in rad about the vertical."""
    columns = [about_vertical(frames[:, :, i], angle) for i in range(3)]
    return np.stack(columns, axis=2)


def _starts(upper: Array, lower: Array) -> list[tuple[float, Array, Array, float]]:
    """The best (δ in rad, j, k, sin β) of a grid over δ and j."""
    rows = slice(None, None, -(-len(upper) // START_ROWS))
    directions = _half_sphere(DIRECTIONS)
    found: list[tuple[float, float, Array, Array, float]] = []
    for angle in HEADING_GRID:
        turned = about_vertical_frames(upper[rows], np.full(len(upper[rows]), angle))
        relative = np.einsum("nji,njk->nik", turned, lower[rows])  # lower sensor to upper sensor
        mean = relative.mean(axis=0)
        fourth = np.einsum("nab,ncd->abcd", relative, relative) / len(relative)
        fourth -= np.einsum("ab,cd->abcd", mean, mean)
        scatter = np.einsum("abcd,ma,mc->mbd", fourth, directions, directions)
        values, vectors = np.linalg.eigh(scatter)
        best = int(np.argmin(values[:, 0]))
        j, k = directions[best], vectors[best, :, 0]
        found.append((float(values[best, 0]), float(angle), j, k, float(j @ mean @ k)))
    found.sort(key=lambda one: one[0])
    return [one[1:] for one in found[:STARTS]]


def _half_sphere(count: int) -> Array:
    """(count, 3) unit vectors spread evenly over half a sphere by the golden angle."""
    z = (np.arange(count) + 0.5) / count
    angle = np.pi * (3.0 - 5.0**0.5) * np.arange(count)
    level = np.sqrt(1.0 - z * z)
    return np.stack([level * np.cos(angle), level * np.sin(angle), z], axis=1)


def _refine(
    t: Array, upper: Array, lower: Array, start: tuple[float, Array, Array, float], knots: Knots
) -> tuple[float, Array, Array, float, Array, Array, float]:
    """Cost, j, k, sin β, δ at the knots, covariance of all, and the RMS of (2) in rad, from a start."""
    angle, j, k, sine = start
    heading = np.full(knots.size, angle)
    for _ in range(ITERATIONS):
        normal, gradient, cost, residual = _normal_equations(t, upper, lower, j, k, sine, heading, knots)
        change = np.asarray(np.linalg.solve(normal, gradient), np.float64)
        limit = min(1.0, 0.3 / max(float(np.abs(change).max()), 1e-12))
        change = change * limit
        j, k, sine = turn_axis(j, change[:2]), turn_axis(k, change[2:4]), sine + float(change[4])
        heading = heading + change[PARAMETERS:]
        if np.abs(change).max() < CONVERGED:
            break
    return cost, j, k, sine, heading, np.asarray(np.linalg.inv(normal), np.float64), residual


def _normal_equations(
    t: Array, upper: Array, lower: Array, j: Array, k: Array, sine: float, heading: Array, knots: Knots
) -> tuple[Array, Array, float, float]:
    """The normal matrix and right side of a step over (j, k, sin β, δ at the knots), the cost, and the RMS of (2)."""
    i, share = knots.before, knots.share
    angle = (1.0 - share) * heading[i] + share * heading[i + 1]
    first, second = about_vertical(upper @ j, angle), lower @ k
    error = np.sum(first * second, axis=1) - sine
    by_upper = [np.sum(about_vertical(upper @ column, angle) * second, axis=1) for column in tangents(j).T]
    by_lower = [np.sum(first * (lower @ column), axis=1) for column in tangents(k).T]
    by_all = np.stack([*by_upper, *by_lower, -np.ones(len(t))], axis=1)
    by_heading = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    square = error**2
    variance = max(float(np.median(square)) / 0.455, MIN_RESIDUAL**2)  # the median of χ² of one freedom
    interval = (t[-1] - t[0]) / (len(t) - 1)
    weight = min(interval / CORRELATION, 1.0) / variance / (1.0 + square / (CAUCHY**2 * variance))
    size = PARAMETERS + knots.size
    normal, gradient = np.zeros((size, size)), np.zeros(size)
    normal[:PARAMETERS, :PARAMETERS] = (by_all * weight[:, None]).T @ by_all
    gradient[:PARAMETERS] = -(weight * error) @ by_all
    for row, hat in ((PARAMETERS + i, 1.0 - share), (PARAMETERS + 1 + i, share)):
        np.add.at(gradient, row, -hat * weight * by_heading * error)
        np.add.at(normal[:, :PARAMETERS], row, (hat * weight * by_heading)[:, None] * by_all)
        for column, other in ((PARAMETERS + i, 1.0 - share), (PARAMETERS + 1 + i, share)):
            np.add.at(normal, (row, column), hat * other * weight * by_heading**2)
    normal[:PARAMETERS, PARAMETERS:] = normal[PARAMETERS:, :PARAMETERS].T
    add_walk(normal, gradient, heading, knots.interval, PARAMETERS)
    normal[range(PARAMETERS), range(PARAMETERS)] += 1e-6  # a direction that the motion does not show keeps a huge σ
    cost = float(np.median(square))
    return normal, gradient, cost, float(np.sqrt(np.mean(square)))
