"""The emulated chips of a board on one emulated bus."""

from collections.abc import Callable

from levelhead.sources.sensors.board import BoardSpec
from levelhead.sources.sensors.emulated.barometer import EmulatedBMP280, EmulatedBMP390
from levelhead.sources.sensors.emulated.base import EmulatedChip
from levelhead.sources.sensors.emulated.bus import EmulatedBus
from levelhead.sources.sensors.emulated.hubs import EmulatedBNO055, EmulatedBNO085
from levelhead.sources.sensors.emulated.icm42688 import EmulatedICM42688
from levelhead.sources.sensors.emulated.imus import (
    EmulatedICM20948,
    EmulatedLSM6DSO32,
    EmulatedLSM6DSOX,
    EmulatedMPU6050,
    EmulatedMPU9250,
)
from levelhead.sources.sensors.emulated.magnetometers import (
    EmulatedAK09916,
    EmulatedAK8963,
    EmulatedHMC5883L,
    EmulatedLIS3MDL,
    EmulatedQMC5883L,
)
from levelhead.sources.sensors.emulated.world import World

INERTIAL: dict[str, Callable[..., EmulatedChip]] = {
    "mpu6050": EmulatedMPU6050,
    "mpu9250": EmulatedMPU9250,
    "lsm6dsox": EmulatedLSM6DSOX,
    "lsm6dso32": EmulatedLSM6DSO32,
    "icm20948": EmulatedICM20948,
    "icm42688": EmulatedICM42688,
    "bno055": EmulatedBNO055,
    "bno085": EmulatedBNO085,
}
MAGNETIC: dict[str, Callable[..., EmulatedChip]] = {
    "hmc5883l": EmulatedHMC5883L,
    "qmc5883l": EmulatedQMC5883L,
    "lis3mdl": EmulatedLIS3MDL,
}
BEHIND_A_BYPASS: dict[str, Callable[..., EmulatedChip]] = {"ak8963": EmulatedAK8963, "ak09916": EmulatedAK09916}
BAROMETRIC: dict[str, Callable[..., EmulatedChip]] = {"bmp280": EmulatedBMP280, "bmp390": EmulatedBMP390}


def emulate_board(wanted: BoardSpec, world: World, *, drift: float = 0.0) -> EmulatedBus:
    """A bus with the chips of a board.

    Args:
        wanted: which chips.
        world: their motion.
        drift: by which share the clock of the inertial chip is fast.
    """
    where = {} if wanted.address is None else {"address": wanted.address}
    inertial = INERTIAL[wanted.inertial](world, drift=drift, **where)
    chips = [inertial]
    if wanted.mag in BEHIND_A_BYPASS:
        chips.append(BEHIND_A_BYPASS[wanted.mag](world, inertial if hasattr(inertial, "bypassed") else None))
    elif wanted.mag is not None:
        chips.append(MAGNETIC[wanted.mag](world))
    if wanted.baro is not None:
        chips.append(BAROMETRIC[wanted.baro](world))
    return EmulatedBus(*chips)
