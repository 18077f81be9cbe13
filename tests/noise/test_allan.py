"""Allan deviations beside allantools, degrees of freedom beside the same, and coefficients that were put in."""

import numpy as np
import pytest

from levelhead.noise.allan import CHUNK, WHITE, allan_curve, degrees_of_freedom, every_second, integral, interval_of
from levelhead.noise.fit import fit
from levelhead.simulate import noise as processes

pytest.importorskip("scipy")


@pytest.fixture(scope="module")
def allantools():
    """Its import takes a second, so its tests are in the second tier."""
    return pytest.importorskip("allantools")


@pytest.mark.slow
@pytest.mark.parametrize("count", [1001, 40_000])
def test_deviations_are_those_of_allantools(allantools, count):
    random = np.random.default_rng(1)
    rate = 3.0 + random.standard_normal(count) + 1e-2 * np.cumsum(random.standard_normal(count))
    mine = allan_curve(rate, 0.01, count)
    tau, theirs, *_ = allantools.oadev(rate, rate=100.0, data_type="freq", taus=mine.tau)
    np.testing.assert_allclose(mine.tau, tau, rtol=1e-12)
    np.testing.assert_allclose(mine.deviation, theirs, rtol=1e-9)


def test_an_integral_in_parts_is_that_of_the_whole():
    rate = 3.0 + np.random.default_rng(4).standard_normal(2 * CHUNK + 7)
    whole = np.concatenate([[0.0], np.cumsum(rate - rate.mean()) * 0.01])
    angle = integral(rate, 0.01)
    np.testing.assert_array_equal(angle, whole)
    np.testing.assert_array_equal(every_second(angle), whole[::2])


def test_a_long_sum_may_have_steps(monkeypatch):
    rate = np.random.default_rng(2).standard_normal(50_000)
    whole = allan_curve(rate, 0.01, len(rate))
    monkeypatch.setattr("levelhead.noise.allan.TERMS", 300)
    stepped = allan_curve(rate, 0.01, len(rate))
    assert (stepped.deviation != whole.deviation).any()
    freedom = np.array([degrees_of_freedom(WHITE, whole.count, int(m)) for m in whole.factor])
    assert (np.abs(stepped.deviation / whole.deviation - 1.0) < 0.1 / np.sqrt(2.0 * freedom)).all()  # of its own 1σ


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "alpha"), [(0, 2), (1, 0), (2, -1), (3, -2)])
@pytest.mark.parametrize("factor", [2, 100, 3000])
def test_degrees_of_freedom_are_those_of_the_handbook(allantools, kind, alpha, factor):
    theirs = allantools.ci.edf_simple(10_001, factor, alpha)
    assert degrees_of_freedom(kind, 10_000, factor) == pytest.approx(theirs, rel=1e-12)


def test_intervals_hold_the_truth_as_often_as_they_say():
    """White noise of N = 1: σ(τ) = 1/√τ."""
    inside = 0
    for seed in range(200):
        curve = allan_curve(np.random.default_rng(seed).standard_normal(2000), 1.0, 50)
        freedom = np.array([degrees_of_freedom(WHITE, curve.count, int(m)) for m in curve.factor])
        low, high = interval_of(curve.deviation, freedom)
        truth = 1.0 / np.sqrt(curve.tau)
        inside += int(((low <= truth) & (truth <= high))[[0, 8, -1]].sum())
    assert 550 <= inside <= 588  # of 600; 570 ± 5.3 (1σ) if they were independent


@pytest.mark.slow
def test_each_noise_is_found_alone():
    """4 h of noise in which each of N, B, K dominates a part of the curve."""
    random, n, rate = np.random.default_rng(3), 360_000, 25.0
    three = np.ones(3)
    made = (
        processes.white(random, n, rate, 1.0 * three)
        + processes.flicker(random, n, 0.3 * three)
        + processes.random_walk(random, n, rate, 0.03 * three)
    )
    found = fit(allan_curve(np.ascontiguousarray(made[:, 0]), 1.0 / rate, n))
    quantisation, white, flicker, walk = found.value
    assert quantisation == 0.0
    assert white == pytest.approx(1.0, rel=0.02)
    assert flicker == pytest.approx(0.3, rel=0.2)
    assert walk == pytest.approx(0.03, rel=0.5)
    assert (found.low[1:] > 0.0).all()
    assert found.misfit < 3.0


def test_quantisation_noise_is_found_where_it_is():
    random, n, rate = np.random.default_rng(4), 60_000, 100.0
    three = np.ones(3)
    made = processes.white(random, n, rate, 1.0 * three) + processes.angle_white(random, n, rate, 0.05 * three)
    found = fit(allan_curve(np.ascontiguousarray(made[:, 0]), 1.0 / rate, n))
    assert found.value[0] == pytest.approx(0.05, rel=0.02)
    assert found.value[1] == pytest.approx(1.0, rel=0.05)


@pytest.mark.slow
def test_flicker_noise_is_flat_where_the_standard_says(allantools):
    """Allan deviation √(2 ln 2/π) B at every τ (IEEE Std 952-1997, annex C), by allantools."""
    made = processes.flicker(np.random.default_rng(5), 200_000, np.ones(3))
    taus = [10.0, 100.0, 1000.0]
    deviations = [allantools.oadev(column, rate=1.0, data_type="freq", taus=taus)[1] for column in made.T]
    np.testing.assert_allclose(np.mean(deviations, axis=0), 0.6643, rtol=0.06)
