"""MPU-6050: gyroscope and accelerometer through the FIFO (InvenSense RM-MPU-6000A-00 rev 4.2, register map)."""

import struct
import time
from collections.abc import Callable

from levelhead.sample import Triple
from levelhead.sources.sensors.bus import Bus, Port, at_least, blank, code_for
from levelhead.sources.sensors.fifo import Drained, Row, read_words
from levelhead.units import STANDARD_GRAVITY, factor

NAME = "MPU-6050"
ADDRESSES = (0x68, 0x69)
IDENTITY = 0x68
SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, FIFO_EN = 0x19, 0x1A, 0x1B, 0x1C, 0x23
INT_STATUS, ACCEL_XOUT_H, USER_CTRL, PWR_MGMT_1 = 0x3A, 0x3B, 0x6A, 0x6B
FIFO_COUNTH, FIFO_R_W, WHO_AM_I = 0x72, 0x74, 0x75
DEVICE_RESET, PLL_GYRO_X = 0x80, 0x01  # PWR_MGMT_1
FIFO_ENABLE, FIFO_RESET = 0x40, 0x04  # USER_CTRL
GYR_AND_ACC = 0x78  # FIFO_EN: XG, YG, ZG, ACCEL
FIFO_SIZE, ROW = 1024, 12
SIX = struct.Struct(">6h")
START_UP = 0.1  # s after a reset (register 107)

# LSB per unit: PS-MPU-6000A-00 rev 3.4, 6.1 and 6.2.
GYR_COUNTS = {250.0: 131.0, 500.0: 65.5, 1000.0: 32.8, 2000.0: 16.4}  # °/s
ACC_COUNTS = {2.0: 16384.0, 4.0: 8192.0, 8.0: 4096.0, 16.0: 2048.0}  # g
GYR_CODES = {dps: code << 3 for code, dps in enumerate(GYR_COUNTS)}
ACC_CODES = {g: code << 3 for code, g in enumerate(ACC_COUNTS)}
BANDWIDTHS = {184.0: 1, 94.0: 2, 44.0: 3, 21.0: 4, 10.0: 5, 5.0: 6}  # Hz of the accelerometer, register 26
RATES = [1000.0 / (1 + divider) for divider in range(256)]


def bandwidth_for(rate: float) -> int:
    """The filter setting with the highest bandwidth below half the rate: what is above it would come back as noise."""
    return next((code for hertz, code in BANDWIDTHS.items() if hertz <= 0.5 * rate), 6)


class MPU6050:
    """The chip, through a bus.

    Args:
        bus: the bus.
        address: 0x68, or 0x69 with AD0 high.
        rate: samples a second, Hz; the chip takes the next one of 1000/n (``rate`` tells which).
        gyr_range: 250, 500, 1000 or 2000 °/s.
        acc_range: 2, 4, 8 or 16 g.
        clock: host time in s.
        wait: sleeps so many seconds.

    Raises:
        LevelheadError: a range or a rate that the chip does not have.
    """

    name = NAME

    def __init__(
        self, bus: Bus, address: int = ADDRESSES[0], *, rate: float = 200.0, gyr_range: float = 500.0,
        acc_range: float = 4.0, clock: Callable[[], float] = time.monotonic, wait: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        self.port, self._clock = Port(bus, address, NAME, wait), clock
        self.rate = at_least(rate, RATES, NAME)
        self._gyr_code = code_for("gyr range", gyr_range, GYR_CODES, "deg/s", NAME)
        self._acc_code = code_for("acc range", acc_range, ACC_CODES, "g", NAME)
        self.gyr_scale = factor("gyr", "deg/s") / GYR_COUNTS[gyr_range]
        self.acc_scale = STANDARD_GRAVITY / ACC_COUNTS[acc_range]

    def start(self) -> None:
        """Checks who it is, wakes it, sets ranges, filter and rate, and empties the FIFO.

        Raises:
            SensorError: nobody answers, or another chip does.
        """
        port = self.port
        port.expect(WHO_AM_I, IDENTITY, 0x7E)
        port.write(PWR_MGMT_1, DEVICE_RESET)
        port.wait(START_UP)
        port.write(PWR_MGMT_1, PLL_GYRO_X)
        port.write(CONFIG, bandwidth_for(self.rate))
        port.write(SMPLRT_DIV, round(1000.0 / self.rate) - 1)
        port.write(GYRO_CONFIG, self._gyr_code)
        port.write(ACCEL_CONFIG, self._acc_code)
        port.write(FIFO_EN, GYR_AND_ACC)
        self.empty()

    def empty(self) -> None:
        """Forgets what the FIFO holds; it fills again from here."""
        self.port.write(USER_CTRL, FIFO_RESET)
        self.port.write(USER_CTRL, FIFO_ENABLE)

    def drain(self) -> Drained:
        """All whole samples of the FIFO. After an overflow nobody knows where a sample begins (1024 bytes are no
        multiple of 12): the FIFO is emptied, and that is said.

        Raises:
            SensorError: the chip does not answer.
        """
        count = int.from_bytes(self.port.read(FIFO_COUNTH, 2), "big")
        at = self._clock()
        if count > FIFO_SIZE - ROW:
            if count > FIFO_SIZE:
                raise self.port.implausible()
            self.empty()
            return Drained([], at, True)
        words = read_words(self.port, FIFO_R_W, count // ROW, ROW, self.empty)
        return Drained([], at, True) if words is None else Drained([self.decode(word) for word in words], at)

    def decode(self, row: bytes) -> Row:
        """12 bytes, big-endian: accelerometer x, y, z, gyroscope x, y, z, in SI units.

        Raises:
            SensorError: nothing but zeros or ones, which is no reading.
        """
        if blank(row):
            raise self.port.implausible()
        a, b, c, x, y, z = SIX.unpack(row)
        g, s = self.gyr_scale, self.acc_scale
        return (x * g, y * g, z * g), (a * s, b * s, c * s)

    def latest(self) -> tuple[Triple, Triple, float]:
        """The registers as they are now, in one burst of 14 bytes from 0x3B: gyr (rad/s), acc (m/s²), temperature (°C).

        Raises:
            SensorError: the chip does not answer, or says nothing but zeros or ones.
        """
        data = self.port.burst(ACCEL_XOUT_H, 14)
        (temperature,) = struct.unpack(">h", data[6:8])
        gyr, acc = self.decode(data[:6] + data[8:])
        return gyr, acc, temperature / 340.0 + 36.53  # register 65
