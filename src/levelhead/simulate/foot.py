"""A sensor on the foot of somebody who walks in a loop, in closed form: stance, a roll over the toe, swing.

A point of the sole stands on the ground in stance, the foot rolls about it at both ends of stance, and in swing it
moves to the next place. Every course is a polynomial that is C³ at its ends, and derivatives are exact.
"""

import math
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array
from levelhead.rotations import rotate
from levelhead.simulate.disturbance import require_number
from levelhead.simulate.motion import Motion

PERIOD = 1.1  # s, of a stride
SWING = (0.40, 0.96)  # of a stride: when the standing point moves
PUSH_OFF = (0.52, 0.28, math.radians(-55.0))  # middle and half-width in strides, and pitch: the heel rises
HEEL_STRIKE = (0.88, 0.12, math.radians(20.0))  # the toe is up
LIFT = 0.05  # m, of the standing point in swing
SENSOR = (0.04, 0.02, 0.09)  # m from the standing point to the sensor, forward, left, up
BEFORE, AFTER = 4.0, 3.0  # s of standing


class Trajectory(NamedTuple):
    """A quantity with its first and second time derivatives."""

    value: Array
    rate: Array
    acceleration: Array


def foot(
    strides: int = 20, rate: float = 200.0, *, length: float = 1.3, climb: float = 0.0, period: float = PERIOD
) -> Motion:
    """A walk along a circle that ends where it began, the sensor's x axis forward, z up.

    Args:
        strides: how many, at least 3.
        rate: samples a second.
        length: m, of a stride, along the chord.
        climb: m by which each stride rises; then it ends above its beginning.
        period: s, of a stride.

    Raises:
        LevelheadError: a number out of range.
    """
    if not isinstance(strides, int) or strides < 3:
        raise LevelheadError(f"strides is {strides!r}; expected a whole number, at least 3")
    for name, value, unit in (("rate", rate, "Hz"), ("length", length, "m"), ("period", period, "s")):
        require_number(name, value, unit, positive=True)
    t = np.arange(round((BEFORE + strides * period + AFTER) * rate)) / rate
    phase = np.clip((t - BEFORE) / period, 0.0, strides)
    stride = np.minimum(phase.astype(int), strides - 1)
    within = phase - stride
    pitch = _add(_bump(within, PUSH_OFF, period), _bump(within, HEEL_STRIKE, period))
    begin, end = SWING
    share = _smoothstep((within - begin) / (end - begin), (end - begin) * period)
    turn = 2.0 * math.pi / strides
    yaw = Trajectory(turn * (stride + share.value), turn * share.rate, turn * share.acceleration)
    radius = 0.5 * length / math.sin(0.5 * turn)
    angle = turn * np.arange(strides + 1)
    places = np.stack([radius * np.sin(angle), radius * (1.0 - np.cos(angle)), climb * np.arange(strides + 1)], axis=1)
    step = np.diff(places, axis=0)[stride]
    lift = _bump(within, (0.5 * (begin + end), 0.5 * (end - begin), LIFT), period)
    up = np.array([0.0, 0.0, 1.0])
    ground = Trajectory(
        places[stride] + share.value[:, None] * step + lift.value[:, None] * up,
        share.rate[:, None] * step + lift.rate[:, None] * up,
        share.acceleration[:, None] * step + lift.acceleration[:, None] * up,
    )
    return _carry(t, ground, yaw, pitch)


def _add(one: Trajectory, other: Trajectory) -> Trajectory:
    return Trajectory(one.value + other.value, one.rate + other.rate, one.acceleration + other.acceleration)


def _bump(within: Array, shape: tuple[float, float, float], period: float) -> Trajectory:
    """h (1 − x²)⁴ of the phase within a stride, which vanishes with three derivatives at x = ±1."""
    middle, half, height = shape
    x = np.clip((within - middle) / half, -1.0, 1.0)
    left, pace = 1.0 - x * x, 1.0 / (half * period)
    return Trajectory(
        height * left**4,
        -8.0 * height * pace * x * left**3,
        height * pace**2 * (48.0 * x * x * left**2 - 8.0 * left**3),
    )


def _smoothstep(x: Array, time: float) -> Trajectory:
    """35 x⁴ − 84 x⁵ + 70 x⁶ − 20 x⁷ from 0 to 1 within ``time`` s (D. Ebert et al., Texturing and Modeling, 2003)."""
    x = np.clip(x, 0.0, 1.0)
    return Trajectory(
        x**4 * (35.0 - 84.0 * x + 70.0 * x**2 - 20.0 * x**3),
        140.0 * (x * (1.0 - x)) ** 3 / time,
        420.0 * (x * (1.0 - x)) ** 2 * (1.0 - 2.0 * x) / time**2,
    )


def _carry(t: Array, ground: Trajectory, yaw: Trajectory, pitch: Trajectory) -> Motion:
    """The motion of the sensor on a foot whose standing point, yaw and pitch (nose down is positive) are given."""
    half_yaw, half_pitch = 0.5 * yaw.value, -0.5 * pitch.value
    cy, sy, cp, sp = np.cos(half_yaw), np.sin(half_yaw), np.cos(half_pitch), np.sin(half_pitch)
    quat = np.stack([cy * cp, -sy * sp, cy * sp, sy * cp], axis=1)
    sine, cosine = np.sin(-pitch.value), np.cos(-pitch.value)
    omega, alpha = -pitch.rate, -pitch.acceleration
    gyr = np.stack([-yaw.rate * sine, omega, yaw.rate * cosine], axis=1)
    gyr_rate = np.stack(
        [
            -yaw.acceleration * sine - yaw.rate * omega * cosine,
            alpha,
            yaw.acceleration * cosine - yaw.rate * omega * sine,
        ],
        axis=1,
    )
    arm = np.broadcast_to(SENSOR, gyr.shape)
    swing = np.cross(gyr, arm)
    return Motion(
        t,
        quat,
        gyr,
        ground.value + rotate(quat, arm) - np.asarray(SENSOR),
        ground.rate + rotate(quat, swing),
        ground.acceleration + rotate(quat, np.cross(gyr_rate, arm) + np.cross(gyr, swing)),
    )
