"""MPU-9250, MPU-9255 and MPU-6500: gyroscope and accelerometer through the FIFO (InvenSense RM-MPU-9250A-00 rev 1.6).

Registers are those of the MPU-6050, but for a filter of the accelerometer's own, a smaller FIFO and the scale of the
thermometer. The magnetometer inside an MPU-9250, the AK8963, is a chip of its own at 0x0C once bypass mode is on.
"""

import functools

from levelhead.sources.sensors import mpu6050
from levelhead.sources.sensors.bus import Port
from levelhead.sources.sensors.fifo_imu import ChipSettings, FifoImu, Registers
from levelhead.sources.sensors.invensense import build_chip

NAME = "MPU-9250"
ADDRESSES = (0x68, 0x69)
IDENTITY, MPU9255, MPU6500 = 0x71, 0x73, 0x70  # register 117
ACCEL_CONFIG_2, INT_PIN_CFG = 0x1D, 0x37
BYPASS_EN = 0x02  # INT_PIN_CFG
FIFO_SIZE = 512  # bytes


def configure(port: Port, settings: ChipSettings) -> None:
    """See ``FifoChip``; opens the bypass to the magnetometer as well."""
    identity = port.read(mpu6050.WHO_AM_I, 1)[0]
    if identity not in (MPU9255, MPU6500):
        port.expect(mpu6050.WHO_AM_I, IDENTITY)
    bandwidth = mpu6050.bandwidth_for(settings.rate)
    port.write(mpu6050.PWR_MGMT_1, mpu6050.DEVICE_RESET)
    port.wait(mpu6050.START_UP)
    port.write(mpu6050.PWR_MGMT_1, mpu6050.PLL_GYRO_X)
    port.write(INT_PIN_CFG, BYPASS_EN)
    port.write(mpu6050.CONFIG, bandwidth)
    port.write(ACCEL_CONFIG_2, bandwidth)
    port.write(mpu6050.SMPLRT_DIV, round(1000.0 / settings.rate) - 1)
    port.write(mpu6050.GYRO_CONFIG, settings.gyr_code)
    port.write(mpu6050.ACCEL_CONFIG, settings.acc_code)
    port.write(mpu6050.FIFO_EN, mpu6050.GYR_AND_ACC)


def output(data: bytes) -> Registers:
    """See ``FifoChip``: accelerometer, temperature (PS-MPU-9250A-01, 3.4.2), gyroscope."""
    a, b, c, temperature, x, y, z = mpu6050.SEVEN.unpack(data)
    return Registers((x, y, z), (a, b, c), temperature / 333.87 + 21.0)


CHIP = build_chip(
    NAME,
    ADDRESSES,
    base_rate=1000.0,
    code_shift=3,
    fifo_size=FIFO_SIZE,
    registers=(mpu6050.FIFO_COUNTH, mpu6050.FIFO_R_W, mpu6050.ACCEL_XOUT_H),
    configure=configure,
    empty=mpu6050.empty,
    output=output,
)
MPU9250 = functools.partial(FifoImu, CHIP)
