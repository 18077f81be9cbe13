"""Whole numbers of chips and drivers: how many make 1 g, 1 deg/s, 1 µT, and the units of whole numbers.

Sensitivities from the data sheets: MPU-6050 (PS-MPU-6000A-00, 6.1 and 6.2), AK8963
(MS1356-E-02), ICM-20948 (DS-000189), BMI160 (BST-BMI160-DS000), BMX055 (BST-BMX055-DS000), BNO055 (BST-BNO055-DS000,
tables 3-17, 3-19, 3-22), LSM6DS3 (DocID026899), LSM9DS1 (DocID025715), L3GD20, LSM303DLHC, LIS3MDL, ITG-3200, ADXL345,
HMC5883L, FXOS8700 and FXAS21002, ADIS16448, QMI8658; and the scaled integers of MAVLink (mrad/s, mg, mG) and ST (mdps,
mg, mG).
"""

from typing import NamedTuple

from levelhead.units import DEGREE, GRAVITY

ACC = (32768.0, 16384.0, 8192.0, 4096.0, 2048.0, 1024.0, 512.0, 256.0, 128.0, 64.0)  # per g
_ACC_OFF = 0.15  # an accelerometer's scale error and zero-g offset, at most
_FIELD = (22.0, 70.0)  # µT, on earth, and a little iron


class Chip(NamedTuple):
    """Counts per unit at each full scale.

    Attributes:
        name: its usual name.
        acc: per g.
        gyr: per deg/s.
        mag: per µT, of the magnetometer beside it on boards.
        rarity: the cost of its choice beside the commonest.
        usual: the one of ``gyr`` after power-up, or none.
    """

    name: str
    acc: tuple[float, ...]
    gyr: tuple[float, ...]
    mag: tuple[float, ...] = ()
    rarity: float = 0.5
    usual: float | None = None


_POWERS = (16384.0, 8192.0, 4096.0, 2048.0)
_ST = (1 / 61e-6, 1 / 122e-6, 1 / 244e-6, 1 / 488e-6)
CHIPS = (
    Chip("MPU-6050, BMI160", _POWERS, (131.0, 65.5, 32.8, 16.4), (1 / 0.15, 1 / 0.6, 1 / 0.3), 0.0, 131.0),
    Chip("BMI160", _POWERS, (262.4,), (16.0,), 1.0),
    Chip("BNO055", (100.0 * GRAVITY,), (16.0,), (16.0,), 0.3),
    Chip("ITG-3200", (256.0,), (14.375,), (10.9,), 0.2),
    Chip("L3GD20, LSM6DS3", _ST, (114.286, 57.143, 14.286), (68.42, 11.0), 0.4),
    Chip("LSM6DS3", _ST, (28.571, 228.571), (68.42,), 0.6),
    Chip("BMX055", (1024.0, 512.0, 256.0, 128.0), (16.4, 32.8, 65.6, 131.2, 262.4), (16.0,), 1.0),
    Chip("FXAS21002", (4096.0, 2048.0, 1024.0), (16.0, 32.0, 64.0, 128.0), (10.0,), 1.5),
    Chip("QMI8658", _POWERS, (16.0, 32.0, 64.0, 128.0), (), 1.5),
    Chip("ADIS16448", (1200.0,), (25.0, 50.0, 100.0), (7.0,), 1.5),
)  # fmt: skip
RADIANS, DEGREES = Chip("rad/s", (), (DEGREE,)), Chip("deg/s", (), (1.0,))  # numbers per deg/s, of any sensor
_SCALED_ALONE = (Chip("deg/s", (), (1.0,), (), 0.0), Chip("mdps", (), (1000.0,), (), 1.0))  # beside decimals
_SCALED = {  # beside whole numbers of an accelerometer in mg, and in thousandths of 1 m/s²: by their number per g
    1000.0: (
        Chip("deg/s", (1000.0,), (1.0,), (10.0, 1.0), 0.0),
        Chip("mdps", (1000.0,), (1000.0,), (10.0,), 0.3),
        Chip("thousandths of 1 rad/s", (1000.0,), (1000.0 * DEGREE,), (10.0,), 0.3),
        Chip("tenths of 1 deg/s", (1000.0,), (10.0,), (), 1.0),
        Chip("hundredths of 1 deg/s", (1000.0,), (100.0,), (), 1.5),
    ),
    1000.0 * GRAVITY: (
        Chip("thousandths of 1 rad/s", (1000.0 * GRAVITY,), (1000.0 * DEGREE,), (10.0,), 0.0),
        Chip("mdps", (1000.0 * GRAVITY,), (1000.0,), (10.0,), 0.5),
        Chip("deg/s", (1000.0 * GRAVITY,), (1.0,), (), 1.0),
    ),
}
STEPS = (  # deg/s, of chips' numbers: their sensitivities, and full scales over 2^15
    *sorted({1.0 / per for chip in CHIPS for per in chip.gyr}),
    *(full / 32768.0 for full in (125.0, 250.0, 500.0, 1000.0, 2000.0)),
)
GYR = {per: chip.name for chip in reversed((*CHIPS[:6], *_SCALED[1000.0][1:3])) for per in chip.gyr}  # per deg/s


def acc_sensitivity(norm: float) -> float | None:
    """The counts per g that make a median length of ``norm`` counts gravity; None if there are none."""
    return next((per_g for per_g in ACC if abs(norm / per_g - 1.0) < _ACC_OFF), None)


def candidates(acc_per_g: float | None) -> tuple[Chip, ...]:
    """The units and chips of a gyroscope beside an accelerometer of that many numbers per g; None: with decimals."""
    scaled = () if acc_per_g is None else _SCALED.get(acc_per_g, ())
    return (RADIANS, DEGREES, *(_SCALED_ALONE if acc_per_g is None else scaled), *CHIPS)


def field_sensitivity(chip: Chip, mag_norm: float) -> float | None:
    """The counts per µT with which whole numbers of usual length ``mag_norm`` are the earth's field; None if none."""
    return next((per for per in chip.mag if _FIELD[0] < mag_norm / per < _FIELD[1]), None)
