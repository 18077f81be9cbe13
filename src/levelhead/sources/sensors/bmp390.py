"""BMP390, BMP388: pressure and temperature, with the compensation of the data sheet (Bosch BST-BMP390-DS002, 8)."""

import struct
import time
from collections.abc import Callable
from typing import NamedTuple

from levelhead.sources.sensors.bmp280 import Weather
from levelhead.sources.sensors.bus import Bus, Port

NAME = "BMP390"
ADDRESSES = (0x77, 0x76)
IDENTITY, BMP388 = 0x60, 0x50
ID, STATUS, DATA, PWR_CTRL, OSR, ODR, CONFIG, TRIM, CMD = 0x00, 0x03, 0x04, 0x1B, 0x1C, 0x1D, 0x1F, 0x31, 0x7E
SOFT_RESET = 0xB6
READY = 0x60  # STATUS: pressure and temperature
NORMAL, PRESSURE_X8_TEMPERATURE_X1, HERTZ_25, FILTER_3 = 0x33, 0x03, 0x03, 0x04
INTERVAL = 0.04  # s
SIZES = struct.Struct("<HHbhhbbHHbbhbb")
SCALES = (2**-8, 2**30, 2**48, 2**20, 2**29, 2**32, 2**37, 2**-3, 2**6, 2**8, 2**15, 2**48, 2**48, 2**65)  # 8.4


class PressureTrim(NamedTuple):
    """The trimming values of one specimen as the formulas use them (8.4)."""

    t1: float
    t2: float
    t3: float
    p1: float
    p2: float
    p3: float
    p4: float
    p5: float
    p6: float
    p7: float
    p8: float
    p9: float
    p10: float
    p11: float

    @classmethod
    def unpack(cls, data: bytes) -> "PressureTrim":
        """From the 21 bytes of registers 0x31 to 0x45."""
        numbers = [float(number) for number in SIZES.unpack(data)]
        numbers[3] -= 16384.0
        numbers[4] -= 16384.0
        return cls(*(number / scale for number, scale in zip(numbers, SCALES, strict=True)))


def compensate(trim: PressureTrim, raw_pressure: int, raw_temperature: int) -> Weather:
    """The floating-point formulas of the data sheet, 8.5 and 8.6."""
    above = raw_temperature - trim.t1
    t = above * trim.t2 + above * above * trim.t3
    offset = trim.p5 + t * (trim.p6 + t * (trim.p7 + t * trim.p8))
    slope = trim.p1 + t * (trim.p2 + t * (trim.p3 + t * trim.p4))
    square = raw_pressure * raw_pressure * (trim.p9 + t * trim.p10)
    return Weather(offset + raw_pressure * slope + square + raw_pressure**3 * trim.p11, t)


class BMP390:
    """The chip, through a bus.

    Args:
        bus: the bus.
        address: 0x77, or 0x76 with SDO low.
        clock: host time in s; the chip has a flag for new readings.
        wait: sleeps so many seconds.
    """

    name = NAME
    rate = 1.0 / INTERVAL

    def __init__(
        self, bus: Bus, address: int = ADDRESSES[0], *,
        clock: Callable[[], float] = time.monotonic, wait: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        self.port = Port(bus, address, NAME, wait)
        self.trim: PressureTrim | None = None

    def start(self) -> None:
        """Checks who it is, resets it, reads its trimming values and lets it run.

        Raises:
            SensorError: no chip answers, or another one does.
        """
        if self.port.read(ID, 1)[0] != BMP388:
            self.port.expect(ID, IDENTITY)
        self.port.write(CMD, SOFT_RESET)
        self.port.wait(2e-3)
        self.trim = PressureTrim.unpack(self.port.burst(TRIM, 21))
        self.port.write(OSR, PRESSURE_X8_TEMPERATURE_X1)
        self.port.write(ODR, HERTZ_25)
        self.port.write(CONFIG, FILTER_3)
        self.port.write(PWR_CTRL, NORMAL)

    def read(self) -> Weather | None:
        """Pressure and temperature, or None if there is nothing new.

        Raises:
            SensorError: the chip does not answer.
        """
        if self.trim is None or self.port.read(STATUS, 1)[0] & READY != READY:
            return None
        data = self.port.burst(DATA, 6)
        return compensate(self.trim, int.from_bytes(data[:3], "little"), int.from_bytes(data[3:], "little"))
