"""ICM-20948: gyroscope and accelerometer through the FIFO, and the AK09916 magnetometer inside it (TDK DS-000189).

The magnetometer is reached directly, in bypass mode, as a chip of its own at 0x0C.
"""

import struct
import time
from collections.abc import Callable
from typing import ClassVar

from levelhead.sample import Triple
from levelhead.sources.sensors.bus import Bus, Port, at_least, blank, code_for
from levelhead.sources.sensors.fifo import Drained, Row, read_words
from levelhead.units import STANDARD_GRAVITY, factor

NAME = "ICM-20948"
ADDRESSES = (0x69, 0x68)
IDENTITY = 0xEA
REG_BANK_SEL = 0x7F
# Bank 0.
WHO_AM_I, USER_CTRL, PWR_MGMT_1, PWR_MGMT_2, INT_PIN_CFG, INT_STATUS_2 = 0x00, 0x03, 0x06, 0x07, 0x0F, 0x1B
ACCEL_XOUT_H, FIFO_EN_2, FIFO_RST, FIFO_MODE, FIFO_COUNTH, FIFO_R_W = 0x2D, 0x67, 0x68, 0x69, 0x70, 0x72
# Bank 2.
GYRO_SMPLRT_DIV, GYRO_CONFIG_1, ACCEL_SMPLRT_DIV_1, ACCEL_SMPLRT_DIV_2, ACCEL_CONFIG = 0x00, 0x01, 0x10, 0x11, 0x14
DEVICE_RESET, AUTO_CLOCK = 0x80, 0x01  # PWR_MGMT_1
FIFO_ENABLE, BYPASS_EN = 0x40, 0x02
GYR_AND_ACC = 0x1E  # FIFO_EN_2: ACCEL, GYRO_Z, GYRO_Y, GYRO_X
FIFO_SIZE, ROW = 512, 12
START_UP = 0.1  # s, table 1: register read and write after power-up

# LSB per unit: tables 1 and 2.
GYR_COUNTS = {250.0: 131.0, 500.0: 65.5, 1000.0: 32.8, 2000.0: 16.4}  # °/s
ACC_COUNTS = {2.0: 16384.0, 4.0: 8192.0, 8.0: 4096.0, 16.0: 2048.0}  # g
GYR_CODES = {dps: code << 1 for code, dps in enumerate(GYR_COUNTS)}
ACC_CODES = {g: code << 1 for code, g in enumerate(ACC_COUNTS)}
BANDWIDTHS = {196.6: 0, 151.8: 1, 119.5: 2, 51.2: 3, 23.9: 4, 11.6: 5, 5.7: 6}  # Hz, table 16
RATES = [1125.0 / (1 + divider) for divider in range(256)]


class ICM20948:
    """The chip, through a bus. Its magnetometer is ``AK09916``, on the same bus once this one has started.

    Args:
        bus: the bus.
        address: 0x69, or 0x68 with AD0 low.
        rate: samples a second, Hz; the chip takes the next one of 1125/n (``rate`` tells which).
        gyr_range: 250, 500, 1000 or 2000 °/s.
        acc_range: 2, 4, 8 or 16 g.
        clock: host time in s.
        wait: sleeps so many seconds.

    Raises:
        LevelheadError: a range or a rate that the chip does not have.
    """

    name = NAME

    def __init__(
        self, bus: Bus, address: int = ADDRESSES[0], *, rate: float = 225.0, gyr_range: float = 500.0,
        acc_range: float = 4.0, clock: Callable[[], float] = time.monotonic, wait: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        self.port, self._clock = Port(bus, address, NAME, wait), clock
        self.rate = at_least(rate, RATES, NAME)
        self._gyr_code = code_for("gyr range", gyr_range, GYR_CODES, "deg/s", NAME)
        self._acc_code = code_for("acc range", acc_range, ACC_CODES, "g", NAME)
        self.gyr_scale = factor("gyr", "deg/s") / GYR_COUNTS[gyr_range]
        self.acc_scale = STANDARD_GRAVITY / ACC_COUNTS[acc_range]

    def start(self) -> None:
        """Checks who it is, wakes it, sets ranges, filters and rate, opens the way to the magnetometer.

        Raises:
            SensorError: nobody answers, or another chip does.
        """
        port = self.port
        port.write(REG_BANK_SEL, 0x00)
        port.expect(WHO_AM_I, IDENTITY)
        port.write(PWR_MGMT_1, DEVICE_RESET)
        port.wait(START_UP)
        port.write(PWR_MGMT_1, AUTO_CLOCK)
        port.write(PWR_MGMT_2, 0x00)
        port.write(INT_PIN_CFG, BYPASS_EN)
        filters = next((code for hertz, code in BANDWIDTHS.items() if hertz <= 0.5 * self.rate), 6) << 3 | 0x01
        divider = round(1125.0 / self.rate) - 1
        port.write(REG_BANK_SEL, 0x20)
        port.write(GYRO_SMPLRT_DIV, divider)
        port.write(GYRO_CONFIG_1, filters | self._gyr_code)
        port.write(ACCEL_SMPLRT_DIV_1, divider >> 8)
        port.write(ACCEL_SMPLRT_DIV_2, divider & 0xFF)
        port.write(ACCEL_CONFIG, max(filters, 0x09) | self._acc_code)  # its code 0 is another bandwidth
        port.write(REG_BANK_SEL, 0x00)
        port.write(FIFO_MODE, 0x1F)  # snapshot: when full, new samples are dropped and old ones stay whole
        port.write(FIFO_EN_2, GYR_AND_ACC)
        port.write(USER_CTRL, FIFO_ENABLE)
        self.empty()

    def empty(self) -> None:
        """Forgets what the FIFO holds; it fills again from here."""
        self.port.write(FIFO_RST, 0x1F)
        self.port.write(FIFO_RST, 0x00)

    def drain(self) -> Drained:
        """All whole samples of the FIFO; when it was full, samples are missing behind them: they are given up as well.

        Raises:
            SensorError: the chip does not answer, or says nothing but zeros or ones.
        """
        count = int.from_bytes(self.port.read(FIFO_COUNTH, 2), "big")
        at = self._clock()
        if count > FIFO_SIZE:
            raise self.port.implausible()
        if count > FIFO_SIZE - ROW:
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
        a, b, c, x, y, z = struct.unpack(">6h", row)
        g, s = self.gyr_scale, self.acc_scale
        return (x * g, y * g, z * g), (a * s, b * s, c * s)

    def latest(self) -> tuple[Triple, Triple, float]:
        """The registers as they are now, in one burst of 14 bytes from 0x2D: gyr (rad/s), acc (m/s²), temperature (°C).

        Raises:
            SensorError: the chip does not answer, or says nothing but zeros or ones.
        """
        data = self.port.burst(ACCEL_XOUT_H, 14)
        (temperature,) = struct.unpack(">h", data[12:])
        gyr, acc = self.decode(data[:12])
        return gyr, acc, temperature / 333.87 + 21.0  # table 3


class AK09916:
    """The magnetometer inside, through the bypass; its axes are turned to those of the other two sensors.

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
            SensorError: nobody answers, or another chip does.
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
