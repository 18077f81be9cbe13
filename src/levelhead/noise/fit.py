"""The coefficients of IEEE Std 952 from Allan deviations: N, B, K and Q with 95 % intervals.

    σ²(τ) = 3 Q²/τ² + N²/τ + (2 ln 2/π) B² + K² τ/3                                                             (1)

is linear in the squares. Each estimate s of σ² has a χ² distribution, so its deviance is

    d = ν (s/σ² − 1 − ln s/σ²)                                                                                  (2)

and the signed roots ±√d are nearly normal. Estimates from the same data are correlated: with the power spectrum S of
the noise and the frequency response G of each τ (equation 1 of ``allan``),

    cov(s₁, s₂) ∝ ∫ S² |G₁|² |G₂|² df                                                                           (3)

(Percival & Walden, Wavelet Methods for Time Series Analysis, 2000, 8.3). The fit has the least rᵀ C⁻¹ r of the roots r
with squares ≥ 0, found by Fisher scoring; each step is a least squares problem with bounds. The 95 % interval of a
coefficient holds the values for which this sum, with the others free, is at most 3.84 above its minimum (profile
likelihood).
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.noise.allan import QUANTISATION, AllanCurve, degrees_of_freedom
from levelhead.recording import Array

NAMES = ("quantisation_noise", "white_noise_density", "bias_instability", "random_walk")
FLICKER_SHARE = 2.0 * math.log(2.0) / math.pi
RISE = 3.84  # of the sum at the ends of a 95 % interval: χ²(1)
ROUNDS = 60
FREQUENCIES = 6_000  # at which equation 3 is integrated
MAX_FILTERED = 0.3  # s: a chip's low-pass filter shapes shorter τ only
CLEARLY = 6.63  # by which a sum is smaller with one number more, in one of 100 cases by chance: χ²(1)
MIN_FACTORS = 32  # times as many samples as an averaging factor make the sum over them long
MISFIT = 3.0  # mean squared misfit in σ from which the shortest τ is not of this model


class Coefficients(NamedTuple):
    """Q, N, B and K of one axis, each with its 1σ and the ends of its 95 % interval; 0 where the interval begins at 0.

    Attributes:
        value: (4,) in unit·s, unit/√Hz, unit and unit/√s.
        sigma: (4,) 1σ.
        low: (4,) lower ends; 0: this noise does not show.
        high: (4,) upper ends.
        freedom: (k,) ν of each τ of the curve.
        used: (k,) which of them the fit has used.
        misfit: mean squared misfit in σ: about 1 for noise of this model.
    """

    value: Array
    sigma: Array
    low: Array
    high: Array
    freedom: Array
    used: NDArray[np.bool_]
    misfit: float


def shapes(tau: Array) -> Array:
    """(k, 4) the terms of equation 1 for squares of 1."""
    return np.stack([3.0 / tau**2, 1.0 / tau, np.full_like(tau, FLICKER_SHARE), tau / 3.0], axis=1)


class Data(NamedTuple):
    """The data of the fit: the terms of equation 1, σ² as measured, its ν, the whitening of equation 2's roots, and
    squares that are known (place -> square).
    """

    terms: Array
    seen: Array
    freedom: Array
    whitening: Array
    known: dict[int, float]


class NoiseFit(NamedTuple):
    """A minimum: the squares, the sum there, and the data."""

    squares: Array
    total: float
    data: Data


def freedoms(curve: AllanCurve, rows: NDArray[np.bool_], squares: Array) -> Array:
    """(k,) ν at the τ in ``rows``, mixed by the share of σ² of each noise there."""
    parts = shapes(curve.tau[rows]) * squares
    share = parts / np.maximum(parts.sum(axis=1, keepdims=True), 1e-300)
    each = np.array([[degrees_of_freedom(kind, curve.count, int(m)) for kind in range(4)] for m in curve.factor[rows]])
    mixed: Array = np.exp((share * np.log(np.maximum(each, 0.5))).sum(axis=1))
    return mixed


def spectral(curve: AllanCurve, rows: NDArray[np.bool_], squares: Array) -> tuple[Array, Array]:
    """(k,) ν of the estimates at the τ in ``rows``, and (k, k) their correlation, equation 3."""
    factor, interval = curve.factor[rows].astype(float), float(curve.tau[0] / curve.factor[0])
    f = np.geomspace(0.01 / factor[-1], 0.5, FREQUENCIES)  # in cycles a sample
    chord = 2.0 * np.sin(math.pi * f)
    rate = chord / interval  # rad/s
    spectrum = squares @ np.array([interval * rate**2, np.ones_like(f), 1.0 / rate, rate**-2.0])
    power = spectrum * (np.sin(math.pi * np.outer(factor, f)) ** 2 / (factor[:, None] * chord)) ** 2
    area = np.trapezoid(power, f)
    root = power * np.sqrt(np.gradient(f))
    product = root @ root.T
    squared = np.diag(product)
    freedom: Array = 2.0 * (curve.count + 1 - 2.0 * factor) * area**2 / squared
    return freedom, product / np.sqrt(np.outer(squared, squared))


def roots(model: Array, data: Data) -> Array:
    """(k,) whitened signed roots of the deviances, equation 2."""
    ratio = data.seen / model
    deviance = data.freedom * np.maximum(ratio - 1.0 - np.log(ratio), 0.0)
    whitened: Array = data.whitening @ (np.sign(ratio - 1.0) * np.sqrt(deviance))
    return whitened


def minimum(data: Data, known: dict[int, float]) -> tuple[Array, float]:
    """Squares ≥ 0 with the least sum, those in ``known`` (place -> square) held fixed, and the sum."""
    from scipy.optimize import nnls

    known = data.known | known
    free = [i for i in range(4) if i not in known]
    squares, model = np.zeros(4), data.seen.copy()
    for i, square in known.items():
        squares[i] = square
    fixed = data.terms @ squares
    best, found = math.inf, squares.copy()
    for _ in range(ROUNDS):
        whitening = data.whitening * (np.sqrt(0.5 * data.freedom) / model)
        left = whitening @ data.terms[:, free]
        scale = np.maximum(np.linalg.norm(left, axis=0), 1e-300)
        squares[free] = nnls(left / scale, whitening @ (data.seen - fixed))[0] / scale
        model = np.maximum(data.terms @ squares, 1e-6 * data.seen)
        total = float(np.square(roots(model, data)).sum())
        improved = best - total
        if improved > 0.0:
            best, found = total, squares.copy()
        if improved < 1e-6:
            break
    return found, best


def fit(curve: AllanCurve) -> Coefficients:
    """Q, N, B and K of one axis.

    A chip's low-pass filter makes the shortest τ too quiet: up to 0.3 s, they are left out as long as the fit without
    them is much better.
    """
    used = (curve.factor & (curve.factor - 1)) == 0  # one in an octave
    if not (curve.deviation[used] > 0.0).all():
        return _silent(curve)
    result = _select_fit(curve, used)
    while _misfit(result) > MISFIT:
        shorter = used.copy()
        shorter[int(used.argmax())] = False
        if shorter.sum() < 6 or curve.tau[shorter][0] > MAX_FILTERED:
            break
        without = _select_fit(curve, shorter)
        if _misfit(without) > 0.7 * _misfit(result):
            break
        used, result = shorter, without
    return _with_intervals(curve, used, result)


def _select_fit(curve: AllanCurve, used: NDArray[np.bool_]) -> NoiseFit:
    """The fit without Q, which most sensors do not show, or with it where that is clearly better."""
    without, with_it = _minimise(curve, used, {QUANTISATION: 0.0}), _minimise(curve, used, {})
    return with_it if without.total - with_it.total > CLEARLY else without


def _silent(curve: AllanCurve) -> Coefficients:
    """Of an axis without any noise."""
    zero = np.zeros(4)
    return Coefficients(zero, zero, zero, zero, np.ones(len(curve.tau)), np.zeros(len(curve.tau), bool), 0.0)


def _minimise(curve: AllanCurve, used: NDArray[np.bool_], known: dict[int, float]) -> NoiseFit:
    """Alternates between the squares and the ν and correlations that follow from them."""
    terms, seen = shapes(curve.tau[used]), curve.deviation[used] ** 2
    squares, total = np.array([0.0, 1.0, 0.0, 0.0]), math.inf
    many = curve.factor[used] * MIN_FACTORS < curve.count  # equation 3 holds for sums of many independent terms
    for _ in range(4):
        freedom, correlation = spectral(curve, used, squares)
        freedom = np.where(many, freedom, freedoms(curve, used, squares))
        data = Data(terms, seen, freedom, np.linalg.inv(np.linalg.cholesky(correlation)), known)
        squares, total = minimum(data, {})
    return NoiseFit(squares, total, data)


def _misfit(result: NoiseFit) -> float:
    """Mean squared misfit in σ, a degree of freedom."""
    return result.total / max(1, len(result.data.seen) - int((result.squares > 0.0).sum()))


def _with_intervals(curve: AllanCurve, used: NDArray[np.bool_], result: NoiseFit) -> Coefficients:
    """The coefficients with profile likelihood intervals, wider where the model does not fit (Birge's ratio)."""
    misfit, data = _misfit(result), result.data
    rise = RISE * max(1.0, misfit)

    def profile(square: float, place: int) -> float:
        return minimum(data, {place: square})[1] - result.total - rise

    low, high = np.zeros(4), np.zeros(4)
    for place in range(4):
        best = float(result.squares[place])
        step = max(best, 1e-6 * float((data.seen / data.terms[:, place]).min()))
        top = best + step
        while profile(top, place) < 0.0 and top < 1e12 * step:
            top = best + 4.0 * (top - best)
        high[place] = math.sqrt(_root(profile, place, best, top))
        if best > 0.0 and profile(0.0, place) > 0.0:
            low[place] = math.sqrt(_root(profile, place, best, 0.0))
    value = np.sqrt(result.squares)
    every = np.ones(len(curve.tau), bool)
    sigma = (high - low) / (2.0 * 1.96)
    return Coefficients(value, sigma, low, high, freedoms(curve, every, result.squares), used, misfit)


def _root(of: Callable[[float, int], float], place: int, inside: float, outside: float) -> float:
    """The square at which a profile, below 0 at ``inside`` and above at ``outside``, is 0."""
    from scipy.optimize import brentq

    width = abs(outside - inside)
    return float(brentq(of, inside, outside, args=(place,), xtol=1e-5 * width, rtol=1e-5))
