"""MPU-6050: gyroscope and accelerometer through the FIFO (InvenSense RM-MPU-6000A-00 rev 4.2, register map)."""

import functools
import struct

from levelhead.sources.sensors.bus import Port
from levelhead.sources.sensors.fifo_imu import ChipSettings, FifoImu, Registers
from levelhead.sources.sensors.invensense import build_chip

NAME = "MPU-6050"
ADDRESSES = (0x68, 0x69)
IDENTITY = 0x68
SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, FIFO_EN = 0x19, 0x1A, 0x1B, 0x1C, 0x23
INT_STATUS, ACCEL_XOUT_H, USER_CTRL, PWR_MGMT_1 = 0x3A, 0x3B, 0x6A, 0x6B
FIFO_COUNTH, FIFO_R_W, WHO_AM_I = 0x72, 0x74, 0x75
DEVICE_RESET, PLL_GYRO_X = 0x80, 0x01  # PWR_MGMT_1
FIFO_ENABLE, FIFO_RESET = 0x40, 0x04  # USER_CTRL
GYR_AND_ACC = 0x78  # FIFO_EN: XG, YG, ZG, ACCEL
FIFO_SIZE = 1024  # bytes
SEVEN = struct.Struct(">7h")
START_UP = 0.1  # s after a reset (register 107)

BANDWIDTHS = {184.0: 1, 94.0: 2, 44.0: 3, 21.0: 4, 10.0: 5, 5.0: 6}  # Hz of the accelerometer, register 26


def bandwidth_for(rate: float) -> int:
    """The filter code of the highest bandwidth below half the rate: higher frequencies would be aliased."""
    return next((code for hertz, code in BANDWIDTHS.items() if hertz <= 0.5 * rate), 6)


def configure(port: Port, settings: ChipSettings) -> None:
    """See ``FifoChip``."""
    port.expect(WHO_AM_I, IDENTITY, 0x7E)
    port.write(PWR_MGMT_1, DEVICE_RESET)
    port.wait(START_UP)
    port.write(PWR_MGMT_1, PLL_GYRO_X)
    port.write(CONFIG, bandwidth_for(settings.rate))
    port.write(SMPLRT_DIV, round(1000.0 / settings.rate) - 1)
    port.write(GYRO_CONFIG, settings.gyr_code)
    port.write(ACCEL_CONFIG, settings.acc_code)
    port.write(FIFO_EN, GYR_AND_ACC)


def empty(port: Port) -> None:
    """See ``FifoChip``."""
    port.write(USER_CTRL, FIFO_RESET)
    port.write(USER_CTRL, FIFO_ENABLE)


def output(data: bytes) -> Registers:
    """See ``FifoChip``: accelerometer, temperature (register 65), gyroscope."""
    a, b, c, temperature, x, y, z = SEVEN.unpack(data)
    return Registers((x, y, z), (a, b, c), temperature / 340.0 + 36.53)


CHIP = build_chip(
    NAME,
    ADDRESSES,
    base_rate=1000.0,
    code_shift=3,
    fifo_size=FIFO_SIZE,
    registers=(FIFO_COUNTH, FIFO_R_W, ACCEL_XOUT_H),
    configure=configure,
    empty=empty,
    output=output,
)
MPU6050 = functools.partial(FifoImu, CHIP)
