"""Readings of a sensor whose errors are known, without them.

The true rate is ω − S ω − b, the true specific force a − c, the true field h − d w × h with h = μ − o and the true rate
w: the field was measured d seconds ago, when a constant one stood at h + d w × h in the sensor.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.kernels import mat3
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.tilt import NO_LENGTH
from levelhead.kernels.vec3 import Vec3, cross, scale, sub


class Errors(NamedTuple):
    """What a sensor does wrong."""

    gyr_matrix: Mat3  # S: scale factor errors on the diagonal, cross-axis terms beside it
    gyr_bias: Vec3  # b, rad/s
    acc_bias: Vec3  # c, m/s²
    mag_offset: Vec3  # o, in the unit of the magnetometer
    mag_delay: float  # d, s, by which the magnetometer is later than the gyroscope


class Readings(NamedTuple):
    """What a filter is fed with: rad/s, m/s², and the field."""

    gyr: Vec3
    acc: Vec3
    mag: Vec3


@kernel
def rate(errors: Errors, gyr: Vec3) -> Vec3:
    """ω − S ω − b"""
    return sub(sub(gyr, mat3.apply(errors.gyr_matrix, gyr)), errors.gyr_bias)


@kernel
def field(errors: Errors, turn: Vec3, mag: Vec3) -> Vec3:
    """h − d w × h, h = μ − o"""
    h = sub(mag, errors.mag_offset)
    return sub(h, scale(cross(turn, h), errors.mag_delay))


@kernel
def silent(v: Vec3) -> bool:
    """Whether a sensor says nothing at all: the zero vector, which is another thing than a missing reading."""
    x, y, z = v
    return x * x + y * y + z * z <= NO_LENGTH


@kernel
def measured(turn: float) -> float:
    """A component of the rate; 0 if it is missing."""
    return turn if turn - turn == 0.0 else 0.0


@kernel
def corrected(errors: Errors, gyr: Vec3, acc: Vec3, mag: Vec3) -> Readings:
    """All three; a sensor that is silent stays so, and where the rate is missing the field is taken for undelayed."""
    turn = rate(errors, gyr)
    x, y, z = turn
    if not silent(acc):
        acc = sub(acc, errors.acc_bias)
    if not silent(mag):
        mag = field(errors, Vec3(measured(x), measured(y), measured(z)), mag)
    return Readings(turn, acc, mag)
