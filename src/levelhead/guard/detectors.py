"""What the readings alone tell, whatever filter they go to: rest, full scale, stuck axes, forces that are no gravity.

All that is told here is the same for every run over a recording, so lanes say it once for all of theirs. A reading that
is missing is left out: the slow mean stands for it where rest is looked for, and no other detector sees it.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.health import ACC_MISSING, ACC_SATURATED, ACC_STUCK, GYR_MISSING, GYR_SATURATED, GYR_STUCK
from levelhead.guard import Guard, square_off, toward
from levelhead.kernels.angle import DEGREE
from levelhead.kernels.tilt import GAP_SECONDS, GRAVITY
from levelhead.kernels.vec3 import ZERO, Vec3

SPELL = 0.02  # s: rest need not be looked for more often
SMOOTH = 0.5  # s, time constant of the means that rest is told by
FAST = 4.0  # rad/s: no gyroscope has a smaller full scale (250 °/s) than this
HARD = 19.0  # m/s²: no accelerometer has a smaller full scale (2 g) than this
PLATEAU = 0.997  # of the largest reading so far: readings above this may be clipped
NEAR = 0.7  # of the largest reading so far: who comes from below in two samples comes steeply
AT_FULL = 0.99  # of a full scale found: where it ends drifts with temperature
STEEP = 2.0  # 1/s, of the reading itself: a smooth peak that is flat for PLATEAU_SECONDS is reached at 0.6 at most
PLATEAU_SECONDS = 0.0199
NOT_ABRUPT = -1.0
LEAST = 1e-5  # rad/s, m/s²: no sensor has finer steps than this
STUCK_SAMPLES = 20.0
STUCK_SECONDS = 1.0  # of one value while another axis moves


class Sum(NamedTuple):
    """∫ rate dt and ∫ specific force dt of a spell, and its seconds."""

    x: float
    y: float
    z: float
    a: float
    b: float
    c: float
    spell: float


class Calm(NamedTuple):
    """Slow means of rate and specific force, and whether the last spell was near them: this may be rest."""

    gyr: Vec3
    acc: Vec3
    quiet: bool


class Extreme(NamedTuple):
    """The largest readings of a sensor so far, upwards and downwards (any axis), and whether they are its full scale.

    Calibration moves the two ends of a range by different amounts.
    """

    up: float
    down: float
    last: float  # largest component of the last reading
    before: float  # and of the one before
    stay: float  # s near the largest since it was reached abruptly; negative: it was not
    found: int  # 1: up is full scale, 2: down is
    clipped: bool


class Repeat(NamedTuple):
    """The last reading, which axes have repeated theirs since (bits 1, 2, 4), and for how many seconds."""

    last: Vec3
    axes: int
    spent: float


class Sensors(NamedTuple):
    """What is remembered of the readings, and what is wrong with the last of them."""

    sum: Sum
    calm: Calm
    fast: Extreme
    hard: Extreme
    gyr: Repeat
    acc: Repeat
    odd: bool  # the last specific force is too far from g
    was_odd: bool  # and so was it at the sample before
    health: int


NOTHING = Sum(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
BEFORE = Sensors(
    NOTHING,
    Calm(ZERO, ZERO, False),
    Extreme(FAST, FAST, 0.0, 0.0, NOT_ABRUPT, 0, False),
    Extreme(HARD, HARD, 0.0, 0.0, NOT_ABRUPT, 0, False),
    Repeat(ZERO, 0, 0.0),
    Repeat(ZERO, 0, 0.0),
    False,
    False,
    0,
)


@kernel
def gathered(sum: Sum, gyr: Vec3, acc: Vec3, dt: float) -> Sum:
    """One more sample of a spell, or the first one of the next."""
    x, y, z = gyr
    a, b, c = acc
    if sum.spell >= SPELL:
        return Sum(x * dt, y * dt, z * dt, a * dt, b * dt, c * dt, dt)
    p, q, r, u, v, w, spell = sum
    return Sum(p + x * dt, q + y * dt, r + z * dt, u + a * dt, v + b * dt, w + c * dt, spell + dt)


@kernel
def settled(guard: Guard, calm: Calm, sum: Sum, blind: bool) -> Calm:
    """After a spell: quiet when rate and specific force, averaged over it, stay near their own slow means."""
    mean, force, _ = calm
    x, y, z, a, b, c, dt = sum
    one = 1.0 / dt
    gyr = Vec3(x * one, y * one, z * one)
    acc = Vec3(a * one, b * one, c * one)
    gyr_limit = guard.rest_gyr * DEGREE
    quiet = square_off(mean, gyr) < gyr_limit * gyr_limit and square_off(force, acc) < guard.rest_acc * guard.rest_acc
    weight = dt / (SMOOTH + dt)
    return Calm(toward(mean, gyr, weight), toward(force, acc, weight), quiet and dt <= GAP_SECONDS and not blind)


@kernel
def clipped(extreme: Extreme, v: Vec3, full: float, dt: float) -> Extreme:
    """Whether a reading is at full scale: ``full`` if known (not 0), else the largest one so far if it is a plateau.

    A body slows down before it turns round; a clipped reading goes up steeply and then stays.
    """
    x, y, z = v
    up, down, last, before, stay, found, was = extreme
    far = NEAR * min(up, down)
    if full == 0.0 and -far < x < far and -far < y < far and -far < z < far:  # nearly always
        if last == 0.0 and not was:
            return extreme
        return Extreme(up, down, 0.0, 0.0, NOT_ABRUPT, found, False)
    high = max(x, y, z)
    low = -min(x, y, z)
    if full > 0.0:
        return Extreme(full, full, 0.0, 0.0, NOT_ABRUPT, 3, max(high, low) >= PLATEAU * full)
    upwards = high > low
    largest = high if upwards else low
    top = up if upwards else down
    side = 1 if upwards else 2
    if largest < PLATEAU * top:
        return Extreme(up, down, largest, last, NOT_ABRUPT, found, found & side != 0 and largest > AT_FULL * top)
    beyond = PLATEAU * largest > top
    if beyond and found & side != 0:
        found -= side  # it can say more than that
    if beyond or last < PLATEAU * top:
        rise = max(largest - last, last - before)
        stay = 0.0 if rise > STEEP * dt * largest else NOT_ABRUPT
    elif stay >= 0.0:
        stay += dt
        if stay >= PLATEAU_SECONDS:
            found |= side
        if found & side == 0:  # a plateau is as high as it began; where a full scale ends drifts with temperature
            return Extreme(up, down, largest, last, stay, found, False)
    return Extreme(max(up, high), max(down, low), largest, last, stay, found, found & side != 0)


@kernel
def repeated(repeat: Repeat, v: Vec3, dt: float) -> Repeat:
    """Which axes say the same again while another one moves; zero aside, which a simulation without noise says."""
    (a, b, c), axes, spent = repeat
    x, y, z = v
    if x != a and y != b and z != c:
        return Repeat(v, 0, 0.0)
    if abs(x - a) < LEAST and abs(y - b) < LEAST and abs(z - c) < LEAST:
        return repeat  # nothing moved: it may be a sensor without noise
    same = 0
    if x == a and x != 0.0:
        same |= 1
    if y == b and y != 0.0:
        same |= 2
    if z == c and z != 0.0:
        same |= 4
    if axes & same == 0:
        return Repeat(v, same, 0.0)
    return Repeat(v, axes & same, spent + dt)


@kernel
def stuck(repeat: Repeat, dt: float) -> bool:
    """Whether an axis says the same for long, and many times, while another one moves."""
    return repeat.spent > max(STUCK_SECONDS, STUCK_SAMPLES * dt)


@kernel
def far_from_g(guard: Guard, acc: Vec3) -> bool:
    """Whether the norm of a specific force is not that of gravity."""
    x, y, z = acc
    square = x * x + y * y + z * z
    low = max(GRAVITY - guard.acc_gate, 0.0)
    high = GRAVITY + guard.acc_gate
    return not low * low <= square <= high * high


@kernel
def sensed(guard: Guard, sensors: Sensors, gyr: Vec3, acc: Vec3, missing: int, blind: bool, dt: float) -> Sensors:
    """One sample.

    ``missing``: health bits of the readings that are not there; ``blind``: the rate has been missing for long.
    """
    sum, calm, fast, hard, gyr_repeat, acc_repeat, was_odd, _, _ = sensors
    odd = was_odd
    health = 0
    no_gyr = missing & GYR_MISSING != 0
    no_acc = missing & ACC_MISSING != 0
    sum = gathered(sum, calm.gyr if no_gyr else gyr, calm.acc if no_acc else acc, dt)
    if sum.spell >= SPELL:
        calm = settled(guard, calm, sum, blind)
    if not no_gyr:
        fast = clipped(fast, gyr, guard.gyr_range * DEGREE, dt)
        gyr_repeat = repeated(gyr_repeat, gyr, dt)
        if fast.clipped:
            health = GYR_SATURATED
        if stuck(gyr_repeat, dt):
            health |= GYR_STUCK
    if not no_acc:
        hard = clipped(hard, acc, guard.acc_range, dt)
        acc_repeat = repeated(acc_repeat, acc, dt)
        if hard.clipped:
            health |= ACC_SATURATED
        elif stuck(acc_repeat, dt):
            health |= ACC_STUCK
        odd = far_from_g(guard, acc)
    return Sensors(sum, calm, fast, hard, gyr_repeat, acc_repeat, odd, was_odd, health)
