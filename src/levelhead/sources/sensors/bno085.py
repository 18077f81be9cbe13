"""BNO085, BNO086, BNO080: hubs with a filter of their own (CEVA 1000-3927; SH-2 Reference Manual 1000-3625).

They speak SHTP (1000-3535): packets of a header of four bytes (length with the header, channel, number) and a cargo. A
reading that ends early goes on in the next one, behind a header with the continuation bit.
"""

import struct
import time
from collections.abc import Callable, Iterator

from levelhead.sample import Triple, Wxyz
from levelhead.sources.sensors.bno055 import require_ranges
from levelhead.sources.sensors.bus import RETRIES, Bus, Port, SensorError, at_least
from levelhead.sources.sensors.fifo_imu import FifoReading
from levelhead.units import GRAVITY

NAME = "BNO085"
ADDRESSES = (0x4A, 0x4B)
EXECUTABLE, CONTROL, REPORTS = 1, 2, 3  # channels
LAST_CHANNEL = 5
HEADER, CONTINUED = struct.Struct("<HBB"), 0x8000
LONGEST = 1024  # bytes of a packet
RESET = b"\x01"  # on EXECUTABLE
PRODUCT_REQUEST, PRODUCT, SET_FEATURE, TIME_BASE, TIME_REBASE = 0xF9, 0xF8, 0xFD, 0xFB, 0xFA
FEATURE_LAYOUT = struct.Struct("<BBBHIII")  # report, feature, flags, change, interval and batch in µs, special
ACCELEROMETER, MAGNETOMETER, ROTATION, GYROSCOPE = 0x01, 0x03, 0x05, 0x07  # GYROSCOPE: uncalibrated
LENGTHS = {ACCELEROMETER: 10, MAGNETOMETER: 10, ROTATION: 14, GYROSCOPE: 16, TIME_BASE: 5, TIME_REBASE: 5}
THREE, FOUR = struct.Struct("<3h"), struct.Struct("<4h")
ACC_BIT, GYR_BIT, MAG_BIT, QUAT_BIT = 2.0**-8, 2.0**-9, 2.0**-4, 2.0**-14  # m/s², rad/s, µT (6.5 of the manual)
RATES = (25.0, 50.0, 100.0, 200.0, 400.0)  # Hz of the gyroscope; the accelerometer has its own near these
MAG_RATE = 100.0  # Hz, at most
GYR_RANGE, ACC_RANGE = 2000.0, 8.0  # °/s, g
START_UP, ANSWER = 0.3, 0.02  # s after a reset; s between two looks for an answer
LOOKS, PACKETS = 25, 256  # looks for an answer; packets of one reading
MISSING: Triple = (float("nan"),) * 3


class BNO085:
    """The chip, through a bus with ``i2c_rdwr``.

    Rates are those of the gyroscope before the hub's own correction of its bias. The specific force and the field are
    those that the hub has calibrated. The attitude is its rotation vector: to x east, y north, z up.

    Args:
        bus: the bus.
        address: 0x4A or 0x4B; None: 0x4A.
        rate: samples a second, Hz; the hub takes the next one of 25, 50, 100, 200 and 400.
        gyr_range: full scale in °/s, at most 2000, which it is.
        acc_range: full scale in g, at most 8, which it is.
        clock: host time in s.
        wait: sleeps for a number of seconds.

    Raises:
        LevelheadError: a larger range, or a higher rate.
    """

    name, gyr_range, acc_range = NAME, GYR_RANGE, ACC_RANGE * GRAVITY

    def __init__(
        self, bus: Bus, address: int | None = None, *, rate: float = 200.0, gyr_range: float = GYR_RANGE,
        acc_range: float = ACC_RANGE, clock: Callable[[], float] = time.monotonic,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        require_ranges(NAME, gyr_range, GYR_RANGE, acc_range, ACC_RANGE)
        self._clock = clock
        self.port = Port(bus, ADDRESSES[0] if address is None else address, NAME, wait)
        self.rate = at_least(rate, RATES, NAME)
        self._sent = [0] * (LAST_CHANNEL + 1)  # packets by channel
        self._restart()

    def _restart(self) -> None:
        self._number: int | None = None  # of the last report of the gyroscope
        self._gyr: Triple | None = None  # that waits for its specific force
        self._acc: Triple | None = None  # that no sample has yet

    def start(self) -> None:
        """Resets the hub, asks who it is, and switches its reports on.

        Raises:
            SensorError: no chip answers, or another one does.
        """
        self._sent = [0] * (LAST_CHANNEL + 1)
        self._restart()
        self._send(EXECUTABLE, RESET)
        self.port.wait(START_UP)
        self._send(CONTROL, bytes([PRODUCT_REQUEST, 0]))
        if self._find_answer(PRODUCT) is None:
            raise SensorError(
                "wrong_chip",
                f"the chip at 0x{self.port.address:02x} sends no identity; expected a {NAME}: check its name",
            )
        interval = round(1e6 / self.rate)
        for report in (ACCELEROMETER, GYROSCOPE, ROTATION, MAGNETOMETER):
            every = max(interval, round(1e6 / MAG_RATE)) if report == MAGNETOMETER else interval
            self._send(CONTROL, FEATURE_LAYOUT.pack(SET_FEATURE, report, 0, 0, every, 0, 0))

    def _send(self, channel: int, cargo: bytes) -> None:
        head = HEADER.pack(HEADER.size + len(cargo), channel, self._sent[channel])
        self._sent[channel] = (self._sent[channel] + 1) & 0xFF
        for _ in range(RETRIES):
            try:
                return self.port.send(head + cargo)
            except SensorError:
                self.port.failed -= 1
                self.port.retried += 1
        self.port.send(head + cargo)

    def _find_answer(self, report: int) -> bytes | None:
        """The cargo that begins with this report, on the channel for control; None: it does not come."""
        for _ in range(LOOKS):
            for channel, cargo in self._packets():
                if channel == CONTROL and cargo[0] == report:
                    return cargo
            self.port.wait(ANSWER)
        return None

    def _packets(self) -> Iterator[tuple[int, bytes]]:
        """Channel and cargo of all packets that wait."""
        for _ in range(PACKETS):
            head = self._head()
            length, channel, _ = HEADER.unpack(head)
            if length == 0xFFFF:
                raise self.port.implausible()
            length &= ~CONTINUED
            if length <= HEADER.size:
                return
            if length > LONGEST or channel > LAST_CHANNEL:
                raise self.port.implausible()
            yield channel, self.port.receive(length)[HEADER.size :]

    def _head(self) -> bytes:
        """The next header; its reading takes nothing away, and is tried again."""
        for _ in range(RETRIES):
            try:
                return self.port.receive(HEADER.size)
            except SensorError:
                self.port.failed -= 1
                self.port.retried += 1
        return self.port.receive(HEADER.size)

    def drain(self) -> FifoReading:
        """All samples that wait, with the newest field and attitude.

        Raises:
            SensorError: the hub does not answer.
        """
        rows: list[tuple[Triple, Triple]] = []
        mag: Triple | None = None
        attitude: Wxyz | None = None
        lost = False
        for channel, cargo in self._packets():
            if channel != REPORTS:
                continue
            for report in split_reports(cargo):
                kind = report[0]
                if kind == GYROSCOPE:
                    lost |= self._number is not None and (report[1] - self._number) & 0xFF != 1
                    self._number = report[1]
                    self._add_rate(rows, scale(report, GYR_BIT))
                elif kind == ACCELEROMETER:
                    self._add_force(rows, scale(report, ACC_BIT))
                elif kind == MAGNETOMETER:
                    mag = scale(report, MAG_BIT)
                elif kind == ROTATION:
                    i, j, k, w = (one * QUAT_BIT for one in FOUR.unpack_from(report, 4))
                    attitude = w, i, j, k
        return FifoReading(rows, self._clock(), lost, mag, attitude)

    def _add_rate(self, rows: list[tuple[Triple, Triple]], gyr: Triple) -> None:
        if self._gyr is not None:
            rows.append((self._gyr, MISSING))
            self._gyr = None
        if self._acc is None:
            self._gyr = gyr
        else:
            rows.append((gyr, self._acc))
            self._acc = None

    def _add_force(self, rows: list[tuple[Triple, Triple]], acc: Triple) -> None:
        if self._gyr is None:
            self._acc = acc
        else:
            rows.append((self._gyr, acc))
            self._gyr = None


def split_reports(cargo: bytes) -> Iterator[bytes]:
    """The reports of a cargo, one by one, up to one whose length is not known, or that is cut off."""
    left = cargo
    while left and (length := LENGTHS.get(left[0], 0)) and length <= len(left):
        yield left[:length]
        left = left[length:]


def scale(report: bytes, bit: float) -> Triple:
    """The three numbers of a report behind its number, status and delay."""
    x, y, z = THREE.unpack_from(report, 4)
    return x * bit, y * bit, z * bit
