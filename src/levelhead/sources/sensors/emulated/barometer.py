"""Emulated barometers: register addresses and the data sheet's formulas are shared with the drivers."""

import struct
from collections.abc import Callable

from levelhead.sources.sensors import bmp280, bmp390
from levelhead.sources.sensors.bmp280 import Trim, compensate
from levelhead.sources.sensors.emulated.base import EmulatedChip
from levelhead.sources.sensors.emulated.world import World

EXAMPLE_TRIM = Trim(27504, 26435, -1000, 36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000)  # BMP280, 3.12
USUAL_TRIM = (27772, 18748, -7, -342, -1246, 35, 0, 24911, 29991, -13, -10, 16354, 6, -60)


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


class EmulatedBMP390(EmulatedChip):
    """BMP390 with plausible trimming values: the data sheet has no example."""

    def __init__(
        self, world: World, address: int = bmp390.ADDRESSES[0], *, identity: int = bmp390.IDENTITY,
        trim: tuple[int, ...] = USUAL_TRIM,
    ) -> None:  # fmt: skip
        self.identity, self.trim = identity, bmp390.SIZES.pack(*trim)
        super().__init__(world, address)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self.memory[bmp390.ID] = self.identity
        self.put(bmp390.TRIM, self.trim)
        self.put(bmp390.DATA, bytes([0, 0, 0x80, 0, 0, 0x80]))

    @property
    def rate(self) -> float:  # noqa: D102
        return 200.0 / 2 ** self.memory[bmp390.ODR] if self.memory[bmp390.PWR_CTRL] == bmp390.NORMAL else 0.0

    def measure(self, row: int) -> None:  # noqa: D102
        trim = bmp390.PressureTrim.unpack(self.trim)
        heat = bisect(lambda raw: bmp390.compensate(trim, 0, raw).temperature - self.world.temperature, 24)
        push = bisect(lambda raw: self.world.pressure - bmp390.compensate(trim, raw, heat).pressure, 24)
        self.put(bmp390.DATA, push.to_bytes(3, "little") + heat.to_bytes(3, "little"))
        self.memory[bmp390.STATUS] = bmp390.READY

    def read(self, register: int) -> int:  # noqa: D102
        value = self.memory[register]
        if bmp390.DATA <= register < bmp390.DATA + 6:
            self.memory[bmp390.STATUS] = 0
        return value

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == bmp390.CMD and value == bmp390.SOFT_RESET:
            return self.reset()
        super().write(register, value)
        if register in (bmp390.PWR_CTRL, bmp390.ODR):
            self.restart()


def bisect(rising: Callable[[int], float], bits: int = 20) -> int:
    """The number of ``bits`` bits at which a rising function passes zero."""
    low, high = 0, (1 << bits) - 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if rising(middle) < 0.0 else (low, middle)
    return high
