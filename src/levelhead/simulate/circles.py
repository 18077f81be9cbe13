"""A walk in circles: the motion that looks to an orientation filter like a bias of the gyroscope.

A velocity that is fixed to the body and turns with it is an acceleration that is constant in the body, and so is the
tilt that it pretends: a bias of V Ω²/g (docs/explanation/self-calibration.md, eq. 21). Halfway the sensor turns over,
and a supposed bias of a horizontal axis becomes one of heading.
"""

import numpy as np

from levelhead.simulate.disturbance import require_number
from levelhead.simulate.motion import Motion

TURN_TIME = 2.0  # s in which the sensor is turned over
TURN = 0.5 * np.pi  # rad


def circles(duration: float = 180.0, rate: float = 100.0, *, speed: float = 1.0, period: float = 10.0) -> Motion:
    """A body that walks in circles and turns along; at half of the time it is turned over by 90° about its x axis.

    Args:
        duration: s.
        rate: samples a second.
        speed: m/s, of the walk.
        period: s, of a circle.

    Raises:
        LevelheadError: one of them is not greater than 0.
    """
    require_number("duration", duration, "s", positive=True)
    require_number("rate", rate, "Hz", positive=True)
    require_number("speed", speed, "m/s", positive=True)
    require_number("period", period, "s", positive=True)
    t = np.arange(int(duration * rate)) / rate
    omega = 2.0 * np.pi / period
    yaw = omega * t
    u = np.clip((t - 0.5 * duration) / TURN_TIME, 0.0, 1.0)
    over = TURN * u * u * (3.0 - 2.0 * u)
    over_rate = TURN * 6.0 * u * (1.0 - u) / TURN_TIME
    c, s = np.cos(0.5 * yaw), np.sin(0.5 * yaw)
    a, b = np.cos(0.5 * over), np.sin(0.5 * over)
    quat = np.stack([c * a, c * b, s * b, s * a], axis=1)
    gyr = np.stack([over_rate, omega * np.sin(over), omega * np.cos(over)], axis=1)
    zero = np.zeros_like(t)
    forward = np.stack([np.cos(yaw), np.sin(yaw), zero], axis=1)
    left = np.stack([-np.sin(yaw), np.cos(yaw), zero], axis=1)
    return Motion(t, quat, gyr, -speed / omega * left, speed * forward, speed * omega * left)
