"""What holds on parts that were left out: the gain with its interval, parts that got worse, and a stretch by itself."""

from dataclasses import replace

import numpy as np
import pytest

import levelhead as lh
from levelhead.evaluate import evaluate
from levelhead.tune.left_out import Fold, gain, losses, root_mean_square, stretch_scores
from levelhead.tune.reference_orientation import references

stats = pytest.importorskip("scipy.stats")


def fold(name, before, after):
    """A part whose three errors are alike."""
    scores = np.stack([np.stack([np.asarray(one, float)] * 3, axis=-1) for one in (before, after)], axis=1)
    return Fold(name, 1.0, 1.0, scores)


def test_the_interval_is_that_of_scipys_t_test():
    rng = np.random.default_rng(3)
    before = rng.uniform(1.0, 2.0, (4, 3))
    after = before * np.exp(np.linspace(-0.5, 0.1, 12).reshape(3, 4).T)
    found = gain([fold(str(i), *one) for i, one in enumerate(zip(before, after, strict=True))], 0)
    ratios = np.log(after / before)
    interval = stats.ttest_1samp(ratios.ravel(), 0.0).confidence_interval(0.95)
    between = ratios.mean(axis=1).std(ddof=1) / 2.0
    assert between < ratios.std(ddof=1) / np.sqrt(12.0)  # else the parts would decide
    assert found.share == pytest.approx(1.0 - np.exp(ratios.mean()))
    assert found.low == pytest.approx(1.0 - np.exp(interval.high))
    assert found.high == pytest.approx(1.0 - np.exp(interval.low))


def test_parts_that_disagree_widen_the_interval():
    """Stretches of a part are alike here, so the parts are what is independent."""
    alike = [fold(str(i), [1.0, 1.0, 1.0], [ratio] * 3) for i, ratio in enumerate((0.5, 0.6, 0.9, 1.3))]
    every = np.log([0.5, 0.6, 0.9, 1.3])
    sigma = every.std(ddof=1) / 2.0
    assert gain(alike, 0).low == pytest.approx(1.0 - np.exp(every.mean() + stats.t.ppf(0.975, 11) * sigma))
    assert gain(alike, 0).low < 0.0 < gain(alike, 0).share


def test_a_part_that_got_worse_beyond_its_noise_is_named():
    good = fold("quarter 1", [1.0, 1.1, 0.9], [0.5, 0.6, 0.4])
    noisy = fold("quarter 2", [1.0, 1.0, 1.0], [0.5, 1.0, 2.2])
    bad = fold("quarter 3", [1.0, 1.0, 1.0], [1.2, 1.3, 1.25])
    (found,) = losses([good, noisy, bad], [1])
    assert (found.part, found.measure) == ("quarter 3", "tilt")
    assert found.before == pytest.approx(1.0) and found.after == pytest.approx(np.sqrt(np.mean([1.44, 1.69, 1.5625])))


def test_one_stretch_for_each_log_takes_its_noise_from_the_others():
    logs = [fold(str(i), [1.0], [ratio]) for i, ratio in enumerate((0.6, 0.7, 0.65, 1.02, 0.66))]
    assert losses(logs, [0]) == []
    assert [one.part for one in losses([*logs, fold("far", [1.0], [3.0])], [0])] == ["far"]


def test_stretches_of_a_part_are_those_of_evaluate_on_it():
    log = lh.simulate.recording("LSM6DSO32", "hand", 30.0, 50.0, seed=4, mag="HMC5883L")
    (whole,) = references([log], "truth", True, lh.Guard())
    part = whole.alone(slice(500, 1000))
    assert len(part.recording) == 500 and part.recording.t[0] == log.t[500]
    scores = stretch_scores(part, [lh.Mahony()], 4, lh.Guard())
    alone = log[500:1000]
    error = evaluate(replace(alone, truth=replace(alone.truth, north=False)), lh.fuse(alone, lh.Mahony()))
    np.testing.assert_allclose(root_mean_square(scores)[0], [error.total, error.tilt, error.heading], rtol=1e-9)
