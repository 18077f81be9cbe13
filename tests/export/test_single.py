"""What stands for facts about double in single precision, derived in exact fractions."""

from fractions import Fraction

import numpy as np
import pytest
from tests.reference.c_kernel import translated

from levelhead.compiler.mark import kernel
from levelhead.errors import LevelheadError
from levelhead.export.kinds import FLOAT
from levelhead.export.type_table import TypeTable, decimal
from levelhead.kernels import tilt, trig, vec3
from levelhead.kernels.single import INSTEAD, round_constant, shortest, single

HUGE = 1e60
PI = Fraction(314159265358979323846264338327950288419716939937510, 10**50)


def bits(value):
    """How many bits the number needs."""
    numerator = Fraction(value).numerator
    return (numerator // (numerator & -numerator)).bit_length()


def test_rounding_to_a_whole_number():
    magic = np.float32(INSTEAD[trig.ROUND])
    for x in np.float32([-70000.6, -2.5, -0.4, 0.0, 0.49, 0.51, 1.5, 2.5, 123456.7]):
        assert (x + magic) - magic == np.float32(np.rint(x))


def test_half_pi_in_three_parts():
    parts = [INSTEAD[part] for part in (trig.HALF_PI_1, trig.HALF_PI_2, trig.HALF_PI_3)]
    assert bits(parts[0]) <= 8 and bits(parts[1]) <= 11
    k = np.arange(1, 8192, dtype=np.float32)
    for part in parts[:2]:  # exact products
        np.testing.assert_array_equal((k * np.float32(part)).astype(float), k.astype(float) * part)
    assert abs(sum(map(Fraction, parts)) - PI / 2) < Fraction(1, 10**14)


def test_the_rest_of_pi():
    quarter = single(trig.QUARTER)
    assert INSTEAD[trig.PI_SHORT] == pytest.approx(float((PI / 4 - Fraction(quarter)) / Fraction(quarter)), rel=1e-7)


def test_the_shortest_vectors_have_squares():
    for name in (INSTEAD[vec3.SHORTEST] ** 2, INSTEAD[tilt.NO_LENGTH]):
        assert np.float32(name) > np.finfo(np.float32).tiny


def test_literals_read_back():
    rng = np.random.default_rng(1)
    for value in [*(10.0 ** rng.uniform(-30, 30, 500)), 0.1, 1.0, 12582912.0]:
        assert np.float32(float(decimal(shortest(round_constant(value))))) == np.float32(value)


@pytest.mark.parametrize("value", [1e60, 1e-60])
def test_what_single_precision_cannot_hold_is_refused(value):
    with pytest.raises(OverflowError, match="out of the range of single precision"):
        TypeTable("lh_test", "float").number(value)


@kernel
def tiny(a: float) -> float:
    return a * 1e-60


@kernel
def huge(a: float) -> float:
    return a * HUGE


@kernel
def below(a: float) -> float:
    return a + -1e60


def test_with_file_and_line_or_name():
    with pytest.raises(LevelheadError, match=rf"test_single.py:{tiny.__code__.co_firstlineno + 2}: 1e-60 cannot be"):
        translated(tiny, FLOAT, real="float")
    with pytest.raises(LevelheadError, match="the constant HUGE of tests.export.test_single: 1e\\+60 is out of"):
        translated(huge, FLOAT, real="float")
    translated(tiny, FLOAT), translated(huge, FLOAT)


def test_double_has_what_single_precision_cannot_hold():
    assert "a + -1e60" in translated(below, FLOAT)[2]
    with pytest.raises(LevelheadError, match=rf"test_single.py:{below.__code__.co_firstlineno + 2}: 1e\+60 cannot be"):
        translated(below, FLOAT, real="float")
