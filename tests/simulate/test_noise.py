"""The random processes have the coefficients that they were given, at every sample rate."""

import numpy as np
import pytest

from levelhead.simulate import noise

THREE = np.ones(3)


def allan(values, rate, tau):
    """Overlapping Allan deviation of (n, 3) values at one averaging time, pooled over the axes (Riley 2008, eq. 11)."""
    m = round(tau * rate)
    angle = np.vstack([np.zeros(3), np.cumsum(values, axis=0) / rate])
    second = angle[2 * m :] - 2.0 * angle[m:-m] + angle[: -2 * m]
    return np.sqrt(np.mean(second**2) / (2.0 * tau**2))


@pytest.mark.slow
@pytest.mark.parametrize("rate", [100.0, 400.0])
def test_white_noise_has_the_same_allan_deviation_at_every_rate(rate):
    values = noise.white(noise.generator(1), int(2000 * rate), rate, 0.02 * THREE)
    assert np.std(values) == pytest.approx(0.02 * np.sqrt(rate), rel=0.01)
    for tau in (0.1, 1.0, 4.0):
        assert allan(values, rate, tau) == pytest.approx(0.02 / np.sqrt(tau), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [100.0, 400.0])
def test_random_walk_has_the_same_allan_deviation_at_every_rate(rate):
    values = noise.random_walk(noise.generator(2), int(2000 * rate), rate, 0.003 * THREE)
    taus = np.array([1.0, 4.0, 16.0])
    measured = np.array([allan(values, rate, tau) for tau in taus])
    np.testing.assert_allclose(measured, 0.003 * np.sqrt(taus / 3.0), rtol=0.1)
    slope = np.polyfit(np.log(taus), np.log(measured), 1)[0]
    assert slope == pytest.approx(0.5, abs=0.06)


def test_random_walk_spreads_with_the_root_of_time():
    ends = [noise.random_walk(noise.generator(seed), 1001, 10.0, 0.5 * THREE)[[0, -1]] for seed in range(300)]
    first, last = np.array(ends)[:, 0], np.array(ends)[:, 1]
    assert not first.any()
    assert np.std(last) == pytest.approx(0.5 * np.sqrt(100.0), rel=0.07)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [20.0, 80.0])
def test_gauss_markov_peaks_at_the_flicker_floor(rate):
    """Allan deviation of a Gauss-Markov process, IEEE Std 952-1997 annex C, and its peak at 0.664 B."""
    time, instability = 2.0, 0.7
    sigma = instability * noise.FLICKER_FLOOR / noise.GAUSS_MARKOV_PEAK
    values = noise.gauss_markov(noise.generator(3), int(8000 * rate), rate, instability * THREE, time)
    assert np.std(values) == pytest.approx(sigma, rel=0.03)
    for tau in (1.0, 1.89 * time, 10.0):
        x = tau / time
        bracket = 1.0 - (3.0 - 4.0 * np.exp(-x) + np.exp(-2.0 * x)) / (2.0 * x)
        expected = np.sqrt(2.0 * sigma**2 / x * bracket)
        assert allan(values, rate, tau) == pytest.approx(expected, rel=0.04)
    assert allan(values, rate, 1.89 * time) == pytest.approx(0.664 * instability, rel=0.03)


def test_gauss_markov_is_the_textbook_recursion():
    random, n, decay = noise.generator(4), 200, np.exp(-1.0 / (50.0 * 0.5))
    sigma = 2.0 * noise.FLICKER_FLOOR / noise.GAUSS_MARKOV_PEAK
    drawn = random.standard_normal((n, 3)) * sigma
    state, expected = drawn[0], [drawn[0]]
    for k in range(1, n):
        state = decay * state + np.sqrt(1.0 - decay**2) * drawn[k]
        expected.append(state)
    values = noise.gauss_markov(noise.generator(4), n, 50.0, 2.0 * THREE, 0.5)
    np.testing.assert_allclose(values, expected, rtol=0, atol=1e-12)


def test_constants():
    assert pytest.approx(0.664, abs=5e-4) == noise.FLICKER_FLOOR
    x = np.linspace(0.5, 5.0, 10_001)
    curve = np.sqrt(2.0 / x * (1.0 - (3.0 - 4.0 * np.exp(-x) + np.exp(-2.0 * x)) / (2.0 * x)))
    assert curve.max() == pytest.approx(noise.GAUSS_MARKOV_PEAK, rel=2e-3)
    assert x[curve.argmax()] == pytest.approx(1.89, abs=0.01)
