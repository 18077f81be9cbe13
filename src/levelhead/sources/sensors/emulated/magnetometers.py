"""Emulated magnetometers: register addresses are shared with the drivers, no code is."""

import struct

from levelhead.sources.sensors.ak09916 import AK09916
from levelhead.sources.sensors.ak8963 import AK8963
from levelhead.sources.sensors.compass import GAUSS, HMC5883L, QMC5883L
from levelhead.sources.sensors.emulated.base import EmulatedChip
from levelhead.sources.sensors.emulated.imus import EmulatedICM20948, EmulatedMPU9250
from levelhead.sources.sensors.emulated.world import World
from levelhead.sources.sensors.lis3mdl import LIS3MDL


class BehindBypass(EmulatedChip):
    """A chip inside another one's package: it answers only where that one lets it through.

    Args:
        world: its motion.
        host: the chip around it; None: it always answers.
        drift: by which share its clock is fast.
    """

    ADDRESS: int

    def __init__(
        self, world: World, host: EmulatedICM20948 | EmulatedMPU9250 | None = None, *, drift: float = 0.0
    ) -> None:
        self.host = host
        super().__init__(world, self.ADDRESS, drift)

    def update(self) -> None:  # noqa: D102
        if self.host is not None and not self.host.bypassed:
            raise OSError(121, "Remote I/O error")
        super().update()


class EmulatedAK09916(BehindBypass):
    """AK09916: y and z point the other way; the next reading waits until ST2 was read."""

    ADDRESS = AK09916.address

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self.put(AK09916.WIA1, bytes(AK09916.IDENTITY))

    @property
    def rate(self) -> float:  # noqa: D102
        code = self.memory[AK09916.CNTL2]
        return next((hertz for hertz, known in AK09916.RATES.items() if known == code), 0.0)

    def measure(self, row: int) -> None:  # noqa: D102
        x, y, z = (round(value / AK09916.SCALE) for value in self.world.mag(row))
        self.put(AK09916.ST1 + 1, struct.pack("<3h", x, -y, -z))
        full = max(abs(x), abs(y), abs(z)) > 32752
        self.memory[AK09916.ST1 + 8] = AK09916.OVERFLOW if full else 0
        self.memory[AK09916.ST1] = AK09916.DATA_READY

    def read(self, register: int) -> int:  # noqa: D102
        value = self.memory[register]
        if register == AK09916.ST1 + 8:
            self.memory[AK09916.ST1] = 0
        return value

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == AK09916.CNTL3 and value & 0x01:
            return self.reset()
        if register == AK09916.CNTL2:
            self.restart()
        super().write(register, value)


class EmulatedAK8963(BehindBypass):
    """AK8963: its x and y are the other way round; sensitivities can be read in fuse-ROM mode alone."""

    ADDRESS = AK8963.address
    ADJUSTMENTS = (176, 170, 165)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self.memory[AK8963.WIA] = AK8963.IDENTITY

    @property
    def rate(self) -> float:  # noqa: D102
        code = self.memory[AK8963.CNTL1] & 0x0F
        return next((hertz for hertz, known in AK8963.RATES.items() if known == code), 0.0)

    def measure(self, row: int) -> None:  # noqa: D102
        x, y, z = self.world.mag(row)
        fine = AK8963.SCALE if self.memory[AK8963.CNTL1] & AK8963.BITS_16 else 4.0 * AK8963.SCALE
        counts = [
            round(value / fine / (1.0 + (adjustment - 128) / 256.0))
            for value, adjustment in zip((y, x, -z), self.ADJUSTMENTS, strict=True)
        ]
        self.put(AK8963.ST1 + 1, struct.pack("<3h", *counts))
        full = abs(x) + abs(y) + abs(z) >= 4912.0
        self.memory[AK8963.ST1 + 7] = AK8963.OVERFLOW if full else 0
        self.memory[AK8963.ST1] = AK8963.DATA_READY

    def read(self, register: int) -> int:  # noqa: D102
        if AK8963.ASAX <= register < AK8963.ASAX + 3:
            readable = self.memory[AK8963.CNTL1] & 0x0F == AK8963.FUSE_ROM
            return self.ADJUSTMENTS[register - AK8963.ASAX] if readable else 0
        value = self.memory[register]
        if register == AK8963.ST1 + 7:
            self.memory[AK8963.ST1] = 0
        return value

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == AK8963.CNTL2 and value & 0x01:
            return self.reset()
        if register == AK8963.CNTL1:
            self.restart()
        super().write(register, value)


class EmulatedLIS3MDL(EmulatedChip):
    """LIS3MDL: power-down after a reset; the flag goes down when the data are read."""

    def __init__(self, world: World, *, identity: int = LIS3MDL.IDENTITY, drift: float = 0.0) -> None:
        self.identity = identity
        super().__init__(world, LIS3MDL.address, drift)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self.memory[LIS3MDL.WHO_AM_I] = self.identity
        self.memory[LIS3MDL.CTRL1], self.memory[LIS3MDL.CTRL3] = 0x10, 0x03

    @property
    def rate(self) -> float:  # noqa: D102
        on = self.memory[LIS3MDL.CTRL3] & 0x03 == LIS3MDL.CONTINUOUS
        return list(LIS3MDL.RATES)[self.memory[LIS3MDL.CTRL1] >> 2 & 7] if on else 0.0

    def measure(self, row: int) -> None:  # noqa: D102
        counts = list(LIS3MDL.COUNTS.values())[self.memory[LIS3MDL.CTRL2] >> 5 & 3]
        self.put(LIS3MDL.DATA, self.world.coded("mag", "<", GAUSS / counts)[row])
        self.memory[LIS3MDL.STATUS] = LIS3MDL.READY

    def read(self, register: int) -> int:  # noqa: D102
        value = self.memory[register & ~LIS3MDL.INCREMENT]
        if register & ~LIS3MDL.INCREMENT == LIS3MDL.DATA + 5:
            self.memory[LIS3MDL.STATUS] = 0
        return value

    def next(self, register: int) -> int:  # noqa: D102
        return register + 1 if register & LIS3MDL.INCREMENT else register

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == LIS3MDL.CTRL2 and value & LIS3MDL.SOFT_RESET:
            return self.reset()
        super().write(register, value)
        if register in (LIS3MDL.CTRL1, LIS3MDL.CTRL3):
            self.restart()


class EmulatedHMC5883L(EmulatedChip):
    """HMC5883L: idle after power-up, 12 bits, −4096 for too much."""

    def __init__(self, world: World, *, identity: bytes = HMC5883L.IDENTITY, drift: float = 0.0) -> None:
        self.identity = identity
        super().__init__(world, HMC5883L.address, drift)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self.put(HMC5883L.CRA, bytes([0x10, 0x20, 0x01]))
        self.put(HMC5883L.ID_A, self.identity)

    @property
    def rate(self) -> float:  # noqa: D102
        if self.memory[HMC5883L.MODE] & 0x03 != 0:
            return 0.0
        return list(HMC5883L.RATES)[min(6, self.memory[HMC5883L.CRA] >> 2 & 7)]

    def measure(self, row: int) -> None:  # noqa: D102
        counts = list(HMC5883L.COUNTS.values())[self.memory[HMC5883L.CRB] >> 5]
        x, y, z = (round(value / GAUSS * counts) for value in self.world.mag(row))
        codes = [code if -2048 <= code <= 2047 else HMC5883L.OVERFLOW for code in (x, z, y)]
        self.put(HMC5883L.DATA, struct.pack(">3h", *codes))
        self.memory[HMC5883L.STATUS] = HMC5883L.READY

    def write(self, register: int, value: int) -> None:  # noqa: D102
        super().write(register, value)
        if register in (HMC5883L.MODE, HMC5883L.CRA):
            self.restart()


class EmulatedQMC5883L(EmulatedChip):
    """QMC5883L: standby after power-up; the flag goes down when the data are read."""

    def __init__(self, world: World, *, identity: int = QMC5883L.IDENTITY, drift: float = 0.0) -> None:
        self.identity = identity
        super().__init__(world, QMC5883L.address, drift)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self.memory[QMC5883L.CHIP_ID] = self.identity

    @property
    def rate(self) -> float:  # noqa: D102
        control = self.memory[QMC5883L.CONTROL_1]
        return list(QMC5883L.RATES)[control >> 2 & 3] if control & 0x03 == QMC5883L.CONTINUOUS else 0.0

    def measure(self, row: int) -> None:  # noqa: D102
        gauss = 8.0 if self.memory[QMC5883L.CONTROL_1] & 0x10 else 2.0
        self.put(QMC5883L.DATA, self.world.coded("mag", "<", GAUSS / QMC5883L.COUNTS[gauss])[row])
        full = max(map(abs, self.world.mag(row))) > gauss * GAUSS
        self.memory[QMC5883L.STATUS] = QMC5883L.READY | (QMC5883L.OVERFLOW if full else 0)

    def read(self, register: int) -> int:  # noqa: D102
        value = self.memory[register]
        if register == QMC5883L.DATA + 5:
            self.memory[QMC5883L.STATUS] = 0
        return value

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == QMC5883L.CONTROL_2 and value & QMC5883L.SOFT_RESET:
            return self.reset()
        super().write(register, value)
        if register == QMC5883L.CONTROL_1:
            self.restart()
