"""The writes of levelhead's own driver into a chip, for a sketch to repeat."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from levelhead.sources.sensors.bus import Port


class Write(NamedTuple):
    """One byte into a register, and the wait behind it."""

    register: int
    value: int
    wait: int = 0  # ms


class WriteRecorder(Port):
    """Stands in place of a bus and records the writes of a driver; all that it reads is 0.

    Attributes:
        writes: so far.
        reads: how many writes there were before it, and its register, for each reading.
        identity: register, value, and the bits of it that count.
    """

    def __init__(self) -> None:
        self.writes: list[Write] = []
        self.reads: list[tuple[int, int]] = []
        self.identity = (0, 0, 0)
        self.wait = self._note_wait

    def write(self, register: int, value: int) -> None:  # noqa: D102
        self.writes.append(Write(register, value))

    def read(self, register: int, size: int) -> bytes:  # noqa: D102
        self.reads.append((len(self.writes), register))
        return bytes(size)

    def expect(self, register: int, identity: int, mask: int = 0xFF) -> None:  # noqa: D102
        self.identity = (register, identity, mask)

    def _note_wait(self, seconds: float) -> None:
        self.writes[-1] = self.writes[-1]._replace(wait=max(round(1000.0 * seconds), 1))


def write_calls(chip: str, writes: Iterable[Write]) -> Iterator[str]:
    """The calls of a sketch that write all of it."""
    for one in writes:
        wait = f", {one.wait}" if one.wait else ""
        yield f"write_register({chip}, 0x{one.register:02X}, 0x{one.value:02X}{wait})"
