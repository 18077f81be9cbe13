"""Chips that people own, with the figures of their data sheets.

How a data sheet is read, the same for all:

- Its noise densities are one-sided (ST's note: noise RMS is related to a bandwidth of half the data rate), so
  N, with which samples have σ = N·√rate, is the figure divided by √2.
- A ± tolerance is read as 3σ.
- An output saturates at the end of its word, 32767 bits (HMC5883L: 2047), which can be beyond the nominal range.
- Cross-axis sensitivity (a fraction) is read as an angle (rad), again as 3σ.

A value that no data sheet gives is marked TYPICAL below. Read in the documents themselves:
MPU-6050, LSM6DSO32, ICM-20948 (accelerometer and magnetometer) and the HMC5883L's gains; the rest is as others quote
them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

from levelhead.errors import LevelheadError, nearest
from levelhead.simulate.imu import Imu, Iron
from levelhead.simulate.triad_errors import PerAxis, TriadErrors
from levelhead.units import GRAVITY, factor

TOLERANCE_SIGMAS = 3.0
ONE_SIDED = math.sqrt(2.0)

# TYPICAL, from literature and no data sheet: Allan deviations of consumer MEMS sensors. Random walks: the fit
# of a RealSense camera's IMU (OpenVINS configuration for rpng/ar_table_dataset, 1.11e-6 rad/s/√s and 4.13e-5 m/s²/√s).
# Bias instability: 6 °/h is a usual figure for such gyroscopes (an MPU-6050 was measured at 0.0012 °/s = 4.3 °/h,
# robotics.stackexchange.com/q/8860); for such accelerometers 50 µg. Correlation times of minutes are usual; 100 s is a
# choice.
GYR_INSTABILITY = 6.0 / 3600.0  # °/s
GYR_WALK = math.degrees(1.11e-6)  # °/s/√s
ACC_INSTABILITY = 50e-6  # g
ACC_WALK = 4.13e-5 / GRAVITY  # g/√s
CORRELATION_TIME = 100.0  # s
CROSS_AXIS = 0.01  # fraction, where the data sheet has none


class SheetScale(NamedTuple):
    """One setting of the full scale: the size of a bit and the one-sided noise density, in the sheet's unit."""

    bit: float
    noise_density: float


@dataclass(frozen=True)
class DataSheet:
    """A data sheet's page about one triad, in the data sheet's own unit.

    Attributes:
        quantity: "gyr", "acc" or "mag": whose units ``unit`` is one of.
        unit: "deg/s", "g", "G" or "µT".
        scales: nominal full scale → SheetScale.
        default: the full scale that ``imu`` uses by default.
        zero: ± tolerance of the zero level, one for all axes or one for each.
        sensitivity: ± tolerance of the sensitivity, a fraction.
        cross_axis: cross-axis sensitivity, a fraction.
        last_code: the largest number that the output can be.
        instability: bias instability.
        walk: random walk, unit/√s.
    """

    quantity: str
    unit: str
    scales: Mapping[float, SheetScale]
    default: float
    zero: PerAxis
    sensitivity: float
    cross_axis: float = CROSS_AXIS
    last_code: int = 32767
    instability: float = 0.0
    walk: float = 0.0

    def errors(self, full_scale: float | None) -> TriadErrors:
        """The error model at a nominal full scale in the sheet's unit (None: the default one).

        Raises:
            LevelheadError: the chip has no such full scale.
        """
        wanted = self.default if full_scale is None else full_scale
        if wanted not in self.scales:
            legal = ", ".join(f"{one:g}" for one in self.scales)
            raise LevelheadError(f"{self.quantity} range {wanted:g} {self.unit} does not exist; the chip has {legal}")
        scale, si = self.scales[wanted], factor(self.quantity, self.unit)
        zero = self.zero if isinstance(self.zero, tuple) else (self.zero,) * 3
        return TriadErrors(
            white_noise_density=scale.noise_density / ONE_SIDED * si,
            turn_on_bias=(_sigma(zero[0]) * si, _sigma(zero[1]) * si, _sigma(zero[2]) * si),
            bias_instability=self.instability * si,
            correlation_time=CORRELATION_TIME,
            random_walk=self.walk * si,
            scale_factor=_sigma(self.sensitivity),
            misalignment=_sigma(self.cross_axis),
            quantisation=scale.bit * si,
            full_scale=self.last_code * scale.bit * si,
        )


def _sigma(tolerance: float) -> float:
    return tolerance / TOLERANCE_SIGMAS


def _gyroscope(
    scales: Mapping[float, SheetScale], zero: float, sensitivity: float, cross_axis: float = CROSS_AXIS
) -> DataSheet:
    """A sheet in °/s, with the typical values."""
    return DataSheet(
        "gyr", "deg/s", scales, 500, zero, sensitivity, cross_axis, instability=GYR_INSTABILITY, walk=GYR_WALK
    )


def _accelerometer(
    scales: Mapping[float, SheetScale], zero: PerAxis, sensitivity: float, cross_axis: float = CROSS_AXIS
) -> DataSheet:
    """A sheet in g, with the typical values."""
    return DataSheet("acc", "g", scales, 4, zero, sensitivity, cross_axis, instability=ACC_INSTABILITY, walk=ACC_WALK)


def _counts(noise_density: float, per_unit: Mapping[float, float]) -> dict[float, SheetScale]:
    """Scales of a sheet that gives bits per unit and one noise density for all of them."""
    return {full_scale: SheetScale(1.0 / bits, noise_density) for full_scale, bits in per_unit.items()}


# ST gives the size of a bit: mdps and mg; its ranges end at 32768 bits or before.
_ST_DPS: dict[float, float] = {125: 4.375e-3, 250: 8.75e-3, 500: 17.5e-3, 1000: 35e-3, 2000: 70e-3}
_G_COUNTS: dict[float, float] = {2: 16384.0, 4: 8192.0, 8: 4096.0, 16: 2048.0}


class Chip(NamedTuple):
    """A chip: its name, where its figures come from, and its triads (mag None: it has no magnetometer)."""

    name: str
    source: str
    gyr: DataSheet
    acc: DataSheet
    mag: DataSheet | None = None


# AK09916 inside the ICM-20948: DS-000189 rev 1.3, 3.3 table 3: 0.15 µT/LSB, zero-field ±2000 LSB (calibrate it!), table
# 22: ±32752 codes. Noise and sensitivity tolerance are TYPICAL: 0.3 µT rms at 100 Hz, ±5 %.
_AK09916 = DataSheet(
    "mag", "µT", {4900: SheetScale(0.15, 0.3 / math.sqrt(50.0))}, 4900, 2000 * 0.15, 0.05, last_code=32752
)  # fmt: skip

CHIPS = (
    # 6.1 gyroscope: 131 … 16.4 LSB/(°/s), tolerance ±3 %, cross-axis ±2 %, initial ZRO ±20 °/s, 0.005 °/s/√Hz at 10 Hz.
    # 6.2 accelerometer: 16384 … 2048 LSB/g, tolerance ±3 %, cross-axis ±2 %, zero-g ±50 mg (x, y) and ±80 mg (z),
    # 400 µg/√Hz at 10 Hz.
    Chip(
        "MPU-6050",
        "InvenSense PS-MPU-6000A-00 rev 3.4, 6.1 and 6.2",
        _gyroscope(_counts(0.005, {250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}), 20.0, 0.03, 0.02),
        _accelerometer(_counts(400e-6, _G_COUNTS), (0.050, 0.050, 0.080), 0.03, 0.02),
    ),
    # Table 2 accelerometer: 15729 … 17039 LSB/g at 2 g (±4 %), zero-g ±40 mg soldered, 180 µg/√Hz, cross-axis 1 %.
    # Table 3 gyroscope: 15.9 … 16.9 LSB/(°/s) at 2000 °/s (±3 %), zero rate ±3 °/s, 0.007 °/s/√Hz.
    Chip(
        "BMI160",
        "Bosch BST-BMI160-DS000-07 rev 0.8, tables 2 and 3",
        _gyroscope(_counts(0.007, {125: 262.4, 250: 131.2, 500: 65.6, 1000: 32.8, 2000: 16.4}), 3.0, 0.03),
        _accelerometer(_counts(180e-6, _G_COUNTS), 0.040, 0.04, 0.01),
    ),
    # Table 3: zero rate ±10 °/s, 7 mdps/√Hz; zero-g ±40 mg, 90 µg/√Hz (here for all ranges). It gives no tolerance of
    # the sensitivity at 25 °C; this uses the change over temperature instead: ±1.5 % and ±1 %. The range that it calls
    # 245 °/s (8.75 mdps/LSB) is 250 on its successors.
    Chip(
        "LSM6DS3",
        "ST DocID026899 rev 8, table 3",
        _gyroscope({245 if dps == 250 else dps: SheetScale(bit, 0.007) for dps, bit in _ST_DPS.items()}, 10.0, 0.015),
        _accelerometer({g: SheetScale(0.061e-3 * g / 2, 90e-6) for g in _G_COUNTS}, 0.040, 0.01),
    ),
    # Table 3: ±0.5 °/s, ±0.5 %, 3.8 mdps/√Hz; ±20 mg, ±0.5 %, noise density by full scale.
    Chip(
        "LSM6DSO32",
        "ST DocID032891 rev 1, table 3",
        _gyroscope({dps: SheetScale(bit, 0.0038) for dps, bit in _ST_DPS.items()}, 0.5, 0.005),
        _accelerometer(
            {
                4: SheetScale(0.122e-3, 120e-6),
                8: SheetScale(0.244e-3, 130e-6),
                16: SheetScale(0.488e-3, 160e-6),
                32: SheetScale(0.976e-3, 220e-6),
            },
            0.020,
            0.005,
        ),
    ),
    # 3.1 table 1: ±1.5 %, cross-axis ±2 %, ZRO ±5 °/s, 0.015 °/s/√Hz. 3.2 table 2: ±0.5 %, cross-axis ±2 %, zero-g
    # ±50 mg on the board, 230 µg/√Hz.
    Chip(
        "ICM-20948",
        "TDK DS-000189 rev 1.3, tables 1 to 3",
        _gyroscope(_counts(0.015, {250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}), 5.0, 0.015, 0.02),
        _accelerometer(_counts(230e-6, _G_COUNTS), 0.050, 0.005, 0.02),
        _AK09916,
    ),
)

# Honeywell 900405 rev E, configuration register B: 1370 … 230 LSB/G, codes to ±2047; specifications: 2 mG rms at 75 Hz,
# gain tolerance ±5 %, cross-axis 0.2 %. QST QMC5883L datasheet 1.0, specifications: 12000 and 3000 LSB/G, 2 mG, zero
# ±10 mG. The HMC's zero and the QMC's tolerance, cross-axis and bandwidth of the 2 mG are TYPICAL: as for the other.
_TWO_MILLIGAUSS = 2e-3 / math.sqrt(75.0 / 2.0)  # G/√Hz
_HMC_COUNTS: dict[float, float] = {
    0.88: 1370.0,
    1.3: 1090.0,
    1.9: 820.0,
    2.5: 660.0,
    4.0: 440.0,
    4.7: 390.0,
    5.6: 330.0,
    8.1: 230.0,
}
MAGNETOMETERS: dict[str, DataSheet] = {
    "HMC5883L": DataSheet("mag", "G", _counts(_TWO_MILLIGAUSS, _HMC_COUNTS), 1.3, 0.010, 0.05, 0.002, 2047),
    "QMC5883L": DataSheet("mag", "G", _counts(_TWO_MILLIGAUSS, {2: 12000.0, 8: 3000.0}), 8, 0.010, 0.05, 0.002),
    "AK09916": _AK09916,
}


def imu(
    name: str = "MPU-6050",
    *,
    gyr_range: float | None = None,
    acc_range: float | None = None,
    mag: str | None = None,
    mag_range: float | None = None,
    iron: Iron | None = None,
) -> Imu:
    """The error model of a chip, from its data sheet; ``dataclasses.replace`` changes parts of it.

    Args:
        name: "MPU-6050", "BMI160", "LSM6DS3", "LSM6DSO32" or "ICM-20948"; case and dashes do not count.
        gyr_range: full scale in °/s; by default 500.
        acc_range: full scale in g; by default 4.
        mag: a magnetometer beside it, "HMC5883L", "QMC5883L" or "AK09916"; the ICM-20948 has its AK09916 anyway.
        mag_range: full scale of the magnetometer in its data sheet's unit, G (AK09916: µT).
        iron: hard and soft iron around the magnetometer; by default none.

    Returns:
        An Imu. Densities, biases and tolerances are deviations: each seed of ``observe`` is another specimen.

    Raises:
        LevelheadError: an unknown name (the nearest is named) or a range that the chip does not have.
    """
    chip = {_plain(one.name): one for one in CHIPS}.get(_plain(name))
    if chip is None:
        raise LevelheadError(f"'{name}' is not a sensor of levelhead; {nearest(name, [c.name for c in CHIPS])}")
    sheet = chip.mag if mag is None else {_plain(one): page for one, page in MAGNETOMETERS.items()}.get(_plain(mag))
    if mag is not None and sheet is None:
        raise LevelheadError(f"'{mag}' is not a magnetometer of levelhead; {nearest(mag, MAGNETOMETERS)}")
    if sheet is None and (mag_range is not None or iron is not None):
        raise LevelheadError(f"the {chip.name} has no magnetometer; expected mag='HMC5883L' or another beside it")
    board = Imu(
        chip.gyr.errors(gyr_range),
        chip.acc.errors(acc_range),
        None if sheet is None else sheet.errors(mag_range),
        name=chip.name if mag is None else f"{chip.name} + {mag}",
    )
    return board if iron is None else replace(board, iron=iron)


def _plain(name: str) -> str:
    return "".join(letter for letter in name.lower() if letter.isalnum())
