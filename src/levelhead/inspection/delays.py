"""The delay of a vector behind the gyroscope, or the filter of first order that it went through.

Both make gravity come late. A delay is where the fit of ``turn_matrix`` finds none any more. A filter also makes forces
smaller, which move that zero, so its time constant λ is the one of greatest likelihood, with the delay held at 0:

    2 ln L(λ) = −3 n ln s(λ)²,   s = residual / residual without any turn,   of n independent segments              (1)
    σ(λ)⁻² = −d² ln L / dλ²                                                                                         (2)

The residual without any turn stands for the Jacobian of the transformed readings.
"""

import math
from typing import NamedTuple

import numpy as np

from levelhead.recording import Array
from levelhead.signals.turn_matrix import ALL_NINE, Segments, TurnMatrix, fit

SHIFTED = 0.015  # s of delay, beyond which the fit is made again
LONGEST = 0.12  # s, by which an accelerometer may come late without a filter
PROBE, STEP = 0.03, 0.08  # s of the shortest first step, and of the longest steps
TREATMENTS = 6  # shifts that are tried at most
LEAST_SHARE = 0.05  # of a shift that the delay of a fit follows: one above zero
HELD = 1e-6  # s: 1σ of a delay that is held at 0
LAGS = (0.1, 0.2, 0.4, 0.8, 1.6)  # s, time constants that are tried until the likelihood falls
REFINEMENTS = 3  # parabolas
CLOSE = 0.005  # s of a time constant that is known well enough
ROUGH = 0.03  # of a time constant: 1σ that no model has
EXPLAINED = 0.9  # share of the force's change that may be left behind a filter
FILTERED = 6.0  # 2 ln of the odds against a filter before anything is seen


class Timed(NamedTuple):
    """A fit to a vector without its delay, or without its filter.

    Attributes:
        fit: its delay, s, is that which was taken out, or the time constant.
        share: s of eq. 1.
        low_pass: 2 ln of the odds for a filter; 0: a delay.
    """

    fit: TurnMatrix
    share: float
    low_pass: float


def remove_delay(seg: Segments, whole: TurnMatrix, spread: float) -> Timed:
    """The fit without a delay or a filter, whichever leaves less; ``whole`` is the fit to the readings as they are.

    Each is another vector, so the share of its turn that is left decides. Where none leaves less, the fit as it was
    stays, and the distance to the zero of the delay widens its σ. ``spread``: 1σ of the numbers of M about ``whole``.
    """
    usual = Timed(whole, share_left(seg, whole), 0.0)
    if not seg.is_force and abs(whole.delay) < SHIFTED:
        return usual
    shifted = _find_delay(seg, whole, spread)
    away = math.hypot(shifted.fit.sigma[3], shifted.fit.delay - whole.delay)
    best = shifted if shifted.share < usual.share else usual._replace(fit=_widen(whole, 1.0, away))
    if seg.is_force and max(whole.delay, shifted.fit.delay) > SHIFTED:
        filtered = _find_filter(seg, whole, spread)
        if filtered is not None and (filtered.share < best.share or shifted.fit.delay > LONGEST):
            return filtered
    return best


def share_left(seg: Segments, found: TurnMatrix) -> float:
    """The residual over that without any turn."""
    return found.left / max(seg.scatter, 1e-9)


def _find_delay(seg: Segments, whole: TurnMatrix, spread: float) -> Timed:
    """The fit to a vector without its delay, which secants find.

    A vector that is shifted by τ shows a delay of d(τ) = r (τ₀ − τ): forces that the arm or bounded velocities explain
    pull it towards zero, so that r ≤ 1. They do not move its zero τ₀:

        τ₀ = τ + d(τ) / r,   r = (d(τ₁) − d(τ₂)) / (τ₂ − τ₁),   σ(τ₀) = σ(d) / r                                (3)
    """
    one, total, step = whole, 0.0, math.copysign(min(max(abs(whole.delay), PROBE), STEP), whole.delay)
    for _ in range(TREATMENTS):
        total += step
        shifted = seg.shift(total)
        before, one = one.delay, fit(shifted, one.matrix, ALL_NINE, spread, near=one)
        followed = float(np.clip((before - one.delay) / step, LEAST_SHARE, 1.0))
        step = float(np.clip(one.delay / followed, -STEP, STEP))
        if abs(step) < SHIFTED:
            break
    share = share_left(shifted, one)
    return Timed(_widen(one._replace(delay=total + one.delay / followed), followed, 0.0), share, 0.0)


def _widen(found: TurnMatrix, followed: float, away: float) -> TurnMatrix:
    """With the σ of the delay divided by the share of a shift that it follows, and another σ added, s."""
    covariance = found.more_covariance.copy()
    covariance[3] /= followed
    covariance[:, 3] /= followed
    covariance[3, 3] += away**2
    return found._replace(more_covariance=covariance)


def _find_filter(seg: Segments, whole: TurnMatrix, spread: float) -> Timed | None:
    """The fit behind the likeliest filter; None: the odds are against one."""
    held = whole._replace(delay=0.0)

    def sharpen(lag: float) -> tuple[float, TurnMatrix]:
        sharp = seg.sharpen(lag)
        one = fit(sharp, whole.matrix, ALL_NINE, spread, near=held, delay=HELD)
        return 2.0 * math.log(max(share_left(sharp, one), 1e-9)), one

    tried = {0.0: sharpen(0.0)}
    for lag in LAGS:
        tried[lag] = sharpen(lag)
        if tried[lag][0] > min(one for one, _ in tried.values()):
            break
    best = min(tried, key=lambda one: tried[one][0])
    if best in (0.0, LAGS[-1]):
        return None
    for _ in range(REFINEMENTS):
        vertex, _ = _parabola(tried, best)
        if abs(vertex - best) < CLOSE:
            break
        tried[vertex] = sharpen(vertex)
        best = min(tried, key=lambda one: tried[one][0])
    _, curvature = _parabola(tried, best)
    count = 3.0 * whole.by_segment.size / seg.overlap
    cost, found = tried[best]
    odds, share = count * (tried[0.0][0] - cost) - FILTERED, math.exp(0.5 * cost)
    if odds <= 0.0 or share > EXPLAINED:
        return None
    covariance = found.more_covariance.copy()
    covariance[3] = covariance[:, 3] = 0.0
    covariance[3, 3] = 2.0 / (count * curvature) + (ROUGH * best) ** 2
    return Timed(found._replace(delay=best, more_covariance=covariance), share, odds)


def _parabola(tried: dict[float, tuple[float, TurnMatrix]], best: float) -> tuple[float, float]:
    """(s, s⁻²) time constant of the least value, and second derivative, of the parabola through three neighbours."""
    order = sorted(tried)
    at = order.index(best)
    x: Array = np.array(order[at - 1 : at + 2])
    square, slope, _ = np.polyfit(x - best, [tried[one][0] for one in x.tolist()], 2).tolist()
    square = max(square, 1e-6)
    return float(np.clip(best - 0.5 * slope / square, x[0], x[-1])), 2.0 * square
