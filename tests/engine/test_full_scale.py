"""What a sensor would have read beyond its full scale, against parabolas, of which the integral is known."""

import numpy as np
import pytest

import levelhead as lh
from levelhead.engine.full_scale import (
    NO_APPROACH,
    Approach,
    mean_beyond,
    unmeasured_angle,
    unmeasured_velocity,
    update_approach,
)
from levelhead.evaluate.attitude_error import error_quaternion, split_error
from levelhead.guard.detectors import NO_SAMPLES
from levelhead.kernels.vec3 import Vec3
from levelhead.recording import Recording
from levelhead.units import GRAVITY

FULL = 2.0 * GRAVITY


def integral_beyond(values, full, dt):
    """∫ of what is added to one axis, with the full scale known."""
    approach, extreme = NO_APPROACH, NO_SAMPLES.acc_extreme._replace(up=full, down=full)
    total = 0.0
    for value in values:
        reading = Vec3(float(np.clip(value, -full, full)), 0.0, 0.0)
        clipped = extreme._replace(clipped=abs(value) >= full)
        approach = update_approach(approach, reading, clipped, dt)
        total += mean_beyond(approach, dt).x * dt if approach.time > 0.0 else 0.0
    return total


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("lasts", [0.05, 0.1, 0.3])
def test_the_integral_of_a_parabola_is_restored(lasts, sign):
    """a T²/6 with the slope a = 4 (peak − full)/T."""
    dt, beyond = 1e-3, 10.0
    t = np.arange(-0.5, 0.5, dt)
    values = sign * np.maximum(FULL + beyond * (1.0 - (2.0 * t / lasts) ** 2), 0.0)
    exact = sign * 2.0 / 3.0 * beyond * lasts
    assert integral_beyond(values, FULL, dt) == pytest.approx(exact, rel=0.06)


def test_a_blow_adds_next_to_nothing():
    """A reading that is at full scale in one sample has no slope that says how far beyond it went."""
    values = np.r_[np.zeros(100), np.full(20, 150.0), np.zeros(100)]
    assert abs(integral_beyond(values, FULL, 0.01)) < 0.02


def test_no_more_is_added_than_is_read():
    values = np.r_[np.zeros(10), np.linspace(0.0, FULL - 1e-9, 5), np.full(1000, 99.0)]
    assert integral_beyond(values, FULL, 0.01) <= 1000 * 0.01 * FULL * 1.001


def test_sigma_is_a_share_of_what_is_missed():
    beyond = Approach(Vec3(0.0, 0.0, 0.0), Vec3(30.0, 40.0, 0.0), 0.3)
    assert unmeasured_angle(beyond, 0.0) == pytest.approx((0.4 * 50.0 * 0.3**2 / 6.0) ** 2)
    assert unmeasured_velocity(beyond, 0.3) == pytest.approx((50.0 * 0.3**2 / 6.0) ** 2)


def test_parts_of_a_variance_add_up_to_it():
    slope, none = Vec3(30.0, 40.0, 0.0), Vec3(0.0, 0.0, 0.0)
    parts = [unmeasured_velocity(Approach(none, slope, 0.1 * k), 0.1) for k in (1, 2, 3)]
    assert sum(parts) == pytest.approx(unmeasured_velocity(Approach(none, slope, 0.3), 0.3))


def test_a_force_beyond_full_scale_makes_the_vertical_less_sure():
    """The same readings, with a full scale that is known and with one that is far away."""
    recording = run()
    clipped, whole = (lh.fuse(recording, guard=lh.Guard(acc_range=most)) for most in (FULL, 1000.0))
    assert clipped.sigma is not None and whole.sigma is not None
    running = recording.t > 20.0
    assert clipped.sigma[running, :2].mean() > 1.1 * whole.sigma[running, :2].mean()


def run():
    """A minute of running, which starts after 5 s: 2.7 steps a second with pushes to 2.9 g that also brake."""
    rate = 200.0
    t = np.arange(0.0, 65.0, 1.0 / rate)
    running = np.clip((t - 5.0) / 1.0, 0.0, 1.0)
    swing = 0.8 * running * np.sin(2.0 * np.pi * 1.35 * t)
    zero = np.zeros_like(t)
    push = running * 2.5 * GRAVITY * (np.maximum(np.sin(2.0 * np.pi * 2.7 * t), 0.0) ** 2 - 0.25)
    up = GRAVITY + push
    quat = np.stack((np.cos(0.5 * swing), np.sin(0.5 * swing), zero, zero), axis=1)
    noise = np.random.default_rng(1)
    gyr = np.stack((np.gradient(swing, 1.0 / rate), zero, zero), axis=1) + noise.normal(0.0, 2e-3, (len(t), 3))
    acc = np.stack((-0.4 * push, up * np.sin(swing), up * np.cos(swing)), axis=1) + noise.normal(0.0, 0.03, (len(t), 3))
    return Recording(t, gyr, np.clip(acc, -FULL, FULL), None, lh.Truth(quat, north=False))


@pytest.mark.parametrize("params", [lh.ESKF(), lh.EKF()])
def test_a_runner_beyond_full_scale_keeps_the_vertical(params):
    """A seventh of the readings is at full scale: without these a runner would never brake (7° and 10° of tilt)."""
    recording = run()
    track = lh.fuse(recording, params)
    assert recording.truth is not None
    tilt = np.degrees(split_error(error_quaternion(track.quat, recording.truth.quat)).tilt)
    assert np.sqrt(np.mean(tilt[2000:] ** 2)) < 2.0
