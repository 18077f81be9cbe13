"""The emulated chips of a board on one emulated bus."""

from levelhead.sources.sensors.board import BoardSpec
from levelhead.sources.sensors.emulated.barometer import EmulatedBMP280
from levelhead.sources.sensors.emulated.base import EmulatedChip
from levelhead.sources.sensors.emulated.bus import EmulatedBus
from levelhead.sources.sensors.emulated.imus import EmulatedICM20948, EmulatedLSM6DSO32, EmulatedMPU6050
from levelhead.sources.sensors.emulated.magnetometers import EmulatedAK09916, EmulatedHMC5883L, EmulatedQMC5883L
from levelhead.sources.sensors.emulated.world import World


def emulate_board(wanted: BoardSpec, world: World, *, drift: float = 0.0) -> EmulatedBus:
    """A bus with the chips of a board.

    Args:
        wanted: which chips.
        world: what they feel.
        drift: by which share the clock of the inertial chip is fast.
    """
    inertial: EmulatedChip
    where = {} if wanted.address is None else {"address": wanted.address}
    if wanted.inertial == "mpu6050":
        inertial = EmulatedMPU6050(world, drift=drift, **where)
    elif wanted.inertial == "lsm6dso32":
        inertial = EmulatedLSM6DSO32(world, drift=drift, **where)
    else:
        inertial = EmulatedICM20948(world, drift=drift, **where)
    chips: list[EmulatedChip] = [inertial]
    if wanted.mag == "ak09916":
        chips.append(EmulatedAK09916(world, inertial if isinstance(inertial, EmulatedICM20948) else None))
    elif wanted.mag is not None:
        chips.append({"hmc5883l": EmulatedHMC5883L, "qmc5883l": EmulatedQMC5883L}[wanted.mag](world))
    if wanted.baro:
        chips.append(EmulatedBMP280(world))
    return EmulatedBus(*chips)
