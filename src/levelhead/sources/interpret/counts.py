"""Whole numbers of chips and drivers: how many make 1 g, 1 deg/s, 1 µT, and which of them fit the evidence.

Gravity's turn, the noise at rest, the largest rate and the accelerometer beside it each weigh for or against a
sensitivity; the sum chooses one. Sensitivities from the data sheets: MPU-6050 (PS-MPU-6000A-00, 6.1 and 6.2), AK8963
(MS1356-E-02), ICM-20948 (DS-000189), BMI160 (BST-BMI160-DS000), BMX055 (BST-BMX055-DS000), BNO055 (BST-BNO055-DS000,
tables 3-17, 3-19, 3-22), LSM6DS3 (DocID026899), LSM9DS1 (DocID025715), L3GD20, LSM303DLHC, LIS3MDL, ITG-3200, ADXL345,
HMC5883L, FXOS8700 and FXAS21002, ADIS16448, QMI8658; and the scaled integers of MAVLink (mrad/s, mg, mG) and ST (mdps,
mg, mG).
"""

import math
from typing import NamedTuple

from levelhead.units import DEGREE, GRAVITY

ACC = (32768.0, 16384.0, 8192.0, 4096.0, 2048.0, 1024.0, 512.0, 256.0, 128.0, 64.0)  # per g
_ACC_OFF = 0.15  # an accelerometer's scale error and zero-g offset, at most
_USUAL_DEVIATION, _MAX_LENGTH_COST = 0.04, 1.5  # the same, usually; what an accelerometer of another size costs at most
_TURN_ERROR = 0.08  # of the scale that gravity's turn gives, where it correlates perfectly
_UNSURE = 0.5  # what an imperfect correlation adds
_USUAL_NOISE, _NOISE_SPREAD = 0.08, 0.9  # deg/s rms at rest, a factor of 2.5 either way
_ROUNDING = 0.29  # rms of a digit
_MAX_RATE = 2300.0  # deg/s; full scale of the usual chips is ±2000
_IMPROBABLE = 4.0  # what a rate beyond it costs
_MAX_TURN_ERROR = 0.35  # of the logarithm, beyond which gravity's turn excludes a sensitivity
_FIELD = (22.0, 70.0)  # µT, on earth, and a little iron
_NO_FIELD, _OTHER_FIELD = 0.5, 1.5  # costs of a chip without a magnetometer beside it, and of one that shows no field
_MIN_COST_GAP = 2.0  # cost by which the second must be dearer
_MAX_SAME_FACTOR = 1.25  # factor within which a second one makes no difference worth a question


class Sensitivity(NamedTuple):
    """Counts per unit, how far off the evidence is (1: not at all), and whose they are."""

    per_unit: float
    off: float
    whose: str


class Chip(NamedTuple):
    """Counts per unit at each full scale.

    Attributes:
        name: what people call it.
        acc: per g.
        gyr: per deg/s.
        mag: per µT, of the magnetometer beside it on boards.
        rarity: what its choice costs beside the commonest.
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
_SCALED_MG = (  # beside whole mg
    Chip("deg/s", (1000.0,), (1.0,), (10.0, 1.0), 0.0),
    Chip("mdps", (1000.0,), (1000.0,), (10.0,), 0.3),
    Chip("thousandths of 1 rad/s", (1000.0,), (1000.0 * DEGREE,), (10.0,), 0.3),
    Chip("tenths of 1 deg/s", (1000.0,), (10.0,), (), 1.0),
    Chip("hundredths of 1 deg/s", (1000.0,), (100.0,), (), 1.5),
)
_SCALED_M_S2 = (  # beside thousandths of 1 m/s²
    Chip("thousandths of 1 rad/s", (1000.0 * GRAVITY,), (1000.0 * DEGREE,), (10.0,), 0.0),
    Chip("mdps", (1000.0 * GRAVITY,), (1000.0,), (10.0,), 0.5),
    Chip("deg/s", (1000.0 * GRAVITY,), (1.0,), (), 1.0),
)
_SCALED = (Chip("deg/s", (), (1.0,), (), 0.0), Chip("mdps", (), (1000.0,), (), 1.0))
GYR = {per: chip.name for chip in reversed((*CHIPS[:6], *_SCALED_MG[1:3])) for per in chip.gyr}  # per deg/s


class WholeRates(NamedTuple):
    """The evidence in a gyroscope's whole numbers for their unit.

    Attributes:
        turn: rad/s that one number is by gravity's turn; None: nothing turns.
        correlation: of that turn.
        noise: of the numbers at rest, rms.
        large: the largest rate, in numbers.
    """

    turn: float | None
    correlation: float
    noise: float
    large: float


class Choice(NamedTuple):
    """The likeliest sensitivity of a gyroscope.

    Attributes:
        per_degree: numbers per deg/s.
        chip: whose.
        sure: whether no other one that differs is nearly as likely.
    """

    per_degree: float
    chip: Chip
    sure: bool


def acc_sensitivity(norm: float) -> Sensitivity | None:
    """The counts per g that make a median length of ``norm`` counts gravity; None if there are none."""
    for per_g in ACC:
        if abs(norm / per_g - 1.0) < _ACC_OFF:
            return Sensitivity(per_g, norm / per_g, f"{per_g:g} counts per g")
    return None


def choose_sensitivity(
    rates: WholeRates, acc_per_g: float | None, acc_norm: float | None = None, mag_norm: float | None = None
) -> Choice | None:
    """The sensitivity of a gyroscope of whole numbers; None if none fits.

    Args:
        rates: the evidence of its numbers.
        acc_per_g: counts of the accelerometer per g: 1000 for mg; None where it has a unit with decimals.
        acc_norm: the usual length of the accelerometer's numbers, if they are whole.
        mag_norm: that of the magnetometer's, if they are whole.
    """
    costs = sorted(
        (
            (cost + _field_cost(chip, mag_norm), per, chip)
            for chip in (*_scaled(acc_per_g), *CHIPS)
            for per in chip.gyr
            if (cost := _cost(rates, chip, per, acc_per_g, acc_norm)) is not None
        ),
        key=lambda one: one[0],
    )
    if not costs:
        return None
    cost, per, chip = costs[0]
    rivals = [other for other, rival, _ in costs if abs(math.log(rival / per)) > math.log(_MAX_SAME_FACTOR)]
    return Choice(per, chip, not rivals or rivals[0] - cost > _MIN_COST_GAP)


def _scaled(acc_per_g: float | None) -> tuple[Chip, ...]:
    if acc_per_g is None:
        return _SCALED
    if acc_per_g == 1000.0:
        return _SCALED_MG
    return _SCALED_M_S2 if acc_per_g == 1000.0 * GRAVITY else ()


def _cost(rates: WholeRates, chip: Chip, per: float, acc_per_g: float | None, acc_norm: float | None) -> float | None:
    """Half the sum of squares by which a sensitivity misses the evidence, and its rarity; None: excluded."""
    cost = chip.rarity + (0.3 if chip.usual not in (None, per) else 0.0)
    one = DEGREE / per  # rad/s
    if rates.turn is not None and rates.turn > 0.0:
        off = abs(math.log(one / rates.turn))
        if off > _MAX_TURN_ERROR and rates.correlation > 0.7:
            return None
        cost += 0.5 * (off / (_TURN_ERROR + _UNSURE * (1.0 - rates.correlation))) ** 2
    if rates.noise > 0.0:  # constant numbers show none
        noise = max(rates.noise, _ROUNDING) / per
        cost += 0.5 * (math.log(noise / _USUAL_NOISE) / _NOISE_SPREAD) ** 2
    cost += _IMPROBABLE if rates.large / per > _MAX_RATE else 0.0
    norm = acc_norm if acc_norm is not None and acc_norm > 0.0 else acc_per_g
    if norm is not None:
        near = min((abs(math.log(norm / count)) for count in chip.acc), default=1.0)
        cost += min(0.5 * (near / _USUAL_DEVIATION) ** 2, _MAX_LENGTH_COST)
    return cost


def _field_cost(chip: Chip, mag_norm: float | None) -> float:
    if mag_norm is None:
        return 0.0
    return 0.0 if field_sensitivity(chip, mag_norm) is not None else _OTHER_FIELD if chip.mag else _NO_FIELD


def field_sensitivity(chip: Chip, mag_norm: float) -> float | None:
    """The counts per µT with which whole numbers of usual length ``mag_norm`` are the earth's field; None if none."""
    return next((per for per in chip.mag if _FIELD[0] < mag_norm / per < _FIELD[1]), None)


def gyr_sensitivity(scale: float, acc_per_g: float | None = None) -> Sensitivity | None:
    """The counts per deg/s for which gravity turns by ``scale`` rad/s for each count; None if none is near.

    ``acc_per_g`` are the counts of the accelerometer: 256 per g are an ADXL345, whose board has an ITG-3200.
    """
    counts = DEGREE / abs(scale) if scale else math.inf
    if not (counts > 0 and math.isfinite(counts)):
        return None
    found = choose_sensitivity(WholeRates(abs(scale), 0.95, _USUAL_NOISE * counts, 0.0), acc_per_g)
    return None if found is None else Sensitivity(found.per_degree, counts / found.per_degree, found.chip.name)
