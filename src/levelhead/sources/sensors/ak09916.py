"""AK09916: the magnetometer inside the ICM-20948 (TDK DS-000189), reached through its bypass as a chip of its own."""

import struct
import time
from collections.abc import Callable
from typing import ClassVar

from levelhead.sample import Triple
from levelhead.sources.sensors.bus import Bus, Port, at_least, blank


class AK09916:
    """The chip, through a bus; its axes are rotated to those of gyroscope and accelerometer.

    Its x is theirs, its y and z point the other way (DS-000189, figures 12 and 13).

    Args:
        bus: the bus.
        address: 0x0C.
        rate: readings a second: 10, 20, 50 or 100 Hz; the chip takes the next one.
        wait: sleeps so many seconds.

    Raises:
        LevelheadError: a rate that it does not have.
    """

    name = "AK09916"
    address = 0x0C
    IDENTITY = (0x48, 0x09)
    WIA1, ST1, CNTL2, CNTL3 = 0x00, 0x10, 0x31, 0x32
    DATA_READY, OVERFLOW = 0x01, 0x08  # ST1, ST2
    SCALE = 0.15  # µT per bit, table 3
    RATES: ClassVar = {10.0: 0x02, 20.0: 0x04, 50.0: 0x06, 100.0: 0x08}

    def __init__(
        self, bus: Bus, address: int = address, *, rate: float = 100.0, wait: Callable[[float], None] = time.sleep
    ) -> None:
        self.port = Port(bus, address, self.name, wait)
        self.rate = at_least(rate, list(self.RATES), self.name)

    def start(self) -> None:
        """Checks who it is, resets it and sets the rate.

        Raises:
            SensorError: no chip answers, or another one does.
        """
        for offset, identity in enumerate(self.IDENTITY):
            self.port.expect(self.WIA1 + offset, identity)
        self.port.write(self.CNTL3, 0x01)
        self.port.wait(1e-3)
        self.port.write(self.CNTL2, self.RATES[self.rate])

    def read(self) -> Triple | None:
        """The field in µT, or None if there is nothing new, or more than it can measure.

        Nine bytes from ST1 to ST2, whose reading frees the data registers for the next measurement.

        Raises:
            SensorError: the chip does not answer.
        """
        data = self.port.read(self.ST1, 9)
        if not data[0] & self.DATA_READY or data[8] & self.OVERFLOW or blank(data):
            return None
        x, y, z = struct.unpack("<3h", data[1:7])
        return x * self.SCALE, -y * self.SCALE, -z * self.SCALE
