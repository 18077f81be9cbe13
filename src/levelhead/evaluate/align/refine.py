"""Constant rotations and shift of one hypothesis together.

With e the rotation vector of B* X A(t + τ) Y, small changes X ← exp(x) X, Y ← Y exp(y), τ ← τ + s change it by

    δe = Bᵀ x + y + ω s                                                                                         (4)

for small e, where ω is the angular rate of the reference in its sensor's axes. Gauss-Newton steps with Huber's weights
solve Σ w Jᵀ e = 0. The rate is that of the reference on purpose: its noise has nothing to do with that of the
estimate, whereas the smallest Σ |e|² lies half-way between two samples, where interpolation smooths the noise most.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from levelhead.evaluate.align.rotation_fit import Fit, huber_weights, trimmed_rms
from levelhead.evaluate.align.series import MIN_SAMPLES, OrientationSeries, SeriesPair
from levelhead.evaluate.lag import BLOCKS
from levelhead.recording import Array
from levelhead.rotations import angle, from_rotvec, product, relative_rotation, rotvec, to_scipy

POINTS = 4_000  # instants fitted; more do not change the result
_STEPS = 12
_DONE = 1e-8  # rad and s
_RATE_OVER = 0.01  # s, at least, to either side of the instant


class Refinement(NamedTuple):
    """The end of the search: the hypothesis with its last rotations, and the shift.

    Attributes:
        fit: the hypothesis.
        shift: seconds by which the estimate is late.
        shift_error: its standard error in s; None if it was not fitted.
    """

    fit: Fit
    shift: float
    shift_error: float | None


def refine(fit: Fit, shift: float, move_clock: bool, pairs: SeriesPair) -> Refinement:
    """Gauss-Newton from a closed-form fit; ``move_clock``: the shift is a parameter too."""
    when = pairs.instants(shift, POINTS)
    heading_only, any_earth = fit.freedom.earth == "heading", fit.freedom.earth == "any"
    turns_earth, turns_sensor = 3 * any_earth + heading_only, 3 * (fit.freedom.sensor == "any")
    late, error = shift, None
    for _ in range(_STEPS if turns_earth + turns_sensor + move_clock else 0):
        quat, known, rate = _rows(pairs, late, when)
        if len(quat) < MIN_SAMPLES:
            break
        errors = rotvec(relative_rotation(known, fit.apply(quat)))
        weights = huber_weights(np.linalg.norm(errors, axis=1))
        columns = [np.swapaxes(to_scipy(known).as_matrix(), 1, 2)[:, :, 3 - turns_earth :]] if turns_earth else []
        columns += [np.tile(np.eye(3), (len(quat), 1, 1))] if turns_sensor else []
        columns += [rate[:, :, None]] if move_clock else []
        change, error = _step(np.concatenate(columns, axis=2), errors, weights)
        fit, late = _update(fit, late, change, turns_earth, turns_sensor)
        if np.abs(change).max() < _DONE:
            break
    return Refinement(fit._replace(trimmed=_trim_pairs(fit, pairs, late, when)), late, error if move_clock else None)


def _rows(pairs: SeriesPair, late: float, when: Array) -> tuple[Array, Array, Array]:
    """(m, 4) estimate, (m, 4) reference and (m, 3) rate of the reference in rad/s where all three are known."""
    quat, known = pairs.at(late, when)
    rate = rates(pairs.reference, when if pairs.at_reference else when - late)
    good = np.isfinite(quat[:, 0]) & np.isfinite(known[:, 0]) & np.isfinite(rate[:, 0])
    return quat[good], known[good], rate[good]


def rates(course: OrientationSeries, when: Array) -> Array:
    """(m, 3) angular rate in rad/s in the sensor's axes by central differences; NaN where the series has no samples."""
    over = max(course.interval, _RATE_OVER)
    before, after = course.at(when - over), course.at(when + over)
    good = np.isfinite(before[:, 0]) & np.isfinite(after[:, 0])
    found = np.full((len(when), 3), np.nan)
    if good.any():
        found[good] = rotvec(relative_rotation(before[good], after[good])) / (2.0 * over)
    return found


def _step(jacobian: Array, errors: Array, weights: Array) -> tuple[Array, float]:
    """The change of the parameters, and 1σ of the last one.

    Residuals of neighbouring samples are alike, so the covariance is H⁻¹ (Σ_blocks g gᵀ) H⁻¹ with g the sum of w Jᵀ e
    over a block of time (batch means). Parameters that the motion does not determine stay unchanged (pseudo-inverse).
    """
    gradients = np.einsum("k,kij,ki->kj", weights, jacobian, errors)
    hessian = np.einsum("k,kij,kil->jl", weights, jacobian, jacobian)
    scale = np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    inverse = np.linalg.pinv(hessian / np.outer(scale, scale), rcond=1e-9) / np.outer(scale, scale)
    starts = np.unique(np.linspace(0, len(gradients), BLOCKS, endpoint=False).astype(int))
    blocks = np.add.reduceat(gradients, starts, axis=0)
    return -inverse @ gradients.sum(axis=0), sqrt(max(float((inverse @ (blocks.T @ blocks) @ inverse)[-1, -1]), 0.0))


def _update(fit: Fit, late: float, change: Array, turns_earth: int, turns_sensor: int) -> tuple[Fit, float]:
    x, y = np.zeros(3), np.zeros(3)
    x[3 - turns_earth :] = change[:turns_earth]  # heading is the third
    y[:turns_sensor] = change[turns_earth : turns_earth + turns_sensor]
    earth, sensor = product(from_rotvec(x), fit.earth)[0], product(fit.sensor, from_rotvec(y))[0]
    return fit._replace(earth=earth, sensor=sensor), late + float(np.sum(change[turns_earth + turns_sensor :]))


def _trim_pairs(fit: Fit, pairs: SeriesPair, late: float, when: Array) -> float:
    quat, known = pairs.at(late, when)
    good = np.isfinite(quat[:, 0]) & np.isfinite(known[:, 0])
    return trimmed_rms(angle(relative_rotation(known[good], fit.apply(quat[good]))))
