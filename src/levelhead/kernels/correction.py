"""Removes the known errors of a sensor from its readings.

The true rate is ω − S ω − b, the true specific force a − T a − c, the true field h − d w × h with h = μ − M μ − o and
the true rate w: the field was measured d seconds ago, when a constant one stood at h + d w × h in the sensor.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.kernels import mat3
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.tilt import NO_LENGTH
from levelhead.kernels.vec3 import Vec3, cross, scale, sub


class SensorErrors(NamedTuple):
    """The errors of an IMU with a magnetometer."""

    gyr_matrix: Mat3  # S: scale factor errors on the diagonal, cross-axis terms beside it
    gyr_bias: Vec3  # b, rad/s
    acc_matrix: Mat3  # T: scale factor errors and cross-axis terms of the accelerometer
    acc_bias: Vec3  # c, m/s²
    mag_matrix: Mat3  # M: soft iron, scale factors and rotation of the magnetometer
    mag_offset: Vec3  # o, in the unit of the magnetometer
    mag_delay: float  # d, s, by which the magnetometer is later than the gyroscope


class Readings(NamedTuple):
    """One sample: rate in rad/s, specific force in m/s², field in the unit of the magnetometer."""

    gyr: Vec3
    acc: Vec3
    mag: Vec3


@kernel
def true_rate(errors: SensorErrors, gyr: Vec3) -> Vec3:
    """ω − S ω − b"""
    return sub(sub(gyr, mat3.apply(errors.gyr_matrix, gyr)), errors.gyr_bias)


@kernel
def true_force(errors: SensorErrors, acc: Vec3) -> Vec3:
    """a − T a − c"""
    return sub(sub(acc, mat3.apply(errors.acc_matrix, acc)), errors.acc_bias)


@kernel
def true_field(errors: SensorErrors, turn: Vec3, mag: Vec3) -> Vec3:
    """h − d w × h, h = μ − M μ − o"""
    h = sub(sub(mag, mat3.apply(errors.mag_matrix, mag)), errors.mag_offset)
    return sub(h, scale(cross(turn, h), errors.mag_delay))


@kernel
def is_absent(v: Vec3) -> bool:
    """Whether the sensor does not exist: the zero vector. A missing reading is NaN instead."""
    x, y, z = v
    return x * x + y * y + z * z <= NO_LENGTH


@kernel
def zero_if_missing(turn: float) -> float:
    """A component of the rate; 0 if it is NaN or infinite."""
    return turn if turn - turn == 0.0 else 0.0


@kernel
def correct_readings(errors: SensorErrors, gyr: Vec3, acc: Vec3, mag: Vec3) -> Readings:
    """All three readings corrected; the zero vector stays zero, and without a rate the delay is not corrected."""
    turn = true_rate(errors, gyr)
    x, y, z = turn
    if not is_absent(acc):
        acc = true_force(errors, acc)
    if not is_absent(mag):
        mag = true_field(errors, Vec3(zero_if_missing(x), zero_if_missing(y), zero_if_missing(z)), mag)
    return Readings(turn, acc, mag)
