"""Raw counts of an MPU-6050 as it is after power-up, ±2 g and ±250 °/s, recognised by their size.

Most lessons print the registers as they are. At rest the accelerometer then gives 16384 counts (1 g); no unit gives a
number of that size. Other full scales are not guessed: 8192 counts of the accelerometer do not show the gyroscope's.
"""

import numpy as np

from levelhead.recording import Array
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import Scale
from levelhead.units import GRAVITY, factor

PER_G, PER_DEGREE = 16384.0, 131.0  # counts: PS-MPU-6000A-00 rev 3.4, 6.1 and 6.2
TOLERANCE = 0.15  # of g: zero-g offset (80 mg), scale (3 %), and motion
MAX_COUNT = 32768.0
THOUSANDTHS = 1000.0 * GRAVITY  # per g: numbers in m/s² sent as whole ones
_MAX_LENGTH_ERROR = 0.05  # by which their usual length may differ
DEFAULT_SCALES = Conclusion(
    "sensors.unit", "mpu6050", "raw counts", Basis.GUESS,
    confirm={"counts": {"gyr": f"{PER_DEGREE:g}/deg/s", "acc": f"{PER_G:g}/g"}},
)  # fmt: skip


def mpu6050_scales(gyr: Array, acc: Array) -> dict[str, Scale] | None:
    """The scales of (n, 3) gyroscope and accelerometer columns, if they are such counts; None: they are not."""
    both = np.concatenate([gyr.ravel(), acc.ravel()])
    both = both[np.isfinite(both)]
    if len(both) == 0 or np.any(both != np.rint(both)) or np.abs(both).max() > MAX_COUNT:
        return None
    if abs(float(np.nanmedian(np.linalg.norm(acc, axis=1))) / PER_G - 1.0) > TOLERANCE:
        return None
    return {
        "gyr": Scale(factor("gyr", "deg/s"), "raw counts, 131 per deg/s", PER_DEGREE),
        "acc": Scale(factor("acc", "g"), "raw counts, 16384 per g", PER_G),
    }


def are_thousandths(acc: Array) -> bool:
    """Whether (n, 3) numbers are m/s² times 1000, sent as whole numbers."""
    finite = acc[np.isfinite(acc).all(axis=1)]
    if len(finite) == 0 or np.any(finite != np.rint(finite)):
        return False
    return abs(float(np.median(np.linalg.norm(finite, axis=1))) / THOUSANDTHS - 1.0) < _MAX_LENGTH_ERROR
