"""σ of filters with set gains: against a simulation of that very observer, and against what the filters get wrong."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import filters
from levelhead.filters import observer_covariance
from levelhead.filters.contract import Gains
from levelhead.kernels.two_state import Covariance
from levelhead.kernels.vec3 import ZERO, Vec3

G = 9.80665
UP = Vec3(0.0, 0.0, G)
NORTH = Vec3(0.0, 19.0, -45.0)


def carried(gains, n, dt, rest=False, turning=0.0, mag=NORTH):
    """The doubt after n samples with these gains."""
    now = observer_covariance.initial_covariance(UP, mag)
    seen = 1 if mag == ZERO else 3
    for _ in range(n):
        now = observer_covariance.update_covariance(now, gains, Vec3(turning, 0.0, 0.0), UP, rest, 0.0, seen, dt)
    return now


@pytest.mark.parametrize(("share", "off_bias"), [(0.02, 0.0), (0.004, 4e-5), (0.1, 1e-3), (1.0, 0.0)])
@pytest.mark.parametrize("n", [30, 1000])
def test_it_is_the_covariance_of_many_such_observers(share, off_bias, n):
    """4000 observers of one angle, each with its own bias, noise and innovations, as the equations have them."""
    rng = np.random.default_rng(1)
    dt, many, turning = 0.01, 4000, 0.7
    angle = rng.normal(0, math.sqrt(observer_covariance.IRON), many)
    bias = rng.normal(0, math.sqrt(observer_covariance.TURN_ON), many)
    r = observer_covariance.IRON * (1.0 + (1.0 - share) * 2.0 * observer_covariance.IRON_SECONDS / dt)
    for _ in range(n):
        white = math.sqrt((observer_covariance.NOISE + observer_covariance.SCALE * turning**2) * dt)
        angle = angle - bias * dt + rng.normal(0, white, many)  # error of the estimate: truth minus estimate
        bias = bias + rng.normal(0, math.sqrt(observer_covariance.WALK * dt), many)
        innovation = angle + rng.normal(0, math.sqrt(r), many)
        angle = angle - share * innovation
        bias = bias + off_bias * innovation
    found = carried(Gains(0.0, 0.0, share, off_bias), n, dt, turning=turning).heading
    assert found.level == pytest.approx(np.var(angle), rel=0.1)
    assert found.bias == pytest.approx(np.var(bias), rel=0.1)
    spread = math.sqrt(found.level * found.bias / many)
    assert found.cross == pytest.approx(np.mean(angle * bias), abs=5.0 * spread)


def test_without_a_bias_state_it_is_the_geometric_series():
    """Fixed share K, bias known: P → (q + K² r/(1 − K)² …), from P = (1 − K)²(P + q) + K² r."""
    share, dt = 0.05, 0.01
    now = observer_covariance.initial_covariance(UP, NORTH)
    now = now._replace(heading=Covariance(now.heading.level, 0.0, 0.0))
    r = observer_covariance.white_variance(observer_covariance.IRON, 2.0 * observer_covariance.IRON_SECONDS / dt, share)
    for _ in range(3000):
        now = observer_covariance.update_covariance(now, Gains(0.0, 0.0, share, 0.0), ZERO, ZERO, False, 0.0, 2, dt)
        now = now._replace(heading=Covariance(now.heading.level, 0.0, 0.0))
    keep = (1.0 - share) ** 2
    assert now.heading.level == pytest.approx(
        (keep * observer_covariance.NOISE * dt + share**2 * r) / (1.0 - keep), rel=1e-9
    )


@pytest.mark.slow
@pytest.mark.parametrize("dt", [0.001, 0.01, 0.1])
def test_who_averages_long_doubts_less_at_any_rate(dt):
    """The white equivalent's limits: all of s at K = 1, the density 2 τ s when it averages."""
    assert observer_covariance.white_variance(0.3, 2.0 * 5.0 / dt, 1.0) == pytest.approx(0.3)
    assert observer_covariance.white_variance(0.3, 2.0 * 5.0 / dt, 0.0) * dt == pytest.approx(2.0 * 5.0 * 0.3, rel=0.02)
    levels = [carried(Gains(0.0, 0.0, dt / (tau + dt), 0.0), int(60 / dt), dt, rest=True).heading.level
              for tau in (0.5, 5.0, 20.0)]  # fmt: skip
    assert levels == sorted(levels, reverse=True)


def test_heading_without_a_field_grows_with_the_bias_and_slower_once_that_is_read_off():
    none = Gains(0.0, 0.0, 0.0, 0.0)
    unread, read = (carried(none, 6000, 0.01, rest=rest, mag=ZERO).heading for rest in (False, True))
    minute = 60.0
    assert math.sqrt(unread.level) == pytest.approx(math.sqrt(observer_covariance.TURN_ON) * minute, rel=0.05)
    assert math.sqrt(read.level) < 0.1 * math.sqrt(unread.level)
    assert read.bias <= observer_covariance.REST_BIAS + observer_covariance.WALK * 0.011
    said = observer_covariance.sigma(observer_covariance.ObserverCovariance(unread, Covariance(1e9, 0.0, 0.0), 0.0))
    assert said.z == pytest.approx(math.pi / math.sqrt(3.0)), "no doubt is larger than knowing nothing"


CORRECTING = [f for f in filters.ALL if {"gyr", "acc"} <= f.uses]


@pytest.fixture(scope="module")
def simulated():
    """Chips in a hand, at walking, on a drone: after a rest in which the bias can be read off."""
    found = []
    for chip, style, seed in (("BMI160", "hand", 1), ("LSM6DSO32", "walking", 2), ("ICM-20948", "drone", 3)):
        mag = None if chip == "ICM-20948" else "QMC5883L"
        found.append(lh.simulate.recording(chip, style, 60.0, seed=seed, mag=mag))
    return found


# The lesson's filters carry the σ of the noises that they are given: those of the lesson (0.17° for an accelerometer)
# are no hand's, who accelerates by 3 m/s². With the lesson's they say 0.05° and are 100 times as wrong.
PHYSICAL = {"r_measure": 300.0}


@pytest.mark.slow
@pytest.mark.parametrize("flt", CORRECTING, ids=lambda f: f.name)
def test_errors_are_of_the_order_of_sigma(flt, simulated):
    """Error/σ of tilt, RMS: filters that doubt too much are as wrong as those that doubt too little."""
    for recording in simulated:
        six = lh.Recording(recording.t, recording.gyr, recording.acc, None, recording.truth)
        known = {name: value for name, value in PHYSICAL.items() if name in flt.params._fields}
        track = lh.fuse(six, flt.params(**known))
        off = track.as_rotation() * Rotation.from_quat(six.truth.quat, scalar_first=True).inv()
        up = off.apply([0.0, 0.0, 1.0])
        tilt = np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2])[1000:]
        ratio = math.sqrt(np.mean((tilt / track.sigma_tilt[1000:]) ** 2))
        assert 0.1 < ratio < (5.0 if known else 3.0), (
            recording.meta["sensor"],
            recording.meta["motion"],
            ratio,
        )
