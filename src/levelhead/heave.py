"""Heave: the vertical motion of a boat or a buoy about its mean, with 1σ.

Acceleration integrated twice drifts without bound, but a sea has little power below its waves. With w white noise and
s = d/dt, the model of height z is a cascade of three linear wave models (T. I. Fossen, Handbook of Marine Craft
Hydrodynamics and Motion Control, 2011, section 8.2.6), so that power falls with ω⁶ below ω₀ and with ω⁻⁶ above,

    z = K (s / (s² + 2 ζ ω₀ s + ω₀²))³ w                                                                      (1)

and the vertical acceleration is measured with the random walk b of its errors (bias, tilt) and white noise n,

    y = z̈ + b + n,   densities q² of b's walk and r² of n                                                     (2)

ω₀, ζ, K, q and r are those of greatest likelihood for the periodogram I(ω) of y (P. Whittle, Arkiv för Matematik 2,
1953), averaged over neighbours:

    −log L = Σ log S(ω) + I(ω)/S(ω),   S = K² ω⁴ (ω² / ((ω₀² − ω²)² + (2 ζ ω₀ ω)²))³ + q²/ω² + r²               (3)

A Kalman filter of (1) and (2), and the smoother of H. Rauch, F. Tung and C. Striebel (AIAA J. 3(8), 1965), give z. The
smoother delays no frequency, and the filter's estimate is of the present.
"""

import math
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError, require
from levelhead.recording import Array

STATES = 7  # three pairs of (1), and b
HEIGHT, SPEED, ACCELERATION, WALK = 3, 4, 5, 6  # s³, s⁴ and s⁵ of the cascade; b
FASTEST = 1.0  # Hz: waves of boats and buoys are slower
LEAST_WAVES = 10  # in a log
BLOCKS = 60  # in ω₀'s period: a mean over one has 0.05 % less amplitude
BINS = 200  # of the periodogram
LEAST_EVIDENCE = 20.0  # of log L for waves, beyond a sensor's errors alone
LEAST_DAMPING, MOST_DAMPING = 0.02, 1.0  # a regular swell, and from there on nothing oscillates
MOST_DOUBT = 0.5  # σ of heave as a share of heave
ERROR_TIME = 1.0  # s in which an error of attitude changes
FIRST_ERROR = 1.0  # m/s², 1σ of b at the start


class Sea(NamedTuple):
    """The model of a sea and of the errors of vertical acceleration, (1) and (2).

    Attributes:
        height: m, significant: four times the standard deviation of heave.
        period: s, 2π/ω₀: of a broad sea 0.8 times the period of the spectrum's peak.
        damping: ζ; the smaller, the more regular the waves are.
        drift: q, (m/s²)/√s.
        noise: r, (m/s²)/√Hz, of a two-sided density.
    """

    height: float
    period: float
    damping: float = 0.4
    drift: float = 3e-4
    noise: float = 1e-3


class HeaveSample(NamedTuple):
    """Heave now.

    Attributes:
        value: m, up positive, about the mean.
        velocity: m/s.
        sigma: 1σ of the value, m.
    """

    value: float
    velocity: float
    sigma: float


class Heave(NamedTuple):
    """Heave of each sample.

    Attributes:
        value: (n,) m, up positive, about the mean.
        velocity: (n,) m/s.
        sigma: (n,) 1σ of the value, m.
        sea: the model that was found.
    """

    value: Array
    velocity: Array
    sigma: Array
    sea: Sea

    @property
    def significant_height(self) -> float:
        """Four times the standard deviation of heave, m."""
        return 4.0 * float(np.std(self.value))

    @property
    def mean_period(self) -> float:
        """Mean time between upward zeros, s: 2π times the ratio of the standard deviations of heave and velocity."""
        return 2.0 * math.pi * float(np.std(self.value) / np.std(self.velocity))

    def columns(self) -> dict[str, Array]:
        """The columns of a file, with their units."""
        return {"heave [m]": self.value, "heave_velocity [m/s]": self.velocity, "sigma_heave [m]": self.sigma}

    def words(self) -> str:
        """Significant height, mean period and the median of σ."""
        return (
            f"significant height {self.significant_height:.2f} m, mean period {self.mean_period:.1f} s, "
            f"σ {float(np.median(self.sigma)):.3f} m"
        )

    def __repr__(self) -> str:
        return f"Heave({len(self.value)} samples; {self.words()})"


def _feedback(damping: float) -> Array:
    """(6, 6) of the cascade (1), in units of 1/ω₀."""
    matrix = np.zeros((6, 6))
    matrix[:5, 1:] = np.eye(5)
    matrix[5] = -np.array((np.polynomial.Polynomial([1.0, 2.0 * damping, 1.0]) ** 3).coef[:6])
    return matrix


def _spread(damping: float) -> Array:
    """(6, 6) stationary covariance of the cascade driven by noise of unit density: A P + P Aᵀ + e₆ e₆ᵀ = 0."""
    matrix, power = _feedback(damping), np.zeros(36)
    power[-1] = 1.0
    both = np.kron(matrix, np.eye(6)) + np.kron(np.eye(6), matrix)
    return np.asarray(np.linalg.solve(both, -power).reshape(6, 6), np.float64)


class _Cascade:
    """(1) and (2) in steps of ``dt`` s: x ← Φ x + noise of Q."""

    def __init__(self, sea: Sea, dt: float) -> None:
        from scipy.linalg import expm

        omega = 2.0 * math.pi / sea.period
        spread = _spread(sea.damping)
        spread *= (sea.height / 4.0) ** 2 / spread[HEIGHT, HEIGHT]
        self.start = np.zeros((STATES, STATES))
        self.start[:6, :6], self.start[WALK, WALK] = spread, FIRST_ERROR**2
        self.transition = np.eye(STATES)
        self.transition[:6, :6] = expm(_feedback(sea.damping) * omega * dt)
        self.noise = np.zeros((STATES, STATES))
        self.noise[:6, :6] = spread - self.transition[:6, :6] @ spread @ self.transition[:6, :6].T
        self.noise[WALK, WALK] = sea.drift**2 * dt
        self.seen = np.zeros(STATES)
        self.seen[ACCELERATION], self.seen[WALK] = omega**2, 1.0
        self.variance = sea.noise**2 / dt
        self.omega = omega

    def predict(self, x: Array, p: Array) -> tuple[Array, Array]:
        """Mean and covariance a step later."""
        return self.transition @ x, self.transition @ p @ self.transition.T + self.noise

    def correct(self, x: Array, p: Array, y: float) -> tuple[Array, Array]:
        """The same with a vertical acceleration y in m/s²; NaN: none."""
        if math.isnan(y):
            return x, p
        across = p @ self.seen
        gain = across / (self.seen @ across + self.variance)
        return x + gain * (y - self.seen @ x), p - np.outer(gain, across)


class HeaveFilter:
    """Heave while it happens: the Kalman filter of (1) and (2). Its estimate is of the present, without a delay.

    Args:
        sea: ``Heave.sea`` of a recording, or ``Sea(height, period)`` by eye.

    Raises:
        LevelheadError: no numbers above 0, or no SciPy.
    """

    def __init__(self, sea: Sea) -> None:
        require("scipy", "heave", "scipy")
        if not all(math.isfinite(number) and number > 0.0 for number in sea):
            raise LevelheadError(f"the sea is {sea}; expected numbers above 0")
        self.sea = sea
        self._x = np.zeros(STATES)
        self._cascade = _Cascade(sea, sea.period / BLOCKS)
        self._p = self._cascade.start
        self._dt = sea.period / BLOCKS

    def update(self, acceleration: float, dt: float) -> HeaveSample:
        """Takes a vertical acceleration without gravity.

        Args:
            acceleration: m/s², up positive: ``Stream.earth_acceleration(acc).z``; NaN where it is missing.
            dt: s since the sample before.

        Raises:
            LevelheadError: dt is not above 0, or the acceleration is infinite.
        """
        if not 0.0 < dt < math.inf or math.isinf(acceleration):
            raise LevelheadError(f"dt is {dt} s and the acceleration {acceleration}; expected dt above 0, and m/s²")
        if abs(dt - self._dt) > 0.01 * self._dt:  # jitter below matters less than r
            self._dt, self._cascade = dt, _Cascade(self.sea, dt)
        self._x, self._p = self._cascade.correct(*self._cascade.predict(self._x, self._p), acceleration)
        sigma = math.sqrt(self._p[HEIGHT, HEIGHT])
        return HeaveSample(float(self._x[HEIGHT]), float(self._cascade.omega * self._x[SPEED]), sigma)


def estimate_heave(t: Array, acceleration: Array, sigma: Array | None = None) -> Heave:
    """Heave from vertical acceleration.

    Args:
        t: (n,) s.
        acceleration: (n,) m/s² without gravity, up positive; NaN where it is missing.
        sigma: (n,) its 1σ. Where it is beyond its median, as before a filter has found its tilt, b walks faster.

    Raises:
        LevelheadError: no oscillation, fewer than ten waves, σ above half of the heave, or no SciPy.
    """
    require("scipy", "heave", "scipy")
    sea = _Evidence(t, acceleration).sea()
    excess = np.zeros_like(t)
    if sigma is not None:
        excess = np.maximum(np.nan_to_num(sigma) ** 2 - np.nanmedian(sigma) ** 2, 0.0)
    value, velocity, deviation = _smooth(t, acceleration, excess, sea)
    doubt, size = float(np.sqrt(np.mean(deviation**2))), float(np.std(value))
    if doubt > MOST_DOUBT * size:
        raise LevelheadError(
            f"heave is not bounded: its 1σ of {doubt:.2g} m is beyond half of the {size:.2g} m by which it moves; the "
            "errors of acceleration hide the waves"
        )
    return Heave(value, velocity, deviation, sea)


class _Evidence:
    """The periodogram of an acceleration, and the sea that explains it best, (3)."""

    def __init__(self, t: Array, acceleration: Array) -> None:
        self.duration = float(t[-1] - t[0])
        least = LEAST_WAVES / FASTEST
        if self.duration < least:
            raise LevelheadError(
                f"the log lasts {self.duration:.3g} s; heave needs {LEAST_WAVES} waves, more than {least:g} s"
            )
        step = max(self.duration / (len(t) - 1), 0.1 / FASTEST)
        mean = _block_means(t, acceleration, step)
        known = np.isfinite(mean)
        if 2 * known.sum() < len(mean):
            raise LevelheadError("more than half of the accelerations are missing; heave needs most of them")
        even = np.interp(np.arange(len(mean)), np.flatnonzero(known), mean[known])
        taper = np.hanning(len(even)) * math.sqrt(8.0 / 3.0)
        power = np.abs(np.fft.rfft((even - even.mean()) * taper)) ** 2 * step / len(even)
        omega = 2.0 * math.pi * np.fft.rfftfreq(len(even), step)
        last = int(np.searchsorted(omega, 2.0 * math.pi * FASTEST))
        edges = np.unique(np.geomspace(2, last, BINS).astype(int))
        self.count = np.diff(edges).astype(float)
        self.omega = np.add.reduceat(omega[:last], edges[:-1]) / self.count
        self.power = np.add.reduceat(power[:last], edges[:-1]) / self.count + 1e-12 * float(power[2:last].max())

    def sea(self) -> Sea:
        """The sea of greatest likelihood.

        Raises:
            LevelheadError: none is there, or too few waves of it.
        """
        walk = math.log(self.power[0] * self.omega[0] ** 2)
        errors = [[walk, math.log(white)] for white in (self.power.min(), np.median(self.power))]
        waves = []
        for omega in 2.0 * math.pi * FASTEST * np.array([0.06, 0.12, 0.25, 0.5]):
            near = np.abs(np.log(self.omega / omega)) < 0.3
            if near.any():
                waves.append([*errors[0], math.log(omega), math.log(0.4), math.log(0.5 * self.power[near].max())])
        alone, _ = self._minimise(errors)
        cost, found = self._minimise(waves)
        q2, r2, omega, damping, level = (float(number) for number in np.exp(found))
        damping = max(damping, LEAST_DAMPING)
        period = 2.0 * math.pi / omega
        if alone - cost < LEAST_EVIDENCE or damping > MOST_DAMPING or FASTEST * period < 1.0:
            raise LevelheadError(
                "the vertical acceleration shows no waves; heave is the motion of a boat or a buoy, slower than "
                f"{1.0 / FASTEST:g} s and about a height that stays"
            )
        if self.duration < LEAST_WAVES * period:
            raise LevelheadError(
                f"the log lasts {self.duration:.3g} s, {self.duration / period:.1f} waves of {period:.3g} s; heave "
                f"needs {LEAST_WAVES}"
            )
        height = 4.0 * math.sqrt(level * _spread(damping)[HEIGHT, HEIGHT] / omega**3)
        return Sea(height, period, damping, math.sqrt(q2), math.sqrt(r2))

    def _minimise(self, starts: list[list[float]]) -> tuple[float, Array]:
        """The least −log L from several logarithms of q², r² (and ω₀, ζ, K²), and the logarithms there."""
        from scipy.optimize import minimize

        steps = {"xatol": 0.01, "fatol": 0.01, "maxiter": 2000}
        runs = [minimize(self._cost, start, method="Nelder-Mead", options=steps) for start in starts]
        best = min(runs, key=lambda run: float(run.fun))
        return float(best.fun), best.x

    def _cost(self, logarithms: Array) -> float:
        q2, r2, *waves = np.exp(np.clip(logarithms, -60.0, 60.0))
        density = q2 / self.omega**2 + r2
        if waves:
            omega, damping, level = waves[0], max(waves[1], LEAST_DAMPING), waves[2]
            x2 = (self.omega / omega) ** 2
            density = density + level * x2**2 * (x2 / ((1.0 - x2) ** 2 + 4.0 * damping**2 * x2)) ** 3
        return float(np.sum(self.count * (np.log(density) + self.power / density)))


def _origin(t: Array) -> float:
    """Half a sample before the first stamp: a sample is in the middle of its own time."""
    return float(t[0] - 0.5 * (t[-1] - t[0]) / (len(t) - 1))


def _block_means(t: Array, values: Array, step: float) -> Array:
    """(k,) mean of the known values in each block of ``step`` s from ``_origin`` on; NaN where there is none."""
    block = ((t - _origin(t)) / step).astype(int)
    known = np.isfinite(values)
    count = np.bincount(block, known)
    total = np.bincount(block, np.where(known, values, 0.0))
    mean: Array = np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0)
    return mean


def _smooth(t: Array, acceleration: Array, excess: Array, sea: Sea) -> tuple[Array, Array, Array]:
    """(n,) heave, its velocity and 1σ: filter and smoother over blocks, and cubics between their middles."""
    step = max(sea.period / BLOCKS, float(t[-1] - t[0]) / (len(t) - 1))
    mean, more = _block_means(t, acceleration, step), np.nan_to_num(_block_means(t, excess, step))
    model = _Cascade(sea, step)
    n = len(mean)
    before, after = np.zeros((n, STATES)), np.zeros((n, STATES))
    p_before, p_after = np.zeros((n, STATES, STATES)), np.zeros((n, STATES, STATES))
    x, p = np.zeros(STATES), model.start
    for k in range(n):
        if k:
            x, p = model.predict(x, p)
            p[WALK, WALK] += step / ERROR_TIME * max(more[k - 1], more[k])
        before[k], p_before[k] = x, p
        x, p = model.correct(x, p, float(mean[k]))
        after[k], p_after[k] = x, p
    variance = np.empty(n)
    variance[-1] = p[HEIGHT, HEIGHT]
    for k in range(n - 2, -1, -1):
        gain = np.linalg.solve(p_before[k + 1], model.transition @ p_after[k]).T
        after[k] += gain @ (after[k + 1] - before[k + 1])
        p = p_after[k] + gain @ (p - p_before[k + 1]) @ gain.T
        variance[k] = p[HEIGHT, HEIGHT]
    at = np.clip((t - _origin(t)) / step - 0.5, 0.0, n - 1.0)
    first = np.minimum(at.astype(int), n - 2)
    s = at - first
    height, slope = after[:, HEIGHT], model.omega * after[:, SPEED] * step
    rise = height[first + 1] - height[first]
    bend = slope[first] + slope[first + 1] - 2.0 * rise
    turn = rise - slope[first]
    value = height[first] + s * (rise + (s - 1.0) * (turn + s * bend))
    change = rise + (2.0 * s - 1.0) * turn + (3.0 * s - 2.0) * s * bend
    return value, change / step, np.sqrt(np.interp(at, np.arange(n), variance))
