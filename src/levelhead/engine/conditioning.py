"""What a recording says, sample by sample, before any filter is asked: the same for every run over it.

NaN marks a missing reading, the zero vector a sensor that does not exist. A missing rate is replaced by the last one,
for a while; any other missing reading corrects nothing.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.health import (
    ACC_MISSING,
    ACC_SATURATED,
    ACC_STUCK,
    GAP,
    GYR_MISSING,
    GYR_SATURATED,
    GYR_STUCK,
    MAG_MISSING,
)
from levelhead.filters.observer_covariance import SPELL
from levelhead.guard import Guard
from levelhead.guard.detectors import BEFORE, NOTHING, Calm, Sensors
from levelhead.kernels.tilt import GAP_SECONDS, TURN, present
from levelhead.kernels.vec3 import ZERO, Vec3

NO_READING = 1e9  # rad/s, m/s², µT: no sensor says that; NaN and infinity fail the comparison as well
ALL_THERE = NO_READING * NO_READING  # a sum of squares below that has no missing reading in it
BLIND = GYR_MISSING | GYR_SATURATED | GYR_STUCK  # the rate is a guess
NO_FORCE = ACC_SATURATED | ACC_STUCK
LOST = 0.1  # rad that a body may have turned unseen before the filter is told
BEYOND = 0.5  # of the full scale, 1σ: how much faster a body turns than a clipped gyroscope says


class Scene(NamedTuple):
    """The last sample as far as it can be believed, and what is remembered of those before."""

    gyr: Vec3  # rad/s; where it is missing the last good one
    acc: Vec3  # m/s²; the zero vector where it cannot be used
    mag: Vec3
    dt: float
    health: int  # what was wrong with it
    had_field: bool  # there was a magnetometer reading before it
    started: bool  # it has had a specific force by now, with which a filter can start
    idle: bool  # nothing is known of the turn in dt
    blind: float  # s since the last rate that could be believed
    lost: float  # rad², variance of a turn in this sample that nobody has seen
    spell: float  # s since σ was last judged
    seen: int  # what could correct since: 1 accelerometer, 2 magnetometer
    sensors: Sensors


EMPTY = Scene(ZERO, ZERO, ZERO, 0.0, 0, False, False, False, 0.0, 0.0, 0.0, 0, BEFORE)


@kernel
def missing(v: Vec3) -> bool:
    """Whether a reading is NaN, infinite or absurd in any component."""
    x, y, z = v
    return not (-NO_READING < x < NO_READING and -NO_READING < y < NO_READING and -NO_READING < z < NO_READING)


@kernel
def absent(gyr: Vec3, acc: Vec3, mag: Vec3) -> int:
    """Health bits of the readings that are missing."""
    x, y, z = gyr
    a, b, c = acc
    u, v, w = mag
    if (x * x + y * y + z * z) + (a * a + b * b + c * c) + (u * u + v * v + w * w) < ALL_THERE:
        return 0
    health = 0
    if missing(gyr):
        health = GYR_MISSING
    if missing(acc):
        health |= ACC_MISSING
    if missing(mag):
        health |= MAG_MISSING
    return health


@kernel
def unsensed(guard: Guard, sensors: Sensors, gyr: Vec3, acc: Vec3, missing: int, blind: bool, dt: float) -> Sensors:
    """``sensed`` where nothing stands in front of the filter."""
    return sensors


sense = unsensed


class Unseen(NamedTuple):
    """Seconds since the last rate that could be believed, and the variance of the turn in this sample (rad²)."""

    blind: float
    lost: float


SEEN = Unseen(0.0, 0.0)


@kernel
def unseen(health: int, blind: float, full: float, dt: float) -> Unseen:
    """How far the body may have turned while the rate was a guess; nothing as long as that is little."""
    if health & BLIND == 0:
        return SEEN
    reach = BEYOND * full if health & GYR_SATURATED else TURN
    before = reach * blind
    after = reach * (blind + dt)
    if after <= LOST:
        return Unseen(blind + dt, 0.0)
    return Unseen(blind + dt, after * after - (before * before if before > LOST else 0.0))


@kernel
def first(gyr: Vec3, acc: Vec3, mag: Vec3, health: int) -> Scene:
    """The first sample, which a filter starts with once it has a specific force."""
    _, _, fast, hard, gyr_repeat, acc_repeat, _, _, _ = BEFORE
    sensors = Sensors(NOTHING, Calm(gyr, acc, False), fast, hard, gyr_repeat, acc_repeat, False, False, 0)
    return Scene(gyr, acc, mag, 0.0, health, False, present(acc), False, 0.0, 0.0, 0.0, 0, sensors)


@kernel
def judging(scene: Scene) -> bool:
    """Whether a spell has ended, after which σ is judged."""
    return scene.spell >= SPELL or scene.lost > 0.0


@kernel
def perceived(guard: Guard, scene: Scene, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> Scene:
    """The next sample."""
    last, _, field, _, _, had_field, started, _, blind, _, spell, seen, sensors = scene
    health = absent(gyr, acc, mag)
    if health != 0:
        gyr = last if health & GYR_MISSING else gyr
        acc = ZERO if health & ACC_MISSING else acc
        mag = ZERO if health & MAG_MISSING else mag
    if not started:
        return first(gyr, acc, mag, health)
    out_of_sight = health & GYR_MISSING != 0 and blind > GAP_SECONDS
    sensors = sense(guard, sensors, gyr, acc, health, out_of_sight, dt)
    health |= sensors.health
    if sensors.health & NO_FORCE:
        acc = ZERO
    if judging(scene):
        spell = 0.0
        seen = 0
    if present(acc):
        seen |= 1
    if present(mag):
        seen |= 2
    if dt > GAP_SECONDS:
        health |= GAP
    blind, lost = unseen(health, blind, sensors.fast.up, dt)
    idle = out_of_sight or dt > GAP_SECONDS
    return Scene(
        gyr, acc, mag, dt, health, had_field or present(field), True, idle, blind, lost, spell + dt, seen, sensors
    )
