"""The lesson: one angle, a noisy accelerometer and a drifting gyroscope, with published results to check against."""

import math

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array, Recording, Truth
from levelhead.simulate.noise import check_seed
from levelhead.units import GRAVITY

SAMPLES = 6000
INTERVAL = 0.01  # s: 60 s at 100 Hz
GYR_NOISE = 0.3  # °/s, 1σ of a sample
BUMPS = 20
BUMP = 15.0  # °, bumps are uniform within ± this


def lesson(seed: int = 42, *, accel_noise: float = 3.0, bias_walk: float = 0.02) -> Recording:
    """The classic lesson in sensor fusion: 60 s at 100 Hz of roll, measured in two ways that contradict each other.

    The true angle is 30°·sin 0.2t + 10°·sin 0.05t. The accelerometer sees it with white noise, a vibration
    5°·sin 50t·exp(−0.05t) and 20 bumps; the gyroscope sees its rate with 0.3 °/s of white noise and a bias that walks.

    The numbers come from NumPy's legacy generator (frozen for ever by NEP 19) in the published order, so that seed 42
    gives the published errors to the digit: RMSE 3.3346° from the accelerometer alone, 1.3213° from the gyroscope
    alone, 0.3357° from the complementary filter with α = 0.98, 0.4536° from the textbook Kalman filter (q_angle 0.001,
    q_bias 0.003, r 4). ``tests/simulate/test_lesson.py`` holds them.

    Args:
        seed: of ``numpy.random.RandomState``, 0 to 2³²−1.
        accel_noise: 1σ of the accelerometer angle in degrees, per sample.
        bias_walk: the bias of the gyroscope takes steps of ``bias_walk``·dt °/s (1σ), 0.0002 °/s by default.

    Returns:
        A Recording with acc = g·(0, sin a, cos a) for the accelerometer angle a, so that ``atan2(acc_y, acc_z)`` gives
        it back; gyr = (rate, 0, 0) in rad/s; truth.quat a roll about x; truth.bias = (bias, 0, 0) in rad/s.

    Raises:
        LevelheadError: the seed is out of range, or a noise is negative or not finite.
    """
    for name, value, unit in (("accel_noise", accel_noise, "°"), ("bias_walk", bias_walk, "°/s")):
        if not (math.isfinite(value) and value >= 0.0):
            raise LevelheadError(f"{name} of the lesson is {value}; expected a finite number of {unit}, zero or more")

    t = INTERVAL * np.arange(SAMPLES, dtype=np.float64)
    angle = 30.0 * np.sin(0.2 * t) + 10.0 * np.sin(0.05 * t)
    # The order of the draws is part of the lesson: another order gives another recording for the same seed.
    random = np.random.RandomState(check_seed(seed, 2**32))
    accel = angle + random.normal(0.0, accel_noise, SAMPLES)
    accel += 5.0 * np.sin(50.0 * t) * np.exp(-0.05 * t)
    accel[random.choice(SAMPLES, BUMPS, replace=False)] += random.uniform(-BUMP, BUMP, BUMPS)
    bias = np.cumsum(random.normal(0.0, bias_walk * INTERVAL, SAMPLES))
    rate: Array = np.gradient(angle, INTERVAL) + bias + random.normal(0.0, GYR_NOISE, SAMPLES)

    meta = {"source": "lesson", "seed": seed, "accel_noise": accel_noise, "bias_walk": bias_walk}
    tilt = np.radians(accel)
    acc: Array = GRAVITY * np.stack([np.zeros(SAMPLES), np.sin(tilt), np.cos(tilt)], axis=1)
    gyr: Array = _about_x(np.radians(rate))
    return Recording(t, gyr, acc, truth=_truth(angle, bias), meta=meta)


def hard_lesson(seed: int = 42) -> Recording:
    """The lesson's hard case: 10° of accelerometer noise and a bias that walks five times as fast.

    Args:
        seed: as for ``lesson``.

    Raises:
        LevelheadError: the seed is out of range.
    """
    return lesson(seed, accel_noise=10.0, bias_walk=0.1)


def _about_x(values: Array) -> Array:
    """(n,) values as the x components of (n, 3) vectors."""
    vectors = np.zeros((len(values), 3))
    vectors[:, 0] = values
    return vectors


def _truth(angle: Array, bias: Array) -> Truth:
    """Angle (°) and bias (°/s) as a roll about x and a bias in rad/s."""
    half = np.radians(angle) / 2.0
    zero = np.zeros_like(half)
    return Truth(np.stack([np.cos(half), np.sin(half), zero, zero], axis=1), _about_x(np.radians(bias)))
