"""The magnetometers beside the chips of a sketch: the writes that wake them, and the axis of each register.

The sketch makes the writes of levelhead's own drivers: AK8963 in the MPU-9250 (AKM MS1356-E-02), AK09916 in the
ICM-20948 (TDK DS-000189), LIS3MDL beside an LSM6DS chip (ST DocID024204, rev. 6).
"""

from typing import NamedTuple

from levelhead.export.config import ExportConfig
from levelhead.export.layout import template
from levelhead.export.register_writes import WriteRecorder, write_calls
from levelhead.open_types import Untyped
from levelhead.sources.sensors.ak09916 import AK09916
from levelhead.sources.sensors.ak8963 import AK8963
from levelhead.sources.sensors.compass import GAUSS
from levelhead.sources.sensors.lis3mdl import LIS3MDL


class FieldRegisters(NamedTuple):
    """A magnetometer as a sketch reads it: a status byte, x, y and z with the low byte first, and the bytes behind.

    Attributes:
        driver: levelhead's.
        status: its register.
        size: bytes of a burst.
        ready: bit of the first byte that is set where there is a new reading.
        overflow: bit of the last byte that is set where the field is beyond the range; 0: there is none.
        axes: its x, y, z as 1, 2, 3, with a sign, that are x, y and z of the inertial chip.
        scale: µT per count.
    """

    driver: type[Untyped]
    status: int
    size: int
    ready: int
    overflow: int
    axes: tuple[int, int, int]
    scale: float


IN_MPU9250 = FieldRegisters(
    AK8963, AK8963.ST1, 8, AK8963.DATA_READY, AK8963.OVERFLOW, (2, 1, -3), AK8963.SCALE
)  # PS-MPU-9250A-01, figures 4 and 5
IN_ICM20948 = FieldRegisters(
    AK09916, AK09916.ST1, 9, AK09916.DATA_READY, AK09916.OVERFLOW, (1, -2, -3), AK09916.SCALE
)  # DS-000189, figures 12 and 13
BESIDE_LSM6DS = FieldRegisters(
    LIS3MDL, LIS3MDL.STATUS | LIS3MDL.INCREMENT, 7, LIS3MDL.READY, 0, (1, 2, 3), GAUSS / LIS3MDL.COUNTS[4.0]
)
ON = {"MPU-9250": IN_MPU9250, "ICM-20948": IN_ICM20948}
LIS3MDL_BOARD = "+LIS3MDL"  # behind the name of a chip: a board with both


def find_magnetometer(config: ExportConfig, chip: str) -> FieldRegisters | None:
    """The magnetometer that a sketch reads; None: there is none, or the filter does not use one."""
    if config.axis or "mag" in config.without or "mag" not in config.flt.uses:
        return None
    return BESIDE_LSM6DS if chip.endswith(LIS3MDL_BOARD) else ON.get(chip)


def field_reader(found: FieldRegisters) -> str:
    """The functions of a sketch that start a magnetometer and read it."""
    bus: Untyped = None
    driver, recorder = found.driver(bus), WriteRecorder()
    driver.port = recorder
    driver.start()
    register, value, mask = recorder.identity
    calls = list(write_calls("MAGNETOMETER", recorder.writes))
    factor, before = "MAG_COUNT", ""
    for at, sensitivities in recorder.reads:
        calls.insert(at, "read_sensitivities()")
        factor = "mag_count[{i}]"
        before = template("sketch.ak8963.ino").substitute(register=f"0x{sensitivities:02X}")
    lines = []
    for k, axis in enumerate(found.axes):
        i = abs(axis) - 1
        count = f"(int16_t)((uint16_t)bytes[{2 * i + 2}] << 8 | bytes[{2 * i + 1}])"
        lines.append(f"  mag[{k}] = {'-' if axis < 0 else ''}{factor.format(i=i)} * {count};")
    head = f"const uint8_t MAGNETOMETER = 0x{driver.address:02X};\nconst float MAG_COUNT = {found.scale:.8g}f;  // uT\n"
    return f"{head}\n{before}" + template("sketch.mag.ino").substitute(
        identity=f"0x{register:02X}",
        value=f"0x{value:02X}",
        mask=f"0x{mask:02X}",
        starts="\n    && ".join(calls),
        status=f"0x{found.status:02X}",
        size=found.size,
        fresh=f"bytes[0] & 0x{found.ready:02X}"
        + (f" && !(bytes[{found.size - 1}] & 0x{found.overflow:02X})" if found.overflow else ""),
        lines="\n".join(lines),
    )
