"""ICM-20948: gyroscope and accelerometer through the FIFO (TDK DS-000189).

The magnetometer inside it, the AK09916, is a chip of its own at 0x0C once bypass mode is on.
"""

import functools
import struct

from levelhead.sources.sensors.bus import Port
from levelhead.sources.sensors.fifo_imu import ChipSettings, FifoImu, Registers
from levelhead.sources.sensors.invensense import build_chip

NAME = "ICM-20948"
ADDRESSES = (0x69, 0x68)
IDENTITY = 0xEA
REG_BANK_SEL = 0x7F
# Bank 0.
WHO_AM_I, USER_CTRL, PWR_MGMT_1, PWR_MGMT_2, INT_PIN_CFG = 0x00, 0x03, 0x06, 0x07, 0x0F
ACCEL_XOUT_H, FIFO_EN_2, FIFO_RST, FIFO_MODE, FIFO_COUNTH, FIFO_R_W = 0x2D, 0x67, 0x68, 0x69, 0x70, 0x72
# Bank 2.
GYRO_SMPLRT_DIV, GYRO_CONFIG_1, ACCEL_SMPLRT_DIV_1, ACCEL_SMPLRT_DIV_2, ACCEL_CONFIG = 0x00, 0x01, 0x10, 0x11, 0x14
DEVICE_RESET, AUTO_CLOCK = 0x80, 0x01  # PWR_MGMT_1
FIFO_ENABLE, BYPASS_EN = 0x40, 0x02
GYR_AND_ACC = 0x1E  # FIFO_EN_2: ACCEL, GYRO_Z, GYRO_Y, GYRO_X
FIFO_SIZE = 512  # bytes
SEVEN = struct.Struct(">7h")
START_UP = 0.1  # s, table 1: register read and write after power-up

BANDWIDTHS = {196.6: 0, 151.8: 1, 119.5: 2, 51.2: 3, 23.9: 4, 11.6: 5, 5.7: 6}  # Hz, table 16


def configure(port: Port, settings: ChipSettings) -> None:
    """See ``FifoChip``; opens the bypass to the magnetometer as well."""
    port.write(REG_BANK_SEL, 0x00)
    port.expect(WHO_AM_I, IDENTITY)
    port.write(PWR_MGMT_1, DEVICE_RESET)
    port.wait(START_UP)
    port.write(PWR_MGMT_1, AUTO_CLOCK)
    port.write(PWR_MGMT_2, 0x00)
    port.write(INT_PIN_CFG, BYPASS_EN)
    filters = next((code for hertz, code in BANDWIDTHS.items() if hertz <= 0.5 * settings.rate), 6) << 3 | 0x01
    divider = round(1125.0 / settings.rate) - 1
    port.write(REG_BANK_SEL, 0x20)
    port.write(GYRO_SMPLRT_DIV, divider)
    port.write(GYRO_CONFIG_1, filters | settings.gyr_code)
    port.write(ACCEL_SMPLRT_DIV_1, divider >> 8)
    port.write(ACCEL_SMPLRT_DIV_2, divider & 0xFF)
    port.write(ACCEL_CONFIG, max(filters, 0x09) | settings.acc_code)  # its code 0 is another bandwidth
    port.write(REG_BANK_SEL, 0x00)
    port.write(FIFO_MODE, 0x1F)  # snapshot: when full, new samples are dropped and old ones stay whole
    port.write(FIFO_EN_2, GYR_AND_ACC)
    port.write(USER_CTRL, FIFO_ENABLE)


def empty(port: Port) -> None:
    """See ``FifoChip``."""
    port.write(FIFO_RST, 0x1F)
    port.write(FIFO_RST, 0x00)


def output(data: bytes) -> Registers:
    """See ``FifoChip``: accelerometer, gyroscope, temperature (table 3)."""
    a, b, c, x, y, z, temperature = SEVEN.unpack(data)
    return Registers((x, y, z), (a, b, c), temperature / 333.87 + 21.0)


CHIP = build_chip(
    NAME,
    ADDRESSES,
    base_rate=1125.0,
    code_shift=1,
    fifo_size=FIFO_SIZE,
    registers=(FIFO_COUNTH, FIFO_R_W, ACCEL_XOUT_H),
    configure=configure,
    empty=empty,
    output=output,
)
ICM20948 = functools.partial(FifoImu, CHIP)
