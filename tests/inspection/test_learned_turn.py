"""The matrix between gyroscope and gravity that the filter learns."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.reference.moved_sensor import RATE, observe_motion

from levelhead.inspection.agreement import FLOOR, MIMICKED, Seen, _combine, agree
from levelhead.inspection.learned import LINEAR, Learned
from levelhead.inspection.learned_turn import LearnedTurn, learn_turn
from levelhead.recording import Recording


def tumble(seconds: float = 60.0) -> Recording:
    t = np.arange(0.0, seconds, 1.0 / RATE)[:, None]
    angles = np.sin(2.0 * np.pi * np.array([0.11, 0.17, 0.23]) * t + [0.0, 1.0, 2.0]) * [1.2, 0.9, 0.8]
    return observe_motion(angles, 0.5 * np.sin(2.0 * np.pi * np.array([1.1, 1.7, 0.9]) * t))


@pytest.mark.parametrize("seed", range(3))
def test_the_matrix_put_in_is_learned_to_within_its_sigma(seed: int) -> None:
    right = tumble()
    matrix = np.eye(3) + np.random.default_rng(seed).normal(0.0, 0.06, (3, 3))
    found = learn_turn(replace(right, gyr=right.gyr @ np.linalg.inv(matrix).T))
    assert found is not None
    sigma = np.sqrt(np.diag(found.covariance)).reshape(3, 3)
    assert sigma.max() < 0.02
    assert np.abs((found.matrix - matrix) / np.hypot(sigma, 0.002)).max() < 3.5


def test_an_axis_that_does_not_turn_is_not_known() -> None:
    t = np.arange(0.0, 60.0, 1.0 / RATE)[:, None]
    found = learn_turn(observe_motion(np.sin(0.8 * t) * [1.0, 0.0, 0.0], np.zeros((len(t), 3))))
    assert found is not None
    sigma = np.sqrt(np.diag(found.covariance)).reshape(3, 3)
    assert sigma[0, 0] < 0.02
    assert sigma[1, 1] > 0.3 and sigma[2, 2] > 0.3


def test_a_prior_taken_off_and_put_back_leaves_the_numbers() -> None:
    """Bayes' rule for normal distributions, by hand: two numbers, of which the second is hardly shown."""
    shown, prior = np.diag([400.0, 0.1]), np.array([0.2, 0.5])
    mean = np.array([0.1, 2.0])
    covariance = np.linalg.inv(shown + np.diag(prior**-2.0))
    beside = Learned(covariance @ shown @ mean, covariance)
    alone = beside.without_prior(prior)
    np.testing.assert_allclose(alone.mean, mean, rtol=1e-9)
    np.testing.assert_allclose(alone.covariance, np.linalg.inv(shown), rtol=1e-9)
    np.testing.assert_allclose(alone.with_prior(prior), beside.mean, rtol=1e-9)
    assert abs(beside.mean[1]) < 0.1  # so a number far off, but not shown, is near with the prior


@pytest.mark.parametrize("name", ["openaxes/circle100_radius", "tyrex/Guillaume_Nexus5_Dist_BackPocket"])
def test_a_number_that_is_not_shown_hides_no_other(data_dir: Path, name: str) -> None:
    found = learn_turn(start_of(data_dir, name))
    assert found is not None
    sigma = np.sqrt(np.diag(found.covariance)).reshape(3, 3)
    assert np.abs((found.matrix - np.eye(3)) / np.hypot(sigma, FLOOR)).max() < 4.0


def test_what_is_far_from_the_identity_is_not_learned() -> None:
    right = tumble()
    for matrix in (2.0 * np.eye(3), 0.5 * np.eye(3), np.diag([1.0, 1.0, -1.0])):
        found = learn_turn(replace(right, gyr=right.gyr @ matrix))
        assert found is None or np.abs(found.matrix - np.eye(3)).max() < 2.0 * LINEAR
        assert agree(replace(right, gyr=right.gyr @ matrix)).fault is not None


def seen() -> Seen:
    return agree(tumble()).seen[0]


def test_two_that_agree_are_weighted_by_their_covariances() -> None:
    one = seen()._replace(weight=np.eye(9) / 0.04**2)
    floor = FLOOR + MIMICKED / (one.contrast**2 - 1.0)
    learned = LearnedTurn(one.fit.matrix + 0.03, np.eye(9) * (0.04**2 - floor**2))
    both = _combine(one, learned)
    np.testing.assert_allclose(both.fit.matrix, one.fit.matrix + 0.015, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(both.weight, 2.0 * one.weight)


def test_one_that_contradicts_the_segments_does_not_count() -> None:
    one = seen()._replace(weight=np.eye(9) / 0.04**2)
    assert _combine(one, LearnedTurn(one.fit.matrix + 0.5, 1e-4 * np.eye(9))) is one
    assert _combine(one, None) is one


def start_of(data_dir: Path, name: str) -> Recording:
    """A minute of a real recording without its magnetometer."""
    path = data_dir / "truth" / f"{name}.npz"
    if not path.is_file():
        pytest.skip(f"no truth/{name} among the real recordings")
    with np.load(path) as log:
        rows = log["t"] < log["t"][0] + 60.0
        return Recording(log["t"][rows], log["gyr"][rows], log["acc"][rows])


@pytest.mark.parametrize("phone", ["Nexus5_Dist", "Nexus5_NoDist", "iPhone4S_Dist", "iPhone5_Dist"])
def test_forces_of_an_arm_that_swings_are_not_taken_for_a_scale(data_dir: Path, phone: str) -> None:
    """They follow the tilt. By the usual density of the velocity alone the scale would be 6 to 30 % off, ±2 %."""
    recording = start_of(data_dir, f"tyrex/Guillaume_{phone}_Swinging")
    found = learn_turn(recording)
    if found is not None:
        sigma = np.sqrt(np.diag(found.covariance)).reshape(3, 3)
        assert np.abs((found.matrix - np.eye(3)) / sigma).max() < 4.0
    assert agree(recording).fault is None


@pytest.mark.parametrize("factor", [0.9, 1.1, 1.147])
def test_a_tenth_too_much_is_named_on_a_walk(data_dir: Path, factor: float) -> None:
    """By the segments alone it was not."""
    recording = start_of(data_dir, "x3mate/x3mate_walking_st")
    assert agree(recording).fault is None
    fault = agree(replace(recording, gyr=factor * recording.gyr)).fault
    assert fault is not None and fault.kind == "scale"
    assert 1.0 / fault.matrix[0, 0] == pytest.approx(factor, rel=0.04)


def test_readings_without_a_number_teach_nothing_wrong() -> None:
    recording = tumble()
    holes = recording.gyr.copy()
    holes[500:600] = np.nan
    for gyr in (holes, np.full_like(holes, np.nan), 1e6 * recording.gyr):
        found = learn_turn(replace(recording, gyr=gyr))
        assert found is None or (np.isfinite(found.matrix).all() and np.isfinite(found.covariance).all())
