"""The one-axis filters against their textbook twins, in any unit."""

import numpy as np
import pytest
from tests.reference import textbook

import levelhead as lh

N, DT = 400, 0.02


@pytest.fixture(scope="module")
def pair():
    rng = np.random.default_rng(7)
    t = np.arange(N) * DT
    true = 20 * np.sin(0.8 * t)
    return t, true + rng.normal(0, 2, N), np.gradient(true, DT) + 1.5 + rng.normal(0, 0.5, N)


@pytest.mark.parametrize("joseph", [False, True])
@pytest.mark.parametrize("per_sample", [False, True])
def test_kalman_is_the_textbook_filter(pair, joseph, per_sample):
    t, level, rate = pair
    params = lh.Kalman(q_angle=0.01, q_bias=0.02, r_measure=4, q_per_sample=per_sample, joseph=joseph)
    got = lh.fuse_axis(t, level, rate, params)
    q = np.diag([0.01, 0.02]) * (1 if per_sample else DT)
    x, p = textbook.kalman(level, rate, DT, q, 4.0, np.array([level[0], 0.0]), np.eye(2), joseph)
    np.testing.assert_allclose(got.level, x[:, 0], rtol=1e-10)
    np.testing.assert_allclose(got.bias, x[:, 1], atol=1e-10)
    np.testing.assert_allclose(got.p_level, p[:, 0, 0], rtol=1e-9)
    np.testing.assert_allclose(got.p_cross, p[:, 0, 1], rtol=1e-9)
    np.testing.assert_allclose(got.p_bias, p[:, 1, 1], rtol=1e-9)
    np.testing.assert_allclose(got.rate[1:], rate[1:] - got.bias[:-1], rtol=1e-12)
    np.testing.assert_allclose(got.level[1:], level[1:] - (1 - got.gain_level[1:]) * got.innovation[1:], rtol=1e-9)


def test_bias_rate_kalman_is_the_textbook_filter(pair):
    t, level, rate = pair
    params = lh.BiasRateKalman(q_angle=0.01, q_bias=0.02, q_bias_rate=1e-3, r_measure=4, p_bias_rate=0.1)
    got = lh.fuse_axis(t, level, rate, params)
    q = np.diag([0.01, 0.02, 1e-3]) * DT
    x, p = textbook.kalman(level, rate, DT, q, 4.0, np.array([level[0], 0.0, 0.0]), np.diag([1.0, 1.0, 0.1]))
    np.testing.assert_allclose(np.stack([got.level, got.bias, got.bias_rate], 1), x, atol=1e-9)
    np.testing.assert_allclose([got.p_level, got.p_bias, got.p_bias_rate], np.diagonal(p, 0, 1, 2).T, rtol=1e-8)


@pytest.mark.parametrize("alpha", [0.0, 0.8, 0.98])
def test_complementary_is_the_textbook_filter(pair, alpha):
    t, level, rate = pair
    got = lh.fuse_axis(t, level, rate, lh.Complementary(alpha=alpha, dt=DT))
    np.testing.assert_allclose(got.level, textbook.complementary(level, rate, DT, alpha), rtol=1e-10, atol=1e-10)


def test_the_time_constant_does_not_depend_on_the_sample_rate():
    """A step of the measured level decays with τ, however it is sampled: after τ seconds 1/e is left."""
    for dt in (0.001, 0.002, 0.004):
        t = np.arange(0.0, 1.0 + dt / 2, dt)
        level = np.where(t == 0, 1.0, 0.0)
        got = lh.fuse_axis(t, level, np.zeros(len(t)), lh.Complementary(tau=1.0))
        assert got.level[-1] == pytest.approx(np.exp(-1.0), rel=2 * dt)


@pytest.mark.compiled
def test_densities_do_not_change_meaning_with_the_sample_rate_but_q_per_sample_does():
    def final_bias_variance(dt, per_sample):
        t = np.arange(0.0, 60.0, dt)
        params = lh.Kalman(r_measure=4 * 0.01 / dt, q_per_sample=per_sample)  # the same noise density of the level
        return lh.fuse_axis(t, np.zeros(len(t)), np.zeros(len(t)), params).p_bias[-1]

    assert final_bias_variance(0.01, False) == pytest.approx(final_bias_variance(0.0025, False), rel=0.02)
    assert final_bias_variance(0.0025, True) > 1.5 * final_bias_variance(0.01, True)


def test_angles_are_blended_on_the_circle():
    t = np.arange(300) * 0.01
    level = (170.0 + 20.0 * t / t[-1] * 1.5 + 180.0) % 360.0 - 180.0  # from 170° through 180° to −160°
    rate = np.full(300, 30.0 / t[-1])
    for params in (lh.Complementary(), lh.Kalman(), lh.BiasRateKalman()):
        got = lh.fuse_axis(t, level, rate, params, period=360.0)
        error = (got.level - level + 180.0) % 360.0 - 180.0
        assert np.abs(error).max() < 0.5, params


@pytest.mark.compiled
def test_bias_rate_kalman_follows_a_ramp_of_the_bias_that_kalman_lags_behind():
    rng = np.random.default_rng(3)
    t = np.arange(60_000) * 0.01
    bias = 0.5 / 600 * t  # 0.5 °/s in ten minutes
    level, rate = rng.normal(0, 0.5, len(t)), bias + rng.normal(0, 0.05, len(t))
    steady = lh.Kalman(q_bias=1e-9, r_measure=0.25)
    running = lh.BiasRateKalman(q_bias=1e-9, q_bias_rate=1e-12, r_measure=0.25)
    lag = [bias[-1] - lh.fuse_axis(t, level, rate, p).bias[-5000:].mean() + bias[-5000:].mean() - bias[-1]
           for p in (steady, running)]  # fmt: skip
    assert abs(lag[1]) < 0.2 * abs(lag[0])


def test_any_unit():
    """A price with a trend that is known up to a drifting bias; scaling the unit scales the answer."""
    rng = np.random.default_rng(0)
    day = np.arange(250.0)
    price = 100 + 0.3 * day + rng.normal(0, 2, 250)
    trend = np.full(250, 0.2)
    params = lh.Kalman(q_angle=0.01, q_bias=1e-6, r_measure=4.0, p_angle=4.0, p_bias=0.1)
    got = lh.fuse_axis(day, price, trend, params)
    assert got.level[-1] == pytest.approx(100 + 0.3 * 249, abs=1.5)
    assert got.bias[-1] == pytest.approx(-0.1, abs=0.03)
    cents = lh.Kalman(q_angle=100.0, q_bias=0.01, r_measure=4e4, p_angle=4e4, p_bias=1e3)
    np.testing.assert_allclose(lh.fuse_axis(day, price * 100, trend * 100, cents).level, got.level * 100, rtol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([0, 1], [0, np.nan], [0, 0]), "level is NaN at row 1"),
        (([0, 1], [0, 1], [0]), "rate has shape (1,); expected (2,)"),
        (([0, 0], [0, 1], [0, 0]), "t does not increase at row 1"),
        (([0, 1], [0, 1], [0, 0], lh.GyroIntegration()), "GyroIntegration needs an IMU"),
        (([0, 1], ["a", "b"], [0, 0]), "expected real numbers"),
    ],
)
def test_bad_pairs_are_refused(arguments, words):
    with pytest.raises(lh.LevelheadError) as caught:
        lh.fuse_axis(*arguments)
    assert words in str(caught.value)


@pytest.mark.compiled
def test_kalman_covariance_stays_positive_and_symmetric_over_a_long_run():
    t = np.arange(300_000) * 0.01
    got = lh.fuse_axis(t, np.zeros(len(t)), np.zeros(len(t)), lh.Kalman(q_angle=0.0, q_bias=0.0, r_measure=1e-3))
    assert (got.p_level * got.p_bias - got.p_cross**2).min() > -1e-12
    assert (got.p_level >= 0).all() and (got.p_bias >= 0).all()
