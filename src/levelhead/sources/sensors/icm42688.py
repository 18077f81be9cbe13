"""ICM-42688-P: gyroscope and accelerometer through the FIFO (TDK DS-000347 rev 1.6)."""

import functools
import struct

from levelhead.sources.sensors import invensense
from levelhead.sources.sensors.bus import Port
from levelhead.sources.sensors.fifo_imu import ChipSettings, FifoChip, FifoImu, FifoLevel, FifoRow, Registers
from levelhead.units import GRAVITY, factor

NAME = "ICM-42688-P"
ADDRESSES = (0x68, 0x69)
IDENTITY = 0x47
DEVICE_CONFIG, FIFO_CONFIG, TEMP_DATA1, FIFO_COUNTH, FIFO_DATA = 0x11, 0x16, 0x1D, 0x2E, 0x30
SIGNAL_PATH_RESET, PWR_MGMT0, GYRO_CONFIG0, ACCEL_CONFIG0, GYRO_ACCEL_CONFIG0 = 0x4B, 0x4E, 0x4F, 0x50, 0x52
FIFO_CONFIG1, WHO_AM_I, REG_BANK_SEL = 0x5F, 0x75, 0x76
SOFT_RESET, LOW_NOISE, FIFO_FLUSH, STREAM = 0x01, 0x0F, 0x02, 0x40
GYR_AND_ACC = 0x07  # FIFO_CONFIG1: temperature, gyroscope, accelerometer
FIFO_SIZE, PACKET = 2048, 16  # bytes; packet 3: header, accelerometer, gyroscope, temperature, time stamp (6.1)
SIX, SEVEN = struct.Struct(">6h"), struct.Struct(">7h")
INVALID = -32768  # a sensor that has just been switched on
RESET_TIME, START_UP = 1e-3, 0.045  # s: register 0x11; gyroscope, table 1

# LSB per unit, tables 1 and 2; the codes count down.
GYR_COUNTS = {2000.0: 16.4, 1000.0: 32.8, 500.0: 65.5, 250.0: 131.0, 125.0: 262.0}  # °/s
ACC_COUNTS = dict(reversed(invensense.ACC_COUNTS.items()))  # g
RATES = {12.5: 11, 25.0: 10, 50.0: 9, 100.0: 8, 200.0: 7, 500.0: 15, 1000.0: 6, 2000.0: 5, 4000.0: 4, 8000.0: 3}
BANDWIDTH_SHARES = {2: 0, 4: 1, 5: 2, 8: 3, 10: 4, 16: 5, 20: 6, 40: 7}  # of the larger of 400 Hz and the rate


def configure(port: Port, settings: ChipSettings) -> None:
    """See ``FifoChip``."""
    port.write(REG_BANK_SEL, 0x00)
    port.expect(WHO_AM_I, IDENTITY)
    port.write(DEVICE_CONFIG, SOFT_RESET)
    port.wait(RESET_TIME)
    code, fastest = RATES[settings.rate], max(400.0, settings.rate)
    bandwidth = next((one for n, one in BANDWIDTH_SHARES.items() if fastest / n <= 0.5 * settings.rate), 7)
    port.write(GYRO_CONFIG0, settings.gyr_code | code)
    port.write(ACCEL_CONFIG0, settings.acc_code | code)
    port.write(GYRO_ACCEL_CONFIG0, bandwidth << 4 | bandwidth)
    port.write(PWR_MGMT0, LOW_NOISE)
    port.wait(START_UP)
    port.write(FIFO_CONFIG1, GYR_AND_ACC)
    port.write(FIFO_CONFIG, STREAM)


def empty(port: Port) -> None:
    """See ``FifoChip``."""
    port.write(SIGNAL_PATH_RESET, FIFO_FLUSH)


def level(data: bytes) -> FifoLevel | None:
    """See ``FifoChip``: the number of bytes; a full FIFO drops the oldest packets."""
    count = int.from_bytes(data, "big")
    return None if count > FIFO_SIZE else FifoLevel(count // PACKET, count > FIFO_SIZE - PACKET)


def rows(words: list[bytes]) -> tuple[list[FifoRow], list[bytes]]:
    """See ``FifoChip``: packets whose readings are valid."""
    found = []
    for packet in words:
        a, b, c, x, y, z = SIX.unpack_from(packet, 1)
        if {INVALID} not in ({a, b, c}, {x, y, z}):
            found.append(FifoRow((x, y, z), (a, b, c)))
    return found, []


def output(data: bytes) -> Registers:
    """See ``FifoChip``: temperature (4.13), accelerometer, gyroscope."""
    temperature, a, b, c, x, y, z = SEVEN.unpack(data)
    return Registers((x, y, z), (a, b, c), temperature / 132.48 + 25.0)


CHIP = FifoChip(
    name=NAME,
    addresses=ADDRESSES,
    rates=list(RATES),
    gyr_bits={dps: factor("gyr", "deg/s") / counts for dps, counts in GYR_COUNTS.items()},
    acc_bits={g: GRAVITY / counts for g, counts in ACC_COUNTS.items()},
    gyr_codes={dps: code << 5 for code, dps in enumerate(GYR_COUNTS)},
    acc_codes={g: code << 5 for code, g in enumerate(ACC_COUNTS)},
    configure=configure,
    empty=empty,
    level_register=FIFO_COUNTH,
    level=level,
    fifo_register=FIFO_DATA,
    word_size=PACKET,
    rows=rows,
    output_register=TEMP_DATA1,
    output_size=14,
    output=output,
)
ICM42688 = functools.partial(FifoImu, CHIP)
