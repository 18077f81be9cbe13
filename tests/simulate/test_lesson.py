"""The lesson's published figures, each from a textbook filter written here in plain NumPy."""

import numpy as np
import pytest

from levelhead import simulate
from levelhead.errors import LevelheadError

DT = 0.01


def angles(recording):
    """Time-free view of the lesson in degrees: true angle, accelerometer angle, gyroscope rate."""
    w, x, _, _ = recording.truth.quat.T
    true = np.degrees(2.0 * np.arctan2(x, w))
    accel = np.degrees(np.arctan2(recording.acc[:, 1], recording.acc[:, 2]))
    return true, accel, np.degrees(recording.gyr[:, 0])


def complementary(accel, rate, alpha):
    angle = np.empty_like(accel)
    angle[0] = accel[0]
    for i in range(1, len(accel)):
        angle[i] = alpha * (angle[i - 1] + rate[i] * DT) + (1.0 - alpha) * accel[i]
    return angle


def kalman(accel, rate, q_angle, q_bias, r):
    angle = np.empty_like(accel)
    angle[0] = accel[0]
    x, p = np.array([accel[0], 0.0]), np.eye(2)
    f, q, h = np.array([[1.0, -DT], [0.0, 1.0]]), np.diag([q_angle, q_bias]), np.array([1.0, 0.0])
    for i in range(1, len(accel)):
        x = f @ x + np.array([DT * rate[i], 0.0])
        p = f @ p @ f.T + q
        gain = p @ h / (h @ p @ h + r)
        x = x + gain * (accel[i] - h @ x)
        p = (np.eye(2) - np.outer(gain, h)) @ p
        angle[i] = x[0]
    return angle


def rmse(estimate, true):
    return np.sqrt(np.mean((estimate - true) ** 2))


@pytest.fixture(scope="module")
def lesson():
    return angles(simulate.lesson())


def test_accelerometer_alone(lesson):
    true, accel, _ = lesson
    assert rmse(accel, true) == pytest.approx(3.3346, abs=1e-4)


def test_gyroscope_alone(lesson):
    true, accel, rate = lesson
    steps = rate * DT
    steps[0] = accel[0]
    assert rmse(np.cumsum(steps), true) == pytest.approx(1.3213, abs=1e-4)


def test_complementary_filter(lesson):
    true, accel, rate = lesson
    assert rmse(complementary(accel, rate, 0.98), true) == pytest.approx(0.3357, abs=1e-4)


def test_best_alpha_on_the_grid(lesson):
    true, accel, rate = lesson
    error, alpha = min((rmse(complementary(accel, rate, alpha), true), alpha) for alpha in np.arange(80, 100) / 100)
    assert alpha == 0.99
    assert error == pytest.approx(0.2651, abs=1e-4)


@pytest.mark.parametrize(("per", "published"), [(1.0, 0.4536), (DT, 0.2830)])
def test_kalman_filter_with_noise_per_sample_and_as_a_density(lesson, per, published):
    true, accel, rate = lesson
    assert rmse(kalman(accel, rate, 0.001 * per, 0.003 * per, 4.0), true) == pytest.approx(published, abs=1e-4)


def test_layout():
    recording = simulate.lesson(7)
    assert len(recording) == 6000
    assert recording.rate == pytest.approx(100.0)
    assert recording.meta["source"] == "lesson"
    np.testing.assert_allclose(np.linalg.norm(recording.acc, axis=1), 9.80665)
    assert not recording.acc[:, 0].any()
    assert not recording.gyr[:, 1:].any()
    assert not recording.truth.bias[:, 1:].any()


def test_gyroscope_is_rate_plus_truth_bias_plus_noise():
    recording = simulate.lesson(5, bias_walk=3.0)
    true, _, rate = angles(recording)
    rest = rate - np.gradient(true, DT) - np.degrees(recording.truth.bias[:, 0])
    assert np.std(rest) == pytest.approx(0.3, rel=0.03)
    assert abs(rest.mean()) < 0.3 / np.sqrt(6000) * 3


def test_hard_lesson_is_the_lesson_with_other_noise():
    hard, same = simulate.hard_lesson(3), simulate.lesson(3, accel_noise=10.0, bias_walk=0.1)
    np.testing.assert_array_equal(hard.acc, same.acc)
    np.testing.assert_array_equal(hard.gyr, same.gyr)
    easy = simulate.lesson(3)
    np.testing.assert_allclose(hard.truth.bias, 5.0 * easy.truth.bias)
    np.testing.assert_array_equal(hard.truth.quat, easy.truth.quat)


def test_without_noise_only_vibration_and_bumps_are_left():
    true, accel, _ = angles(simulate.lesson(1, accel_noise=0.0))
    t = np.arange(6000) * DT
    rest = accel - true - 5.0 * np.sin(50.0 * t) * np.exp(-0.05 * t)
    bumped = np.abs(rest) > 1e-9
    assert bumped.sum() == 20
    assert np.abs(rest).max() <= 15.0


@pytest.mark.parametrize("arguments", [{"seed": -1}, {"seed": 1.5}, {"accel_noise": -1.0}, {"bias_walk": np.nan}])
def test_bad_arguments(arguments):
    with pytest.raises(LevelheadError, match="expected a"):
        simulate.lesson(**arguments)
