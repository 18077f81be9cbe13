"""The error model of a triad: three axes of a gyroscope, an accelerometer or a magnetometer."""

import math
from dataclasses import dataclass, fields

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array
from levelhead.simulate import noise
from levelhead.simulate.disturbance import Bumps, Vibration, bumps, require_number, vibration

PerAxis = float | tuple[float, float, float]

# One random stream per effect, so that effects can be switched on and off one by one.
TURN_ON, MATRIX, WHITE, INSTABILITY, WALK, VIBRATION, BUMPS, FLICKER, ANGLE = range(9)


@dataclass(frozen=True)
class TriadErrors:
    """Errors of a triad. "Unit" is rad/s, m/s² or µT; one number holds for each of the three axes.

    Attributes:
        white_noise_density: N in unit/√Hz: samples have σ = N·√rate, the Allan deviation at τ = 1 s is N. For a
            gyroscope this is the angle random walk. It is the two-sided density of IEEE Std 952; the one-sided density
            of data sheets is √2 times as large.
        turn_on_bias: 1σ of the constant that each run begins with, in unit.
        bias_instability: B in unit: the flat part of the Allan deviation lies at 0.664·B. Modelled as a first-order
            Gauss–Markov process, see ``noise.gauss_markov``.
        correlation_time: of that process, in s.
        random_walk: K in unit/√s, which is unit/s/√Hz (rate random walk): the bias wanders by σ = K·√t.
        flicker_noise: B in unit of true flicker noise, without a correlation time: as in an Allan plot of a real
            sensor; ``bias_instability`` is its substitute with a finite model.
        quantisation_noise: Q in unit·s: white noise of the integrated reading, whose Allan deviation is √3 Q/τ.
        scale_factor: 1σ of the scale factor error of each axis, a fraction (0.01 is one percent).
        misalignment: 1σ in rad of each of the six small angles by which the axes misalignment (cross-axis sensitivity).
        quantisation: one least significant bit, in unit; 0 leaves the values continuous.
        full_scale: readings stop at ± this, in unit.
        vibration: a sine from outside, or None.
        bumps: shocks from outside, or None.

    Raises:
        LevelheadError: a value is negative or not a number.
    """

    white_noise_density: PerAxis = 0.0
    turn_on_bias: PerAxis = 0.0
    bias_instability: PerAxis = 0.0
    correlation_time: float = 100.0
    random_walk: PerAxis = 0.0
    scale_factor: PerAxis = 0.0
    misalignment: float = 0.0
    quantisation: float = 0.0
    full_scale: float = math.inf
    vibration: Vibration | None = None
    bumps: Bumps | None = None
    flicker_noise: PerAxis = 0.0
    quantisation_noise: PerAxis = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in ("vibration", "bumps"):
                continue
            values = value if isinstance(value, tuple) else (value,)
            if len(values) not in (1, 3):
                raise LevelheadError(f"{field.name} has {len(values)} values; expected one, or three (x, y, z)")
            for one in values:
                positive = field.name in ("correlation_time", "full_scale")
                require_number(
                    field.name, one, _UNITS[field.name], positive=positive, infinite=field.name == "full_scale"
                )


_UNITS = {
    "white_noise_density": "in unit/√Hz",
    "turn_on_bias": "in the sensor's unit",
    "bias_instability": "in the sensor's unit",
    "correlation_time": "s",
    "random_walk": "in unit/√s",
    "flicker_noise": "in the sensor's unit",
    "quantisation_noise": "in unit·s",
    "scale_factor": "as a fraction",
    "misalignment": "rad",
    "quantisation": "in the sensor's unit",
    "full_scale": "in the sensor's unit",
}


@dataclass(frozen=True, eq=False)
class TriadReadings:
    """Readings of a triad, with the errors in them.

    Attributes:
        values: (n, 3) in the sensor's unit.
        bias: (n, 3) turn-on bias + bias instability or flicker noise + random walk, in the sensor's unit.
        turn_on_bias: (3,) the constant part of it.
        matrix: (3, 3) scale factor and misalignment: values = matrix @ true + bias + noise.
    """

    values: Array
    bias: Array
    turn_on_bias: Array
    matrix: Array


def apply_errors(triad: TriadErrors, true: Array, t: Array, seed: int, sensor: int = 0) -> TriadReadings:
    """Readings of the triad for the true values ``true``.

    The effects act in the order in which they do in hardware: true → scale factor and misalignment → bias → white noise
    → vibration and bumps → saturation → quantisation.

    Args:
        triad: the error model.
        true: (n, 3) in the sensor's unit.
        t: (n,) s, evenly spaced, at least two.
        seed: zero or more; the same seed gives the same bits.
        sensor: number of the sensor on its board, so that the noises of two are independent.

    Raises:
        LevelheadError: the seed is negative.
    """
    n, rate = len(t), float((len(t) - 1) / (t[-1] - t[0]))

    def stream(effect: int) -> np.random.Generator:
        return noise.generator(seed, 1, sensor, effect)

    matrix = error_matrix(stream(MATRIX), triad)
    turn_on = stream(TURN_ON).standard_normal(3) * np.asarray(triad.turn_on_bias)
    bias = np.tile(turn_on, (n, 1))
    if np.any(triad.bias_instability):
        instability = np.asarray(triad.bias_instability)
        bias += noise.gauss_markov(stream(INSTABILITY), n, rate, instability, triad.correlation_time)
    if np.any(triad.flicker_noise):
        bias += noise.flicker(stream(FLICKER), n, np.asarray(triad.flicker_noise))
    if np.any(triad.random_walk):
        bias += noise.random_walk(stream(WALK), n, rate, np.asarray(triad.random_walk))
    values = true @ matrix.T + bias
    if np.any(triad.white_noise_density):
        values += noise.white(stream(WHITE), n, rate, np.asarray(triad.white_noise_density))
    if np.any(triad.quantisation_noise):
        values += noise.angle_white(stream(ANGLE), n, rate, np.asarray(triad.quantisation_noise))
    if triad.vibration is not None:
        values += vibration(stream(VIBRATION), t, triad.vibration)
    if triad.bumps is not None:
        values += bumps(stream(BUMPS), t, triad.bumps)
    return TriadReadings(digitise(values, triad.full_scale, triad.quantisation), bias, turn_on, matrix)


def error_matrix(random: np.random.Generator, triad: TriadErrors) -> Array:
    """(3, 3) diag(1 + s)·(I + E): scale factor errors s and six misalignment angles E.

    All six off-diagonal elements are drawn, three for the axes that are not at right angles and three for the triad
    turned as a whole against the package (Tedaldi, Pretto & Menegatti 2014, A robust and easy to implement method for
    IMU calibration without external equipments, ICRA; here with both parts in one matrix).
    """
    scale = 1.0 + random.standard_normal(3) * np.asarray(triad.scale_factor)
    misalignment = random.standard_normal((3, 3)) * triad.misalignment
    np.fill_diagonal(misalignment, 0.0)
    matrix: Array = scale[:, None] * (np.eye(3) + misalignment)
    return matrix


def digitise(values: Array, full_scale: float, quantisation: float) -> Array:
    """Stop ``values`` at ± full scale, then round them to whole bits; zero is always a code (mid-tread)."""
    clipped: Array = np.clip(values, -full_scale, full_scale)
    if quantisation == 0.0:
        return clipped
    last = math.floor(full_scale / quantisation * (1.0 + 1e-12)) if math.isfinite(full_scale) else math.inf
    # Rounding must not lift a saturated value over full scale when full scale is not a whole number of bits.
    codes: Array = np.clip(np.rint(clipped / quantisation), -last, last) * quantisation
    return codes
