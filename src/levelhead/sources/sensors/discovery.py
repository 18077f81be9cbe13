"""The chips that answer on an I²C bus: known ones, by the identity that each of them gives. Nothing is written."""

import errno
import re
from pathlib import Path
from typing import NamedTuple

from levelhead.errors import LevelheadError
from levelhead.sources.sensors import bmp280, bmp390, bno055, bno085, icm20948, icm42688, lsm6dso32, mpu6050, mpu9250
from levelhead.sources.sensors.ak09916 import AK09916
from levelhead.sources.sensors.ak8963 import AK8963
from levelhead.sources.sensors.bus import Bus, Port
from levelhead.sources.sensors.compass import HMC5883L, QMC5883L
from levelhead.sources.sensors.lis3mdl import LIS3MDL


class Signature(NamedTuple):
    """The signature of a chip: its name for ``--source``, its addresses, a register, and the value there."""

    name: str
    addresses: tuple[int, ...]
    register: int
    identity: bytes
    mask: int = 0xFF


class FoundChip(NamedTuple):
    """A chip that answers; "" is one that is not known."""

    address: int
    name: str


SIGNATURES = (
    Signature("mpu6050", mpu6050.ADDRESSES, mpu6050.WHO_AM_I, bytes([mpu6050.IDENTITY]), 0x7E),
    Signature("icm20948", icm20948.ADDRESSES, icm20948.WHO_AM_I, bytes([icm20948.IDENTITY])),
    Signature("mpu9250", mpu9250.ADDRESSES, mpu6050.WHO_AM_I, bytes([mpu9250.IDENTITY])),
    Signature("mpu9250", mpu9250.ADDRESSES, mpu6050.WHO_AM_I, bytes([mpu9250.MPU9255])),
    Signature("icm42688", icm42688.ADDRESSES, icm42688.WHO_AM_I, bytes([icm42688.IDENTITY])),
    Signature("lsm6dsox", lsm6dso32.ADDRESSES, lsm6dso32.WHO_AM_I, bytes([lsm6dso32.IDENTITY])),  # or another LSM6DSO
    Signature("bno055", bno055.ADDRESSES, bno055.CHIP_ID, bno055.IDENTITIES),
    Signature("lis3mdl", (LIS3MDL.address, 0x1E), LIS3MDL.WHO_AM_I, bytes([LIS3MDL.IDENTITY])),
    Signature("ak09916", (AK09916.address,), AK09916.WIA1, bytes(AK09916.IDENTITY)),
    Signature("ak8963", (AK8963.address,), AK8963.WIA, bytes([AK8963.IDENTITY])),
    Signature("hmc5883l", (HMC5883L.address,), HMC5883L.ID_A, HMC5883L.IDENTITY),
    Signature("qmc5883l", (QMC5883L.address,), QMC5883L.CHIP_ID, bytes([QMC5883L.IDENTITY])),
    Signature("bmp280", bmp280.ADDRESSES, bmp280.ID, bytes([bmp280.IDENTITY])),
    Signature("bmp390", bmp390.ADDRESSES, bmp390.ID, bytes([bmp390.IDENTITY])),
    Signature("bmp390", bmp390.ADDRESSES, bmp390.ID, bytes([bmp390.BMP388])),
)


def i2c_buses(folder: Path = Path("/dev")) -> list[int]:
    """Numbers of the I²C buses of this machine."""
    matches = (re.fullmatch(r"i2c-(\d+)", path.name) for path in folder.glob("i2c-*"))
    return sorted(int(match[1]) for match in matches if match)


def find_chips(bus: Bus) -> list[FoundChip]:
    """The chips that answer at the addresses of known ones.

    Raises:
        OSError: the bus itself does not work; a chip that is not there is no error.
    """
    found = []
    for address in sorted({address for one in SIGNATURES for address in one.addresses} | {*bno085.ADDRESSES}):
        answered, name = False, ""
        if address in bno085.ADDRESSES:
            name = "bno085" if _is_hub(bus, address) else ""
            answered = bool(name) or _read(bus, address, 0, 1) is not None
        for signature in SIGNATURES:
            if address not in signature.addresses or name:
                continue
            data = _read(bus, address, signature.register, len(signature.identity))
            if data is None:
                continue
            answered = True
            if bytes(byte & signature.mask for byte in data) == signature.identity:
                name = signature.name
        if answered:
            found.append(FoundChip(address, name))
    return found


def _read(bus: Bus, address: int, register: int, length: int) -> bytes | None:
    """Registers of a chip; None: the address is not acknowledged."""
    try:
        return bytes(bus.read_byte_data(address, register + i) for i in range(length))
    except OSError as error:
        if error.errno in (errno.EREMOTEIO, errno.ENXIO, errno.EIO):
            return None
        raise


def _is_hub(bus: Bus, address: int) -> bool:
    """Whether a packet of SHTP waits at the address, as after power-up and while reports are on."""
    try:
        head = Port(bus, address, bno085.NAME).receive(bno085.HEADER.size)
    except LevelheadError:
        return False
    length, channel, _ = bno085.HEADER.unpack(head)
    known: bool = bno085.HEADER.size < length & ~bno085.CONTINUED <= bno085.LONGEST
    return known and channel <= bno085.LAST_CHANNEL
