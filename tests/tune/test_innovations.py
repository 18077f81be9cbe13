"""Innovations over seconds: eq. 1 beside integration sample by sample, the scale beside SciPy's fit, and the goal."""

from dataclasses import replace

import numpy as np
import pytest

import levelhead as lh
from levelhead.errors import LevelheadError
from levelhead.evaluate import evaluate
from levelhead.rotations import about_up, from_rotvec, product, rotate
from levelhead.tune.innovations import HORIZON, innovations_of, most_likely_scale

stats = pytest.importorskip("scipy.stats")


@pytest.fixture(scope="module")
def log():
    recording = lh.simulate.recording("LSM6DSO32", "hand", 40.0, 50.0, seed=4, mag="HMC5883L")
    acc = recording.acc.copy()
    acc[700:705] = np.nan  # missing samples
    return replace(recording, acc=acc)


@pytest.fixture(scope="module")
def held(log):
    return innovations_of(log, np.ones(len(log), bool))


@pytest.mark.parametrize("name", ["acc", "mag"])
def test_the_mean_reading_is_that_of_an_integration_from_each_instant(log, held, name):
    bias = np.array([0.004, -0.003, 0.002])
    sensor = held.force if name == "acc" else held.field
    found = sensor.at(np.broadcast_to(bias, (len(held.rows), 3)))
    for i in (0, len(held.rows) // 2, len(held.rows) - 1):
        row = held.rows[i]
        end = np.searchsorted(log.t, log.t[row] + HORIZON)
        attitude, turned = np.array([[1.0, 0.0, 0.0, 0.0]]), []
        for k in range(row, end):
            if k > row:
                step = (log.gyr[k] - bias) * (log.t[k] - log.t[k - 1])
                attitude = product(attitude, from_rotvec(step)[None])
            turned.append(rotate(attitude, getattr(log, name)[k][None])[0])
        expected = np.nanmean(turned, axis=0)
        assert np.linalg.norm(found[i] - expected) < 2e-3 * np.linalg.norm(expected)  # of the second order in bias
        without = np.linalg.norm(sensor.value[i] - expected)
        assert np.linalg.norm(found[i] - expected) < 0.2 * without or without < 1e-3 * np.linalg.norm(expected)


def test_the_scale_is_the_most_likely_one():
    values = stats.t.rvs(4.0, scale=0.3, size=4000, random_state=1)
    _, _, scale = stats.t.fit(values, f0=4.0, floc=0.0)
    assert most_likely_scale(np.abs(values), 1) == pytest.approx(scale, rel=1e-3)
    shocks = values.copy()
    shocks[:40] = 30.0  # one in a hundred a hundred times too large
    assert most_likely_scale(np.abs(shocks), 1) < 1.1 * scale


def test_the_true_orientation_predicts_best(log, held):
    true = replace(lh.fuse(log), quat=log.truth.quat, bias=np.zeros((len(log), 3)))
    tilted = replace(true, quat=product(from_rotvec(np.array([0.1, 0.0, 0.0]))[None], true.quat))
    biased = replace(true, bias=np.full((len(log), 3), 0.02))
    turned = replace(true, quat=product(about_up(0.5)[None], true.quat))
    best = held.scales(true)
    assert all(one > 1.2 * other for one, other in zip(held.scales(tilted)[:2], best[:2], strict=True))
    assert all(one > 1.2 * other for one, other in zip(held.scales(biased), best, strict=True))
    np.testing.assert_allclose(held.scales(turned), best, rtol=0.02)  # a constant heading does not count


@pytest.mark.slow
def test_poor_gains_become_better_by_the_likelihood(log):
    start = lh.Mahony(kp=4.0)
    found = lh.tune_filter(log, start, ["kp"], goal="likelihood", runs=40)
    before, after = (evaluate(log, lh.fuse(log, one)).tilt for one in (start, found.best))
    assert after < 0.7 * before
    assert found.kinds == ["likelihood"] and found.check is not None
    assert "innovation" in found.verdict()[0]
    assert any(line.startswith("by the likelihood of the innovations over 5 s") for line in found.verdict())
    parts = [fold.name for fold in found.folds]
    assert parts == ["quarter 1", "quarter 2", "quarter 3", "quarter 4"]


def test_a_likelihood_of_heading_alone_is_refused(log):
    with pytest.raises(LevelheadError, match="expected total or tilt"):
        lh.tune_filter(log, lh.Mahony(), ["kp"], goal="likelihood", metric="heading")
    with pytest.raises(LevelheadError, match="'likelyhood' is not a goal; did you mean 'likelihood'"):
        lh.tune_filter(log, lh.Mahony(), ["kp"], goal="likelyhood")
