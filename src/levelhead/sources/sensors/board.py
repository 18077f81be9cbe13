"""A board: an inertial chip, and beside it perhaps a magnetometer and a barometer, as one source of samples."""

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from levelhead.axis_map import IDENTITY, AxisMap
from levelhead.errors import LevelheadError, nearest
from levelhead.open_types import Untyped
from levelhead.sample import Sample, Triple
from levelhead.sources.sensors.ak09916 import AK09916
from levelhead.sources.sensors.ak8963 import AK8963
from levelhead.sources.sensors.bmp280 import BMP280
from levelhead.sources.sensors.bmp390 import BMP390
from levelhead.sources.sensors.bno055 import BNO055
from levelhead.sources.sensors.bno085 import BNO085
from levelhead.sources.sensors.bus import Bus, Port, SensorError, open_bus
from levelhead.sources.sensors.compass import HMC5883L, QMC5883L
from levelhead.sources.sensors.fifo_imu import FifoReading
from levelhead.sources.sensors.icm20948 import ICM20948
from levelhead.sources.sensors.icm42688 import ICM42688
from levelhead.sources.sensors.lis3mdl import LIS3MDL
from levelhead.sources.sensors.lsm6dso32 import LSM6DSO32
from levelhead.sources.sensors.lsm6dsox import LSM6DSOX
from levelhead.sources.sensors.mpu6050 import MPU6050
from levelhead.sources.sensors.mpu9250 import MPU9250
from levelhead.sources.sensors.sample_clock import SampleClock


class Inertial(Protocol):
    """The interface of drivers of gyroscope and accelerometer; ranges in °/s and m/s²."""

    name: str
    port: Port
    rate: float
    gyr_range: float
    acc_range: float

    def start(self) -> None: ...  # noqa: D102
    def drain(self) -> FifoReading: ...  # noqa: D102


class Magnetometer(Protocol):
    """The interface of drivers of magnetometers."""

    name: str
    port: Port
    rate: float

    def start(self) -> None: ...  # noqa: D102
    def read(self) -> Triple | None: ...  # noqa: D102


INERTIAL: dict[str, Callable[..., Inertial]] = {
    "mpu6050": MPU6050, "mpu9250": MPU9250, "lsm6dsox": LSM6DSOX, "lsm6dso32": LSM6DSO32, "icm20948": ICM20948,
    "icm42688": ICM42688, "bno055": BNO055, "bno085": BNO085,
}  # fmt: skip
MAGNETIC: dict[str, type[Untyped]] = {
    "hmc5883l": HMC5883L, "qmc5883l": QMC5883L, "lis3mdl": LIS3MDL, "ak8963": AK8963, "ak09916": AK09916,
}  # fmt: skip
BAROMETRIC: dict[str, type[Untyped]] = {"bmp280": BMP280, "bmp390": BMP390}
BUILT_IN = {"mpu9250": "ak8963", "icm20948": "ak09916"}  # magnetometers in the same package
CHIPS = (*INERTIAL, *MAGNETIC, *BAROMETRIC)
RETRY = 1.0  # s until a chip that failed is set up anew


class BoardSpec(NamedTuple):
    """A board in words, taken apart.

    Attributes:
        inertial: the chip with gyroscope and accelerometer.
        mag: the magnetometer, or None.
        baro: the barometer, or None.
        bus: number of the I²C bus.
        address: of the inertial chip; None: its usual one.
    """

    inertial: str
    mag: str | None
    baro: str | None
    bus: int
    address: int | None


def parse_board(text: str) -> BoardSpec:
    """A board from words such as ``mpu6050``, ``mpu6050+hmc5883l+bmp280``, ``icm20948@0`` or ``mpu6050@1:0x69``.

    Behind @ are the number of the bus, 1 by default, and the address of the inertial chip. The ICM-20948 and the
    MPU-9250 bring a magnetometer of their own.

    Raises:
        LevelheadError: an unknown chip (the nearest is named), no inertial one, two of a kind, a bus without a number.
    """
    chips, _, place = text.lower().replace("-", "").partition("@")
    number, _, address = place.partition(":")
    try:
        bus = int(number) if number else 1
        where = int(address, 0) if address else None
    except ValueError:
        raise LevelheadError(
            f"'{text}': there is no bus behind @; expected such as mpu6050@1 or mpu6050@1:0x69"
        ) from None
    names = [name for name in chips.split("+") if name]
    for name in names:
        if name not in CHIPS:
            raise LevelheadError(f"there is no driver for '{name}'; {nearest(name, CHIPS)}")
    inertial = [name for name in names if name in INERTIAL]
    mags = [name for name in names if name in MAGNETIC]
    baros = [name for name in names if name in BAROMETRIC]
    if len(inertial) != 1 or len(mags) > 1 or len(baros) > 1:
        raise LevelheadError(
            f"'{text}' is not a board; expected one of {', '.join(INERTIAL)}, and with + at most one magnetometer "
            f"({', '.join(MAGNETIC)}) and one barometer ({', '.join(BAROMETRIC)})"
        )
    mag = mags[0] if mags else BUILT_IN.get(inertial[0])
    return BoardSpec(inertial[0], mag, baros[0] if baros else None, bus, where)


class Board:
    """A source of samples: ``poll`` gives those that are new, with stamps of a clock that was fitted to the chip's.

    Args:
        inertial: driver of gyroscope and accelerometer.
        mag: driver of a magnetometer, or None.
        baro: driver of a barometer, or None.
        axes: how the board sits on the body.
        clock: host time in s, the same as the drivers'.

    Attributes:
        name: the chips.
        rate: samples a second.
        gyr_range: full scale in °/s.
        acc_range: full scale in m/s².
        lost: how often samples were lost, because a FIFO ran over or a transfer broke off.
    """

    ended = False

    def __init__(
        self, inertial: Inertial, mag: Magnetometer | None = None, baro: BMP280 | BMP390 | None = None, *,
        axes: AxisMap = IDENTITY, clock: Callable[[], float] = time.monotonic, bus: Bus | None = None,
    ) -> None:  # fmt: skip
        self._inertial, self._mag, self._baro, self._axes, self._clock, self._bus = (
            inertial,
            mag,
            baro,
            axes,
            clock,
            bus,
        )
        self.drivers: Sequence[Untyped] = [one for one in (inertial, mag, baro) if one is not None]
        self.name = "+".join(one.name for one in self.drivers)
        self.rate = inertial.rate
        self.gyr_range, self.acc_range = inertial.gyr_range, inertial.acc_range
        self.lost = 0
        self._aligned = axes == IDENTITY
        self._clock_fit = SampleClock(self.rate)
        self._mag_every = 1.0 / mag.rate if mag is not None else 0.0
        self._mag_due = -float("inf")
        self._troubles: list[tuple[str, str]] = []
        self._broken: dict[str, float] = {}  # chips that failed, and when they are tried again

    @property
    def retried(self) -> int:
        """Transfers that failed and were tried again."""
        return sum(one.port.retried for one in self.drivers)

    @property
    def failed(self) -> int:
        """Transfers that failed for good."""
        return sum(one.port.failed for one in self.drivers)

    def start(self) -> None:
        """Sets up all chips; the content of the FIFOs is discarded.

        Raises:
            SensorError: a chip does not answer, or is another one.
        """
        for driver in self.drivers:
            driver.start()
        self._clock_fit.restart()

    restart = start

    def poll(self) -> list[Sample]:
        """The samples that are new, the oldest first; the last one carries new readings of magnetometer and barometer.

        Raises:
            SensorError: the inertial chip does not answer, or gives impossible readings.
        """
        reading = self._inertial.drain()
        rows, at = reading.rows, reading.time
        if reading.lost:
            self.lost += 1
            self._clock_fit.restart()
            self._troubles.append(
                ("samples_lost", f"samples of the {self._inertial.name} were lost, an unknown number")
            )
        if not rows:
            return []
        stamps = self._clock_fit.stamps(len(rows), at)
        mag = reading.mag if self._mag is None else self._read_mag(self._mag, at)
        weather = None if self._baro is None else self._read_auxiliary(self._baro, at)
        pressure, temperature = weather if weather is not None else (None, None)
        gyr, acc = rows.pop()
        last = Sample(stamps.pop(), gyr, acc, mag, pressure, temperature, reading.attitude)
        samples = [Sample(t, gyr, acc) for t, (gyr, acc) in zip(stamps, rows, strict=True)] if rows else []
        samples.append(last)
        return samples if self._aligned else [self._axes.apply(sample) for sample in samples]

    def _read_mag(self, driver: Magnetometer, now: float) -> Triple | None:
        """The magnetometer's reading, asked for no more often than it has new ones."""
        if now < self._mag_due:
            return None
        mag: Triple | None = self._read_auxiliary(driver, now)
        if mag is not None:
            self._mag_due = now + 0.8 * self._mag_every
        return mag

    def _read_auxiliary(self, driver: Untyped, now: float) -> Untyped:
        """The new reading of a chip beside the inertial one. A fault is reported, and the chip set up a second later.

        Gyroscope and accelerometer go on without it.
        """
        if now < self._broken.get(driver.name, now):
            return None
        try:
            if self._broken.pop(driver.name, None) is not None:
                driver.start()
            return driver.read()
        except SensorError as error:
            self._broken[driver.name] = now + RETRY
            self._troubles.append((error.kind, str(error)))
            return None

    def troubles(self) -> list[tuple[str, str]]:
        """Faults since the last call that did not end the source: (event, sentence)."""
        found = self._troubles
        if found:
            self._troubles = []
        return found

    def close(self) -> None:
        """Lets go of the bus."""
        if self._bus is not None:
            self._bus.close()

    def __enter__(self) -> "Board":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def assemble_board(
    wanted: BoardSpec, bus: Bus, *, rate: float = 200.0, gyr_range: float = 500.0, acc_range: float = 4.0,
    axes: AxisMap = IDENTITY, clock: Callable[[], float] = time.monotonic, wait: Callable[[float], None] = time.sleep,
) -> Board:  # fmt: skip
    """The drivers of a board on a bus, not started yet.

    Args:
        wanted: which chips.
        bus: the bus that they are on, which the board closes.
        rate: samples a second, Hz.
        gyr_range: full scale in °/s.
        acc_range: full scale in g.
        axes: how the board sits on the body.
        clock: host time in s.
        wait: sleeps so many seconds.

    Raises:
        LevelheadError: a rate or a range that the chip does not have.
    """
    inertial = INERTIAL[wanted.inertial](
        bus, wanted.address, rate=rate, gyr_range=gyr_range, acc_range=acc_range, clock=clock, wait=wait
    )
    mag = None
    if wanted.mag is not None:
        mag = MAGNETIC[wanted.mag](bus, wait=wait, **({"clock": clock} if wanted.mag == "hmc5883l" else {}))
    baro = None if wanted.baro is None else BAROMETRIC[wanted.baro](bus, clock=clock, wait=wait)
    return Board(inertial, mag, baro, axes=axes, clock=clock, bus=bus)


def open_board(
    text: str, *, rate: float = 200.0, gyr_range: float = 500.0, acc_range: float = 4.0, axes: AxisMap = IDENTITY
) -> Board:
    """A board in words on a real bus, started.

    Args:
        text: as for ``parse_board``: "mpu6050", "mpu6050+hmc5883l@1:0x69".
        rate: samples a second, Hz.
        gyr_range: full scale in °/s.
        acc_range: full scale in g.
        axes: how the board sits on the body.

    Raises:
        LevelheadError: no such chip, bus, rate or range; no answer, or that of another chip.
    """
    wanted = parse_board(text)
    board = assemble_board(wanted, open_bus(wanted.bus), rate=rate, gyr_range=gyr_range, acc_range=acc_range, axes=axes)
    try:
        board.start()
    except LevelheadError:
        board.close()
        raise
    return board
