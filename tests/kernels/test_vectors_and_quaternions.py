"""Vectors, quaternions and angles against NumPy and SciPy."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from levelhead.kernels import angle, quat, tilt, triad, vec3
from levelhead.kernels.quat import Euler, Quat
from levelhead.kernels.vec3 import ZERO, Vec3

NUMBER = st.floats(-100, 100)
VECTORS = st.builds(Vec3, NUMBER, NUMBER, NUMBER)
ANGLE = st.floats(-math.pi, math.pi)
PITCH = st.floats(-1.5, 1.5)
EULERS = st.builds(Euler, ANGLE, PITCH, ANGLE)
UNITS = EULERS.map(quat.from_euler)


def scipy_of(q):
    return Rotation.from_quat(np.array(q), scalar_first=True)


@given(VECTORS, VECTORS, NUMBER)
def test_vectors(a, b, s):
    A, B = np.array(a), np.array(b)
    np.testing.assert_array_equal(vec3.add(a, b), A + B)
    np.testing.assert_array_equal(vec3.sub(a, b), A - B)
    np.testing.assert_array_equal(vec3.scale(a, s), A * s)
    assert vec3.dot(a, b) == pytest.approx(A @ B, abs=1e-10)
    np.testing.assert_allclose(vec3.cross(a, b), np.cross(A, B), atol=1e-10)
    assert vec3.norm(a) == pytest.approx(np.linalg.norm(A), abs=1e-12)


@given(VECTORS)
def test_normalize_is_unit_or_zero(a):
    n = vec3.norm(vec3.normalize(a))
    assert n == 0.0 if vec3.norm(a) <= vec3.SHORTEST else n == pytest.approx(1.0, abs=1e-12)


@pytest.mark.slow
@given(UNITS, UNITS, VECTORS)
def test_products_and_rotation(p, q, v):
    np.testing.assert_allclose(quat.rotate(p, v), scipy_of(p).apply(v), atol=1e-11)
    composed = quat.rotate(quat.multiply(p, q), v)
    np.testing.assert_allclose(composed, quat.rotate(p, quat.rotate(q, v)), atol=1e-10)
    back = quat.multiply(p, quat.conjugate(p))
    np.testing.assert_allclose(back, (1, 0, 0, 0), atol=1e-14)


@given(EULERS)
def test_euler_angles_are_scipys_intrinsic_zyx(e):
    expected = Rotation.from_euler("ZYX", [e.yaw, e.pitch, e.roll])
    q = quat.from_euler(e)
    assert (scipy_of(q) * expected.inv()).magnitude() < 1e-12
    again = quat.from_euler(quat.to_euler(q))
    assert (scipy_of(again) * expected.inv()).magnitude() < 1e-11


@pytest.mark.parametrize("pitch", [math.pi / 2, -math.pi / 2])
def test_euler_angles_at_the_pole_are_finite_and_mean_the_same_rotation(pitch):
    q = quat.from_euler(Euler(0.3, pitch, -0.4))
    e = quat.to_euler(q)
    assert all(math.isfinite(x) for x in e)
    assert e.pitch == pytest.approx(pitch, abs=1e-7)


@given(st.builds(Vec3, *[st.floats(-2.0, 2.0)] * 3))
def test_exp_is_scipys_and_log_its_inverse(v):
    np.testing.assert_allclose(scipy_of(quat.exp(v)).as_matrix(), Rotation.from_rotvec(v).as_matrix(), atol=1e-14)
    if vec3.norm(v) < math.pi - 1e-6:
        np.testing.assert_allclose(quat.log(quat.exp(v)), v, atol=1e-12)


@given(st.builds(Vec3, *[st.floats(-0.12, 0.12)] * 3))
@example(Vec3(0.07505675367808554, 0.0729570571455497, 0.06900001242095685))
def test_the_series_of_exp_is_exact_to_rounding(v):
    half = 0.5 * math.sqrt(v.x**2 + v.y**2 + v.z**2)
    q = quat.exp(v)
    assert q.w == pytest.approx(math.cos(half), abs=3e-16)
    square = sum(Fraction(c) ** 2 for c in v) / 4
    sinc = sum((-square) ** k / math.factorial(2 * k + 1) for k in range(8)) / 2  # exact: only the kernel rounds
    np.testing.assert_allclose([q.x, q.y, q.z], [float(Fraction(c) * sinc) for c in v], rtol=4e-16, atol=1e-300)


@given(UNITS)
def test_log_takes_the_short_way(q):
    assert vec3.norm(quat.log(q)) <= math.pi + 1e-12
    np.testing.assert_allclose(quat.log(Quat(-q.w, -q.x, -q.y, -q.z)), quat.log(q), atol=1e-9)


@given(UNITS, VECTORS, st.floats(1e-4, 0.1))
def test_integration_is_right_multiplication_by_the_turn(q, gyr, dt):
    expected = scipy_of(q) * Rotation.from_rotvec(np.array(gyr) * dt)
    assert (scipy_of(quat.integrate(q, gyr, dt)) * expected.inv()).magnitude() < 1e-11


@given(st.floats(-1e6, 1e6), st.sampled_from([360.0, 2 * math.pi, 1.0]))
def test_wrap(x, period):
    w = angle.wrap(x, period)
    assert -period / 2 - 1e-6 <= w <= period / 2 + 1e-6
    turns = (x - w) / period
    assert turns == pytest.approx(round(turns), abs=1e-6)


@given(st.floats(-179.999, 179.999))
def test_wrap_leaves_what_is_inside_to_the_bit(x):
    assert angle.wrap(x, 360.0) == x
    assert angle.wrap(x, 0.0) == x


def test_blend_goes_the_short_way_round():
    middle = angle.blend(175.0, -175.0, 0.5, 360.0)
    assert abs(middle) == pytest.approx(180.0)
    assert angle.blend(175.0, -175.0, 0.5, 0.0) == pytest.approx(0.0), "on a line there is no other way"


@given(EULERS)
def test_tilt_of_a_resting_sensor(e):
    acc = Vec3(*scipy_of(quat.from_euler(e)).inv().apply([0, 0, 9.80665]))
    found = quat.to_euler(triad.initial_attitude(acc, ZERO))
    assert angle.wrap(found.roll - e.roll, angle.TWO_PI) == pytest.approx(0.0, abs=1e-9)
    assert found.pitch == pytest.approx(e.pitch, abs=1e-9)


@pytest.mark.parametrize("octant", range(8))
@pytest.mark.parametrize("roll", [-2.5, -0.6, 0.0, 0.9])
@pytest.mark.parametrize("pitch", [-1.2, 0.0, 0.7])
def test_tilt_compensated_heading_in_all_octants(octant, roll, pitch):
    yaw = (octant + 0.5) * math.pi / 4 - math.pi
    true = scipy_of(quat.from_euler(Euler(roll, pitch, yaw))).inv()
    acc, field = Vec3(*true.apply([0.0, 0.0, 9.8])), Vec3(*true.apply([0.0, 19.0, -45.0]))
    assert quat.to_euler(triad.initial_attitude(acc, field)).yaw == pytest.approx(yaw, abs=1e-12)


@given(EULERS, EULERS)
def test_innovations_are_the_differences_of_the_angles(predicted, true):
    attitude = quat.from_euler(predicted)
    acc = Vec3(*scipy_of(quat.from_euler(true)).inv().apply([0, 0, 9.80665]))
    up = quat.up(attitude)
    roll = angle.wrap(true.roll - predicted.roll, angle.TWO_PI)
    assert angle.wrap(tilt.roll_innovation(up, acc) - roll, angle.TWO_PI) == pytest.approx(0.0, abs=1e-8)
    assert tilt.pitch_innovation(up, acc) == pytest.approx(true.pitch - predicted.pitch, abs=1e-8)


@given(EULERS, st.floats(-0.5, 0.5), st.floats(-0.05, 0.05), st.floats(-3, 3))
def test_adding_roll_pitch_and_yaw_adds_to_the_euler_angles(e, roll, pitch, yaw):
    q = quat.from_euler(e)
    q = tilt.add_yaw(tilt.add_roll_pitch(q, tilt.pitch_axis(quat.up(q)), roll, pitch), yaw)
    expected = quat.from_euler(Euler(e.roll + roll, e.pitch + pitch, e.yaw + yaw))
    assert (scipy_of(q) * scipy_of(expected).inv()).magnitude() < 1e-11


@given(EULERS, NUMBER, NUMBER, NUMBER)
def test_rates_of_the_euler_angles_in_the_sensor_frame(e, roll, pitch, yaw):
    """ω = (φ' − ψ' sin θ, θ' cos φ + ψ' sin φ cos θ, −θ' sin φ + ψ' cos φ cos θ)"""
    sr, cr, sp, cp = math.sin(e.roll), math.cos(e.roll), math.sin(e.pitch), math.cos(e.pitch)
    expected = (roll - yaw * sp, pitch * cr + yaw * sr * cp, -pitch * sr + yaw * cr * cp)
    up = quat.up(quat.from_euler(e))
    rates = vec3.add(tilt.in_sensor(tilt.pitch_axis(up), roll, pitch), vec3.scale(up, yaw))
    np.testing.assert_allclose(rates, expected, atol=1e-9)
