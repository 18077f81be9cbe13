"""What the FIFOs of all chips share: reading them in blocks, and what to do when a block fails."""

from collections.abc import Callable
from typing import NamedTuple

from levelhead.sample import Triple
from levelhead.sources.sensors.bus import BLOCK, Port, SensorError

Row = tuple[Triple, Triple]  # gyr in rad/s, acc in m/s²


class Drained(NamedTuple):
    """What a FIFO held.

    Attributes:
        rows: (gyr in rad/s, acc in m/s²), the oldest first.
        at: host time of the look, s.
        lost: whether samples are lost, because the FIFO ran over or a transfer broke off.
    """

    rows: list[Row]
    at: float
    lost: bool = False


def read_words(port: Port, register: int, count: int, size: int, empty: Callable[[], None]) -> list[bytes] | None:
    """``count`` words of ``size`` bytes from a FIFO, in as few block reads as there can be.

    A transfer that fails is not tried again: its bytes may be gone, and nobody knows where the next word begins. The
    FIFO is emptied by ``empty`` then, and the answer is None.

    Raises:
        SensorError: the chip does not even take that.
    """
    words: list[bytes] = []
    most = BLOCK // size
    while (left := count - len(words)) > 0:
        length = size * (left if left < most else most)
        try:
            data = port.read_once(register, length)
        except SensorError:
            empty()
            return None
        words += [data] if length == size else [data[start : start + size] for start in range(0, length, size)]
    return words
