"""Rest of the sensor, and its gyroscope bias at rest: the only place where that is decided.

Rate and specific force are averaged over short intervals. The sensor is quiet while these averages stay near their own
slow means, and at rest once it has been quiet for ``rest_time`` with a mean rate that is not a steady turn. At rest the
mean rate is the bias. Before it has moved for the first time, a sensor that is n times as quiet as it has to be needs a
n-th of that time: most lie still when they are switched on, and many not for long.
"""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.guard.params import Guard
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.lowpass import lowpass_weight
from levelhead.kernels.tilt import GAP_SECONDS
from levelhead.kernels.vec3 import ZERO, Vec3, add, add_scaled, scale, sub
from levelhead.units import DEGREE

INTERVAL = 0.02  # s over which readings are averaged
MEAN_TIME = 0.5  # s, time constant of the slow means
FASTEST = 5.0  # the pace of rest of a sensor that does not move at all: noise may be a fifth of the bounds
BIAS_CHANGE = (2.0 * DEGREE) * (2.0 * DEGREE)  # (rad/s)², by which a bias may differ from the known one
BIAS_TIME = 10.0  # s, time constant of the bias at rest


class Sums(NamedTuple):
    """∫ rate dt (rad) and ∫ specific force dt (m/s) over an interval, its length (s), and whether it ends here."""

    gyr: Vec3
    acc: Vec3
    time: float
    complete: bool


class SlowMeans(NamedTuple):
    """Slow means of rate (rad/s) and specific force (m/s²), and how near the last interval was to them."""

    gyr: Vec3
    acc: Vec3
    pace: float  # at which the last interval counts for rest: how many times nearer to them it was than it has to be


class Rest(NamedTuple):
    """The time for which the sensor has been quiet, and its bias."""

    time: float  # s; of the first rest times its pace
    bias: Vec3  # rad/s, of the gyroscope, that was read off at rest
    moved: bool  # since the start
    known: bool  # the bias was read off


NO_SUMS = Sums(gyr=ZERO, acc=ZERO, time=0.0, complete=False)


@kernel
def distance2(mean: Vec3, v: Vec3) -> float:
    """|v − mean|²"""
    x = v.x - mean.x
    y = v.y - mean.y
    z = v.z - mean.z
    return x * x + y * y + z * z


@kernel
def blend(mean: Vec3, v: Vec3, weight: float) -> Vec3:
    """mean + weight (v − mean)"""
    a, b, c = mean
    x, y, z = v
    return Vec3(a + weight * (x - a), b + weight * (y - b), c + weight * (z - c))


@kernel
def add_sample(sums: Sums, gyr: Vec3, acc: Vec3, dt: float) -> Sums:
    """Adds a sample (rad/s, m/s², ``dt`` s) to the interval, or begins the next one with it."""
    before = NO_SUMS if sums.complete else sums
    time = before.time + dt
    return Sums(
        gyr=add_scaled(before.gyr, gyr, dt),
        acc=add_scaled(before.acc, acc, dt),
        time=time,
        complete=has_elapsed(time, dt, INTERVAL),
    )


@kernel
def pace_of_rest(guard: Guard, means: SlowMeans, gyr: Vec3, acc: Vec3) -> float:
    """How many times nearer to the slow means the averages of an interval are than they have to be; 0: they are not."""
    rate2 = guard.rest_gyr * guard.rest_gyr * (DEGREE * DEGREE)
    force2 = guard.rest_acc * guard.rest_acc
    turn2 = distance2(means.gyr, gyr)
    push2 = distance2(means.acc, acc)
    if turn2 >= rate2 or push2 >= force2:
        return 0.0
    return 1.0 / sqrt(max(turn2 / rate2, push2 / force2, 1.0 / (FASTEST * FASTEST)))


@kernel
def update_means(guard: Guard, means: SlowMeans, sums: Sums, blind: bool) -> SlowMeans:
    """The slow means after an interval; quiet if its averages are within ``rest_gyr`` and ``rest_acc`` of them.

    ``blind``: the rate has been missing for long.
    """
    dt = sums.time
    one = 1.0 / dt
    gyr, acc = scale(sums.gyr, one), scale(sums.acc, one)
    pace = 0.0 if dt > GAP_SECONDS or blind else pace_of_rest(guard, means, gyr, acc)
    weight = dt / (MEAN_TIME + dt)
    return SlowMeans(blend(means.gyr, gyr, weight), blend(means.acc, acc, weight), pace)


@kernel
def is_turn(guard: Guard, mean: Vec3, rest: Rest, own: Vec3) -> bool:
    """Whether a steady mean rate (rad/s) is a turn and no bias: too large for any, or far from the known one.

    ``own`` is the filter's own estimate beside that of ``rest``. A bias may be large when the gyroscope is switched on,
    but then hardly changes. A smaller rate than the known bias is accepted, as that may come from a steady turn.
    """
    limit = guard.bias_limit * DEGREE
    square = distance2(ZERO, mean)
    if square > limit * limit:
        return True
    if not rest.known:
        return False
    known = add(rest.bias, own)
    before = distance2(ZERO, known)
    return square > before and distance2(known, mean) > BIAS_CHANGE


@kernel
def has_rested(guard: Guard, time: float) -> bool:
    """Whether ``time`` (s), a sum of intervals, has reached ``rest_time``."""
    return time > 0.0 and has_elapsed(time, INTERVAL, guard.rest_time)


@kernel
def update_rest(guard: Guard, rest: Rest, own: Vec3, means: SlowMeans, dt: float) -> Rest:
    """After an interval of ``dt`` seconds: how long the sensor has been quiet, and the bias (rad/s) as a running mean.

    ``own`` is the bias that the filter estimates itself; it is subtracted.
    """
    time, bias, moved = rest.time, rest.bias, rest.moved
    known = rest.known
    mean = means.gyr
    if means.pace == 0.0 or is_turn(guard, mean, rest, own):
        return Rest(time=0.0, bias=bias, moved=True, known=known)
    age = max(time - guard.rest_time, 0.0)
    time += dt if moved or has_rested(guard, time) else dt * means.pace
    if has_rested(guard, time):
        bias = blend(bias, sub(mean, own), lowpass_weight(BIAS_TIME, age, dt))
    return Rest(time=time, bias=bias, moved=moved, known=known or has_rested(guard, time))


@kernel
def is_resting(guard: Guard, rest: Rest) -> bool:
    """Whether the sensor has been quiet for ``rest_time``."""
    return has_rested(guard, rest.time)
