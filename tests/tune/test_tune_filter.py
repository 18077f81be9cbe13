"""Parameters found with truth and without it, what they are worth where nobody looked, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import levelhead as lh
from levelhead.errors import LevelheadError
from levelhead.evaluate import evaluate
from levelhead.recording import Recording, Truth
from levelhead.tune.error_bands import advice, error_bands
from levelhead.tune.minimise import minimise
from levelhead.tune.parameter_space import space_of
from levelhead.tune.reference_orientation import references
from levelhead.tune.tune_filter import tune_filter

pytest.importorskip("scipy")


def moved(seed: int, seconds: float = 60.0) -> Recording:
    return lh.simulate.recording("LSM6DSO32", "hand", seconds, 50.0, seed=seed, mag="HMC5883L")


def error(recording: Recording, params: lh.Mahony) -> float:
    return evaluate(recording, lh.fuse(recording, params)).total_aligned


@pytest.fixture(scope="module")
def logs():
    return [moved(seed) for seed in (1, 2, 3)]


@pytest.fixture(scope="module")
def poor(logs):
    """Found from parameters that are ten times too large."""
    return tune_filter(logs, lh.Mahony(kp=4.0, k_mag=3.0), ["kp", "k_mag"], runs=60)


@pytest.mark.slow
def test_poor_parameters_become_good_where_nobody_looked(poor):
    assert poor.worth and poor.held_out_gain > 0.3
    other = moved(9)
    assert error(other, poor.params) < 0.7 * error(other, lh.Mahony(kp=4.0, k_mag=3.0))
    assert poor.params.ki == lh.Mahony().ki  # not searched
    assert poor.verdict()[0].startswith("take Mahony with kp=")


@pytest.mark.slow
def test_errors_are_those_of_evaluate(poor, logs):
    every = [error(log, poor.best) for log in logs]
    np.testing.assert_allclose(poor.after, every, rtol=0.03)  # of a part of the samples


@pytest.mark.slow
def test_without_truth_they_differ_little(poor, logs):
    blind = [replace(log, truth=None) for log in logs]
    found = tune_filter(blind, lh.Mahony(kp=4.0, k_mag=3.0), ["kp", "k_mag"], runs=60)
    assert found.kinds == ["smoother"] and found.check is None
    lost = np.array([error(log, found.best) / error(log, poor.best) for log in logs])
    assert np.exp(np.mean(np.log(lost))) < 1.1


@pytest.mark.slow
def test_asked_for_the_smoother_the_truth_checks_it(logs):
    found = tune_filter(logs[0], lh.Mahony(kp=4.0), ["kp"], goal="smoother", runs=40)
    assert found.check is not None
    assert found.check.before[0] == pytest.approx(error(logs[0], lh.Mahony(kp=4.0)))
    assert found.check.after[0] == pytest.approx(error(logs[0], found.best))
    assert any(line.startswith("against the truth, which was not used") for line in found.verdict())


@pytest.mark.slow
def test_good_parameters_are_kept(poor, logs):
    again = tune_filter(logs, poor.best, ["kp", "k_mag"], runs=60)
    assert not again.worth
    assert again.params == poor.best
    assert again.verdict()[0].startswith("keep the parameters given of Mahony")


@pytest.mark.slow
def test_a_gain_that_does_not_last_is_not_the_headline(poor):
    """The parts left out lose by as much as they gained."""
    turned = [fold._replace(before=fold.after, after=fold.before, scores=fold.scores[:, ::-1]) for fold in poor.folds]
    found = replace(poor, folds=tuple(turned))
    assert not found.worth and found.params == poor.space.params
    first = found.verdict()[0]
    assert first.startswith("keep the parameters given of Mahony: the gain does not last; on logs left out of the")
    assert f"{100 * -found.held_out_gain:.0f} % more" in first


@pytest.mark.slow
def test_a_log_left_out_is_not_looked_at(logs):
    """Of logs that want different parameters the one left out is worse than where it was searched."""
    turned = replace(logs[1], acc=logs[1].acc + 3.0 * np.sin(7.0 * logs[1].t)[:, None])
    found = tune_filter([logs[0], turned], lh.Mahony(), ["kp"], runs=40)
    alone = tune_filter(turned, lh.Mahony(), ["kp"], runs=40)
    left = found.folds[1]
    other = tune_filter(logs[0], lh.Mahony(), ["kp"], runs=40)
    assert left.after == pytest.approx(error(turned, other.best), rel=0.03)
    assert left.after > alone.after[0]


@pytest.mark.slow
def test_a_minimum_at_the_end_of_the_range_is_said(logs):
    found = tune_filter(logs[0], lh.Mahony(kp=4.0), ["kp=2:8"], runs=40)
    assert found.at_end(0) == "lowest"
    assert any("kp = 2 is the lowest value searched" in line for line in found.verdict())
    curve = found.curves[0]
    flat = replace(curve, **{name: np.full(len(curve.values), 1.0) for name in ("total", "tilt", "heading")})
    level = replace(found, curves=(flat,))  # the same end, but the error does not fall towards it
    assert level.at_end(0) == "" and not any("searched" in line for line in level.verdict())


@pytest.mark.slow
def test_progress_goes_one_way(logs):
    seen: list[float] = []
    tune_filter(logs[0], lh.Mahony(), ["kp"], runs=40, progress=seen.append)
    assert len(seen) > 10 and max(seen) <= 1.0


def test_the_search_finds_a_known_minimum():
    place = np.array([0.2, 0.7, 0.5, 0.9])

    def objective(points):
        return np.sum((points - place) ** 2 * [1.0, 9.0, 4.0, 1.0], axis=1)

    found = minimise(objective, np.full(4, 0.5), 320)
    np.testing.assert_allclose(found.point, place, atol=0.03)
    assert found.runs <= 330
    start = minimise(objective, place, 40)
    assert start.value == 0.0


def test_parts_of_an_error_are_told_apart():
    t = np.arange(0.0, 120.0, 0.02)
    flat = np.zeros_like(t)

    def held(angle):
        rec = Recording(t, np.zeros((len(t), 3)), np.tile([0.0, 0.0, 9.81], (len(t), 1)), None, Truth(
            np.stack([flat + 1.0, flat, flat, flat], axis=1)))  # fmt: skip
        half = 0.5 * np.radians(angle)
        return error_bands(rec, lh.Track(t, np.stack([np.cos(half), np.sin(half), flat, flat], axis=1)), True)

    slow, middle, fast = (held(np.sin(2.0 * np.pi * t / period)) for period in (100.0, 4.0, 0.2))
    root = np.sqrt(0.5)
    assert slow.drift == pytest.approx(root, rel=0.1) and slow.sway < 0.1 and slow.jitter < 0.01
    assert middle.sway == pytest.approx(root, rel=0.35) and middle.drift < 0.1
    assert fast.jitter == pytest.approx(root, rel=0.05) and fast.sway < 0.1
    said = advice(slow, {("ki", 2.0): slow._replace(drift=0.3, jitter=0.2), ("kp", 0.5): slow})
    assert str(said[0]).startswith("drift") and "raise ki (doubled: 0.3°, but jitter" in str(said[0])


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["kq"], "has no parameter 'kq'"),
        (["kp", "kp=1:2"], "named twice"),
        (["kp=2:1"], "not a range to search"),
        (["kp=0:1"], "not a range to search"),
        (["kp=a:1"], "is not a range; write"),
        (["whole_field"], "is a switch"),
    ],
)
def test_wrong_wishes_are_refused(words, sentence):
    with pytest.raises(LevelheadError, match=sentence):
        space_of(lh.Mahony(), words)


def test_a_filter_without_parameters_is_refused():
    with pytest.raises(LevelheadError, match="AccelTilt has no parameter to tune"):
        space_of(lh.AccelTilt())


def test_another_name_is_searched_too():
    space = space_of(lh.Complementary(tau=0.99), ["alpha"])
    assert space.at(space.start) == lh.Complementary(tau=0.99)
    assert space.at(np.array([1.0])).alpha == pytest.approx(0.99)


def test_what_cannot_serve_is_refused(logs):
    def refused(recording, kind, sentence):
        with pytest.raises(LevelheadError, match=sentence):
            references([recording], kind, True, lh.Guard())

    truth = logs[0].truth
    short = truth.quat.copy()
    short[1500:] = np.nan
    refused(replace(logs[0], truth=replace(truth, quat=short)), "truth", "the truth covers 30 s of 60 s")
    refused(replace(logs[0], truth=replace(truth, quat=np.full_like(short, np.nan))), "truth", "missing")
    refused(replace(logs[0], truth=None), "truth", "holds no true orientation")
    refused(logs[0][:300], None, "6 s are too short to tune on")
    still = lh.simulate.recording("LSM6DSO32", "still", 60.0, 50.0, seed=1)
    refused(still, "truth", "the sensor hardly turns")
    refused(replace(still, truth=None), None, "too short to tune on|hardly turns")
    with pytest.raises(LevelheadError, match="no recording to tune on"):
        tune_filter([], lh.Mahony())
    with pytest.raises(LevelheadError, match="'tils' is not an error"):
        tune_filter(logs, lh.Mahony(), metric="tils")
    with pytest.raises(LevelheadError, match="1 runs are not a search"):
        tune_filter(logs, lh.Mahony(), runs=1)


@pytest.mark.slow
def test_what_is_weak_is_said(logs):
    found = tune_filter(logs[0][:1500], lh.Mahony(), ["kp"], runs=40)
    assert any("30 s of motion in " in line for line in found.verdict())


def test_unasked_a_large_filter_is_searched_where_motion_and_room_decide():
    assert space_of(lh.EKF()).names == ("gyr_noise_per_rate", "acc_motion", "acc_tau", "mag_noise")
    assert space_of(lh.EKF(), ["gate"]).names == ("gate",)
