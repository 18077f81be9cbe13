"""What all emulated chips share: registers, and a clock of their own by which they measure."""

import struct
from collections import deque

from levelhead.sources.sensors.emulated.world import Moment, World


class Registers:
    """256 registers of a chip that measures at a rate of its own.

    Args:
        world: what it feels.
        address: on the bus.
        drift: by which share its clock is fast.
    """

    def __init__(self, world: World, address: int, drift: float = 0.0) -> None:
        self.world, self.address, self.drift = world, address, drift
        self.memory = bytearray(256)
        self.since, self._done = world.began, 0
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

    def look(self) -> None:
        """Brings it up to the present: all measurements that were due are made."""
        rate = self.rate * (1.0 + self.drift)
        if rate <= 0.0:
            return
        due = int((self.world.clock() - self.since) * rate)
        if due - self._done > 2048:  # more than any FIFO holds
            self._done = due - 2048
        start = self.since - self.world.began
        while self._done < due:
            self._done += 1
            self.measure(self.world.at(start + self._done / rate))

    def measure(self, moment: Moment) -> None:
        """Takes one measurement."""

    def read(self, register: int) -> int:
        """One byte, with what its reading does."""
        return self.memory[register]

    def write(self, register: int, value: int) -> None:
        """One byte, with what its writing does."""
        self.memory[register] = value

    def next(self, register: int) -> int:
        """The register after this one in a block."""
        return (register + 1) & 0xFF

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
        self.bytes: deque[int] = deque()
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
            for _ in range(len(self.bytes) + len(data) - self.size):
                self.bytes.popleft()
        self.bytes.extend(data)

    def pop(self) -> int:
        """One byte; 0xFF from an empty FIFO."""
        return self.bytes.popleft() if self.bytes else 0xFF


def words(order: str, scale: float, *values: float) -> bytes:
    """16-bit numbers of ``values`` in bits of size ``scale``, clipped at the end of the word; order ">" or "<"."""
    codes = [min(32767, max(-32768, round(value / scale))) for value in values]
    return struct.pack(f"{order}{len(codes)}h", *codes)
