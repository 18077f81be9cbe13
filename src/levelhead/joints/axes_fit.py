"""Gauss-Newton over the axes of a joint in both sensors and the heading of one sensor relative to the other.

R(t) and S(t) are the orientations of the upper and the lower sensor, each with a heading of its own, δ(t) the lead of
the lower heading, j and k an axis in either sensor. A kind of joint states an error e(t) of them that its build makes 0
(``hinge``, ``two_axes``).

min Σ w|e|²/s² + Σ Δδ²/(HEADING_WALK² Δt) over j, k (two angles each), a further constant where the joint has one, and δ
at knots, a line between them, with a random walk of ``HEADING_WALK`` as a prior. s² follows from the median of |e|², w
is the weight of Cauchy's distribution, and readings within ``CORRELATION`` count as one. The inverse of the normal
matrix gives all variances. Of several starts the one of least Σ log(1 + |e|²/(c s)²) counts, Cauchy's likelihood.
"""

from collections.abc import Callable
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
LONGEST_STEP = 0.3  # rad
CONVERGED = 1e-7  # rad


class AxesFit(NamedTuple):
    """The evidence of a motion on a joint."""

    upper: Array  # (3,) unit vector of the axis in the frame of the upper sensor
    lower: Array  # (3,) in that of the lower one
    sigma_upper: float  # rad, 1σ of its direction
    sigma_lower: float
    heading: Array  # (n,) rad, δ
    sigma_heading: Array  # (n,) rad
    residual: float  # rad, RMS of |e|
    spread: float  # rad, RMS of the turn of one sensor in the other: how much the joint moves
    likelihood: float = np.inf  # log of the ratio to the best fit with the other heading
    referenced: bool = False  # heading is that of two tracks with north, and no axis is needed for it


class AxesState(NamedTuple):
    """Axes, the constant (rad; 0 where the joint has none) and δ (rad): one value as a start, then at the knots."""

    upper: Array
    lower: Array
    constant: float
    heading: Array


class Linearisation(NamedTuple):
    """e of all samples and its derivatives."""

    error: Array  # (n, d) rad
    by_axes: Array  # (n, d, p) by the angles of both axes and the constant
    by_heading: Array  # (n, d)


class Knots(NamedTuple):
    """δ at knots, and of each sample the knot before it and the share of the knot after it."""

    interval: float  # s
    size: int
    before: NDArray[np.intp]
    share: Array

    def at_samples(self, values: Array) -> Array:
        """(n,) values at the samples."""
        result: Array = (1.0 - self.share) * values[self.before] + self.share * values[self.before + 1]
        return result

    def variance_at_samples(self, covariance: Array) -> Array:
        """(n,) variances at the samples."""
        i, share = self.before, self.share
        rest = 1.0 - share
        result: Array = (
            rest**2 * covariance[i, i] + share**2 * covariance[i + 1, i + 1] + 2.0 * rest * share * covariance[i, i + 1]
        )
        return result


class AxesSolution(NamedTuple):
    """A state at its minimum."""

    state: AxesState
    covariance: Array  # of the angles of both axes, the constant where there is one, and δ at the knots
    square: Array  # (n,) rad², |e|²
    variance: float  # rad², s²


Linearise = Callable[[Array, Array, AxesState, Array], Linearisation]


def fit_axes(
    t: Array,
    upper: Array,
    lower: Array,
    starts: list[AxesState],
    linearise: Linearise,
    median: float,
    cost_of_heading: Callable[[Array], float] | None = None,
) -> tuple[AxesFit, Array]:
    """The best fit from several starts, and (n, 3, 3) the orientation of the lower sensor in the upper one.

    Args:
        t: (n,) s.
        upper: (n, 3, 3) rotations, sensor to earth.
        lower: the same of the other sensor.
        starts: states with one heading.
        linearise: e and its derivatives from rotations, a state and (n,) δ.
        median: of |e|²/s².
        cost_of_heading: minus the log of a likelihood of (n,) δ, by other readings than the orientations.
    """
    rows = thin(t)
    when, first, second = t[rows], upper[rows], lower[rows]
    knots = knots_between(when, when[0], when[-1])
    solutions = [_solve(when, first, second, start, linearise, knots, median) for start in starts]
    variance = min(one.variance for one in solutions)
    interval = min((when[-1] - when[0]) / (len(when) - 1) / CORRELATION, 1.0)
    costs = [
        0.5 * CAUCHY**2 * interval * float(np.sum(np.log1p(one.square / (CAUCHY**2 * variance)))) for one in solutions
    ]
    every = knots_between(t, when[0], when[-1])
    if cost_of_heading is not None:
        headings = [every.at_samples(one.state.heading) for one in solutions]
        costs = [cost + cost_of_heading(heading) for cost, heading in zip(costs, headings, strict=True)]
    best = int(np.argmin(costs))
    state, covariance, square, _ = solutions[best]
    others = [
        cost
        for cost, one in zip(costs, solutions, strict=True)
        if np.cos(one.state.heading.mean() - state.heading.mean()) < 0.0
    ]
    heading = every.at_samples(state.heading)
    relative = np.einsum("nji,njk->nik", about_vertical(upper, heading), lower)
    fit = AxesFit(
        upper=state.upper,
        lower=state.lower,
        sigma_upper=float(np.sqrt(covariance[0, 0] + covariance[1, 1])),
        sigma_lower=float(np.sqrt(covariance[2, 2] + covariance[3, 3])),
        heading=heading,
        sigma_heading=np.sqrt(every.variance_at_samples(covariance[-knots.size :, -knots.size :])),
        residual=float(np.sqrt(np.mean(square))),
        spread=0.0,
        likelihood=min(others, default=np.inf) - costs[best],
    )
    return fit, relative


def thin(t: Array) -> slice:
    """The rows that a fit uses."""
    return slice(None, None, -(-len(t) // MAX_ROWS))


def _solve(
    t: Array, upper: Array, lower: Array, start: AxesState, linearise: Linearise, knots: Knots, median: float
) -> AxesSolution:
    """Gauss-Newton from a start."""
    state = start._replace(heading=np.full(knots.size, start.heading))
    for _ in range(ITERATIONS):
        errors = linearise(upper, lower, state, knots.at_samples(state.heading))
        square = np.sum(errors.error**2, axis=1)
        variance = max(float(np.median(square)) / median, MIN_RESIDUAL**2)
        normal, gradient = _normal_equations(t, errors, square / variance, state.heading, knots)
        normal, gradient = normal / variance, gradient / variance
        add_walk(normal, gradient, state.heading, knots.interval, errors.by_axes.shape[2])
        change = np.asarray(np.linalg.solve(normal, gradient), np.float64)
        change *= min(1.0, LONGEST_STEP / max(float(np.abs(change).max()), CONVERGED))
        state = AxesState(
            turn_axis(state.upper, change[:2]),
            turn_axis(state.lower, change[2:4]),
            state.constant + (float(change[4]) if errors.by_axes.shape[2] > 4 else 0.0),
            state.heading + change[errors.by_axes.shape[2] :],
        )
        if np.abs(change).max() < CONVERGED:
            break
    return AxesSolution(state, np.asarray(np.linalg.inv(normal), np.float64), square, variance)


def _normal_equations(t: Array, errors: Linearisation, chi: Array, heading: Array, knots: Knots) -> tuple[Array, Array]:
    """The normal matrix and right side of a step, times s²; ``chi`` (n,) is |e|²/s²."""
    error, by_axes, by_heading = errors
    i, share, count = knots.before, knots.share, by_axes.shape[2]
    weight = min((t[-1] - t[0]) / (len(t) - 1) / CORRELATION, 1.0) / (1.0 + chi / CAUCHY**2)
    size = count + knots.size
    normal, gradient = np.zeros((size, size)), np.zeros(size)
    weighted = weight[:, None, None] * by_axes
    normal[:count, :count] = np.einsum("nia,nib->ab", weighted, by_axes)
    gradient[:count] = -np.einsum("nia,ni->a", weighted, error)
    square_heading = weight * np.sum(by_heading**2, axis=1)
    pull = -weight * np.sum(by_heading * error, axis=1)
    mixed = np.einsum("ni,nia->na", by_heading, weighted)
    hats = ((count + i, 1.0 - share), (count + 1 + i, share))
    for row, hat in hats:
        np.add.at(gradient, row, hat * pull)
        np.add.at(normal[:, :count], row, hat[:, None] * mixed)
        for column, other in hats:
            np.add.at(normal, (row, column), hat * other * square_heading)
    normal[:count, count:] = normal[count:, :count].T
    normal[range(count), range(count)] += 1e-12  # a direction that the motion does not show keeps a huge σ
    return normal, gradient


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


def knots_between(t: Array, first: float, last: float) -> Knots:
    """Knots from ``first`` to ``last`` s, and the place of each stamp between them."""
    count = int(np.clip(np.ceil((last - first) / KNOT_INTERVAL), 1, MAX_KNOTS)) + 1
    interval = (last - first) / (count - 1)
    place = (t - first) / interval
    before = np.clip(np.floor(place).astype(np.intp), 0, count - 2)
    return Knots(interval, count, before, place - before)


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
    """(n, 3) vectors, or (n, 3, k) with vectors in columns, turned by (n,) angles in rad about the vertical."""
    c, s = (part.reshape(-1, *(1,) * (vectors.ndim - 2)) for part in (np.cos(angle), np.sin(angle)))
    x, y, z = np.moveaxis(vectors, 1, 0)
    return np.stack([c * x - s * y, s * x + c * y, z], axis=1)
