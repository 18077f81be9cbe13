"""The common part of all emulated chips: registers, and a clock of their own by which they measure."""

import errno
import os
import struct

from levelhead.sources.sensors.emulated.world import World


class EmulatedChip:
    """256 registers of a chip that measures at a rate of its own.

    Args:
        world: its motion.
        address: on the bus.
        drift: by which share its clock is fast.
    """

    def __init__(self, world: World, address: int, drift: float = 0.0) -> None:
        self.world, self.address, self.drift = world, address, drift
        self.memory = bytearray(256)
        self.reset()

    def reset(self) -> None:
        """As after power-up."""
        self.memory[:] = bytes(256)
        self.restart()

    def restart(self) -> None:
        """Begins to count its measurements anew."""
        self.since, self._done = self.world.clock(), 0

    @property
    def rate(self) -> float:
        """Measurements a second by its own clock; 0: it sleeps."""
        return 0.0

    def update(self) -> None:
        """Brings it up to the present: all measurements that were due are made."""
        rate = self.rate * (1.0 + self.drift)
        if rate <= 0.0:
            return
        due = int((self.world.clock() - self.since) * rate)
        if due == self._done:
            return
        if due - self._done > 2048:  # more than any FIFO holds
            self._done = due - 2048
        start = self.world.since(self.since)
        while self._done < due:
            self._done += 1
            self.measure(self.world.row(start + self._done / rate))

    def measure(self, row: int) -> None:
        """Takes one measurement, of that row of the world."""

    def read(self, register: int) -> int:
        """One byte, with the effect of its reading."""
        return self.memory[register]

    def write(self, register: int, value: int) -> None:
        """One byte, with the effect of its writing."""
        self.memory[register] = value

    def receive(self, length: int) -> bytes:
        """Bytes that a host reads without naming a register: only hubs give some.

        Raises:
            OSError: this one does not acknowledge.
        """
        raise OSError(errno.EREMOTEIO, os.strerror(errno.EREMOTEIO))

    def send(self, data: bytes) -> None:
        """Bytes that a host writes without naming a register; raises as ``receive`` does."""
        self.receive(0)

    def next(self, register: int) -> int:
        """The register after this one in a block."""
        return (register + 1) & 0xFF

    def block(self, register: int, length: int) -> bytes:
        """``length`` bytes from ``register`` on, one after the other."""
        values = bytearray()
        for _ in range(length):
            values.append(self.read(register))
            register = self.next(register)
        return bytes(values)

    def put(self, register: int, data: bytes) -> None:
        """Bytes into registers."""
        self.memory[register : register + len(data)] = data


class Fifo:
    """A FIFO of bytes.

    Args:
        size: bytes that it holds.
        keep_old: when full, new bytes are dropped; otherwise old ones are.
    """

    def __init__(self, size: int, keep_old: bool = False) -> None:
        self.size, self.keep_old = size, keep_old
        self.bytes = bytearray()
        self.overflowed = False

    def clear(self) -> None:
        """Empties it."""
        self.bytes.clear()
        self.overflowed = False

    def push(self, data: bytes) -> None:
        """Adds one sample."""
        if len(self.bytes) + len(data) > self.size:
            self.overflowed = True
            if self.keep_old:
                return
            del self.bytes[: len(self.bytes) + len(data) - self.size]
        self.bytes.extend(data)

    def take(self, count: int = 1) -> bytes:
        """The oldest bytes; 0xFF from an empty FIFO."""
        data = bytes(self.bytes[:count])
        del self.bytes[:count]
        return data.ljust(count, b"\xff")


def word(order: str, value: float) -> bytes:
    """One 16-bit number; order ">" or "<"."""
    return struct.pack(f"{order}h", round(value))
