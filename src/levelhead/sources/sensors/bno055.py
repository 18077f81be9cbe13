"""BNO055: a chip with a filter of its own (Bosch BST-BNO055-DS000-14).

In its mode NDOF sensors and quaternion come at 100 Hz (table 3-14), the magnetometer at 20 Hz. The chip subtracts the
offsets that it has found from the sensors' data (3.6.5). It has no FIFO.
"""

import struct
import time
from collections.abc import Callable

from levelhead.errors import LevelheadError
from levelhead.sample import Triple
from levelhead.sources.sensors.bus import Bus, Port, blank
from levelhead.sources.sensors.fifo_imu import FifoReading
from levelhead.units import DEGREE, GRAVITY

NAME = "BNO055"
ADDRESSES = (0x28, 0x29)
IDENTITIES = bytes([0xA0, 0xFB, 0x32, 0x0F])  # CHIP_ID, ACC_ID, MAG_ID, GYR_ID
CHIP_ID, PAGE_ID, DATA, UNIT_SEL, OPR_MODE, PWR_MODE, SYS_TRIGGER = 0x00, 0x07, 0x08, 0x3B, 0x3D, 0x3E, 0x3F
CONFIG, NDOF, NORMAL, RESET, SI_UNITS = 0x00, 0x0C, 0x00, 0x20, 0x00  # SI_UNITS: m/s², °/s
START_UP, TO_CONFIG, TO_NDOF = 0.65, 0.019, 0.007  # s: table 0-2, table 3-6
FIRST_DATA = 0.2  # s from then on in which all data may still be zero
LENGTH = 32  # bytes: accelerometer, magnetometer, gyroscope, Euler angles, quaternion
SIXTEEN = struct.Struct("<16h")
ACC_BIT, GYR_BIT, MAG_BIT, QUAT_BIT = 0.01, DEGREE / 16.0, 1.0 / 16.0, 2.0**-14  # m/s², rad/s, µT; tables 3-17 to 3-31
RATE, GYR_RANGE, ACC_RANGE = 100.0, 2000.0, 4.0  # Hz, °/s, g: table 3-4
SAME = 1.3  # intervals after which the same bytes are the next sample
MISSED = 1.9  # intervals between two samples that were seen, from which on one between them was not


class BNO055:
    """The chip, through a bus.

    Args:
        bus: the bus.
        address: 0x28 or 0x29; None: 0x28.
        rate: samples a second; its own rate is 100 Hz, whatever is asked.
        gyr_range: full scale in °/s, at most 2000, which it is.
        acc_range: full scale in g, at most 4, which it is.
        clock: host time in s.
        wait: sleeps for a number of seconds.

    Raises:
        LevelheadError: a larger range.
    """

    name, rate, gyr_range, acc_range = NAME, RATE, GYR_RANGE, ACC_RANGE * GRAVITY

    def __init__(
        self, bus: Bus, address: int | None = None, *, rate: float = RATE, gyr_range: float = GYR_RANGE,
        acc_range: float = ACC_RANGE, clock: Callable[[], float] = time.monotonic,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        require_ranges(NAME, gyr_range, GYR_RANGE, acc_range, ACC_RANGE)
        self._clock = clock
        self.port = Port(bus, ADDRESSES[0] if address is None else address, NAME, wait)
        self._last, self._at = b"", 0.0  # bytes of the last sample, and the host time of them, or of the start

    def start(self) -> None:
        """Identifies the chip, resets it and lets its filter run.

        Raises:
            SensorError: no chip answers, or another one does.
        """
        port = self.port
        port.write(PAGE_ID, 0x00)
        port.expect(CHIP_ID, IDENTITIES[0])
        port.write(OPR_MODE, CONFIG)
        port.wait(TO_CONFIG)
        port.write(SYS_TRIGGER, RESET)
        port.wait(START_UP)
        port.expect(CHIP_ID, IDENTITIES[0])
        port.write(PWR_MODE, NORMAL)
        port.write(UNIT_SEL, SI_UNITS)
        port.write(OPR_MODE, NDOF)
        port.wait(TO_NDOF)
        self._last, self._at = b"", self._clock()

    def drain(self) -> FifoReading:
        """The newest sample, if it is new. The chip has no flag for that: its bytes change, or an interval is over.

        Raises:
            SensorError: the chip does not answer, or gives nothing but zeros or ones.
        """
        data = self.port.read(DATA, LENGTH)
        now = self._clock()
        if blank(data):
            if any(data) or self._last or now - self._at > FIRST_DATA:
                raise self.port.implausible()
            return FifoReading([], now)
        since = (now - self._at) * RATE
        if self._last and data == self._last and since < SAME:
            return FifoReading([], now)
        lost = bool(self._last) and since > MISSED
        new_field = data[6:12] != self._last[6:12]
        self._last, self._at = data, now
        a, b, c, mx, my, mz, x, y, z, _, _, _, *quat = SIXTEEN.unpack(data)
        gyr: Triple = (x * GYR_BIT, y * GYR_BIT, z * GYR_BIT)
        acc: Triple = (a * ACC_BIT, b * ACC_BIT, c * ACC_BIT)
        mag = (mx * MAG_BIT, my * MAG_BIT, mz * MAG_BIT) if new_field and any((mx, my, mz)) else None
        w, i, j, k = (one * QUAT_BIT for one in quat)
        return FifoReading([(gyr, acc)], now, lost, mag, (w, i, j, k) if any(quat) else None)


def require_ranges(chip: str, gyr_range: float, most_gyr: float, acc_range: float, most_acc: float) -> None:
    """Ranges of a chip whose own filter sets them.

    Raises:
        LevelheadError: one is larger than the chip's.
    """
    for what, wanted, most, unit in (("gyr", gyr_range, most_gyr, "deg/s"), ("acc", acc_range, most_acc, "g")):
        if not 0.0 < wanted <= most:
            raise LevelheadError(f"{what} range {wanted:g} {unit} does not exist; the {chip} has {most:g}")
