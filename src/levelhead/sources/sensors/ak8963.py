"""AK8963: the magnetometer inside the MPU-9250 (AKM MS1356-E-02; RM-MPU-9250A-00, 5), through its bypass."""

import struct
import time
from collections.abc import Callable
from typing import ClassVar

from levelhead.sample import Triple
from levelhead.sources.sensors.bus import Bus, Port, at_least, blank


class AK8963:
    """The chip, through a bus; its axes are rotated to those of gyroscope and accelerometer.

    Their x and y are its y and x, and its z points the other way (PS-MPU-9250A-01, figures 4 and 5). Each axis has a
    sensitivity of its own, which the chip holds.

    Args:
        bus: the bus.
        address: 0x0C.
        rate: readings a second: 8 or 100 Hz; the chip takes the next one.
        wait: sleeps so many seconds.

    Raises:
        LevelheadError: a rate that it does not have.
    """

    name = "AK8963"
    address = 0x0C
    IDENTITY = 0x48
    WIA, ST1, CNTL1, CNTL2, ASAX = 0x00, 0x02, 0x0A, 0x0B, 0x10
    DATA_READY, OVERFLOW = 0x01, 0x08  # ST1, ST2
    POWER_DOWN, FUSE_ROM, BITS_16 = 0x00, 0x0F, 0x10  # CNTL1
    SCALE = 0.15  # µT per bit of 16
    RATES: ClassVar = {8.0: 0x02, 100.0: 0x06}

    def __init__(
        self, bus: Bus, address: int = address, *, rate: float = 100.0, wait: Callable[[float], None] = time.sleep
    ) -> None:
        self.port = Port(bus, address, self.name, wait)
        self.rate = at_least(rate, list(self.RATES), self.name)
        self._scales = (self.SCALE, self.SCALE, self.SCALE)

    def start(self) -> None:
        """Checks who it is, resets it, reads its sensitivities (8.3.11) and sets the rate.

        Raises:
            SensorError: no chip answers, or another one does.
        """
        self.port.expect(self.WIA, self.IDENTITY)
        self.port.write(self.CNTL2, 0x01)
        self.port.wait(1e-3)
        self.port.write(self.CNTL1, self.FUSE_ROM)
        self.port.wait(1e-3)
        x, y, z = (self.SCALE * (1.0 + (value - 128) / 256.0) for value in self.port.read(self.ASAX, 3))
        self._scales = x, y, z
        self.port.write(self.CNTL1, self.POWER_DOWN)
        self.port.wait(1e-3)
        self.port.write(self.CNTL1, self.RATES[self.rate] | self.BITS_16)

    def read(self) -> Triple | None:
        """The field in µT, or None if there is nothing new, or more than it can measure.

        Eight bytes from ST1 to ST2, whose reading frees the data registers for the next measurement.

        Raises:
            SensorError: the chip does not answer.
        """
        data = self.port.read(self.ST1, 8)
        if not data[0] & self.DATA_READY or data[7] & self.OVERFLOW or blank(data):
            return None
        counts = struct.unpack("<3h", data[1:7])
        x, y, z = (count * scale for count, scale in zip(counts, self._scales, strict=True))
        return y, x, -z
