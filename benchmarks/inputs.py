"""The data that the benchmarks run on: a sensor that is turned about smoothly, with noise and bias."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
DT = 0.01  # s
GRAVITY = 9.80665  # m/s²


def turning(t: Array) -> Any:
    """The attitude, sensor to earth, that both ``imu`` and ``field`` go through."""
    from scipy.spatial.transform import Rotation

    yaw, pitch, roll = np.sin(0.11 * t), 0.5 * np.sin(0.37 * t), 0.8 * np.sin(0.53 * t + 1.0)
    return Rotation.from_euler("ZYX", np.stack([yaw, pitch, roll], axis=1))


def field(n: int, seed: int = 2) -> Array:
    """The magnetic field (n, 3) in µT that goes with ``imu``."""
    noise = np.random.default_rng(seed)
    return np.asarray(turning(np.arange(n) * DT).inv().apply([0.0, 19.0, -45.0])) + noise.normal(0.0, 0.5, (n, 3))


def imu(n: int, seed: int = 1) -> tuple[Array, Array, Array]:
    """Time (n,) in s, angular rate (n, 3) in rad/s and specific force (n, 3) in m/s², 100 Hz."""
    noise = np.random.default_rng(seed)
    t = np.arange(n) * DT
    attitude = turning(t)
    gyr = np.zeros((n, 3))
    gyr[1:] = (attitude[:-1].inv() * attitude[1:]).as_rotvec() / DT
    gyr += np.radians([0.3, -0.2, 0.1]) + noise.normal(0.0, 0.005, (n, 3))
    acc = attitude.inv().apply([0.0, 0.0, GRAVITY]) + noise.normal(0.0, 0.1, (n, 3))
    return t, gyr, acc


def axis(n: int, seed: int = 1) -> tuple[Array, Array, Array]:
    """Time (n,) in s, a measured angle in ° and its rate in °/s, 100 Hz; read-only, as levelhead keeps arrays."""
    noise = np.random.default_rng(seed)
    t = np.arange(n) * DT
    level = 30.0 * np.sin(t) + noise.normal(0.0, 1.0, n)
    rate = 30.0 * np.cos(t) + 2.0 + noise.normal(0.0, 0.1, n)
    for array in (t, level, rate):
        array.flags.writeable = False
    return t, level, rate
