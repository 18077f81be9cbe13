"""Lag of an estimate: the time shift of the truth that fits it best.

Compared is a signal s of the orientation that never wraps: the vertical as the sensor sees it (which does not depend on
heading), or, where heading is absolute, all nine entries of the rotation matrix. The lag τ minimises

    J(τ) = Σ | s_est(t) − s_true(t − τ) − c |²                                                                  (1)

with c the mean difference, so that a constant misalignment is not taken for a delay. J is scanned over ±1 s, then its
minimum is refined by Gauss-Newton steps τ ← τ − Σ (r − r̄)·ṡ / Σ |ṡ − mean ṡ|², which is the vertex of the parabola that
touches J there.
"""

from math import radians, sqrt

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array
from levelhead.rotations import matrix

MAX_LAG = 1.0  # s, the longest lag or lead looked for
MIN_MOTION = radians(1.0)  # RMS about the mean; a smaller motion has no measurable lag
MAX_STANDARD_ERROR = 0.02  # s, the largest standard error with which a lag is still worth saying
BLOCKS = 24  # of time, for the standard error
SCAN_POINTS, FIT_POINTS = 2_000, 20_000  # samples compared; more do not change the result


def signal(quat: Array, with_heading: bool) -> Array:
    """(k, n) the vertical in sensor axes (k = 3), or the whole rotation matrix (k = 9), of (n, 4) quaternions."""
    turned = matrix(quat)
    return turned.reshape(-1, 9).T if with_heading else turned[:, 2].T


def _at(when: Array, t: Array, values: Array) -> Array:
    return np.stack([np.interp(when, t, row, np.nan, np.nan) for row in values])


def _centre_rows(values: Array) -> Array:
    """(k, m) without the columns that are not finite and without each row's mean."""
    values = values[:, np.isfinite(values).all(axis=0)]
    return values - values.mean(axis=1, keepdims=True) if values.shape[1] else values


def _cost(tau: float, t: Array, truth: Array, when: Array, estimate: Array) -> float:
    rest = _centre_rows(estimate - _at(when - tau, t, truth))
    return float(np.mean(rest**2)) if rest.size else np.inf


def _scan(t: Array, truth: Array, when: Array, estimate: Array) -> float | None:
    """The lag, to 25 ms, with the least J; None when that lies at the end of the range."""
    longest = min(MAX_LAG, 0.25 * float(t[-1] - t[0]))
    grid = np.arange(-1.0, 1.0001, 0.025) * longest
    costs = [_cost(tau, t, truth, when, estimate) for tau in grid]
    best = int(np.argmin(costs))
    return float(grid[best]) if 0 < best < len(grid) - 1 else None


def _step(
    tau: float, t: Array, signals: tuple[Array, Array], when: Array, estimate: Array
) -> tuple[float, float] | None:
    """One Gauss-Newton step on J: the new lag and its standard error, both in s; None when nothing moves.

    ``signals`` are the true signal and its rate. Residuals of neighbouring samples are alike, so the standard error
    comes from sums over blocks of time (batch means): √(Σ_blocks (Σ r·ṡ)²) / Σ |ṡ|².
    """
    rest = estimate - _at(when - tau, t, signals[0])
    rate = _at(when - tau, t, signals[1])
    good = np.isfinite(rest).all(axis=0) & np.isfinite(rate).all(axis=0)
    if good.sum() < BLOCKS:
        return None
    rest, rate = _centre_rows(rest[:, good]), _centre_rows(rate[:, good])
    power = float(np.sum(rate**2))
    if power == 0.0:
        return None
    change = -float(np.sum(rest * rate)) / power
    left = np.sum((rest + change * rate) * rate, axis=0)  # the residual after this step
    blocks = np.add.reduceat(left, np.linspace(0, len(left), BLOCKS, endpoint=False).astype(int))
    return tau + change, sqrt(float(np.sum(blocks**2))) / power


def _refine(tau: float, t: Array, truth: Array, when: Array, estimate: Array) -> float | None:
    """Gauss-Newton on J from ``tau``; None where the standard error exceeds ``MAX_STANDARD_ERROR``."""
    signals = truth, np.gradient(truth, t, axis=1)
    for _ in range(8):
        found = _step(tau, t, signals, when, estimate)
        if found is None:
            return None
        change, (tau, error) = found[0] - tau, found
        if abs(change) < 1e-7:
            break
    return tau if error <= MAX_STANDARD_ERROR and abs(tau) <= MAX_LAG else None


def lag(t: Array, estimate: Array, truth: Array, rows: NDArray[np.bool_], with_heading: bool) -> float | None:
    """Seconds by which ``estimate`` trails ``truth`` (negative: leads); None when the motion is too small.

    Args:
        t: (n,) seconds.
        estimate: (n, 4) quaternions wxyz.
        truth: (n, 4) quaternions wxyz, NaN where unknown.
        rows: (n,) samples to compare.
        with_heading: whether the headings of both mean the same.
    """
    chosen = np.flatnonzero(rows)
    if len(chosen) < BLOCKS:
        return None
    true_signal = signal(truth, with_heading)
    swing = _centre_rows(true_signal[:, chosen])
    if sqrt(float(np.mean(np.sum(swing**2, axis=0)))) < MIN_MOTION:
        return None

    def subsample(count: int) -> tuple[Array, Array]:
        picked = chosen[np.unique(np.linspace(0, len(chosen) - 1, min(count, len(chosen))).astype(int))]
        return t[picked], signal(estimate[picked], with_heading)

    start = _scan(t, true_signal, *subsample(SCAN_POINTS))
    return None if start is None else _refine(start, t, true_signal, *subsample(FIT_POINTS))
