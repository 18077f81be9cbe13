"""Raw counts of the chips that people use: how many make 1 g, or 1 deg/s.

From the data sheets: MPU-6050 (PS-MPU-6000A-00, 6.1 and 6.2), BMI160, LSM6DS3, L3GD20, ITG-3200, ADXL345, BNO055.
"""

import math
from typing import NamedTuple

from levelhead.units import DEGREE, GRAVITY

ACC = (32768.0, 16384.0, 8192.0, 4096.0, 2048.0, 1024.0, 512.0, 256.0, 128.0, 64.0)  # per g
GYR = {
    131.0: "±250 deg/s (MPU-6050, BMI160)",
    65.5: "±500 deg/s (MPU-6050, BMI160)",
    32.8: "±1000 deg/s (MPU-6050, BMI160)",
    16.4: "±2000 deg/s (MPU-6050, BMI160)",
    14.375: "±2000 deg/s (ITG-3200)",
    262.4: "±125 deg/s (BMI160)",
    114.286: "8.75 mdps a count (L3GD20, LSM6DS3)",
    57.143: "17.5 mdps a count (L3GD20, LSM6DS3)",
    28.571: "35 mdps a count (LSM6DS3)",
    14.286: "70 mdps a count (L3GD20, LSM6DS3)",
    16.0: "16 counts per deg/s (BNO055)",
    1000.0: "mdps",
    1000.0 * DEGREE: "thousandths of 1 rad/s",
}  # per deg/s
_COMMON = {131.0, 65.5, 32.8, 16.4, 14.375}  # of several that fit, these come first
_ACC_OFF, _GYR_OFF = 0.15, 1.4  # an accelerometer's scale error, at most; a factor for what gravity's turn can tell


class Sensitivity(NamedTuple):
    """Counts per unit, how far off the evidence is (1: not at all), and whose they are."""

    per_unit: float
    off: float
    whose: str


def acc_sensitivity(norm: float) -> Sensitivity | None:
    """The counts per g that make a median length of ``norm`` counts gravity; None if there are none."""
    for per_g in ACC:
        if abs(norm / per_g - 1.0) < _ACC_OFF:
            return Sensitivity(per_g, norm / per_g, f"{per_g:g} counts per g")
    return None


def gyr_sensitivity(scale: float, acc_per_g: float | None = None) -> Sensitivity | None:
    """The counts per deg/s for which gravity turns by ``scale`` rad/s for each count; None if none is near.

    ``acc_per_g`` are the counts of the accelerometer: 256 per g are an ADXL345, whose board has an ITG-3200.
    """
    counts = DEGREE / abs(scale) if scale else math.inf
    best: tuple[float, float] | None = None
    for per_unit in GYR:
        off = abs(math.log(counts / per_unit)) if counts > 0 and math.isfinite(counts) else math.inf
        favour = 0.1 if per_unit in _COMMON else 0.0
        favour += 0.2 if per_unit == 14.375 and acc_per_g == 256.0 else 0.0
        if per_unit == 1000.0 * DEGREE:  # only beside thousandths of 1 m/s²
            if acc_per_g != 1000.0 * GRAVITY:
                continue
            favour = 0.2
        if off < math.log(_GYR_OFF) and (best is None or off - favour < best[0]):
            best = off - favour, per_unit
    return None if best is None else Sensitivity(best[1], counts / best[1], GYR[best[1]])
