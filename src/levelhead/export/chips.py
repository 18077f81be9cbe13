"""The chips that a sketch reads: the writes that wake them, and the axis of each output register.

A chip that levelhead drives itself is taken from its driver: the sketch makes the writes of that driver. The others are
from their data sheets, register by register.
"""

import functools
from collections.abc import Callable, Mapping
from typing import NamedTuple

from levelhead.errors import LevelheadError, nearest
from levelhead.export.magnetometers import LIS3MDL_BOARD
from levelhead.export.register_writes import Write, WriteRecorder
from levelhead.sources.sensors import icm20948, lsm6dso32, lsm6dsox, mpu6050, mpu9250
from levelhead.sources.sensors.fifo_imu import ChipSettings, Counts, FifoChip, Registers
from levelhead.units import DEGREE, GRAVITY

RATE = 100.0  # Hz, of the sketch


class Layout(NamedTuple):
    """The output registers: words of 16 bits with a sign."""

    first: int
    words: int
    little: bool  # the low byte comes first
    gyr: tuple[int, int, int]  # the numbers of the words
    acc: tuple[int, int, int]


class SketchChip(NamedTuple):
    """A chip as a sketch uses it.

    Attributes:
        name: as it is sold.
        address: on the bus; the usual one.
        source: the data sheet.
        identity: register, value, and the bits of it that count.
        gyr: full scale in °/s -> rad/s per count.
        acc: full scale in g -> m/s² per count.
        start: the writes, for the two full scales.
        layout: the output registers.
    """

    name: str
    address: int
    source: str
    identity: tuple[int, int, int]
    gyr: Mapping[float, float]
    acc: Mapping[float, float]
    start: Callable[[float, float], list[Write]]
    layout: Layout


def _driven(chip: FifoChip, source: str) -> SketchChip:
    """A chip that levelhead drives, as its driver has it."""
    rate = min(one for one in chip.rates if one >= RATE)

    def record(gyr: float, acc: float) -> WriteRecorder:
        recorder = WriteRecorder()
        chip.configure(recorder, ChipSettings(rate, chip.gyr_codes[gyr], chip.acc_codes[acc]))
        return recorder

    usual = record(min(chip.gyr_codes), min(chip.acc_codes))
    return SketchChip(
        chip.name,
        chip.addresses[0],
        source,
        usual.identity,
        chip.gyr_bits,
        chip.acc_bits,
        lambda gyr, acc: record(gyr, acc).writes,
        find_layout(chip.output_register, chip.output_size, chip.output),
    )


def find_layout(first: int, size: int, output: Callable[[bytes], Registers]) -> Layout:
    """Where a driver finds each axis in a burst, from its reading of bytes that are all different."""
    data = bytes(range(1, size + 1))
    read = output(data)
    for little in (False, True):
        words = [int.from_bytes(data[i : i + 2], "little" if little else "big") for i in range(0, size, 2)]
        if set(read.gyr + read.acc) <= set(words):
            return Layout(first, size // 2, little, _indices(words, read.gyr), _indices(words, read.acc))
    raise LevelheadError("the driver's output registers are not words of 16 bits")


def _indices(words: list[int], counts: Counts) -> tuple[int, int, int]:
    x, y, z = counts
    return words.index(x), words.index(y), words.index(z)


ACC_16384 = {2.0: GRAVITY / 16384.0, 4.0: GRAVITY / 8192.0, 8.0: GRAVITY / 4096.0, 16.0: GRAVITY / 2048.0}


def _start_lsm6ds3(gyr: float, acc: float) -> list[Write]:
    """CTRL3_C: reset, then whole words and addresses that count up; CTRL1_XL and CTRL2_G: 104 samples a second."""
    acc_code = {2.0: 0x00, 16.0: 0x04, 4.0: 0x08, 8.0: 0x0C}[acc]
    gyr_code = {250.0: 0x00, 500.0: 0x04, 1000.0: 0x08, 2000.0: 0x0C}[gyr]
    return [Write(0x12, 0x01, 20), Write(0x12, 0x44), Write(0x10, 0x40 | acc_code), Write(0x11, 0x40 | gyr_code)]


def _start_bmi160(gyr: float, acc: float) -> list[Write]:
    """CMD: reset, both sensors on; ACC_CONF and GYR_CONF: 100 samples a second, the usual low-pass; the ranges."""
    acc_code = {2.0: 0x03, 4.0: 0x05, 8.0: 0x08, 16.0: 0x0C}[acc]
    gyr_code = {2000.0: 0, 1000.0: 1, 500.0: 2, 250.0: 3, 125.0: 4}[gyr]
    return [Write(0x7E, 0xB6, 100), Write(0x7E, 0x11, 10), Write(0x7E, 0x15, 100), Write(0x40, 0x28),
            Write(0x41, acc_code), Write(0x42, 0x28), Write(0x43, gyr_code)]  # fmt: skip


def _start_bno055(gyr: float, acc: float) -> list[Write]:
    """Reset; page 1: ranges, 62.5 and 47 Hz; page 0: units; OPR_MODE: AMG, the readings without Bosch's fusion."""
    acc_code = {2.0: 0, 4.0: 1, 8.0: 2, 16.0: 3}[acc]
    gyr_code = {2000.0: 0, 1000.0: 1, 500.0: 2, 250.0: 3, 125.0: 4}[gyr]
    return [Write(0x3F, 0x20, 700), Write(0x07, 0x01), Write(0x08, 0x0C | acc_code), Write(0x0A, 0x18 | gyr_code),
            Write(0x07, 0x00), Write(0x3B, 0x00), Write(0x3D, 0x07, 20)]  # fmt: skip


GYR_ST = {250.0: 8.75e-3 * DEGREE, 500.0: 17.5e-3 * DEGREE, 1000.0: 35e-3 * DEGREE, 2000.0: 70e-3 * DEGREE}
ACC_ST = {2.0: 0.061e-3 * GRAVITY, 4.0: 0.122e-3 * GRAVITY, 8.0: 0.244e-3 * GRAVITY, 16.0: 0.488e-3 * GRAVITY}
GYR_BOSCH = {full: DEGREE / (262.4 * 125.0 / full) for full in (125.0, 250.0, 500.0, 1000.0, 2000.0)}


@functools.cache
def chips() -> dict[str, SketchChip]:
    """Name -> chip."""
    found = [
        _driven(mpu6050.CHIP, "InvenSense RM-MPU-6000A-00, rev. 4.2"),
        _driven(icm20948.CHIP, "TDK DS-000189"),
        _driven(lsm6dso32.CHIP, "ST DocID032891"),
        _driven(lsm6dsox.CHIP, "ST DS12814"),
        _driven(mpu9250.CHIP, "InvenSense RM-MPU-9250A-00, rev. 1.6"),
        SketchChip("LSM6DS3", 0x6A, "ST DocID026899, rev. 10", (0x0F, 0x69, 0xFF), GYR_ST, ACC_ST, _start_lsm6ds3,
                   Layout(0x22, 6, True, (0, 1, 2), (3, 4, 5))),
        SketchChip("BMI160", 0x68, "Bosch BST-BMI160-DS000", (0x00, 0xD1, 0xFF), GYR_BOSCH, ACC_16384, _start_bmi160,
                   Layout(0x0C, 6, True, (0, 1, 2), (3, 4, 5))),
        SketchChip("BNO055", 0x28, "Bosch BST-BNO055-DS000", (0x00, 0xA0, 0xFF),
                   dict.fromkeys(GYR_BOSCH, DEGREE / 16.0), dict.fromkeys(ACC_16384, 0.01), _start_bno055,
                   Layout(0x08, 9, True, (6, 7, 8), (0, 1, 2))),
    ]  # fmt: skip
    boards = [chip._replace(name=f"{chip.name}{LIS3MDL_BOARD}") for chip in found if chip.name.startswith("LSM6DS")]
    return {chip.name: chip for chip in [*found, *boards]}


def find_chip(name: str) -> SketchChip:
    """A chip by its name; case, dashes and spaces do not count.

    Raises:
        LevelheadError: there is none of that name.
    """
    plain = {_plain(known): known for known in chips()}
    if _plain(name) not in plain:
        raise LevelheadError(f"there is no sketch for '{name}'; {nearest(name, list(chips()))}")
    return chips()[plain[_plain(name)]]


def _plain(name: str) -> str:
    return "".join(letter for letter in name.lower() if letter.isalnum())


def file_stem(chip: SketchChip) -> str:
    """Of the sketch: mpu6050."""
    return _plain(chip.name)
