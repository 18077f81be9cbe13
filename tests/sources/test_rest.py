"""Degrees declared as radians are found out at rest, however short and slow the recording is."""

import itertools
import math

import numpy as np
import pytest

from levelhead import simulate
from levelhead.signals.rest import find_still_gyroscope
from levelhead.sources.interpret.gyroscope import contradicts_rad_s

CASES = [*itertools.product(("MPU-6050", "BMI160", "LSM6DSO32"), ("hand", "walking", "robot", "still"), (1, 2))]


@pytest.mark.parametrize(("chip", "motion", "seed"), CASES)
def test_radians_are_never_taken_for_degrees(chip, motion, seed):
    rec = simulate.recording(chip, motion, 12, 100, seed)
    assert contradicts_rad_s(rec.t, rec.gyr, rec.acc) is None


@pytest.mark.parametrize(("motion", "seed"), [*itertools.product(("hand", "walking", "robot", "still"), (1, 2))])
def test_degrees_of_a_sensor_with_a_bias_are_found_in_seconds(motion, seed):
    rec = simulate.recording("MPU-6050", motion, 12, 100, seed)
    why = contradicts_rad_s(rec.t, np.degrees(rec.gyr), rec.acc)
    assert why is not None


def test_bias_and_noise_at_rest():
    rng = np.random.default_rng(0)
    n = 500
    t = np.arange(n) / 100
    gyr = rng.normal(0, 0.02, (n, 3)) + [0.3, 0.4, 5.0]  # 5 rad/s about the vertical moves no gravity
    acc = rng.normal(0, 0.02, (n, 3)) + [0, 0, 9.81]
    rest = find_still_gyroscope(t, gyr, acc)
    assert rest.windows == 10
    assert rest.rate == pytest.approx(0.5, abs=0.01)
    assert rest.noise == pytest.approx(0.02, rel=0.2)
    shaken = acc + 3 * np.sin(40 * t)[:, None]
    assert find_still_gyroscope(t, gyr, shaken).windows == 0


def test_missing_and_absurd_values_are_no_rest():
    t = np.arange(200) / 100
    gyr, acc = np.zeros((200, 3)), np.tile([0, 0, 9.81], (200, 1))
    gyr[:100], acc[100:] = np.nan, np.nan
    assert find_still_gyroscope(t, gyr, acc).windows == 0
    assert find_still_gyroscope(t[:3], gyr[:3], acc[:3]).windows == 0
    assert not math.isnan(find_still_gyroscope(t, np.full((200, 3), 1e300), acc).rate)
