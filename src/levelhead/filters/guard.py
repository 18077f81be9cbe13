"""What is done about bad readings before a filter sees them: once, the same for all filters.

At rest the gyroscope's bias is read off and taken away; readings at full scale, stuck axes, accelerations that are no
gravity and fields that are not the earth's are told apart and held back, for a bounded time only. ``look`` says for
every sample what the filter may see, what was held back and why (``filters.health``).
"""

from math import pi, sqrt
from typing import Annotated, NamedTuple

from levelhead.filters.contract import Param, parameters
from levelhead.filters.health import (
    ACC_REJECTED,
    ACC_SATURATED,
    ACC_STUCK,
    AT_REST,
    GYR_SATURATED,
    GYR_STUCK,
    MAG_LEARNED,
    MAG_REJECTED,
)
from levelhead.kernels import quat
from levelhead.kernels.gain import share
from levelhead.kernels.jit import kernel
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GAP_SECONDS, GRAVITY, present
from levelhead.kernels.vec3 import ZERO, Vec3, add, dot, norm, scale, sub

DEGREE = pi / 180.0
SPELL = 0.02  # s: rest need not be looked for more often
SMOOTH = 0.5  # s, time constant of the means that rest is told by
CHANGE = (2.0 * DEGREE) * (2.0 * DEGREE)  # (rad/s)², of a bias once known
BIAS_TAU = 10.0  # s over which rest averages the bias
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
FIRST_AGE = 1e-3  # s: what one reading counts
FIELD_TAU = 20.0  # s over which the field is learned
TAKES_BIAS = True  # what the filter judges by itself is left to it
TELLS_FIELD = True


@parameters()
class Guard(NamedTuple):
    """What counts as rest, as saturation and as disturbance; the defaults need no thought."""

    gyr_range: Annotated[float, Param("deg/s", "full scale of the gyroscope; 0: found when it clips", low=0.0)] = 0.0
    acc_range: Annotated[float, Param("m/s²", "full scale of the accelerometer; 0: found when it clips", low=0.0)] = 0.0
    rest_gyr: Annotated[
        float, Param("deg/s", "rest: rate off its mean, at most", low=0.0, sweep=(0.2, 10.0), log=True)
    ] = 2.0
    rest_acc: Annotated[
        float, Param("m/s²", "rest: specific force off its mean, at most", low=0.0, sweep=(0.05, 3.0), log=True)
    ] = 0.5
    rest_time: Annotated[float, Param("s", "rest: for so long", low=0.0, sweep=(0.3, 5.0), log=True)] = 1.5
    bias_limit: Annotated[
        float,
        Param("deg/s", "rest: a mean rate beyond this is a turn and no bias", low=0.0, sweep=(0.5, 20.0), log=True),
    ] = 15.0
    acc_gate: Annotated[
        float, Param("m/s²", "accelerating: | |a| − g |, more than", low=0.0, sweep=(1.0, 300.0), log=True)
    ] = 100.0
    acc_angle: Annotated[
        float,
        Param("deg", "accelerating: and so far from the predicted vertical", low=0.0, sweep=(1.0, 90.0), log=True),
    ] = 20.0
    acc_time: Annotated[
        float, Param("s", "accelerating: believed again after", low=0.0, sweep=(0.1, 10.0), log=True)
    ] = 2.0
    mag_gate: Annotated[
        float, Param("", "disturbed: norm off the learned one by this share", low=0.0, sweep=(0.02, 1.0), log=True)
    ] = 0.1
    mag_angle: Annotated[
        float, Param("deg", "disturbed: or dip off the learned one", low=0.0, sweep=(1.0, 90.0), log=True)
    ] = 10.0
    mag_time: Annotated[
        float,
        Param("s", "disturbed: the new field is taken for the earth's after", low=0.0, sweep=(1.0, 100.0), log=True),
    ] = 20.0


class Rest(NamedTuple):
    """Slow means of rate and specific force, seconds of stillness, and the bias read off (rad/s)."""

    gyr: Vec3
    acc: Vec3
    still: float
    bias: Vec3
    turned: Vec3  # ∫ rate dt and ∫ specific force dt since they were last looked at, and for how many seconds
    pushed: Vec3
    spell: float


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


class Field(NamedTuple):
    """The earth's field as learned: norm, sine of its angle above the horizon; seconds learned, seconds rejected."""

    norm: float
    dip: float
    age: float
    out: float


class Watch(NamedTuple):
    """All that is remembered from sample to sample."""

    rest: Rest
    fast: Extreme
    hard: Extreme
    gyr: Repeat
    acc: Repeat
    acc_out: float  # seconds for which the accelerometer has been rejected
    field: Field


class Look(NamedTuple):
    """What the filter may see of a sample (zero vector: nothing), and what is known about it."""

    gyr: Vec3
    acc: Vec3
    mag: Vec3
    health: int
    watch: Watch


BEFORE = Watch(
    Rest(ZERO, ZERO, 0.0, ZERO, ZERO, ZERO, 0.0),
    Extreme(FAST, FAST, 0.0, 0.0, NOT_ABRUPT, 0, False),
    Extreme(HARD, HARD, 0.0, 0.0, NOT_ABRUPT, 0, False),
    Repeat(ZERO, 0, 0.0),
    Repeat(ZERO, 0, 0.0),
    0.0,
    Field(0.0, 0.0, 0.0, 0.0),
)


@kernel
def square_off(mean: Vec3, v: Vec3) -> float:
    """|v − mean|²"""
    x = v.x - mean.x
    y = v.y - mean.y
    z = v.z - mean.z
    return x * x + y * y + z * z


@kernel
def toward(mean: Vec3, v: Vec3, weight: float) -> Vec3:
    """mean + weight (v − mean)"""
    a, b, c = mean
    x, y, z = v
    return Vec3(a + weight * (x - a), b + weight * (y - b), c + weight * (z - c))


@kernel
def gathered(rest: Rest, gyr: Vec3, acc: Vec3, dt: float) -> Rest:
    """One more sample."""
    mean, force, still, bias, (a, b, c), (d, e, f), spell = rest
    x, y, z = gyr
    turned = Vec3(a + x * dt, b + y * dt, c + z * dt)
    x, y, z = acc
    return Rest(mean, force, still, bias, turned, Vec3(d + x * dt, e + y * dt, f + z * dt), spell + dt)


@kernel
def turning(guard: Guard, mean: Vec3, bias: Vec3, own: Vec3) -> bool:
    """Whether a steady rate is a turn and no bias: too large for any, or far from what is known of it.

    A gyroscope may be turned on with a large bias, but does not change it by much, unless what was known came from a
    steady turn: a smaller one is believed.
    """
    limit = guard.bias_limit * DEGREE
    square = square_off(ZERO, mean)
    if square > limit * limit:
        return True
    if not present(bias):
        return False
    known = add(bias, own)
    before = square_off(ZERO, known)
    return before > 0.0 and square > before and square_off(known, mean) > CHANGE


@kernel
def rested(guard: Guard, rest: Rest, own: Vec3) -> Rest:
    """Rest is when rate and specific force, averaged over ``SPELL``, stay near their own slow means for a while.

    The bias then goes to the mean rate, less what the filter itself takes away (``own``), as a running mean.
    """
    mean, force, still, bias, turned, pushed, dt = rest
    gyr = scale(turned, 1.0 / dt)
    acc = scale(pushed, 1.0 / dt)
    gyr_limit = guard.rest_gyr * DEGREE
    quiet = square_off(mean, gyr) < gyr_limit * gyr_limit and square_off(force, acc) < guard.rest_acc * guard.rest_acc
    weight = dt / (SMOOTH + dt)
    mean = toward(mean, gyr, weight)
    force = toward(force, acc, weight)
    if not quiet or dt > GAP_SECONDS or turning(guard, mean, bias, own):
        return Rest(mean, force, 0.0, bias, ZERO, ZERO, 0.0)
    still += dt
    learned = still - guard.rest_time
    if learned > 0.0:
        bias = toward(bias, sub(mean, own), share(BIAS_TAU, learned, dt))
    return Rest(mean, force, still, bias, ZERO, ZERO, 0.0)


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
def predicted_up(attitude: Quat, gyr: Vec3, dt: float) -> Vec3:
    """The vertical in the sensor frame, ``dt`` after it had this attitude, to first order."""
    x, y, z = quat.up(attitude)
    a, b, c = gyr
    return Vec3(x + dt * (y * c - z * b), y + dt * (z * a - x * c), z + dt * (x * b - y * a))


@kernel
def accelerating(guard: Guard, attitude: Quat, gyr: Vec3, acc: Vec3, dt: float) -> bool:
    """Whether specific force is no gravity: its norm is not g, and it is far from the predicted vertical."""
    x, y, z = acc
    square = x * x + y * y + z * z
    low = max(GRAVITY - guard.acc_gate, 0.0)
    high = GRAVITY + guard.acc_gate
    if low * low <= square <= high * high:
        return False
    a, b, c = predicted_up(attitude, gyr, dt)
    return a * x + b * y + c * z < sqrt(square) * (1.0 - 0.5 * guard.acc_angle * guard.acc_angle * (DEGREE * DEGREE))


@kernel
def first_field(up: Vec3, mag: Vec3) -> Field:
    """The field at the start, which the attitude was made of."""
    if not present(mag):
        return Field(0.0, 0.0, 0.0, 0.0)
    n = norm(mag)
    return Field(n, dot(up, mag) / n, FIRST_AGE, 0.0)


@kernel
def learned(guard: Guard, field: Field, up: Vec3, mag: Vec3, dt: float) -> Field:
    """The field after a reading; ``out`` > 0: it is not the earth's, and was not learned from.

    Norm and dip within the bounds are averaged into the reference. What stays outside for long enough becomes the new
    reference: the room was changed, not the moment. A reference that was learned for a moment, perhaps while the
    attitude was still wrong, is given up as soon.
    """
    strength, dip, age, out = field
    x, y, z = mag
    n = sqrt(x * x + y * y + z * z)
    a, b, c = up
    d = (a * x + b * y + c * z) / n
    if age == 0.0 or out > min(guard.mag_time, age):
        return Field(n, d, dt, 0.0)
    if abs(n - strength) > guard.mag_gate * strength or abs(d - dip) > guard.mag_angle * DEGREE:
        return Field(strength, dip, age, out + dt)
    weight = share(FIELD_TAU, age, dt)
    return Field(strength + weight * (n - strength), dip + weight * (d - dip), min(age + dt, FIELD_TAU), 0.0)


@kernel
def refusal(guard: Guard, hard: Extreme, repeat: Repeat, out: float, dt: float) -> int:
    """Why the accelerometer is not used: a health bit, or 0."""
    if hard.clipped:
        return ACC_SATURATED
    if stuck(repeat, dt):
        return ACC_STUCK
    if 0.0 < out < guard.acc_time:
        return ACC_REJECTED
    return 0


@kernel
def look(guard: Guard, watch: Watch, attitude: Quat, own: Vec3, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> Look:
    """What of a sample the filter may see.

    ``attitude`` is the filter's, one sample old, ``own`` the bias that it takes away by itself.
    """
    rest, fast, hard, gyr_repeat, acc_repeat, out, field = watch
    health = 0
    rest = gathered(rest, gyr, acc if present(acc) else rest.acc, dt)
    if rest.spell >= SPELL:
        rest = rested(guard, rest, own)
    if rest.still > guard.rest_time:
        health = AT_REST
    fast = clipped(fast, gyr, guard.gyr_range * DEGREE, dt)
    if fast.clipped:
        health |= GYR_SATURATED
    gyr_repeat = repeated(gyr_repeat, gyr, dt)
    if stuck(gyr_repeat, dt):
        health |= GYR_STUCK
    x, y, z = gyr
    if TAKES_BIAS:
        a, b, c = rest.bias
        gyr = Vec3(x - a, y - b, z - c)
    if present(acc):
        hard = clipped(hard, acc, guard.acc_range, dt)
        acc_repeat = repeated(acc_repeat, acc, dt)
        out = out + dt if accelerating(guard, attitude, gyr, acc, dt) else 0.0
        refused = refusal(guard, hard, acc_repeat, out, dt)
        if refused != 0:
            health |= refused
            acc = ZERO
    if TELLS_FIELD and present(mag):
        field = learned(guard, field, predicted_up(attitude, gyr, dt), mag, dt)
        if field.out > 0.0:
            health |= MAG_REJECTED
            mag = ZERO
        elif field.age <= dt:
            health |= MAG_LEARNED
    return Look(gyr, acc, mag, health, Watch(rest, fast, hard, gyr_repeat, acc_repeat, out, field))
