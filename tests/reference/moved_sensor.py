"""A sensor that turns and accelerates as given, with the noise of a chip."""

import numpy as np
from scipy.spatial.transform import Rotation

from levelhead.recording import Array, Recording

RATE, G = 50.0, 9.80665  # Hz, m/s²


def observe_motion(angles: Array, acceleration: Array, seed: int = 0) -> Recording:
    """A sensor at rotation vectors (n, 3), rad, with accelerations (n, 3) of the earth's frame, m/s²: closed forms."""
    rng = np.random.default_rng(seed)
    attitude = Rotation.from_rotvec(angles)
    omega = (attitude[:-1].inv() * attitude[1:]).as_rotvec() * RATE
    acc = attitude[1:].inv().apply(acceleration[1:] + [0.0, 0.0, G])
    noise = rng.normal(0.0, 1.0, (2, *omega.shape))
    return Recording(np.arange(len(omega)) / RATE, omega + 2e-3 * noise[0], acc + 0.02 * noise[1])
