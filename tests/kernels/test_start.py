"""TRIAD, the start of every filter, and the quaternion of a matrix: against SciPy and the textbook compass."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from tests.reference import textbook

from levelhead.kernels import mat3, quat, triad
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.quat import Euler
from levelhead.kernels.vec3 import ZERO, Vec3

ANGLE = st.floats(-math.pi, math.pi)
EULERS = st.builds(Euler, ANGLE, st.floats(-math.pi / 2, math.pi / 2), ANGLE)
UP, FIELD = Vec3(0.0, 0.0, 9.81), Vec3(0.0, 19.0, -45.0)


def scipy_of(q):
    return Rotation.from_quat(np.array(q), scalar_first=True)


def rotation(e):
    return Rotation.from_euler("ZYX", [e.yaw, e.pitch, e.roll])


def seen(attitude, v):
    """An earth vector as the sensor sees it."""
    return Vec3(*attitude.inv().apply(v).tolist())


@given(EULERS)
def test_from_matrix_is_scipys(e):
    expected = rotation(e)
    q = quat.from_matrix(Mat3(*expected.as_matrix().ravel().tolist()))
    assert (scipy_of(q) * expected.inv()).magnitude() < 1e-15
    assert math.sqrt(sum(c * c for c in q)) == pytest.approx(1.0, abs=1e-15)
    assert max(q) > max(map(abs, q)) - 1e-12


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("angle", [0.0, 90.0, 120.0, 179.999999, 180.0, -90.0])
def test_from_matrix_at_half_turns(axis, angle):
    expected = Rotation.from_euler(axis, angle, degrees=True)
    q = quat.from_matrix(Mat3(*expected.as_matrix().ravel().tolist()))
    assert (scipy_of(q) * expected.inv()).magnitude() < 1e-15


@given(EULERS)
def test_the_start_is_the_attitude(e):
    true = rotation(e)
    q = triad.initial_attitude(seen(true, UP), seen(true, FIELD))
    assert (scipy_of(q) * true.inv()).magnitude() < 1e-14


@given(EULERS, st.floats(-30.0, 30.0), st.floats(-30.0, 30.0), st.floats(-30.0, 30.0))
def test_the_start_is_the_tilt_compensated_compass(e, x, y, z):
    acc, mag = seen(rotation(e), UP), Vec3(x, y, z)
    if triad.distinct(acc, mag) and abs(e.pitch) < 1.57:
        expected = textbook.compass(acc, mag)
        away = np.linalg.norm(np.cross(acc, mag)) / np.linalg.norm(acc) / np.linalg.norm(mag)
        assert (scipy_of(triad.initial_attitude(acc, mag)) * expected.inv()).magnitude() < 1e-12 / away


@pytest.mark.parametrize("pitch", [90.0, -90.0, 89.9999999, 0.0])
@pytest.mark.parametrize("roll", [0.0, 50.0, 180.0])
def test_without_a_field_yaw_is_zero_also_near_the_vertical(pitch, roll):
    true = Rotation.from_euler("ZYX", [0.0, pitch, roll], degrees=True)
    acc = seen(true, UP)
    q = triad.initial_attitude(acc, ZERO)
    np.testing.assert_allclose(scipy_of(q).inv().apply([0, 0, 1]), np.array(acc) / 9.81, atol=1e-15)
    if abs(pitch) < 89.9:
        assert (scipy_of(q) * true.inv()).magnitude() < 1e-15
    assert abs(quat.forward(q).y) < 1e-15 and abs(quat.rotate(q, Vec3(0.0, 1.0, 0.0)).x) < 1.0 + 1e-15


def test_from_what_there_is():
    assert triad.initial_attitude(ZERO, ZERO) == (1.0, 0.0, 0.0, 0.0)
    assert triad.initial_attitude(UP, ZERO) == (1.0, 0.0, 0.0, 0.0)
    assert triad.initial_attitude(UP, Vec3(0.0, 0.0, -45.0)) == (1.0, 0.0, 0.0, 0.0), "a vertical field has no north"
    assert triad.initial_attitude(Vec3(1e-200, 0.0, 0.0), ZERO) == (1.0, 0.0, 0.0, 0.0), "too short to have a direction"
    level = triad.initial_attitude(ZERO, Vec3(19.0, 0.0, -45.0))
    assert quat.to_euler(level).yaw == pytest.approx(math.pi / 2) and quat.up(level) == (0.0, 0.0, 1.0)
    down = triad.initial_attitude(Vec3(0.0, 0.0, -9.81), ZERO)
    assert quat.up(down).z == pytest.approx(-1.0) and all(map(math.isfinite, down))


@given(EULERS, st.builds(Vec3, *[st.floats(-1.0, 1.0)] * 3), st.builds(Vec3, *[st.floats(-1.0, 1.0)] * 3))
def test_triad_of_two_pairs(e, first, second):
    """The first vector comes out exactly, the second one in the plane that it spans with the first."""
    true = rotation(e)
    if np.linalg.norm(np.cross(first, second)) > 1e-3:
        off = Rotation.from_rotvec(0.1 * np.array(first) / np.linalg.norm(first))  # a lie about the second alone
        told = Vec3(*off.apply(second).tolist())
        q = scipy_of(triad.attitude(seen(true, first), seen(true, second), first, told))
        assert np.degrees((q * (off * true).inv()).magnitude()) < 1e-9


def test_triad_of_parallel_vectors_is_the_identity():
    assert triad.attitude(UP, UP, UP, FIELD) == triad.attitude(UP, FIELD, UP, UP) == (1.0, 0.0, 0.0, 0.0)
    assert not triad.distinct(UP, ZERO) and not triad.distinct(UP, Vec3(0.0, 0.0, -1.0)) and triad.distinct(UP, FIELD)
    axes = triad.axes(UP, FIELD)
    np.testing.assert_allclose(mat3.mul(axes, mat3.transpose(axes)), (1, 0, 0, 0, 1, 0, 0, 0, 1), atol=1e-15)
