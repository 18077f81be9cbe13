"""LSM6DSO32: gyroscope and accelerometer through the tagged FIFO (ST DocID032891, registers; AN5192 for the FIFO)."""

import struct
import time
from collections.abc import Callable

from levelhead.sample import Triple
from levelhead.sources.sensors.bus import Bus, Port, at_least, blank, code_for
from levelhead.sources.sensors.fifo import Drained, Row, read_words
from levelhead.units import STANDARD_GRAVITY, factor

NAME = "LSM6DSO32"
ADDRESSES = (0x6A, 0x6B)
IDENTITY = 0x6C
FIFO_CTRL3, FIFO_CTRL4, WHO_AM_I = 0x09, 0x0A, 0x0F
CTRL1_XL, CTRL2_G, CTRL3_C = 0x10, 0x11, 0x12
OUT_TEMP_L, FIFO_STATUS1, FIFO_DATA_OUT_TAG = 0x20, 0x3A, 0x78
SW_RESET, BDU_AND_IF_INC = 0x01, 0x44  # CTRL3_C
BYPASS, CONTINUOUS = 0x00, 0x06  # FIFO_CTRL4
FIFO_WORDS, WORD = 512, 7  # a word is a tag and six bytes
OVERRUN = 0x48  # FIFO_STATUS2: FIFO_OVR_IA and the latched one
GYR_TAG, ACC_TAG = 0x01, 0x02
START_UP = 0.035  # s after power-up, table 3

# Size of a bit: table 3.
GYR_BITS = {125.0: 4.375e-3, 250.0: 8.75e-3, 500.0: 17.5e-3, 1000.0: 35e-3, 2000.0: 70e-3}  # °/s
ACC_BITS = {4.0: 0.122e-3, 8.0: 0.244e-3, 16.0: 0.488e-3, 32.0: 0.976e-3}  # g
GYR_CODES = {125.0: 0x02, 250.0: 0x00, 500.0: 0x04, 1000.0: 0x08, 2000.0: 0x0C}
ACC_CODES = {4.0: 0x00, 32.0: 0x04, 8.0: 0x08, 16.0: 0x0C}
RATES = {12.5: 1, 26.0: 2, 52.0: 3, 104.0: 4, 208.0: 5, 416.0: 6, 833.0: 7, 1667.0: 8, 3333.0: 9, 6667.0: 10}


class LSM6DSO32:
    """The chip, through a bus.

    Args:
        bus: the bus.
        address: 0x6A, or 0x6B with SDO high.
        rate: samples a second, Hz; the chip takes the next one of 12.5, 26, 52, 104, 208, 416, 833, ….
        gyr_range: 125, 250, 500, 1000 or 2000 °/s.
        acc_range: 4, 8, 16 or 32 g.
        clock: host time in s.
        wait: sleeps so many seconds.

    Raises:
        LevelheadError: a range or a rate that the chip does not have.
    """

    name = NAME

    def __init__(
        self, bus: Bus, address: int = ADDRESSES[0], *, rate: float = 208.0, gyr_range: float = 500.0,
        acc_range: float = 4.0, clock: Callable[[], float] = time.monotonic, wait: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        self.port, self._clock = Port(bus, address, NAME, wait), clock
        self.rate = at_least(rate, list(RATES), NAME)
        self._gyr_code = code_for("gyr range", gyr_range, GYR_CODES, "deg/s", NAME)
        self._acc_code = code_for("acc range", acc_range, ACC_CODES, "g", NAME)
        self.gyr_scale = GYR_BITS[gyr_range] * factor("gyr", "deg/s")
        self.acc_scale = ACC_BITS[acc_range] * STANDARD_GRAVITY
        self._gyr: Triple | None = None  # waits for its accelerometer reading

    def start(self) -> None:
        """Checks who it is, resets it, sets ranges and rate, and empties the FIFO.

        Raises:
            SensorError: nobody answers, or another chip does.
        """
        port, code = self.port, RATES[self.rate]
        port.expect(WHO_AM_I, IDENTITY)
        port.write(CTRL3_C, SW_RESET)
        port.wait(START_UP)
        port.write(CTRL3_C, BDU_AND_IF_INC)
        port.write(CTRL1_XL, code << 4 | self._acc_code)
        port.write(CTRL2_G, code << 4 | self._gyr_code)
        port.write(FIFO_CTRL3, code << 4 | code)
        self.empty()

    def empty(self) -> None:
        """Forgets what the FIFO holds; it fills again from here."""
        self._gyr = None
        self.port.write(FIFO_CTRL4, BYPASS)
        self.port.write(FIFO_CTRL4, CONTINUOUS)

    def drain(self) -> Drained:
        """All samples of the FIFO; in continuous mode an overrun drops the oldest words, and that is said.

        Raises:
            SensorError: the chip does not answer, or says nothing but zeros or ones.
        """
        low, high = self.port.read(FIFO_STATUS1, 2)
        at = self._clock()
        if low == high == 0xFF:
            raise self.port.implausible()
        if high & OVERRUN:
            self.empty()
            return Drained([], at, True)
        words = read_words(self.port, FIFO_DATA_OUT_TAG, low | (high & 0x03) << 8, WORD, self.empty)
        return Drained([], at, True) if words is None else Drained(self.rows(words), at)

    def rows(self, words: list[bytes]) -> list[Row]:
        """Gyroscope and accelerometer words, paired as they come."""
        rows: list[Row] = []
        for word in words:
            if blank(word):
                raise self.port.implausible()
            tag = word[0] >> 3
            x, y, z = struct.unpack_from("<3h", word, 1)
            if tag == GYR_TAG:
                scale = self.gyr_scale
                self._gyr = (x * scale, y * scale, z * scale)
            elif tag == ACC_TAG and self._gyr is not None:
                scale = self.acc_scale
                rows.append((self._gyr, (x * scale, y * scale, z * scale)))
                self._gyr = None
        return rows

    def latest(self) -> tuple[Triple, Triple, float]:
        """The registers as they are now, 14 bytes from 0x20: gyr (rad/s), acc (m/s²), temperature (°C).

        Raises:
            SensorError: the chip does not answer, or says nothing but zeros or ones.
        """
        t, x, y, z, a, b, c = struct.unpack("<7h", self.port.burst(OUT_TEMP_L, 14))
        g, s = self.gyr_scale, self.acc_scale
        return (x * g, y * g, z * g), (a * s, b * s, c * s), t / 256.0 + 25.0  # table 4
