"""Gyroscope and accelerometer through a FIFO: one driver, and the facts in which the chips differ."""

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

from levelhead.sample import Triple, Wxyz
from levelhead.sources.sensors.bus import BLOCK, Bus, Port, SensorError, at_least, blank, code_for
from levelhead.units import DEGREE

Counts = tuple[int, int, int]
MAX_COUNT = 32767.0  # of a 16-bit reading
BLANK_COUNTS = (0, -1)  # a reading of nothing but zero bits or one bits


class FifoRow(NamedTuple):
    """One sample of the FIFO in counts."""

    gyr: Counts
    acc: Counts


class Registers(NamedTuple):
    """The output registers: counts, and the temperature in °C."""

    gyr: Counts
    acc: Counts
    temperature: float


class FifoLevel(NamedTuple):
    """How full the FIFO is: whole words, and whether samples were lost because it was full."""

    words: int
    overflow: bool


class ChipSettings(NamedTuple):
    """Settings of a chip: samples a second (Hz) and the register codes of the two full scales."""

    rate: float
    gyr_code: int
    acc_code: int


class FifoChip(NamedTuple):
    """A chip with gyroscope, accelerometer and FIFO, as data.

    Attributes:
        name: as it is sold.
        addresses: on the bus; the first one is usual.
        rates: samples a second that it has, Hz.
        gyr_bits: full scale in °/s → rad/s per count.
        acc_bits: full scale in g → m/s² per count.
        gyr_codes: full scale in °/s → register code.
        acc_codes: full scale in g → register code.
        configure: identifies the chip, resets it, writes the settings.
        empty: discards the content of the FIFO.
        level_register: of the two bytes of the FIFO's level.
        level: those bytes → FifoLevel; None: bytes that the chip cannot give.
        fifo_register: where the FIFO is read.
        word_size: bytes of a word of the FIFO.
        rows: words → complete rows, and the words that wait for their partner.
        output_register: first of the output registers.
        output_size: bytes of the output registers.
        output: those bytes → Registers.
    """

    name: str
    addresses: tuple[int, ...]
    rates: Sequence[float]
    gyr_bits: dict[float, float]
    acc_bits: dict[float, float]
    gyr_codes: dict[float, int]
    acc_codes: dict[float, int]
    configure: Callable[[Port, ChipSettings], None]
    empty: Callable[[Port], None]
    level_register: int
    level: Callable[[bytes], FifoLevel | None]
    fifo_register: int
    word_size: int
    rows: Callable[[list[bytes]], tuple[list[FifoRow], list[bytes]]]
    output_register: int
    output_size: int
    output: Callable[[bytes], Registers]


class FifoReading(NamedTuple):
    """The content of a FIFO.

    Attributes:
        rows: (gyr in rad/s, acc in m/s²), the oldest first.
        time: host time of the reading, s.
        lost: whether samples are lost, because the FIFO overflowed or a transfer broke off.
        mag: µT, the newest of a chip that measures the field as well, or None.
        attitude: the newest of a chip with a filter of its own, wxyz, or None.
    """

    rows: list[tuple[Triple, Triple]]
    time: float
    lost: bool = False
    mag: Triple | None = None
    attitude: Wxyz | None = None


class FifoImu:
    """A chip on a bus, read through its FIFO.

    Args:
        chip: which one.
        bus: the bus.
        address: None: the chip's usual one.
        rate: samples a second, Hz; the chip takes the next one that it has (see ``rate``).
        gyr_range: full scale in °/s.
        acc_range: full scale in g.
        clock: host time in s.
        wait: sleeps for a number of seconds.

    Attributes:
        name: of the chip.
        gyr_scale: rad/s per count.
        acc_scale: m/s² per count.
        gyr_range: full scale in °/s.
        acc_range: full scale in m/s².

    Raises:
        LevelheadError: a range or a rate that the chip does not have.
    """

    def __init__(
        self, chip: FifoChip, bus: Bus, address: int | None = None, *, rate: float = 200.0, gyr_range: float = 500.0,
        acc_range: float = 4.0, clock: Callable[[], float] = time.monotonic, wait: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        self._chip, self._clock, self.name = chip, clock, chip.name
        self.port = Port(bus, chip.addresses[0] if address is None else address, chip.name, wait)
        self.rate = at_least(rate, chip.rates, chip.name)
        gyr_code = code_for("gyr range", gyr_range, chip.gyr_codes, "deg/s", chip.name)
        acc_code = code_for("acc range", acc_range, chip.acc_codes, "g", chip.name)
        self._settings = ChipSettings(self.rate, gyr_code, acc_code)
        self.gyr_scale, self.acc_scale = chip.gyr_bits[gyr_range], chip.acc_bits[acc_range]
        self.gyr_range = self.gyr_scale * MAX_COUNT / DEGREE
        self.acc_range = self.acc_scale * MAX_COUNT
        self._unpaired: list[bytes] = []

    def start(self) -> None:
        """Identifies the chip, wakes it, sets ranges, filters and rate, and empties the FIFO.

        Raises:
            SensorError: no chip answers, or another one does.
        """
        self._chip.configure(self.port, self._settings)
        self.empty()

    def empty(self) -> None:
        """Discards the content of the FIFO; it fills again from here."""
        self._unpaired = []
        self._chip.empty(self.port)

    def drain(self) -> FifoReading:
        """All whole samples of the FIFO. After an overflow it is emptied, because the lost samples are unknown
        (or, where the size of the FIFO is not a multiple of a sample's, where one begins), and the reading reports it.

        Raises:
            SensorError: the chip does not answer, or gives nothing but zeros or ones.
        """
        chip = self._chip
        data = self.port.read(chip.level_register, 2)
        now = self._clock()
        level = chip.level(data)
        if level is None:
            raise self.port.implausible()
        if level.overflow:
            self.empty()
            return FifoReading([], now, True)
        words = self._read_words(level.words)
        if words is None:
            return FifoReading([], now, True)
        for word in words:
            if blank(word):
                raise self.port.implausible()
        rows, self._unpaired = chip.rows(self._unpaired + words if self._unpaired else words)
        return FifoReading([(self._rate(row.gyr), self._force(row.acc)) for row in rows], now)

    def _read_words(self, count: int) -> list[bytes] | None:
        """``count`` words, in as few block reads as possible.

        A transfer that fails is not tried again: its bytes may be gone, and the place of the next word is unknown.
        The FIFO is emptied then, and the answer is None.

        Raises:
            SensorError: the FIFO cannot even be emptied.
        """
        register, size = self._chip.fifo_register, self._chip.word_size
        words: list[bytes] = []
        most = BLOCK // size
        while (left := count - len(words)) > 0:
            length = size * (left if left < most else most)
            try:
                data = self.port.read_once(register, length)
            except SensorError:
                self.empty()
                return None
            words += [data] if length == size else [data[start : start + size] for start in range(0, length, size)]
        return words

    def _rate(self, counts: Counts) -> Triple:
        x, y, z = counts
        scale = self.gyr_scale
        return x * scale, y * scale, z * scale

    def _force(self, counts: Counts) -> Triple:
        a, b, c = counts
        scale = self.acc_scale
        return a * scale, b * scale, c * scale
