"""A hand that turns a sensor: consistent gyroscope and accelerometer for the tests."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelhead.recording import Array, Recording, Truth


def turning(seconds: float = 20.0, rate: float = 100.0, speed: float = 1.0, noise: float = 0.002) -> Recording:
    """A Recording in SI with truth; ``speed`` rad/s."""
    rng = np.random.default_rng(1)
    t = np.arange(round(seconds * rate)) / rate
    gyr = speed * np.stack([np.sin(1.3 * t), np.cos(0.9 * t), 0.5 * np.sin(0.4 * t)], axis=1)
    quats: list[Array] = []
    now = Rotation.identity()
    for w in gyr:
        quats.append(now.as_quat(scalar_first=True))
        now = now * Rotation.from_rotvec(w / rate)
    quat = np.array(quats)
    rotation = Rotation.from_quat(quat, scalar_first=True)
    acc = rotation.inv().apply([0.0, 0.0, 9.80665]) + rng.normal(0.0, 0.05, gyr.shape)
    mag = rotation.inv().apply([0.0, 18.0, -45.0]) + rng.normal(0.0, 0.3, gyr.shape)
    return Recording(t, gyr + rng.normal(0.0, noise, gyr.shape), acc, mag, Truth(quat, moving=t > 1.0))


@pytest.fixture(scope="session")
def hand() -> Recording:
    """20 s at 100 Hz of a hand that turns a sensor at about 1 rad/s."""
    return turning()
