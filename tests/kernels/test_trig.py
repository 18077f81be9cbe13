"""sin, cos and atan2 of nothing but arithmetic, against long doubles; and where their numbers come from."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.reference import economized

from levelhead.compiler import compile as jit
from levelhead.compiler import mark
from levelhead.kernels import trig

FINITE = st.floats(-1e300, 1e300)
LONG = np.longdouble
PRECISE = pytest.mark.skipif(np.finfo(LONG).eps > 1e-18, reason="long double is no longer than double here")


def truth(x):
    """sin and cos, after taking whole turns off in exact fractions."""
    exact = Fraction(x)
    rest = exact - 2 * economized.PI * round(exact / (2 * economized.PI))
    high = float(rest)
    reduced = LONG(high) + LONG(float(rest - Fraction(high)))
    return np.sin(reduced), np.cos(reduced)


def error(value, expected):
    return abs(float(LONG(value) - expected))


def constants(function):
    return {abs(value) for value in function.__code__.co_consts if isinstance(value, float)}


@pytest.mark.slow
def test_coefficients_are_those_of_the_economized_series():
    assert {abs(c) for c in economized.arctangent(11)} <= constants(trig.atan2)
    assert {abs(c) for c in economized.sine(6) + economized.cosine(6)} <= constants(trig.sincos)


def test_constants_are_pi_and_its_parts():
    assert economized.half_pi_parts() == (trig.HALF_PI_1, trig.HALF_PI_2, trig.HALF_PI_3)
    assert math.pi / 4 == trig.QUARTER and Fraction(3) * Fraction(trig.QUARTER) == 3 * trig.QUARTER
    assert float((economized.PI - Fraction(math.pi)) / Fraction(math.pi)) == trig.PI_SHORT
    assert float(2 / economized.PI) == trig.TURNS
    assert (math.tan(math.pi / 8), math.tan(3 * math.pi / 8)) == pytest.approx((trig.TAN_22, trig.TAN_67), rel=1e-15)


@PRECISE
@given(FINITE, FINITE)
@example(1e-310, -1e-310)
@example(5e-324, 5e-324)
@example(1e300, 1e-300)
@example(-1e-300, -1e300)
@example(8e307, -8e307)
@example(0.0, -0.0)
def test_atan2_is_right_to_4e16(y, x):
    got = trig.atan2(y, x)
    assert -math.pi <= got <= math.pi
    expected = np.arctan2(LONG(y + 0.0), LONG(x + 0.0))  # −0 counts as 0
    assert error(got, expected) < 4e-16


@PRECISE
@given(st.floats(1e-290, 1e300), st.floats(0.0, 1.0))
def test_small_angles_are_right_to_two_units_in_the_last_place(x, ratio):
    y = x * ratio
    if y / x > 1e-300:
        expected = np.arctan2(LONG(y), LONG(x))
        assert error(trig.atan2(y, x), expected) < 2 * 2.3e-16 * float(expected)


@given(FINITE, FINITE)
def test_atan2_is_symmetric_to_the_bit(y, x):
    assert y == 0.0 or trig.atan2(-y, x) == -trig.atan2(y, x)
    assert trig.atan2(y * 0.5, x * 0.5) == trig.atan2(y, x) or min(abs(x), abs(y)) < 1e-300


@pytest.mark.parametrize("zero", [0.0, -0.0])
def test_atan2_on_the_axes(zero):
    assert trig.atan2(zero, 0.0) == trig.atan2(zero, -0.0) == 0.0
    assert trig.atan2(zero, 2.0) == 0.0
    assert trig.atan2(zero, -2.0) == math.pi
    assert trig.atan2(3.0, zero) == math.pi / 2
    assert trig.atan2(-3.0, zero) == -math.pi / 2
    assert trig.atan2(1e-310, 0.0) == math.pi / 2


@pytest.mark.parametrize("eighths", range(-7, 9))
def test_atan2_between_its_pieces(eighths):
    angle = eighths * math.pi / 8
    for away in (-1e-15, 0.0, 1e-15):
        got = trig.atan2(math.sin(angle + away), math.cos(angle + away))
        assert math.remainder(got - angle - away, 2 * math.pi) == pytest.approx(0.0, abs=1e-15)


@PRECISE
@given(
    st.one_of(st.floats(-4.0, 4.0), st.floats(-1e6, 1e6), st.integers(-600_000, 600_000).map(lambda k: k * math.pi / 2))
)
def test_sine_and_cosine_are_right_to_3e16_up_to_a_million(x):
    got, expected = trig.sincos(x), truth(x)
    assert error(got.sin, expected[0]) < 3e-16 and error(got.cos, expected[1]) < 3e-16
    assert trig.sin(x) == got.sin and trig.cos(x) == got.cos


@PRECISE
@given(st.floats(1e6, 1e9), st.sampled_from([1.0, -1.0]))
def test_beyond_that_the_error_grows_with_the_angle_but_stays_a_sine(size, sign):
    got, expected = trig.sincos(sign * size), truth(sign * size)
    assert error(got.sin, expected[0]) < 2e-16 * size and error(got.cos, expected[1]) < 2e-16 * size
    assert abs(got.sin) <= 1.0 and abs(got.cos) <= 1.0


@given(st.floats(-1e6, 1e6))
def test_sine_is_odd_and_cosine_even_to_the_bit(x):
    assert trig.sin(-x) == -trig.sin(x) and trig.cos(-x) == trig.cos(x)


def test_special_angles():
    assert trig.sincos(0.0) == (0.0, 1.0) and trig.sincos(-0.0) == (0.0, 1.0)
    assert trig.sin(math.pi / 2) == 1.0 and trig.cos(math.pi) == -1.0
    assert trig.sin(1e-300) == 1e-300


@mark.kernel
def _both(y: float, x: float) -> float:
    s, c = trig.sincos(y)
    return trig.atan2(s * x, c + y)


@pytest.mark.compiled
def test_machine_code_gives_the_same_bits():
    rng = np.random.default_rng(3)
    machine = jit.compile_kernel(_both)
    for y, x in rng.normal(0.0, 10.0 ** rng.uniform(-3, 3, (2000, 1)), (2000, 2)).tolist():
        assert machine(y, x) == _both(y, x)
