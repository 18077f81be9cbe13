"""The emulated BMP280: register addresses and the data sheet's formulas are shared with the driver."""

import struct
from collections.abc import Callable

from levelhead.sources.sensors import bmp280
from levelhead.sources.sensors.bmp280 import Trim, compensate
from levelhead.sources.sensors.emulated.base import EmulatedChip
from levelhead.sources.sensors.emulated.world import World

EXAMPLE_TRIM = Trim(27504, 26435, -1000, 36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000)  # BMP280, 3.12


class EmulatedBMP280(EmulatedChip):
    """BMP280 with the trimming values of the data sheet's example; raw numbers follow by bisection of its formulas."""

    def __init__(
        self, world: World, address: int = bmp280.ADDRESSES[0], *, identity: int = bmp280.IDENTITY,
        trim: Trim = EXAMPLE_TRIM,
    ) -> None:  # fmt: skip
        self.identity, self.trim = identity, trim
        super().__init__(world, address)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self.memory[bmp280.ID] = self.identity
        self.put(bmp280.CALIBRATION, struct.pack("<HhhHhhhhhhhh", *self.trim))
        self.put(bmp280.DATA, bytes([0x80, 0, 0, 0x80, 0, 0]))

    @property
    def rate(self) -> float:  # noqa: D102
        return 1.0 / bmp280.INTERVAL if self.memory[bmp280.CTRL_MEAS] & 0x03 == 0x03 else 0.0

    def measure(self, row: int) -> None:  # noqa: D102
        heat = bisect(lambda raw: compensate(self.trim, 0, raw).temperature - self.world.temperature)
        push = bisect(lambda raw: self.world.pressure - compensate(self.trim, raw, heat).pressure)
        self.put(bmp280.DATA, b"".join(struct.pack(">I", raw << 12)[:3] for raw in (push, heat)))

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == bmp280.RESET and value == bmp280.RESET_WORD:
            return self.reset()
        super().write(register, value)
        if register == bmp280.CTRL_MEAS:
            self.restart()


def bisect(rising: Callable[[int], float]) -> int:
    """The 20-bit number at which a rising function passes zero."""
    low, high = 0, (1 << 20) - 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if rising(middle) < 0.0 else (low, middle)
    return high
