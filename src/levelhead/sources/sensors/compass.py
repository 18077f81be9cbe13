"""HMC5883L and QMC5883L: two magnetometers that are sold under one name and have nothing in common but the board."""

import struct
import time
from collections.abc import Callable
from typing import ClassVar

from levelhead.sample import Triple
from levelhead.sources.sensors.bus import Bus, Port, at_least, blank, code_for

GAUSS = 100.0  # µT


class HMC5883L:
    """Honeywell's (900405 rev E).

    Args:
        bus: the bus.
        address: 0x1E.
        rate: readings a second, Hz; the chip takes the next one of 0.75, 1.5, 3, 7.5, 15, 30 and 75.
        mag_range: 0.88, 1.3, 1.9, 2.5, 4, 4.7, 5.6 or 8.1 G.
        clock: host time in s.
        wait: sleeps so many seconds.

    Raises:
        LevelheadError: a range or a rate that the chip does not have.
    """

    name = "HMC5883L"
    address = 0x1E
    IDENTITY = b"H43"
    CRA, CRB, MODE, DATA, STATUS, ID_A = 0x00, 0x01, 0x02, 0x03, 0x09, 0x0A
    READY = 0x01
    OVERFLOW = -4096
    COUNTS: ClassVar = {
        0.88: 1370.0,
        1.3: 1090.0,
        1.9: 820.0,
        2.5: 660.0,
        4.0: 440.0,
        4.7: 390.0,
        5.6: 330.0,
        8.1: 230.0,
    }  # per G
    RATES: ClassVar = {0.75: 0, 1.5: 1, 3.0: 2, 7.5: 3, 15.0: 4, 30.0: 5, 75.0: 6}

    def __init__(
        self, bus: Bus, address: int = address, *, rate: float = 75.0, mag_range: float = 1.3,
        clock: Callable[[], float] = time.monotonic, wait: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        self.port, self._clock, self._due = Port(bus, address, self.name, wait), clock, 0.0
        self.rate = at_least(rate, list(self.RATES), self.name)
        codes = {gauss: code for code, gauss in enumerate(self.COUNTS)}
        self._gain = code_for("mag range", mag_range, codes, "G", self.name)
        self.scale = GAUSS / self.COUNTS[mag_range]

    def start(self) -> None:
        """Checks who it is, sets rate and gain, and lets it run.

        Raises:
            SensorError: no chip answers, or another one does.
        """
        for offset, letter in enumerate(self.IDENTITY):
            self.port.expect(self.ID_A + offset, letter)
        self.port.write(self.CRA, self.RATES[self.rate] << 2)
        self.port.write(self.CRB, self._gain << 5)
        self.port.write(self.MODE, 0x00)

    def read(self) -> Triple | None:
        """The field in µT, or None if there is nothing new, or more than the range holds.

        The registers stand in the order x, z, y, and the high byte comes first. The flag in the status register goes
        down only when the chip writes again, so a reading is not taken twice.

        Raises:
            SensorError: the chip does not answer.
        """
        now = self._clock()
        if now < self._due or not self.port.read(self.STATUS, 1)[0] & self.READY:
            return None
        self._due = now + 0.9 / self.rate
        data = self.port.read(self.DATA, 6)
        if blank(data):
            return None
        x, z, y = struct.unpack(">3h", data)
        if self.OVERFLOW in (x, y, z):
            return None
        return x * self.scale, y * self.scale, z * self.scale


class QMC5883L:
    """QST's (datasheet 1.0), which most boards marked HMC5883L carry.

    Args:
        bus: the bus.
        address: 0x0D.
        rate: readings a second, Hz; the chip takes the next one of 10, 50, 100 and 200.
        mag_range: 2 or 8 G.
        wait: sleeps so many seconds.

    Raises:
        LevelheadError: a range or a rate that the chip does not have.
    """

    name = "QMC5883L"
    address = 0x0D
    IDENTITY = 0xFF
    DATA, STATUS, CONTROL_1, CONTROL_2, PERIOD, CHIP_ID = 0x00, 0x06, 0x09, 0x0A, 0x0B, 0x0D
    READY, OVERFLOW = 0x01, 0x02
    CONTINUOUS, SOFT_RESET = 0x01, 0x80
    COUNTS: ClassVar = {2.0: 12000.0, 8.0: 3000.0}  # per G
    RATES: ClassVar = {10.0: 0x00, 50.0: 0x04, 100.0: 0x08, 200.0: 0x0C}

    def __init__(
        self, bus: Bus, address: int = address, *, rate: float = 100.0, mag_range: float = 8.0,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        self.port = Port(bus, address, self.name, wait)
        self.rate = at_least(rate, list(self.RATES), self.name)
        self._range = code_for("mag range", mag_range, {2.0: 0x00, 8.0: 0x10}, "G", self.name)
        self.scale = GAUSS / self.COUNTS[mag_range]

    def start(self) -> None:
        """Checks who it is, resets it, and lets it run.

        Raises:
            SensorError: no chip answers, or another one does.
        """
        self.port.expect(self.CHIP_ID, self.IDENTITY)
        self.port.write(self.CONTROL_2, self.SOFT_RESET)
        self.port.wait(1e-3)
        self.port.write(self.PERIOD, 0x01)  # the datasheet's recommendation
        self.port.write(self.CONTROL_1, self.RATES[self.rate] | self._range | self.CONTINUOUS)

    def read(self) -> Triple | None:
        """The field in µT, or None if there is nothing new, or more than the range holds; low byte first.

        Raises:
            SensorError: the chip does not answer.
        """
        status = self.port.read(self.STATUS, 1)[0]
        if not status & self.READY or status & self.OVERFLOW:
            return None
        data = self.port.read(self.DATA, 6)
        if blank(data):
            return None
        x, y, z = struct.unpack("<3h", data)
        return x * self.scale, y * self.scale, z * self.scale
