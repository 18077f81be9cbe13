"""What the gyroscope says while the accelerometer neither moves nor shakes: bias and noise, which no unit can hide."""

from typing import NamedTuple

import numpy as np

from levelhead.recording import Array, median

WINDOW = 0.5  # s
SHAKING = 0.15  # m/s², standard deviation of an axis from which it is no rest
MOVING = 0.1  # m/s², drift of the specific force over a window from which it is no rest


class StillGyroscope(NamedTuple):
    """What the gyroscope says while the accelerometer holds still, in half seconds.

    Attributes:
        windows: half seconds at rest.
        rate: median rate across the vertical in them; about the vertical the sensor may turn without the
            accelerometer noticing.
        noise: median rms noise of the noisiest axis.
    """

    windows: int
    rate: float
    noise: float


def find_still_gyroscope(t: Array, gyr: Array, acc: Array) -> StillGyroscope:
    """(n, 3) ``gyr`` where (n, 3) ``acc`` in m/s² neither moves nor shakes; ``t`` (n,) s."""
    step = median(np.diff(t)) if len(t) > 1 else 1.0
    size = max(4, round(WINDOW / step)) if step > 0.0 else 4
    count = len(t) // size
    rates, forces = (values[: count * size].reshape(count, size, 3) for values in (gyr, acc))
    with np.errstate(invalid="ignore", over="ignore"):
        mean, quarter = forces.mean(axis=1), size // 4
        drift = np.linalg.norm(forces[:, -quarter:].mean(axis=1) - forces[:, :quarter].mean(axis=1), axis=1)
        length = np.linalg.norm(mean, axis=1)
        still = (forces.std(axis=1).max(axis=1) < SHAKING) & (drift < MOVING) & (np.abs(length - 9.8) < 1.5)
        still &= np.isfinite(rates).all(axis=(1, 2)) & (np.abs(rates).max(axis=(1, 2), initial=0.0) < 1e6)
    if not still.any():
        return StillGyroscope(0, 0.0, 0.0)
    rate, up = rates.mean(axis=1)[still], mean[still] / length[still, None]
    across = rate - (rate * up).sum(axis=1)[:, None] * up
    noise = rates.std(axis=1)[still].max(axis=1)
    return StillGyroscope(int(still.sum()), median(np.linalg.norm(across, axis=1)), median(noise))
