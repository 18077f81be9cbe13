"""The emulated ICM-42688-P: register addresses are shared with the driver, no code is."""

from levelhead.sources.sensors import icm42688 as chip
from levelhead.sources.sensors.emulated.base import EmulatedChip, Fifo, word
from levelhead.sources.sensors.emulated.world import World
from levelhead.units import DEGREE, GRAVITY

HEADER = 0x68  # packet 3: accelerometer, gyroscope, time stamp of its own


class EmulatedICM42688(EmulatedChip):
    """ICM-42688-P: asleep after power-up, 2048 bytes of FIFO in packets of 16 that drop the oldest ones."""

    def __init__(
        self, world: World, address: int = chip.ADDRESSES[0], *, identity: int = chip.IDENTITY, drift: float = 0.0
    ) -> None:
        self.identity, self.fifo = identity, Fifo(chip.FIFO_SIZE)
        super().__init__(world, address, drift)

    def reset(self) -> None:  # noqa: D102
        super().reset()
        self.fifo.clear()
        self.memory[chip.WHO_AM_I] = self.identity
        self.memory[chip.GYRO_CONFIG0] = self.memory[chip.ACCEL_CONFIG0] = 0x06

    @property
    def rate(self) -> float:  # noqa: D102
        if self.memory[chip.PWR_MGMT0] & chip.LOW_NOISE != chip.LOW_NOISE:
            return 0.0
        code = self.memory[chip.GYRO_CONFIG0] & 0x0F
        return next((hertz for hertz, known in chip.RATES.items() if known == code), 0.0)

    def measure(self, row: int) -> None:  # noqa: D102
        dps = 2000.0 / 2 ** (self.memory[chip.GYRO_CONFIG0] >> 5)
        g = 16.0 / 2 ** (self.memory[chip.ACCEL_CONFIG0] >> 5)
        acc = self.world.coded("acc", ">", GRAVITY * g / 32768.0)[row]
        gyr = self.world.coded("gyr", ">", DEGREE / chip.GYR_COUNTS[dps])[row]
        heat = self.world.temperature - 25.0
        self.put(chip.TEMP_DATA1, word(">", heat * 132.48) + acc + gyr)
        on = self.memory[chip.FIFO_CONFIG] == chip.STREAM
        if on and self.memory[chip.FIFO_CONFIG1] & chip.GYR_AND_ACC == chip.GYR_AND_ACC:
            self.fifo.push(bytes([HEADER]) + acc + gyr + bytes([round(heat * 2.07) & 0xFF, 0, 0]))

    def read(self, register: int) -> int:  # noqa: D102
        if register == chip.FIFO_DATA:
            return self.fifo.take()[0]
        if register in (chip.FIFO_COUNTH, chip.FIFO_COUNTH + 1):
            self.put(chip.FIFO_COUNTH, len(self.fifo.bytes).to_bytes(2, "big"))
        return self.memory[register]

    def write(self, register: int, value: int) -> None:  # noqa: D102
        if register == chip.DEVICE_CONFIG and value & chip.SOFT_RESET:
            return self.reset()
        if register == chip.SIGNAL_PATH_RESET and value & chip.FIFO_FLUSH:
            self.fifo.clear()
            return
        super().write(register, value)
        if register in (chip.PWR_MGMT0, chip.GYRO_CONFIG0):
            self.restart()

    def block(self, register: int, length: int) -> bytes:  # noqa: D102
        return self.fifo.take(length) if register == chip.FIFO_DATA else super().block(register, length)
