"""The common part of InvenSense's IMUs: full scales and their bits, and the rows of the FIFO."""

import struct
from collections.abc import Callable

from levelhead.sources.sensors.bus import Port
from levelhead.sources.sensors.fifo_imu import ChipSettings, FifoChip, FifoLevel, FifoRow, Registers
from levelhead.units import GRAVITY, factor

# LSB per unit: PS-MPU-6000A-00 rev 3.4, 6.1 and 6.2; DS-000189, tables 1 and 2.
GYR_COUNTS = {250.0: 131.0, 500.0: 65.5, 1000.0: 32.8, 2000.0: 16.4}  # °/s
ACC_COUNTS = {2.0: 16384.0, 4.0: 8192.0, 8.0: 4096.0, 16.0: 2048.0}  # g
ROW = 12  # bytes
SIX = struct.Struct(">6h")


def rows(words: list[bytes]) -> tuple[list[FifoRow], list[bytes]]:
    """See ``FifoChip``: 12 bytes, big-endian: accelerometer x, y, z, gyroscope x, y, z."""
    found = []
    for word in words:
        a, b, c, x, y, z = SIX.unpack(word)
        found.append(FifoRow((x, y, z), (a, b, c)))
    return found, []


def build_chip(
    name: str,
    addresses: tuple[int, int],
    base_rate: float,
    code_shift: int,
    fifo_size: int,
    registers: tuple[int, int, int],
    configure: Callable[[Port, ChipSettings], None],
    empty: Callable[[Port], None],
    output: Callable[[bytes], Registers],
) -> FifoChip:
    """Rates are ``base_rate`` in Hz by 1 to 256; codes of full scale begin at bit ``code_shift``.

    ``registers``: of the FIFO's level, of its data, and the first one of the 14 bytes with the newest sample.
    ``fifo_size`` in bytes is not a multiple of a row: a full FIFO has lost its rows' boundaries, or the newest rows.
    """

    def level(data: bytes) -> FifoLevel | None:
        count = int.from_bytes(data, "big")
        return None if count > fifo_size else FifoLevel(count // ROW, count > fifo_size - ROW)

    level_register, fifo_register, output_register = registers
    return FifoChip(
        name=name,
        addresses=addresses,
        rates=[base_rate / (1 + divider) for divider in range(256)],
        gyr_bits={dps: factor("gyr", "deg/s") / counts for dps, counts in GYR_COUNTS.items()},
        acc_bits={g: GRAVITY / counts for g, counts in ACC_COUNTS.items()},
        gyr_codes={dps: code << code_shift for code, dps in enumerate(GYR_COUNTS)},
        acc_codes={g: code << code_shift for code, g in enumerate(ACC_COUNTS)},
        configure=configure,
        empty=empty,
        level_register=level_register,
        level=level,
        fifo_register=fifo_register,
        word_size=ROW,
        rows=rows,
        output_register=output_register,
        output_size=14,
        output=output,
    )
