"""LIS3MDL: ST's magnetometer, on boards beside an LSM6DS chip (ST DocID024204 rev 6)."""

import struct
import time
from collections.abc import Callable
from typing import ClassVar

from levelhead.sample import Triple
from levelhead.sources.sensors.bus import Bus, Port, at_least, blank, code_for
from levelhead.sources.sensors.compass import GAUSS


class LIS3MDL:
    """The chip, through a bus.

    Args:
        bus: the bus.
        address: 0x1C, or 0x1E with SDO high.
        rate: readings a second, Hz; the chip takes the next one of 0.625 to 80.
        mag_range: 4, 8, 12 or 16 G.
        wait: sleeps so many seconds.

    Raises:
        LevelheadError: a range or a rate that the chip does not have.
    """

    name = "LIS3MDL"
    address = 0x1C
    IDENTITY = 0x3D
    WHO_AM_I, CTRL1, CTRL2, CTRL3, CTRL4, CTRL5, STATUS, DATA = 0x0F, 0x20, 0x21, 0x22, 0x23, 0x24, 0x27, 0x28
    ULTRA_HIGH_XY, ULTRA_HIGH_Z, SOFT_RESET, CONTINUOUS, BLOCK_UPDATE = 0x60, 0x0C, 0x04, 0x00, 0x40
    READY, OVERRUN, INCREMENT = 0x08, 0x80, 0x80  # STATUS; the highest bit of a register's address
    COUNTS: ClassVar = {4.0: 6842.0, 8.0: 3421.0, 12.0: 2281.0, 16.0: 1711.0}  # per G, table 3
    RATES: ClassVar = {0.625: 0, 1.25: 1, 2.5: 2, 5.0: 3, 10.0: 4, 20.0: 5, 40.0: 6, 80.0: 7}

    def __init__(
        self, bus: Bus, address: int = address, *, rate: float = 80.0, mag_range: float = 4.0,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        self.port = Port(bus, address, self.name, wait)
        self.rate = at_least(rate, list(self.RATES), self.name)
        codes = {gauss: code << 5 for code, gauss in enumerate(self.COUNTS)}
        self._range = code_for("mag range", mag_range, codes, "G", self.name)
        self.scale = GAUSS / self.COUNTS[mag_range]

    def start(self) -> None:
        """Checks who it is, resets it, and lets it run.

        Raises:
            SensorError: no chip answers, or another one does.
        """
        self.port.expect(self.WHO_AM_I, self.IDENTITY)
        self.port.write(self.CTRL2, self.SOFT_RESET)
        self.port.wait(1e-3)
        self.port.write(self.CTRL1, self.ULTRA_HIGH_XY | self.RATES[self.rate] << 2)
        self.port.write(self.CTRL2, self._range)
        self.port.write(self.CTRL4, self.ULTRA_HIGH_Z)
        self.port.write(self.CTRL5, self.BLOCK_UPDATE)
        self.port.write(self.CTRL3, self.CONTINUOUS)

    def read(self) -> Triple | None:
        """The field in µT, or None if there is nothing new; low byte first.

        Raises:
            SensorError: the chip does not answer.
        """
        if not self.port.read(self.STATUS, 1)[0] & self.READY:
            return None
        data = self.port.read(self.DATA | self.INCREMENT, 6)
        if blank(data):
            return None
        x, y, z = struct.unpack("<3h", data)
        return x * self.scale, y * self.scale, z * self.scale
