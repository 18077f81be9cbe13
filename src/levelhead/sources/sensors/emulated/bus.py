"""The emulated bus: smbus2's methods and limits, and faults on demand."""

import errno
import os
from collections.abc import Sequence
from typing import Literal, Protocol

from levelhead.open_types import Untyped
from levelhead.sources.sensors.bus import BLOCK

READ = 0x0001  # of a message of smbus2


class Chip(Protocol):
    """The methods of a chip that the bus calls."""

    address: int

    def read(self, register: int) -> int: ...  # noqa: D102
    def write(self, register: int, value: int) -> None: ...  # noqa: D102
    def block(self, register: int, length: int) -> bytes: ...  # noqa: D102
    def receive(self, length: int) -> bytes: ...  # noqa: D102
    def send(self, data: bytes) -> None: ...  # noqa: D102
    def update(self) -> None: ...  # noqa: D102


class EmulatedBus:
    """Chips on a bus.

    Args:
        chips: the chips; none may share an address.

    Attributes:
        nack: so many of the next transfers are not acknowledged.
        unplugged: nothing is acknowledged any more.
        stuck: the data line is held "low" (the kernel gives up: ETIMEDOUT), or floats "high" (all bits read as one).
    """

    def __init__(self, *chips: Chip) -> None:
        self.chips = {chip.address: chip for chip in chips}
        self.nack = 0
        self.unplugged = False
        self.stuck: Literal["low", "high"] | None = None

    def _chip(self, address: int) -> Chip:
        if self.stuck == "low":
            raise OSError(errno.ETIMEDOUT, os.strerror(errno.ETIMEDOUT))
        chip = self.chips.get(address)
        if chip is None or self.unplugged or self.nack > 0:
            self.nack = max(0, self.nack - 1)
            raise OSError(errno.EREMOTEIO, os.strerror(errno.EREMOTEIO))
        chip.update()
        return chip

    def read_byte_data(self, i2c_addr: int, register: int) -> int:
        """One register."""
        value = self._chip(i2c_addr).read(register)
        return 0xFF if self.stuck == "high" else value

    def write_byte_data(self, i2c_addr: int, register: int, value: int) -> None:
        """One register."""
        self._chip(i2c_addr).write(register, value)

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> Sequence[int]:
        """``length`` registers, or bytes of a FIFO.

        Raises:
            ValueError: longer than SMBus allows.
        """
        if not 1 <= length <= BLOCK:
            raise ValueError(f"Desired block length over {BLOCK} bytes")
        chip = self._chip(i2c_addr)
        values = chip.block(register, length)
        return b"\xff" * length if self.stuck == "high" else values

    def i2c_rdwr(self, *i2c_msgs: Untyped) -> None:
        """smbus2's messages, which name no register: only hubs answer them.

        Raises:
            OSError: there is no answer.
        """
        for message in i2c_msgs:
            chip = self._chip(message.addr)
            if not message.flags & READ:
                chip.send(bytes(message))
                continue
            data = chip.receive(message.len)
            for i, byte in enumerate(b"\xff" * message.len if self.stuck == "high" else data):
                message.buf[i] = bytes([byte])

    def close(self) -> None:
        """Nothing is held."""
