"""Emulated gyroscopes and accelerometers with FIFO: register addresses are shared with the drivers, no code is."""

import struct

from levelhead.sources.sensors import icm20948, invensense, lsm6dso32, lsm6dsox, mpu6050, mpu9250
from levelhead.sources.sensors.emulated.base import EmulatedChip, Fifo, word
from levelhead.sources.sensors.emulated.world import World
from levelhead.units import DEGREE, GRAVITY


class EmulatedMPU6050(EmulatedChip):
    """MPU-6050: asleep after power-up, 1024 bytes of FIFO that drop the oldest ones.

    The consequences of the settings are computed when they are written, and the output registers when they are read, so
    that a measurement takes its reader hardly any time, as in the real chip.
    """

    IDENTITY, FIFO_SIZE = mpu6050.IDENTITY, mpu6050.FIFO_SIZE
    HEAT_COUNTS, HEAT_ZERO = 340.0, 36.53  # counts per °C, and °C at 0

    def __init__(
        self, world: World, address: int = mpu6050.ADDRESSES[0], *, identity: int | None = None, drift: float = 0.0
    ) -> None:
        self.identity, self.fifo = self.IDENTITY if identity is None else identity, Fifo(self.FIFO_SIZE)
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
        scales = GRAVITY / invensense.ACC_COUNTS[g], DEGREE / invensense.GYR_COUNTS[dps]
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
            heat = (self.world.temperature - self.HEAT_ZERO) * self.HEAT_COUNTS
            self.put(mpu6050.ACCEL_XOUT_H, both[:6] + word(">", heat) + both[6:])

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


class EmulatedMPU9250(EmulatedMPU6050):
    """MPU-9250: as the MPU-6050, with half its FIFO; its magnetometer answers only in bypass mode."""

    IDENTITY, FIFO_SIZE = mpu9250.IDENTITY, mpu9250.FIFO_SIZE
    HEAT_COUNTS, HEAT_ZERO = 333.87, 21.0

    @property
    def bypassed(self) -> bool:
        """Whether the magnetometer is on the outer bus."""
        return bool(self.memory[mpu9250.INT_PIN_CFG] & mpu9250.BYPASS_EN)


class EmulatedLSM6DSO32(EmulatedChip):
    """LSM6DSO32: off until it gets a rate, 512 tagged words of FIFO that drop the oldest ones."""

    FULL_SCALES = (4.0, 32.0, 8.0, 16.0)  # g, by the code in CTRL1_XL
    ACC_BITS = lsm6dso32.ACC_BITS

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
        g = self.FULL_SCALES[self.memory[lsm6dso32.CTRL1_XL] >> 2 & 3]
        range_bits = self.memory[lsm6dso32.CTRL2_G]
        dps = 125.0 if range_bits & 0x02 else (250.0, 500.0, 1000.0, 2000.0)[range_bits >> 2 & 3]
        acc = self.world.coded("acc", "<", GRAVITY * self.ACC_BITS[g])[row]
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


class EmulatedLSM6DSOX(EmulatedLSM6DSO32):
    """LSM6DSOX: the same with half the full scales of the accelerometer."""

    FULL_SCALES = (2.0, 16.0, 4.0, 8.0)
    ACC_BITS = lsm6dsox.ACC_BITS


class EmulatedICM20948(EmulatedChip):
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
        acc = self.world.coded("acc", ">", GRAVITY / invensense.ACC_COUNTS[g])[row]
        gyr = self.world.coded("gyr", ">", DEGREE / invensense.GYR_COUNTS[dps])[row]
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
