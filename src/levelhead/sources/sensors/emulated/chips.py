"""The chips, each with the registers that its driver uses: their addresses are shared with it, no line of its work."""

import struct
from typing import Any

from levelhead.sources.sensors import bmp280, icm20948, lsm6dso32, mpu6050
from levelhead.sources.sensors.bmp280 import Trim, compensate
from levelhead.sources.sensors.board import Wanted
from levelhead.sources.sensors.compass import GAUSS, HMC5883L, QMC5883L
from levelhead.sources.sensors.emulated.base import Fifo, Registers, word
from levelhead.sources.sensors.emulated.bus import EmulatedBus
from levelhead.sources.sensors.emulated.world import World
from levelhead.units import STANDARD_GRAVITY, factor

DEGREE = factor("gyr", "deg/s")
EXAMPLE_TRIM = Trim(27504, 26435, -1000, 36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000)  # BMP280, 3.12


class EmulatedMPU6050(Registers):
    """MPU-6050: asleep after power-up, 1024 bytes of FIFO that drop the oldest ones.

    What follows from the settings is worked out when they are written, and the output registers when they are read, so
    that a measurement takes its reader hardly any time, as in the real chip.
    """

    def __init__(
        self, world: World, address: int = mpu6050.ADDRESSES[0], *, identity: int = mpu6050.IDENTITY, drift: float = 0.0
    ) -> None:
        self.identity, self.fifo = identity, Fifo(mpu6050.FIFO_SIZE)
        self._rate, self._row, self._filling = 0.0, -1, False
        self._rows: list[bytes] = []
        super().__init__(world, address, drift)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self.fifo.clear()
        self.memory[mpu6050.PWR_MGMT_1] = 0x40
        self.memory[mpu6050.WHO_AM_I] = self.identity
        self._row = -1
        self._settle()

    def _settle(self) -> None:
        memory = self.memory
        fast = 8000.0 if memory[mpu6050.CONFIG] & 0x07 in (0, 7) else 1000.0
        asleep = memory[mpu6050.PWR_MGMT_1] & 0x40
        self._rate = 0.0 if asleep else fast / (1 + memory[mpu6050.SMPLRT_DIV])
        dps = 250.0 * 2 ** (memory[mpu6050.GYRO_CONFIG] >> 3 & 3)
        g = 2.0 * 2 ** (memory[mpu6050.ACCEL_CONFIG] >> 3 & 3)
        scales = STANDARD_GRAVITY / mpu6050.ACC_COUNTS[g], DEGREE / mpu6050.GYR_COUNTS[dps]
        self._rows = self.world.rows(">", *scales)
        wanted = memory[mpu6050.FIFO_EN] & mpu6050.GYR_AND_ACC == mpu6050.GYR_AND_ACC
        self._filling = bool(wanted and memory[mpu6050.USER_CTRL] & mpu6050.FIFO_ENABLE)

    @property
    def rate(self) -> float:  # noqa: D102
        return self._rate

    def measure(self, row: int) -> None:  # noqa: D102
        self._row = row
        if self._filling:
            self.fifo.push(self._rows[row])

    def _show(self) -> None:
        """The last measurement, in the output registers."""
        if self._row >= 0:
            both = self._rows[self._row]
            self.put(mpu6050.ACCEL_XOUT_H, both[:6] + word(">", (self.world.temperature - 36.53) * 340.0) + both[6:])

    def read(self, register: int) -> int:  # noqa: D102
        if register == mpu6050.FIFO_R_W:
            return self.fifo.take()[0]
        if register in (mpu6050.FIFO_COUNTH, mpu6050.FIFO_COUNTH + 1):
            self.put(mpu6050.FIFO_COUNTH, struct.pack(">H", len(self.fifo.bytes)))
        elif mpu6050.ACCEL_XOUT_H <= register < mpu6050.ACCEL_XOUT_H + 14:
            self._show()
        elif register == mpu6050.INT_STATUS:
            return (0x01 if self._row >= 0 else 0) | (0x10 if self.fifo.overflowed else 0)
        return self.memory[register]

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == mpu6050.PWR_MGMT_1 and value & mpu6050.DEVICE_RESET:
            return self.reset()
        if register == mpu6050.USER_CTRL and value & mpu6050.FIFO_RESET:
            self.fifo.clear()
            value &= ~mpu6050.FIFO_RESET
        if register in (mpu6050.PWR_MGMT_1, mpu6050.CONFIG, mpu6050.SMPLRT_DIV):
            self.restart()
        super().write(register, value)
        self._settle()

    def block(self, register: int, length: int) -> bytes:  # noqa: D102
        if register == mpu6050.FIFO_R_W:
            return self.fifo.take(length)
        if register == mpu6050.FIFO_COUNTH and length == 2:
            return len(self.fifo.bytes).to_bytes(2, "big")
        return super().block(register, length)


class EmulatedLSM6DSO32(Registers):
    """LSM6DSO32: off until it gets a rate, 512 tagged words of FIFO that drop the oldest ones."""

    def __init__(
        self, world: World, address: int = lsm6dso32.ADDRESSES[0], *, identity: int = lsm6dso32.IDENTITY,
        drift: float = 0.0,
    ) -> None:  # fmt: skip
        self.identity, self.fifo = identity, Fifo(lsm6dso32.FIFO_WORDS * lsm6dso32.WORD)
        super().__init__(world, address, drift)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self.fifo.clear()
        self.memory[lsm6dso32.WHO_AM_I] = self.identity
        self.memory[lsm6dso32.CTRL3_C] = 0x04

    @property
    def rate(self) -> float:  # noqa: D102
        code = self.memory[lsm6dso32.CTRL1_XL] >> 4
        return next((hertz for hertz, known in lsm6dso32.RATES.items() if known == code), 0.0)

    def measure(self, row: int) -> None:  # noqa: D102
        g = (4.0, 32.0, 8.0, 16.0)[self.memory[lsm6dso32.CTRL1_XL] >> 2 & 3]
        range_bits = self.memory[lsm6dso32.CTRL2_G]
        dps = 125.0 if range_bits & 0x02 else (250.0, 500.0, 1000.0, 2000.0)[range_bits >> 2 & 3]
        acc = self.world.coded("acc", "<", STANDARD_GRAVITY * lsm6dso32.ACC_BITS[g])[row]
        gyr = self.world.coded("gyr", "<", DEGREE * lsm6dso32.GYR_BITS[dps])[row]
        self.put(lsm6dso32.OUT_TEMP_L, word("<", (self.world.temperature - 25.0) * 256.0) + gyr + acc)
        if self.memory[lsm6dso32.FIFO_CTRL4] & 0x07 == lsm6dso32.CONTINUOUS:
            self.fifo.push(bytes([lsm6dso32.GYR_TAG << 3]) + gyr)
            self.fifo.push(bytes([lsm6dso32.ACC_TAG << 3]) + acc)

    def read(self, register: int) -> int:  # noqa: D102
        if lsm6dso32.FIFO_DATA_OUT_TAG <= register < lsm6dso32.FIFO_DATA_OUT_TAG + lsm6dso32.WORD:
            return self.fifo.take()[0]
        if register in (lsm6dso32.FIFO_STATUS1, lsm6dso32.FIFO_STATUS1 + 1):
            held = len(self.fifo.bytes) // lsm6dso32.WORD
            overrun = lsm6dso32.OVERRUN if self.fifo.overflowed else 0
            self.put(lsm6dso32.FIFO_STATUS1, bytes([held & 0xFF, held >> 8 & 0x03 | overrun]))
        return self.memory[register]

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == lsm6dso32.CTRL3_C and value & lsm6dso32.SW_RESET:
            return self.reset()
        if register == lsm6dso32.FIFO_CTRL4 and value & 0x07 == lsm6dso32.BYPASS:
            self.fifo.clear()
        if register == lsm6dso32.CTRL1_XL:
            self.restart()
        super().write(register, value)

    def block(self, register: int, length: int) -> bytes:  # noqa: D102
        fifo = register == lsm6dso32.FIFO_DATA_OUT_TAG  # behind the last byte of a word the chip goes on with the next
        return self.fifo.take(length) if fifo else super().block(register, length)


class EmulatedICM20948(Registers):
    """ICM-20948: four banks of registers, 512 bytes of FIFO; its magnetometer answers only in bypass mode."""

    def __init__(
        self, world: World, address: int = icm20948.ADDRESSES[0], *, identity: int = icm20948.IDENTITY,
        drift: float = 0.0,
    ) -> None:  # fmt: skip
        self.identity, self.fifo = identity, Fifo(icm20948.FIFO_SIZE, keep_old=True)
        self.banks = [bytearray(256) for _ in range(4)]
        self.bank = 0
        super().__init__(world, address, drift)

    def reset(self) -> None:  # noqa: D102
        for bank in self.banks:
            bank[:] = bytes(256)
        self.bank = 0
        self.memory = self.banks[0]
        self.fifo.clear()
        self.memory[icm20948.PWR_MGMT_1] = 0x41
        self.memory[icm20948.WHO_AM_I] = self.identity
        self.restart()

    @property
    def rate(self) -> float:  # noqa: D102
        if self.memory[icm20948.PWR_MGMT_1] & 0x40:
            return 0.0
        return 1125.0 / (1 + self.banks[2][icm20948.GYRO_SMPLRT_DIV])

    @property
    def bypassed(self) -> bool:
        """Whether the magnetometer is on the outer bus."""
        return bool(self.memory[icm20948.INT_PIN_CFG] & icm20948.BYPASS_EN)

    def measure(self, row: int) -> None:  # noqa: D102
        dps = 250.0 * 2 ** (self.banks[2][icm20948.GYRO_CONFIG_1] >> 1 & 3)
        g = 2.0 * 2 ** (self.banks[2][icm20948.ACCEL_CONFIG] >> 1 & 3)
        acc = self.world.coded("acc", ">", STANDARD_GRAVITY / icm20948.ACC_COUNTS[g])[row]
        gyr = self.world.coded("gyr", ">", DEGREE / icm20948.GYR_COUNTS[dps])[row]
        self.put(icm20948.ACCEL_XOUT_H, acc + gyr + word(">", (self.world.temperature - 21.0) * 333.87))
        on = self.memory[icm20948.USER_CTRL] & icm20948.FIFO_ENABLE
        if on and self.memory[icm20948.FIFO_EN_2] & icm20948.GYR_AND_ACC == icm20948.GYR_AND_ACC:
            self.fifo.push(acc + gyr)

    def read(self, register: int) -> int:  # noqa: D102
        if register == icm20948.REG_BANK_SEL:
            return self.bank << 4
        if self.bank == 0 and register == icm20948.FIFO_R_W:
            return self.fifo.take()[0]
        if self.bank == 0 and register in (icm20948.FIFO_COUNTH, icm20948.FIFO_COUNTH + 1):
            self.put(icm20948.FIFO_COUNTH, struct.pack(">H", len(self.fifo.bytes)))
        return self.banks[self.bank][register]

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == icm20948.REG_BANK_SEL:
            self.bank = value >> 4 & 3
            return
        if self.bank == 0 and register == icm20948.PWR_MGMT_1 and value & icm20948.DEVICE_RESET:
            return self.reset()
        if self.bank == 0 and register == icm20948.FIFO_RST and value & 0x1F:
            self.fifo.clear()
        if (self.bank, register) in ((0, icm20948.PWR_MGMT_1), (2, icm20948.GYRO_SMPLRT_DIV)):
            self.restart()
        self.banks[self.bank][register] = value

    def block(self, register: int, length: int) -> bytes:  # noqa: D102
        fifo = self.bank == 0 and register == icm20948.FIFO_R_W
        return self.fifo.take(length) if fifo else super().block(register, length)


class EmulatedAK09916(Registers):
    """AK09916: y and z point the other way; the next reading waits until ST2 was read."""

    def __init__(self, world: World, host: EmulatedICM20948 | None = None, *, drift: float = 0.0) -> None:
        self.host = host
        super().__init__(world, icm20948.AK09916.address, drift)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self.put(icm20948.AK09916.WIA1, bytes(icm20948.AK09916.IDENTITY))

    def look(self) -> None:  # noqa: D102
        if self.host is not None and not self.host.bypassed:
            raise OSError(121, "Remote I/O error")
        super().look()

    @property
    def rate(self) -> float:  # noqa: D102
        code = self.memory[icm20948.AK09916.CNTL2]
        return next((hertz for hertz, known in icm20948.AK09916.RATES.items() if known == code), 0.0)

    def measure(self, row: int) -> None:  # noqa: D102
        x, y, z = (round(value / icm20948.AK09916.SCALE) for value in self.world.mag(row))
        self.put(icm20948.AK09916.ST1 + 1, struct.pack("<3h", x, -y, -z))
        full = max(abs(x), abs(y), abs(z)) > 32752
        self.memory[icm20948.AK09916.ST1 + 8] = icm20948.AK09916.OVERFLOW if full else 0
        self.memory[icm20948.AK09916.ST1] = icm20948.AK09916.DATA_READY

    def read(self, register: int) -> int:  # noqa: D102
        value = self.memory[register]
        if register == icm20948.AK09916.ST1 + 8:
            self.memory[icm20948.AK09916.ST1] = 0
        return value

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == icm20948.AK09916.CNTL3 and value & 0x01:
            return self.reset()
        if register == icm20948.AK09916.CNTL2:
            self.restart()
        super().write(register, value)


class EmulatedHMC5883L(Registers):
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


class EmulatedQMC5883L(Registers):
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


class EmulatedBMP280(Registers):
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
        heat = bisected(lambda raw: compensate(self.trim, 0, raw).temperature - self.world.temperature)
        push = bisected(lambda raw: self.world.pressure - compensate(self.trim, raw, heat).pressure)
        self.put(bmp280.DATA, b"".join(struct.pack(">I", raw << 12)[:3] for raw in (push, heat)))

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == bmp280.RESET and value == bmp280.RESET_WORD:
            return self.reset()
        super().write(register, value)
        if register == bmp280.CTRL_MEAS:
            self.restart()


def bisected(rising: Any) -> int:
    """The 20-bit number at which a rising function passes zero."""
    low, high = 0, (1 << 20) - 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if rising(middle) < 0.0 else (low, middle)
    return high


def board_of(wanted: Wanted, world: World, *, drift: float = 0.0) -> EmulatedBus:
    """A bus with the chips of a board.

    Args:
        wanted: which chips.
        world: what they feel.
        drift: by which share the clock of the inertial chip is fast.
    """
    inertial: Registers
    where = {} if wanted.address is None else {"address": wanted.address}
    if wanted.inertial == "mpu6050":
        inertial = EmulatedMPU6050(world, drift=drift, **where)
    elif wanted.inertial == "lsm6dso32":
        inertial = EmulatedLSM6DSO32(world, drift=drift, **where)
    else:
        inertial = EmulatedICM20948(world, drift=drift, **where)
    chips: list[Registers] = [inertial]
    if wanted.mag == "ak09916":
        chips.append(EmulatedAK09916(world, inertial if isinstance(inertial, EmulatedICM20948) else None))
    elif wanted.mag is not None:
        chips.append({"hmc5883l": EmulatedHMC5883L, "qmc5883l": EmulatedQMC5883L}[wanted.mag](world))
    if wanted.baro:
        chips.append(EmulatedBMP280(world))
    return EmulatedBus(*chips)
