"""A sensor that is put down again and again and turned by hand in between: the motion of a calibration by poses."""

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.rotations import from_rotvec, product
from levelhead.simulate.disturbance import require_number
from levelhead.simulate.motion import Motion
from levelhead.simulate.noise import generator

STREAM = 5  # of random numbers; the IMU and the slower sensors have 0 to 4
REST, TURN = 2.5, 2.0  # s
MIN_TURN, MAX_TURN = 1.2, 2.8  # rad


def poses(
    count: int = 14, seed: int = 0, *, rest: float = REST, turn: float = TURN, rate: float = 100.0
) -> Motion:  # fmt: skip
    """Poses in random attitudes and turns between them, about random axes by 70° to 160°; the place stays the same.

    Args:
        count: poses.
        seed: zero or more; which ones.
        rest: s of each pose.
        turn: s of each turn; its speed rises and falls smoothly (quintic smoothstep).
        rate: samples a second.

    Raises:
        LevelheadError: a number that is not greater than 0.
    """
    if count < 1:
        raise LevelheadError(f"{count} poses; expected at least 1")
    for name, value, unit in (("rest", rest, "s"), ("turn", turn, "s"), ("rate", rate, "Hz")):
        require_number(name, value, unit, positive=True)
    random = generator(seed, STREAM)
    still, moving = max(1, round(rest * rate)), max(1, round(turn * rate))
    u = np.arange(1, moving + 1) / moving
    share, speed = u**3 * (10.0 - 15.0 * u + 6.0 * u * u), 30.0 * u * u * (1.0 - u) ** 2 / turn
    now, quats, rates = np.array([1.0, 0.0, 0.0, 0.0]), [], []
    for pose in range(count):
        quats.append(np.tile(now, (still, 1)))
        rates.append(np.zeros((still, 3)))
        if pose + 1 < count:
            axis = random.standard_normal(3)
            axis *= random.uniform(MIN_TURN, MAX_TURN) / np.linalg.norm(axis)
            quats.append(product(np.tile(now, (moving, 1)), from_rotvec(np.outer(share, axis))))
            rates.append(np.outer(speed, axis))
            now = quats[-1][-1]
    quat, gyr = np.concatenate(quats), np.concatenate(rates)
    zero = np.zeros_like(gyr)
    return Motion(np.arange(len(gyr)) / rate, quat, gyr, zero, zero, zero)


def poses_for(duration: float, seed: int = 0, rate: float = 100.0) -> Motion:
    """As many poses as fit ``duration`` s best, the turns between them included.

    Raises:
        LevelheadError: not one fits, or a number that is not greater than 0.
    """
    require_number("duration", duration, "s", positive=True)
    return poses(round((duration + TURN) / (REST + TURN)), seed, rate=rate)
