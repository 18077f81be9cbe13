"""What is done about bad readings before a filter sees them: once, the same for all filters.

What the readings tell by themselves stands in ``filters.sensors``: quiet, full scale, stuck axes. Here is what also
hangs on the filter. At rest the gyroscope's bias is read off and taken away; accelerations that are no gravity and
fields that are not the earth's are held back, for a bounded time only. ``look`` says for every sample what the filter
may see, what was held back and why (``filters.health``).
"""

from math import sqrt
from typing import Annotated, NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.health import (
    AT_REST,
    MAG_LEARNED,
    MAG_REJECTED,
)
from levelhead.filters.parameters import Param, parameters
from levelhead.kernels import quat
from levelhead.kernels.angle import DEGREE
from levelhead.kernels.lowpass import lowpass_weight
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import present
from levelhead.kernels.vec3 import ZERO, Vec3, add, dot, norm, sub

CHANGE = (2.0 * DEGREE) * (2.0 * DEGREE)  # (rad/s)², of a bias once known
BIAS_TAU = 10.0  # s over which rest averages the bias
FIRST_AGE = 1e-3  # s: what one reading counts
FIELD_TAU = 20.0  # s over which the field is learned
TELLS_FIELD = True  # a filter that judges the field by itself is left to it


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


class Field(NamedTuple):
    """The earth's field as learned: norm, sine of its angle above the horizon; seconds learned, seconds rejected."""

    norm: float
    dip: float
    age: float
    out: float


class Watch(NamedTuple):
    """What is remembered of a filter in front of which the guard stands."""

    still: float  # s at rest
    bias: Vec3  # rad/s, read off at rest
    acc_out: float  # s for which the specific force has been no gravity
    field: Field


class Look(NamedTuple):
    """What the filter may see of a sample (zero vector: nothing), and what is known about it."""

    mag: Vec3
    health: int
    watch: Watch


BEFORE = Watch(0.0, ZERO, 0.0, Field(0.0, 0.0, 0.0, 0.0))


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
def rested(guard: Guard, watch: Watch, own: Vec3, mean: Vec3, quiet: bool, dt: float) -> Watch:
    """After a spell of ``dt``: rest is when it is quiet for a while, and the ``mean`` rate is no turn.

    The bias then goes to the mean rate, less what the filter itself takes away (``own``), as a running mean.
    """
    still, bias, out, field = watch
    if not quiet or turning(guard, mean, bias, own):
        return Watch(0.0, bias, out, field)
    still += dt
    learned = still - guard.rest_time
    if learned > 0.0:
        bias = toward(bias, sub(mean, own), lowpass_weight(BIAS_TAU, learned, dt))
    return Watch(still, bias, out, field)


@kernel
def resting(guard: Guard, watch: Watch) -> bool:
    """Whether the sensor has been at rest for long enough."""
    return watch.still > guard.rest_time


@kernel
def refusing(guard: Guard, watch: Watch) -> bool:
    """Whether the accelerometer is held back."""
    return 0.0 < watch.acc_out < guard.acc_time


@kernel
def predicted_up(attitude: Quat, gyr: Vec3, dt: float) -> Vec3:
    """The vertical in the sensor frame, ``dt`` after it had this attitude, to first order."""
    x, y, z = quat.up(attitude)
    a, b, c = gyr
    return Vec3(x + dt * (y * c - z * b), y + dt * (z * a - x * c), z + dt * (x * b - y * a))


@kernel
def pushed(guard: Guard, watch: Watch, attitude: Quat, gyr: Vec3, acc: Vec3, odd: bool, dt: float) -> Watch:
    """For how long specific force has been no gravity: its norm is not g (``odd``), and it is far from the vertical."""
    if not present(acc):
        return watch
    still, bias, out, field = watch
    if not odd:
        return Watch(still, bias, 0.0, field)
    x, y, z = acc
    a, b, c = predicted_up(attitude, gyr, dt)
    cosine = 1.0 - 0.5 * guard.acc_angle * guard.acc_angle * (DEGREE * DEGREE)
    far = a * x + b * y + c * z < sqrt(x * x + y * y + z * z) * cosine
    return Watch(still, bias, out + dt if far else 0.0, field)


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
    d = (a * x + b * y + c * z) * (1.0 / n)
    if age == 0.0 or out > min(guard.mag_time, age):
        return Field(n, d, dt, 0.0)
    if abs(n - strength) > guard.mag_gate * strength or abs(d - dip) > guard.mag_angle * DEGREE:
        return Field(strength, dip, age, out + dt)
    weight = lowpass_weight(FIELD_TAU, age, dt)
    return Field(strength + weight * (n - strength), dip + weight * (d - dip), min(age + dt, FIELD_TAU), 0.0)


@kernel
def look(guard: Guard, watch: Watch, attitude: Quat, gyr: Vec3, mag: Vec3, dt: float) -> Look:
    """What of a sample the filter may see.

    ``attitude`` is the filter's, one sample old, ``gyr`` without the bias that was read off at rest.
    """
    health = 0
    if resting(guard, watch):
        health = AT_REST
    if TELLS_FIELD and present(mag):
        still, bias, out, field = watch
        field = learned(guard, field, predicted_up(attitude, gyr, dt), mag, dt)
        watch = Watch(still, bias, out, field)
        if field.out > 0.0:
            health |= MAG_REJECTED
            mag = ZERO
        elif field.age <= dt:
            health |= MAG_LEARNED
    return Look(mag, health, watch)
