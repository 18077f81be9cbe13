"""Emulated chips with a filter of their own: register addresses are shared with the drivers, no code is.

Their filter is perfect: it gives the reference orientation of the world's recording, rounded to its bits.
"""

import errno
import os
import struct

from levelhead.sources.sensors import bno055, bno085
from levelhead.sources.sensors.emulated.base import EmulatedChip
from levelhead.sources.sensors.emulated.world import World
from levelhead.units import DEGREE

BOOT = 0.1  # s after a reset in which a chip does not answer
Q14 = 2.0**-14


def counts(values: tuple[float, ...], bit: float) -> bytes:
    """Signed 16-bit numbers, low byte first, clipped at the end of the word."""
    return struct.pack(f"<{len(values)}h", *(max(-32768, min(32767, round(value / bit))) for value in values))


def refuse(now: float, awake: float) -> None:
    """Acknowledges nothing before it is awake.

    Raises:
        OSError: it is not.
    """
    if now < awake:
        raise OSError(errno.EREMOTEIO, os.strerror(errno.EREMOTEIO))


class EmulatedBNO055(EmulatedChip):
    """BNO055: in its configuration mode after a reset, where all data are zero; 100 Hz in NDOF, the field at 20 Hz."""

    def __init__(
        self, world: World, address: int = bno055.ADDRESSES[0], *, identity: int = bno055.IDENTITIES[0],
        drift: float = 0.0,
    ) -> None:  # fmt: skip
        self.identity = identity
        self._awake, self._measured = -1.0, 0
        super().__init__(world, address, drift)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self._measured = 0
        self.memory[bno055.CHIP_ID : bno055.CHIP_ID + 4] = bytes([self.identity]) + bno055.IDENTITIES[1:]
        self.memory[bno055.UNIT_SEL] = 0x80

    @property
    def rate(self) -> float:  # noqa: D102
        return 100.0 if self.memory[bno055.OPR_MODE] & 0x0F == bno055.NDOF else 0.0

    def update(self) -> None:  # noqa: D102
        refuse(self.world.clock(), self._awake)
        super().update()

    def measure(self, row: int) -> None:  # noqa: D102
        memory, moment = self.memory, self.world.row_moment(row)
        units = memory[bno055.UNIT_SEL]
        acc_bit, gyr_bit = 9.80665e-3 if units & 0x01 else 0.01, 1.0 / 900.0 if units & 0x02 else DEGREE / 16.0
        if self._measured % 5 == 0:
            self.put(bno055.DATA + 6, counts(moment.mag, 1.0 / 16.0))
        self._measured += 1
        self.put(bno055.DATA, counts(moment.acc, acc_bit))
        self.put(bno055.DATA + 12, counts(moment.gyr, gyr_bit))
        self.put(bno055.DATA + 24, counts(self.world.attitude(row), Q14))

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == bno055.SYS_TRIGGER and value & bno055.RESET:
            self.reset()
            self._awake = self.world.clock() + BOOT
            return
        configuring = self.memory[bno055.OPR_MODE] & 0x0F == bno055.CONFIG
        if register == bno055.OPR_MODE:
            super().write(register, value)
            self.put(bno055.DATA, bytes(44))
            self.restart()
        elif configuring or register == bno055.PAGE_ID:  # 3.3.1: elsewhere the others cannot be written
            super().write(register, value)


class EmulatedBNO085(EmulatedChip):
    """BNO085: sends its identity after a reset, and sends reports once they are switched on."""

    ADVERTISEMENT = b"\x00" + b"\x01\x04\x00\x00\x00\x00" + b"\x80\x06" + b"1.1.0\x00" + bytes(200)
    NUMBER = 10_003_608  # of its software

    def __init__(self, world: World, address: int = bno085.ADDRESSES[0], *, drift: float = 0.0) -> None:
        self._awake = -1.0
        super().__init__(world, address, drift)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self._queue: list[tuple[int, bytes]] = [
            (0, self.ADVERTISEMENT),
            (bno085.EXECUTABLE, b"\x01"),
            (bno085.CONTROL, bytes([0xF1, 0, 0x84, 0, 0]) + bytes(11)),
        ]
        self._given = 0  # bytes of the first cargo that the host has
        self._numbers = [0] * 256  # of channels' packets
        self._reports = [0] * 256  # of reports
        self._intervals: dict[int, int] = {}  # µs by report
        self._measured = 0

    @property
    def rate(self) -> float:  # noqa: D102
        interval = self._intervals.get(bno085.GYROSCOPE, 0)
        return 1e6 / interval if interval else 0.0

    def update(self) -> None:  # noqa: D102
        refuse(self.world.clock(), self._awake)
        super().update()

    def measure(self, row: int) -> None:  # noqa: D102
        moment = self.world.row_moment(row)
        w, x, y, z = self.world.attitude(row)
        cargo = struct.pack("<Bi", 0xFB, 12)  # taken 1.2 ms ago
        cargo += self._report(bno085.ACCELEROMETER, counts(moment.acc, 2.0**-8))
        cargo += self._report(bno085.GYROSCOPE, counts(moment.gyr, 2.0**-9) + bytes(6))
        if any((w, x, y, z)):
            cargo += self._report(bno085.ROTATION, counts((x, y, z, w), Q14) + counts((0.03,), 2.0**-12))
        mag_interval = self._intervals.get(bno085.MAGNETOMETER, 0)
        if mag_interval and self._measured % max(1, round(mag_interval * self.rate * 1e-6)) == 0:
            cargo += self._report(bno085.MAGNETOMETER, counts(moment.mag, 2.0**-4))
        self._measured += 1
        if len(self._queue) > 32:  # it does not wait for a host for ever
            del self._queue[1:2]
        self._queue.append((bno085.REPORTS, cargo))

    def _report(self, number: int, data: bytes) -> bytes:
        """A report with its count, status (accuracy 3) and delay."""
        if number not in self._intervals:
            return b""
        count = self._reports[number]
        self._reports[number] = (count + 1) & 0xFF
        return bytes([number, count, 0x03, 0x00]) + data

    def receive(self, length: int) -> bytes:
        """The bytes that the host reads: a header, and as much of the cargo as it asks for."""
        if not self._queue:
            return bytes(length)
        channel, cargo = self._queue[0]
        left = len(cargo) - self._given
        number = self._numbers[channel]
        head = struct.pack("<HBB", left + 4 | (0x8000 if self._given else 0), channel, number)
        part = cargo[self._given : self._given + max(0, length - 4)]
        if part:
            self._given += len(part)
            self._numbers[channel] = (number + 1) & 0xFF
            if self._given == len(cargo):
                self._queue.pop(0)
                self._given = 0
        return (head + part)[:length].ljust(length, b"\x00")

    def send(self, data: bytes) -> None:
        """The bytes that the host writes: a packet; a short one is ignored."""
        if len(data) < 5 or struct.unpack_from("<H", data)[0] != len(data):
            return
        channel, cargo = data[2], data[4:]
        if channel == bno085.EXECUTABLE and cargo == b"\x01":
            self.reset()
            self._awake = self.world.clock() + BOOT
        elif channel == bno085.CONTROL and cargo[0] == 0xF9:
            answer = struct.pack("<BBBBIIHBB", 0xF8, 1, 3, 2, self.NUMBER, 370, 7, 0, 0)
            self._queue.append((bno085.CONTROL, answer))
        elif channel == bno085.CONTROL and cargo[0] == 0xFD and len(cargo) == 17:
            _, report, _, _, interval, _, _ = struct.unpack("<BBBHIII", cargo)
            self._intervals[report] = interval
            self._queue.append((bno085.CONTROL, b"\xfc" + cargo[1:]))
            self.restart()

    def read(self, register: int) -> int:
        """Has no registers; a byte is that of a header."""
        return self.receive(1)[0]

    def write(self, register: int, value: int) -> None:
        """Two bytes are not a packet."""

    def block(self, register: int, length: int) -> bytes:  # noqa: D102
        return self.receive(length)
