"""The axis of a hinge in both sensors, and the heading of one sensor relative to the other.

R(t) and S(t) are the orientations of the upper and the lower sensor, each with a heading of its own, δ(t) what the
lower heading is ahead. Where j and k are the axis in either sensor, a hinge makes

    e(t) = Rz(δ) R j − S k = 0                                                                                  (1)

**Start.** With a constant δ, Σ|e|² is smallest for the first pair of singular vectors of C(δ) = mean(Rᵀ Rz(δ)ᵀ S), and
the largest singular value is 1 where (1) holds. The three values also state the motion: all are 1 where the joint is
stiff. δ is the best of a grid.

**Refinement.** Gauss-Newton over j, k (two angles each) and δ at knots, a line between them, with a random walk of
``HEADING_WALK`` as a prior: min Σ w|e|²/s² + Σ Δδ²/(HEADING_WALK² Δt). s² is the median of |e|²/2, w the weight of
Cauchy's distribution, and readings within ``CORRELATION`` count as one. The inverse of the normal matrix gives all
variances.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array

MIN_SAMPLES = 50
MAX_ROWS = 20_000  # of a fit; of a longer recording every n-th sample
MAX_KNOTS = 1_000
KNOT_INTERVAL = 1.0  # s
CORRELATION = 1.0  # s, over which errors of two smoothed orientations are alike
HEADING_WALK = np.radians(0.1)  # rad/√s
HEADING_GRID = np.radians(np.arange(0.0, 360.0, 5.0))
CAUCHY = 3.0  # σ at which a weight is a half
MIN_RESIDUAL = np.radians(0.05)
ITERATIONS = 20
CONVERGED = 1e-7  # rad


class HingeFit(NamedTuple):
    """What the motion shows of a hinge."""

    upper: Array  # (3,) unit vector of the axis in the frame of the upper sensor
    lower: Array  # (3,) in that of the lower one
    sigma_upper: float  # rad, 1σ of its direction
    sigma_lower: float
    heading: Array  # (n,) rad, δ
    sigma_heading: Array  # (n,) rad
    residual: float  # rad, RMS of |e| over both directions
    spread: float  # rad, RMS of the turn of one sensor in the other: how much the joint moves
    referenced: bool = False  # heading is that of two tracks with north, and no axis is needed for it


class Knots(NamedTuple):
    """δ at knots, and of each sample the knot before it and the share of the knot after it."""

    interval: float  # s
    size: int
    before: NDArray[np.intp]
    share: Array


def fit_hinge(t: Array, upper: Array, lower: Array) -> HingeFit:
    """Axis and relative heading from (n, 3, 3) rotations, sensor to earth, at the stamps ``t`` (s)."""
    step = -(-len(t) // MAX_ROWS)
    rows = slice(None, None, step)
    when, first, second = t[rows], upper[rows], lower[rows]
    angle, j, k, spread = _start(first, second)
    knots = knots_between(when, when[0], when[-1])
    heading = np.full(knots.size, angle)
    for _ in range(ITERATIONS):
        normal, gradient, residual = _normal_equations(when, first, second, j, k, heading, knots)
        change = np.asarray(np.linalg.solve(normal, gradient), np.float64)
        j, k = turn_axis(j, change[:2]), turn_axis(k, change[2:4])
        heading = heading + change[4:]
        if np.abs(change).max() < CONVERGED:
            break
    covariance = np.asarray(np.linalg.inv(normal), np.float64)
    if j[np.argmax(np.abs(j))] < 0.0:
        j, k = -j, -k
    every = knots_between(t, when[0], when[-1])
    values, variance = interpolate_heading(every, heading, covariance[4:, 4:])
    return HingeFit(
        upper=j,
        lower=k,
        sigma_upper=float(np.sqrt(covariance[0, 0] + covariance[1, 1])),
        sigma_lower=float(np.sqrt(covariance[2, 2] + covariance[3, 3])),
        heading=values,
        sigma_heading=np.sqrt(variance),
        residual=residual,
        spread=spread,
    )


def _start(upper: Array, lower: Array) -> tuple[float, Array, Array, float]:
    """δ (rad), both axes for a constant δ, and the spread (rad) of the relative rotation."""
    best = (-1.0, 0.0, np.zeros(3), np.zeros(3), np.zeros(3))
    for angle in HEADING_GRID:
        c, s = np.cos(angle), np.sin(angle)
        back = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        left, values, right = np.linalg.svd(np.einsum("nji,jk,nkl->il", upper, back, lower) / len(upper))
        if values[0] > best[0]:
            best = (values[0], angle, left[:, 0], right[0], values)
    _, angle, j, k, values = best
    return float(angle), j, k, float(np.arccos(np.clip(values[1], -1.0, 1.0)))


def knots_between(t: Array, first: float, last: float) -> Knots:
    """Knots from ``first`` to ``last`` s, and the place of each stamp between them."""
    count = int(np.clip(np.ceil((last - first) / KNOT_INTERVAL), 1, MAX_KNOTS)) + 1
    interval = (last - first) / (count - 1)
    place = (t - first) / interval
    before = np.clip(np.floor(place).astype(np.intp), 0, count - 2)
    return Knots(interval, count, before, place - before)


def interpolate_heading(knots: Knots, heading: Array, covariance: Array) -> tuple[Array, Array]:
    """(n,) δ in rad and its variance in rad² at the samples."""
    i, share = knots.before, knots.share
    rest = 1.0 - share
    variance = (
        rest**2 * covariance[i, i] + share**2 * covariance[i + 1, i + 1] + 2.0 * rest * share * covariance[i, i + 1]
    )
    return rest * heading[i] + share * heading[i + 1], variance


def tangents(axis: Array) -> Array:
    """(3, 2) two unit vectors at right angles to a unit vector and to each other, right-handed with it."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first)], axis=1)


def turn_axis(axis: Array, angles: Array) -> Array:
    """A unit vector moved by two small angles (rad) along its tangents."""
    turned = axis + tangents(axis) @ angles
    result: Array = turned / np.linalg.norm(turned)
    return result


def about_vertical(vectors: Array, angle: Array) -> Array:
    """(n, 3) vectors turned by (n,) angles in rad about the vertical."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = vectors.T
    return np.stack([c * x - s * y, s * x + c * y, z], axis=1)


def _normal_equations(
    t: Array, upper: Array, lower: Array, j: Array, k: Array, heading: Array, knots: Knots
) -> tuple[Array, Array, float]:
    """The normal matrix and right side of a step over (j, k, δ at the knots), and the RMS residual in rad."""
    i, share = knots.before, knots.share
    angle = (1.0 - share) * heading[i] + share * heading[i + 1]
    turned = about_vertical(upper @ j, angle)
    error = turned - lower @ k
    by_upper = np.stack([about_vertical(upper @ column, angle) for column in tangents(j).T], axis=2)
    by_axes = np.concatenate([by_upper, -(lower @ tangents(k))], axis=2)  # (n, 3, 4)
    by_heading = np.stack([-turned[:, 1], turned[:, 0], np.zeros(len(t))], axis=1)
    square = np.sum(error**2, axis=1)
    variance = max(0.5 * float(np.median(square)), MIN_RESIDUAL**2)
    interval = (t[-1] - t[0]) / (len(t) - 1)
    weight = min(interval / CORRELATION, 1.0) / variance / (1.0 + 0.5 * square / (CAUCHY**2 * variance))
    size = 4 + knots.size
    normal, gradient = np.zeros((size, size)), np.zeros(size)
    normal[:4, :4] = np.einsum("n,nia,nib->ab", weight, by_axes, by_axes)
    gradient[:4] = -np.einsum("n,nia,ni->a", weight, by_axes, error)
    hats = ((4 + i, 1.0 - share), (5 + i, share))
    square_heading = weight * np.sum(by_heading**2, axis=1)
    pull = -weight * np.sum(by_heading * error, axis=1)
    mixed = np.einsum("n,ni,nia->na", weight, by_heading, by_axes)
    for row, hat in hats:
        np.add.at(gradient, row, hat * pull)
        np.add.at(normal[:, :4], row, hat[:, None] * mixed)
        for column, other in hats:
            np.add.at(normal, (row, column), hat * other * square_heading)
    normal[:4, 4:] = normal[4:, :4].T
    add_walk(normal, gradient, heading, knots.interval, 4)
    return normal, gradient, float(np.sqrt(np.mean(square)))


def add_walk(normal: Array, gradient: Array, heading: Array, interval: float, first: int) -> None:
    """The random walk of δ from knot to knot; the knots are the parameters from ``first`` on."""
    weight = 1.0 / (HEADING_WALK**2 * interval)
    step = weight * np.diff(heading)
    gradient[first:-1] += step
    gradient[first + 1 :] -= step
    place = np.arange(first, len(gradient) - 1)
    normal[place, place] += weight
    normal[place + 1, place + 1] += weight
    normal[place, place + 1] -= weight
    normal[place + 1, place] -= weight
