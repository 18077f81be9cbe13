"""LSM6DSO32: gyroscope and accelerometer through the tagged FIFO (ST DocID032891, registers; AN5192 for the FIFO)."""

import functools
import struct

from levelhead.sources.sensors.bus import Port
from levelhead.sources.sensors.fifo_imu import ChipSettings, FifoChip, FifoImu, FifoLevel, FifoRow, Registers
from levelhead.units import GRAVITY, factor

NAME = "LSM6DSO32"
ADDRESSES = (0x6A, 0x6B)
IDENTITY = 0x6C
FIFO_CTRL3, FIFO_CTRL4, WHO_AM_I = 0x09, 0x0A, 0x0F
CTRL1_XL, CTRL2_G, CTRL3_C = 0x10, 0x11, 0x12
OUT_TEMP_L, FIFO_STATUS1, FIFO_DATA_OUT_TAG = 0x20, 0x3A, 0x78
SW_RESET, BDU_AND_IF_INC = 0x01, 0x44  # CTRL3_C
BYPASS, CONTINUOUS = 0x00, 0x06  # FIFO_CTRL4
FIFO_WORDS, WORD = 512, 7  # a word is a tag and six bytes
OVERRUN = 0x48  # FIFO_STATUS2: FIFO_OVR_IA and the latched one
GYR_TAG, ACC_TAG = 0x01, 0x02
THREE, SEVEN = struct.Struct("<3h"), struct.Struct("<7h")
START_UP = 0.035  # s after power-up, table 3

# Size of a bit: table 3.
GYR_BITS = {125.0: 4.375e-3, 250.0: 8.75e-3, 500.0: 17.5e-3, 1000.0: 35e-3, 2000.0: 70e-3}  # °/s
ACC_BITS = {4.0: 0.122e-3, 8.0: 0.244e-3, 16.0: 0.488e-3, 32.0: 0.976e-3}  # g
GYR_CODES = {125.0: 0x02, 250.0: 0x00, 500.0: 0x04, 1000.0: 0x08, 2000.0: 0x0C}
ACC_CODES = {4.0: 0x00, 32.0: 0x04, 8.0: 0x08, 16.0: 0x0C}
RATES = {12.5: 1, 26.0: 2, 52.0: 3, 104.0: 4, 208.0: 5, 416.0: 6, 833.0: 7, 1667.0: 8, 3333.0: 9, 6667.0: 10}


def configure(port: Port, settings: ChipSettings) -> None:
    """See ``FifoChip``."""
    code = RATES[settings.rate]
    port.expect(WHO_AM_I, IDENTITY)
    port.write(CTRL3_C, SW_RESET)
    port.wait(START_UP)
    port.write(CTRL3_C, BDU_AND_IF_INC)
    port.write(CTRL1_XL, code << 4 | settings.acc_code)
    port.write(CTRL2_G, code << 4 | settings.gyr_code)
    port.write(FIFO_CTRL3, code << 4 | code)


def empty(port: Port) -> None:
    """See ``FifoChip``."""
    port.write(FIFO_CTRL4, BYPASS)
    port.write(FIFO_CTRL4, CONTINUOUS)


def level(data: bytes) -> FifoLevel | None:
    """See ``FifoChip``: the number of words, ten bits; in continuous mode an overrun drops the oldest words."""
    low, high = data
    return None if low == high == 0xFF else FifoLevel(low | (high & 0x03) << 8, bool(high & OVERRUN))


def rows(words: list[bytes]) -> tuple[list[FifoRow], list[bytes]]:
    """See ``FifoChip``: gyroscope and accelerometer words, paired in the order in which they come."""
    found: list[FifoRow] = []
    waiting: bytes | None = None
    for word in words:
        tag = word[0] >> 3
        if tag == GYR_TAG:
            waiting = word
        elif tag == ACC_TAG and waiting is not None:
            found.append(FifoRow(THREE.unpack_from(waiting, 1), THREE.unpack_from(word, 1)))
            waiting = None
    return found, [] if waiting is None else [waiting]


def output(data: bytes) -> Registers:
    """See ``FifoChip``: temperature (table 4), gyroscope, accelerometer."""
    temperature, x, y, z, a, b, c = SEVEN.unpack(data)
    return Registers((x, y, z), (a, b, c), temperature / 256.0 + 25.0)


CHIP = FifoChip(
    name=NAME,
    addresses=ADDRESSES,
    rates=list(RATES),
    gyr_bits={dps: bit * factor("gyr", "deg/s") for dps, bit in GYR_BITS.items()},
    acc_bits={g: bit * GRAVITY for g, bit in ACC_BITS.items()},
    gyr_codes=GYR_CODES,
    acc_codes=ACC_CODES,
    configure=configure,
    empty=empty,
    level_register=FIFO_STATUS1,
    level=level,
    fifo_register=FIFO_DATA_OUT_TAG,
    word_size=WORD,
    rows=rows,
    output_register=OUT_TEMP_L,
    output_size=14,
    output=output,
)
LSM6DSO32 = functools.partial(FifoImu, CHIP)
