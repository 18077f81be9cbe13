"""BMP280: pressure and temperature, with the compensation of the data sheet (Bosch BST-BMP280-DS001, 8.1)."""

import struct
import time
from collections.abc import Callable
from typing import NamedTuple

from levelhead.sources.sensors.bus import Bus, Port

NAME = "BMP280"
ADDRESSES = (0x76, 0x77)
IDENTITY = 0x58
CALIBRATION, ID, RESET, STATUS, CTRL_MEAS, CONFIG, DATA = 0x88, 0xD0, 0xE0, 0xF3, 0xF4, 0xF5, 0xF7
RESET_WORD = 0xB6
NORMAL_X2_X16 = 2 << 5 | 5 << 2 | 3  # temperature × 2, pressure × 16, normal mode: table 15, "handheld device dynamic"
STANDBY_05_FILTER_4 = 2 << 2  # 0.5 ms, IIR filter 4
INTERVAL = 0.04  # s: with these settings a measurement takes 37.5 ms at most (table 13), and 0.5 ms lie between two
SKIPPED = 0x80000  # content of the registers before the first measurement


class Trim(NamedTuple):
    """The trimming values of one specimen, registers 0x88 to 0x9F (table 17)."""

    t1: int
    t2: int
    t3: int
    p1: int
    p2: int
    p3: int
    p4: int
    p5: int
    p6: int
    p7: int
    p8: int
    p9: int

    @classmethod
    def unpack(cls, data: bytes) -> "Trim":
        """From the 24 bytes of the registers."""
        return cls(*struct.unpack("<HhhHhhhhhhhh", data))


class Weather(NamedTuple):
    """Pressure in Pa, temperature in °C."""

    pressure: float
    temperature: float


def compensate(trim: Trim, raw_pressure: int, raw_temperature: int) -> Weather:
    """The double-precision formulas of the data sheet, 8.1.

    >>> trim = Trim(27504, 26435, -1000, 36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000)
    >>> pressure, temperature = compensate(trim, 415148, 519888)
    >>> f"{pressure:.2f} Pa, {temperature:.2f} °C"  # the example in 3.12
    '100653.27 Pa, 25.08 °C'
    """
    first = (raw_temperature / 16384.0 - trim.t1 / 1024.0) * trim.t2
    off = raw_temperature / 131072.0 - trim.t1 / 8192.0
    fine = first + off * off * trim.t3
    half = fine / 2.0 - 64000.0
    offset = half * half * trim.p6 / 32768.0 + half * trim.p5 * 2.0
    offset = offset / 4.0 + trim.p4 * 65536.0
    slope = (trim.p3 * half * half / 524288.0 + trim.p2 * half) / 524288.0
    slope = (1.0 + slope / 32768.0) * trim.p1
    if slope == 0.0:
        return Weather(float("nan"), fine / 5120.0)
    pressure = (1048576.0 - raw_pressure - offset / 4096.0) * 6250.0 / slope
    square = trim.p9 * pressure * pressure / 2147483648.0
    return Weather(pressure + (square + pressure * trim.p8 / 32768.0 + trim.p7) / 16.0, fine / 5120.0)


class BMP280:
    """The chip, through a bus.

    Args:
        bus: the bus.
        address: 0x76, or 0x77 with SDO high.
        clock: host time in s.
        wait: sleeps so many seconds.
    """

    name = NAME
    rate = 1.0 / INTERVAL

    def __init__(
        self, bus: Bus, address: int = ADDRESSES[0], *,
        clock: Callable[[], float] = time.monotonic, wait: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        self.port, self._clock = Port(bus, address, NAME, wait), clock
        self.trim: Trim | None = None
        self._due = 0.0

    def start(self) -> None:
        """Checks who it is, resets it, reads its trimming values and lets it run.

        Raises:
            SensorError: no chip answers, or another one does.
        """
        self.port.expect(ID, IDENTITY)
        self.port.write(RESET, RESET_WORD)
        self.port.wait(2e-3)
        self.trim = Trim.unpack(self.port.burst(CALIBRATION, 24))
        self.port.write(CONFIG, STANDBY_05_FILTER_4)
        self.port.write(CTRL_MEAS, NORMAL_X2_X16)
        self._due = self._clock() + INTERVAL

    def read(self) -> Weather | None:
        """Pressure and temperature, or None if there is nothing new: the chip has no flag, so that goes by time.

        Raises:
            SensorError: the chip does not answer.
        """
        now = self._clock()
        if self.trim is None or now < self._due:
            return None
        self._due = max(self._due + INTERVAL, now)
        high, mid, low, t_high, t_mid, t_low = self.port.burst(DATA, 6)
        raw_pressure, raw_temperature = high << 12 | mid << 4 | low >> 4, t_high << 12 | t_mid << 4 | t_low >> 4
        if SKIPPED in (raw_pressure, raw_temperature):
            return None
        return compensate(self.trim, raw_pressure, raw_temperature)
