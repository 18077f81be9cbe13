"""The I²C bus as a driver sees it: four methods, retries that are counted, and errors with the parts to check."""

import errno
import time
from collections.abc import Callable, Sequence
from typing import Protocol, cast

from levelhead.errors import LevelheadError
from levelhead.open_types import Untyped

BLOCK = 32  # bytes in one SMBus block read
RETRIES = 3  # further tries of a transfer before it counts as failed


class Bus(Protocol):
    """Methods of smbus2.SMBus, with its own signatures; addresses are the 7-bit ones.

    A transfer that fails raises OSError: EREMOTEIO where nothing acknowledges the address, ETIMEDOUT where a line is
    held down.
    """

    def read_byte_data(self, i2c_addr: int, register: int) -> int: ...  # noqa: D102
    def write_byte_data(self, i2c_addr: int, register: int, value: int) -> None: ...  # noqa: D102
    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> Sequence[int]: ...  # noqa: D102
    def close(self) -> None: ...  # noqa: D102


class PlainBus(Bus, Protocol):
    """A bus with transfers that name no register, which ``smbus2.SMBus`` has as well."""

    def i2c_rdwr(self, *i2c_msgs: Untyped) -> None: ...  # noqa: D102


class SensorError(LevelheadError):
    """A chip that cannot be used, now or ever.

    Attributes:
        kind: the health event that it is: "bus_error", "bus_stuck", "wrong_chip" or "implausible".
    """

    def __init__(self, kind: str, words: str) -> None:
        super().__init__(words)
        self.kind = kind


def open_bus(number: int) -> Bus:
    """The bus /dev/i2c-NUMBER, through smbus2 (extra ``levelhead[live]``).

    Raises:
        LevelheadError: smbus2 is not installed, there is no such bus, or it may not be opened.
    """
    try:
        from smbus2 import SMBus
    except ImportError:
        raise LevelheadError("sensors on I²C need smbus2: pip install 'levelhead[live]'") from None
    try:
        bus: Bus = SMBus(number)
    except FileNotFoundError:
        raise LevelheadError(
            f"there is no I²C bus /dev/i2c-{number}; switch I²C on, or name another bus, such as mpu6050@0"
        ) from None
    except OSError as error:
        raise LevelheadError(
            f"cannot open /dev/i2c-{number}: {error.strerror}; the user must be in the group i2c"
        ) from None
    return bus


class Port:
    """One chip on a bus: transfers are tried again when they fail, and counted.

    Args:
        bus: the bus.
        address: the chip's 7-bit address.
        chip: its name, for sentences.
        wait: sleeps so many seconds; a test gives its own.

    Attributes:
        retried: transfers that failed and were tried again, so far.
        failed: transfers that failed for good, so far.
    """

    def __init__(self, bus: Bus, address: int, chip: str, wait: Callable[[float], None] = time.sleep) -> None:
        self.bus, self.address, self.chip, self.wait = bus, address, chip, wait
        self.retried = self.failed = 0

    def read(self, register: int, length: int) -> bytes:
        """``length`` bytes from ``register`` on, tried again where the bus fails.

        Raises:
            SensorError: it failed ``RETRIES`` + 1 times.
        """
        for _ in range(RETRIES):
            try:
                return bytes(self.bus.read_i2c_block_data(self.address, register, length))
            except OSError:
                self.retried += 1
        return self.read_once(register, length)

    def read_once(self, register: int, length: int) -> bytes:
        """The same without a second try, for a FIFO, where the bytes of a first one may be gone.

        Raises:
            SensorError: it failed.
        """
        try:
            return bytes(self.bus.read_i2c_block_data(self.address, register, length))
        except OSError as error:
            raise self._failure(error) from None

    def write(self, register: int, value: int) -> None:
        """One byte into a register.

        Raises:
            SensorError: it failed ``RETRIES`` + 1 times.
        """
        for _ in range(RETRIES):
            try:
                return self.bus.write_byte_data(self.address, register, value)
            except OSError:
                self.retried += 1
        try:
            return self.bus.write_byte_data(self.address, register, value)
        except OSError as error:
            raise self._failure(error) from None

    def receive(self, length: int) -> bytes:
        """``length`` bytes without the name of a register.

        Raises:
            SensorError: it failed.
            LevelheadError: smbus2 is not installed, or the bus has no such transfers.
        """
        message = _messages().read(self.address, length)
        self._transfer(message)
        return bytes(message)

    def send(self, data: bytes) -> None:
        """Bytes without the name of a register; raises as ``receive`` does."""
        self._transfer(_messages().write(self.address, data))

    def _transfer(self, message: Untyped) -> None:
        if not hasattr(self.bus, "i2c_rdwr"):
            raise LevelheadError(f"the {self.chip} needs a bus with i2c_rdwr, such as smbus2.SMBus")
        try:
            cast(PlainBus, self.bus).i2c_rdwr(message)
        except OSError as error:
            raise self._failure(error) from None

    def expect(self, register: int, identity: int, mask: int = 0xFF) -> None:
        """Makes sure that the chip is the one that it should be.

        Raises:
            SensorError: no chip answers, or another one does.
        """
        found = self.read(register, 1)[0]
        if found & mask != identity:
            raise SensorError(
                "wrong_chip",
                f"the chip at 0x{self.address:02x} has identity 0x{found:02x}; expected 0x{identity:02x}, "
                f"a {self.chip}: check its name and address",
            )

    def burst(self, register: int, length: int) -> bytes:
        """A burst of readings; one that is all zeros or all ones comes from a chip or a line that is off.

        Raises:
            SensorError: the transfer failed, or nothing but zeros or ones came, again and again.
        """
        for _ in range(RETRIES + 1):
            data = self.read(register, length)
            if not blank(data):
                return data
            self.retried += 1
        raise self.implausible()

    def implausible(self) -> SensorError:
        """The error for readings of nothing but zeros or ones."""
        self.failed += 1
        return SensorError(
            "implausible",
            f"the {self.chip} at 0x{self.address:02x} gives nothing but zeros or ones; it lost its power",
        )

    def _failure(self, error: OSError) -> SensorError:
        self.failed += 1
        where = f"the {self.chip} at 0x{self.address:02x}"
        if error.errno in (errno.ETIMEDOUT, errno.EBUSY, errno.EAGAIN):
            return SensorError("bus_stuck", f"the bus of {where} is stuck ({error.strerror}): a line is held down")
        return SensorError("bus_error", f"{where} does not answer ({error.strerror}); check power, wires and address")


def _messages() -> Untyped:
    """smbus2's class of messages."""
    try:
        from smbus2 import i2c_msg
    except ImportError:
        raise LevelheadError("this chip needs smbus2: pip install 'levelhead[live]'") from None
    return i2c_msg


def blank(data: bytes) -> bool:
    """Whether the bytes are all 0x00 or all 0xFF."""
    return data.count(data[0]) == len(data) and data[0] in (0x00, 0xFF)


def code_for(what: str, wanted: float, codes: dict[float, int], unit: str, chip: str) -> int:
    """The register code of a setting that the chip has.

    Raises:
        LevelheadError: it has none such; the sentence names those that it has.
    """
    if wanted not in codes:
        known = ", ".join(f"{value:g}" for value in sorted(codes))
        raise LevelheadError(f"{what} {wanted:g} {unit} does not exist; the {chip} has {known}")
    return codes[wanted]


def at_least(wanted: float, rates: Sequence[float], chip: str) -> float:
    """The lowest of ``rates`` (Hz) that is not below ``wanted``.

    Raises:
        LevelheadError: the chip is not so fast, or the rate is none.
    """
    enough = [rate for rate in rates if rate >= wanted * (1.0 - 1e-6)]
    if not wanted > 0.0 or not enough:
        raise LevelheadError(
            f"the {chip} cannot give {wanted:g} samples a second; expected {min(rates):g} to {max(rates):g}"
        )
    return min(enough)
