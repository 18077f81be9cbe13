"""The shipped filters on the published lesson, NumPy seed 42: the figures of docs/explanation/lesson.md."""

import numpy as np
import pytest

import levelhead as lh
from levelhead.evaluate import evaluate


@pytest.fixture(scope="module")
def lesson():
    return lh.simulate.lesson(42)


def rmse(recording, params):
    return evaluate(recording, lh.fuse(recording, params, guard=None)).total


@pytest.mark.parametrize(
    ("params", "published"),
    [
        (lh.AccelTilt(), 3.3346),
        (lh.GyroIntegration(), 1.3213),
        (lh.Complementary(alpha=0.98), 0.3357),
        (lh.Kalman(q_angle=0.001, q_bias=0.003, r_measure=4.0, q_per_sample=True), 0.4536),
        (lh.Kalman(q_angle=0.001, q_bias=0.003, r_measure=4.0), 0.2830),
        (lh.Kalman(q_angle=0.001, q_bias=0.003, r_measure=4.0, joseph=True), 0.2830),
    ],
    ids=str,
)
def test_published_figures(lesson, params, published):
    assert rmse(lesson, params) == pytest.approx(published, abs=1e-4)


@pytest.mark.slow
def test_the_best_alpha_of_the_grid_is_its_last(lesson):
    grid = np.arange(80, 100) / 100
    errors = [rmse(lesson, lh.Complementary(alpha=alpha)) for alpha in grid]
    assert grid[int(np.argmin(errors))] == 0.99
    assert min(errors) == pytest.approx(0.2651, abs=1e-4)


def test_the_one_axis_filter_in_degrees_gives_the_same_as_the_imu(lesson):
    """Roll of the IMU filter is the one-axis filter on atan2(a_y, a_z): one algorithm, two faces."""
    params = lh.Kalman(r_measure=4.0)
    angle = np.degrees(np.arctan2(lesson.acc[:, 1], lesson.acc[:, 2]))
    axis = lh.fuse_axis(lesson.t, angle, np.degrees(lesson.gyr[:, 0]), params, period=360.0)
    track = lh.fuse(lesson, params, guard=None)
    np.testing.assert_allclose(track.euler()[:, 0], axis.level, atol=1e-9)
    np.testing.assert_allclose(np.degrees(track.bias[:, 0]), axis.bias, atol=1e-9)
    np.testing.assert_allclose(np.degrees(track.sigma[:, 0]) ** 2, axis.p_level, rtol=1e-9)
