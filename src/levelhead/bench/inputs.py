"""The data that speed is measured on: a sensor that is turned about smoothly, with noise and bias."""

import numpy as np

from levelhead.errors import require
from levelhead.recording import Array, Recording
from levelhead.units import GRAVITY

DT = 0.01  # s
FIELD = (0.0, 19.0, -45.0)  # µT: east, north, up


def imu_arrays(n: int, seed: int = 1) -> tuple[Array, Array, Array]:
    """Time (n,) in s, angular rate (n, 3) in rad/s and specific force (n, 3) in m/s², 100 Hz."""
    t, gyr, acc, _ = _sensors(n, seed)
    return t, gyr, acc


def imu_recording(n: int, seed: int = 1, mag: bool = False) -> Recording:
    """The same as a Recording, with a magnetometer if wanted."""
    t, gyr, acc, field = _sensors(n, seed)
    return Recording(t, gyr, acc, field if mag else None)


def _sensors(n: int, seed: int) -> tuple[Array, Array, Array, Array]:
    require("scipy", "the benchmark", "bench")
    from scipy.spatial.transform import Rotation

    noise = np.random.default_rng(seed)
    t = np.arange(n, dtype=np.float64) * DT
    yaw, pitch, roll = np.sin(0.11 * t), 0.5 * np.sin(0.37 * t), 0.8 * np.sin(0.53 * t + 1.0)
    attitude = Rotation.from_euler("ZYX", np.stack([yaw, pitch, roll], axis=1))
    gyr = np.zeros((n, 3))
    gyr[1:] = (attitude[:-1].inv() * attitude[1:]).as_rotvec() / DT
    gyr += np.radians([0.3, -0.2, 0.1]) + noise.normal(0.0, 0.005, (n, 3))
    acc: Array = attitude.inv().apply([0.0, 0.0, GRAVITY]) + noise.normal(0.0, 0.1, (n, 3))
    mag: Array = attitude.inv().apply(FIELD) + noise.normal(0.0, 0.5, (n, 3))
    return t, gyr, acc, mag
