"""Bias against temperature: a polynomial by robust least squares, from a sensor at rest that warms up.

With u = T − T₀ the mean of a block of samples is b₀ + b₁ u + b₂ u² + b₃ u³ + n. The noise n of block i is white plus a
random walk, C = s² I + q min(i, j), because a bias that walks looks like one that follows the temperature; without q, σ
would be several times too small. s² and q come from differences of the residuals, Var(n[i + L] − n[i]) = 2 s² + L q.
Residuals whitened by C go to SciPy's ``least_squares`` with the losses of Huber and then of Cauchy, for which a block
that was touched hardly counts.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from levelhead.calibration import TemperatureCurve
from levelhead.open_types import JsonObject
from levelhead.recording import Array

BLOCKS = 300
MIN_SPAN = 0.5  # K below which nothing is fitted
WEAK_SPAN = 5.0  # K below which the answer is weak
MIN_SIGMAS = 4.0  # σ from which a coefficient shows
BENDS = (5.0, 30.0)  # K from which on there is a term more: data do not choose, so that σ is that of one fit
MAX_DEGREE = 3  # degree
ROBUST = 2.5  # σ from which a block counts by its distance only
MIN_DIFFERENCES = 4  # differences that do not overlap, at the longest lag
HIDDEN = 0.3  # of the noise of a block: a random walk over all blocks that no difference would show
MEDIAN_OF_SQUARE = 0.4549  # of a normal variable, over its variance
ARRAYS = ("value", "sigma", "before", "after")
MIN_BLOCK = 20  # samples with a temperature in a block


class Curve(NamedTuple):
    """Of one axis.

    Attributes:
        value: (4,) b₀ to b₃ in the sensor's unit over K⁰ to K³; 0 above the degree.
        sigma: (4,) 1σ.
        before: RMS of the blocks about their mean.
        after: RMS about the curve.
    """

    value: Array
    sigma: Array
    before: float
    after: float


@dataclass(frozen=True, eq=False)
class TemperatureDrift:
    """How the biases of one sensor change with temperature.

    Attributes:
        reference: T₀, °C.
        low: coldest block, °C.
        high: warmest block, °C.
        value: (3, 4) b₀ to b₃ of x, y and z in the sensor's unit over K⁰ to K³.
        sigma: (3, 4) 1σ.
        before: (3,) RMS of the blocks about their mean.
        after: (3,) RMS about the curve.
        blocks: (k, 4) temperature and mean readings of the blocks; empty when read from a file.
    """

    reference: float
    low: float
    high: float
    value: Array
    sigma: Array
    before: Array
    after: Array
    blocks: Array

    @property
    def span(self) -> float:
        """K between the coldest block and the warmest."""
        return self.high - self.low

    @property
    def clear(self) -> bool:
        """Whether a change of the bias with temperature shows."""
        return bool((np.abs(self.value[:, 1:]) > MIN_SIGMAS * self.sigma[:, 1:]).any())

    def curve(self) -> TemperatureCurve:
        """For a Calibration."""
        return TemperatureCurve(self.reference, self.low, self.high, self.value[:, 1:])

    def to_dict(self) -> JsonObject:
        """For JSON: b₀ to b₃ of x, y and z, without the blocks."""
        arrays = {name: getattr(self, name).tolist() for name in ARRAYS}
        return {"reference_C": self.reference, "low_C": self.low, "high_C": self.high} | arrays

    @classmethod
    def from_dict(cls, part: Mapping[str, object]) -> "TemperatureDrift":
        """The object that ``to_dict`` described; raises KeyError, TypeError or ValueError for anything else."""
        numbers = [np.array(part[f"{name}_C"], dtype=float) for name in ("reference", "low", "high")]
        arrays = [np.array(part[name], dtype=float) for name in ARRAYS]
        shapes = [one.shape for one in (*numbers, *arrays)]
        if shapes != [()] * 3 + [(3, MAX_DEGREE + 1)] * 2 + [(3,)] * 2 or not all(
            np.isfinite(one).all() for one in (*numbers, *arrays)
        ):
            raise ValueError
        reference, low, high = (float(one) for one in numbers)
        value, sigma, before, after = arrays
        return cls(reference, low, high, value, sigma, before, after, np.zeros((0, 4)))

    def bias(self, temperature: Array) -> Array:
        """(n, 3) bias at (n,) °C."""
        powers = np.power.outer(temperature - self.reference, np.arange(MAX_DEGREE + 1))
        found: Array = powers @ self.value.T
        return found


def temperature_drift(values: Array, temperature: Array) -> TemperatureDrift | None:
    """Bias against temperature of (n, 3) readings at rest and (n,) °C, NaN where missing.

    Returns:
        None where the temperature is hardly known, or spans less than 0.5 K.
    """
    blocks = _blocks(values, temperature)
    if len(blocks) < 20 or np.ptp(blocks[:, 0]) < MIN_SPAN:
        return None
    reference = round(float(np.median(blocks[:, 0])), 1)
    curves = [fit_curve(blocks[:, 0] - reference, blocks[:, axis]) for axis in (1, 2, 3)]
    value, sigma, before, after = (np.array([getattr(one, name) for one in curves]) for name in ARRAYS)
    low, high = float(blocks[:, 0].min()), float(blocks[:, 0].max())
    return TemperatureDrift(reference, low, high, value, sigma, before, after, blocks)


def _blocks(values: Array, temperature: Array) -> Array:
    """(k, 4) mean temperature and readings of blocks of equal length."""
    found = []
    for rows in np.array_split(np.arange(len(values)), min(BLOCKS, max(1, len(values) // MIN_BLOCK))):
        part = values[rows]
        good = np.isfinite(part).all(axis=1)
        known = np.isfinite(temperature[rows])
        if known.any() and good.sum() >= MIN_BLOCK // 2:
            found.append([temperature[rows][known].mean(), *part[good].mean(axis=0)])
    return np.array(found).reshape(-1, 4)


def fit_curve(u: Array, means: Array) -> Curve:
    """The polynomial of (k,) means over (k,) K from the reference."""
    scale = float(np.abs(u).max())
    centre = float(np.median(means))
    before = float(np.sqrt(np.mean((means - means.mean()) ** 2)))
    span = float(np.ptp(u))
    degree = 1 + sum(span >= one for one in BENDS)
    value, sigma, left = _solve(u / scale, means - centre, degree)
    powers = scale ** np.arange(degree + 1)
    whole, deviation = np.zeros(MAX_DEGREE + 1), np.zeros(MAX_DEGREE + 1)
    whole[: degree + 1], deviation[: degree + 1] = value / powers, sigma / powers
    whole[0] += centre
    return Curve(whole, deviation, before, float(np.sqrt(np.mean(left**2))))


def _solve(share: Array, means: Array, degree: int) -> tuple[Array, Array, Array]:
    """Coefficients, their 1σ, and the residuals, of means over shares of the largest |u|."""
    from scipy.optimize import least_squares

    matrix = np.power.outer(share, np.arange(degree + 1))
    value: Array = np.asarray(np.linalg.lstsq(matrix, means, rcond=None)[0], dtype=np.float64)
    white = matrix
    for loss in ("huber", "huber", "cauchy"):
        both = whiten(np.column_stack([matrix, means]), *block_variances(means - matrix @ value))
        white, seen = both[:, :-1], both[:, -1]
        found = least_squares(
            lambda one, by=white, of=seen: by @ one - of, value, jac=lambda one, by=white: by,
            loss=loss, f_scale=ROBUST, x_scale="jac",
        )  # fmt: skip
        value = np.asarray(found.x, dtype=np.float64)
    sigma: Array = np.sqrt(np.diag(np.linalg.inv(white.T @ white)))
    left: Array = means - matrix @ value
    return value, sigma, left


def whiten(columns: Array, white: float, walk: float) -> Array:
    """(k, n) columns times the inverse of the Cholesky factor of their rows' covariance, white I + walk min(i, j).

    Differences of neighbouring rows have a covariance in three diagonals, so that the factor has two: walk + white · 2,
    (walk + white in the first row), and −white beside them.
    """
    from scipy.linalg import cholesky_banded, solve_banded

    bands = np.full((2, len(columns)), -white)
    bands[0] = 2.0 * white + walk
    bands[0, 0] = white + walk
    root = cholesky_banded(bands, lower=True)
    found: Array = solve_banded((1, 0), root, np.diff(columns, axis=0, prepend=0.0))
    return found


def block_variances(left: Array) -> tuple[float, float]:
    """Of (k,) residuals: their white part's variance, and a random walk's by block; by medians, so no touch counts."""
    lags = [2**i for i in range(12) if 2**i <= len(left) // MIN_DIFFERENCES]
    spread = [max(float(np.median((left[lag:] - left[:-lag]) ** 2)) / MEDIAN_OF_SQUARE, 1e-300) for lag in lags]
    hidden = HIDDEN * spread[0] / len(left)
    walk = max(
        [hidden, *((one - spread[0]) / (lag - 1) for one, lag in zip(spread[1:], lags[1:], strict=True) if lag > 4)]
    )
    return max(0.5 * (spread[0] - walk), 0.05 * spread[0]), walk
