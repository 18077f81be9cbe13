"""The error split against scipy's rotations and closed-form cases."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from levelhead.evaluate.attitude_error import error_quaternion, heading_offset, split_error
from levelhead.rotations import turn_heading


def quats(rotation: Rotation) -> np.ndarray:
    return np.atleast_2d(rotation.as_quat(scalar_first=True))


def random_pair(seed: int, n: int = 50) -> tuple[Rotation, Rotation]:
    rng = np.random.default_rng(seed)
    return Rotation.random(n, rng=rng), Rotation.random(n, rng=rng)


def test_total_is_the_angle_of_scipys_relative_rotation():
    estimate, truth = random_pair(1)
    found = split_error(error_quaternion(quats(estimate), quats(truth)))
    np.testing.assert_allclose(found.total, (estimate * truth.inv()).magnitude(), atol=1e-12)


def test_tilt_is_the_angle_between_the_verticals():
    estimate, truth = random_pair(2)
    found = split_error(error_quaternion(quats(estimate), quats(truth)))
    up = np.array([0.0, 0.0, 1.0])
    cosine = np.sum(estimate.inv().apply(up) * truth.inv().apply(up), axis=1)
    np.testing.assert_allclose(found.tilt, np.arccos(np.clip(cosine, -1, 1)), atol=1e-7)


def test_broads_formulas():
    """Eqs. 2 to 4 as Laidig et al. print them."""
    estimate, truth = random_pair(3)
    error = quats(estimate * truth.inv())
    w, _, _, z = error.T
    found = split_error(error_quaternion(quats(estimate), quats(truth)))
    np.testing.assert_allclose(found.total, 2 * np.arccos(np.abs(w)), atol=1e-9)
    np.testing.assert_allclose(np.abs(found.heading), 2 * np.arctan(np.abs(z / w)), atol=1e-9)
    np.testing.assert_allclose(found.tilt, 2 * np.arccos(np.sqrt(w**2 + z**2)), atol=1e-7)


@pytest.mark.parametrize("angle", [1e-9, 1e-4, 0.5, 3.0])
def test_a_heading_error_is_only_heading_and_has_its_sign(angle):
    truth = Rotation.from_euler("ZYX", [0.3, -0.7, 1.1])
    for sign in (1, -1):
        estimate = Rotation.from_euler("Z", sign * angle) * truth
        found = split_error(error_quaternion(quats(estimate), quats(truth)))
        assert found.heading[0] == pytest.approx(sign * angle, rel=1e-6)
        assert found.total[0] == pytest.approx(angle, rel=1e-6)
        assert found.tilt[0] < 1e-14


@pytest.mark.parametrize("angle", [1e-9, 1e-4, 0.5, 3.0])
@pytest.mark.parametrize("direction", [0.0, 1.0, 4.0])
def test_an_inclination_error_is_only_tilt(angle, direction):
    truth = Rotation.from_euler("ZYX", [0.3, -0.7, 1.1])
    estimate = Rotation.from_rotvec(angle * np.array([np.cos(direction), np.sin(direction), 0.0])) * truth
    found = split_error(error_quaternion(quats(estimate), quats(truth)))
    assert found.tilt[0] == pytest.approx(angle, rel=1e-6)
    assert abs(found.heading[0]) < 1e-12


def test_a_perfect_estimate_has_no_error_at_all():
    """acos(1 − ε) would say 1e-8 here."""
    truth = Rotation.random(100, rng=np.random.default_rng(4))
    found = split_error(error_quaternion(quats(truth), quats(truth)))
    assert max(np.abs(values).max() for values in found) < 1e-15


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_turning_heading_of_both_and_the_signs_of_quaternions_change_nothing(seed):
    estimate, truth = random_pair(seed, 5)
    rng = np.random.default_rng(seed)
    want = split_error(error_quaternion(quats(estimate), quats(truth)))
    turn = Rotation.from_euler("Z", rng.uniform(-np.pi, np.pi))
    signs = rng.choice([-1.0, 1.0], (2, 5, 1))
    got = split_error(error_quaternion(signs[0] * quats(turn * estimate), signs[1] * quats(turn * truth)))
    for a, b in zip(got, want, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-7)


def test_any_earth_rotation_of_both_keeps_the_total():
    estimate, truth = random_pair(5)
    world = Rotation.random(rng=np.random.default_rng(6))
    want = split_error(error_quaternion(quats(estimate), quats(truth))).total
    got = split_error(error_quaternion(quats(world * estimate), quats(world * truth))).total
    np.testing.assert_allclose(got, want, atol=1e-12)


@pytest.mark.slow
def test_heading_offset_is_the_minimum_that_a_search_finds():
    rng = np.random.default_rng(7)
    truth = Rotation.random(400, rng=rng)
    noise = Rotation.from_rotvec(0.3 * rng.standard_normal((400, 3)))
    estimate = Rotation.from_euler("Z", 2.5) * noise * truth
    error = error_quaternion(quats(estimate), quats(truth))
    rows = np.ones(400, bool)
    found = heading_offset(error, rows)

    def chordal(angle: float) -> float:
        return float(np.mean(1 - np.cos(split_error(turn_heading(error, -angle)).total)))

    grid = np.linspace(-np.pi, np.pi, 4001)
    assert found == pytest.approx(grid[np.argmin([chordal(angle) for angle in grid])], abs=1e-3)


def test_heading_offset_across_the_wrap():
    """A mean of +179° and −179° is 180°, not 0°."""
    truth = Rotation.identity(2)
    estimate = Rotation.from_euler("Z", [[179.0], [-179.0]], degrees=True)
    error = error_quaternion(quats(estimate), quats(truth))
    assert abs(np.degrees(heading_offset(error, np.ones(2, bool)))) == pytest.approx(180.0)


def test_turn_heading_is_scipys_product():
    rotation = Rotation.random(20, rng=np.random.default_rng(8))
    turned = Rotation.from_quat(turn_heading(quats(rotation), 0.8), scalar_first=True)
    assert (turned * (Rotation.from_euler("Z", 0.8) * rotation).inv()).magnitude().max() < 1e-14
