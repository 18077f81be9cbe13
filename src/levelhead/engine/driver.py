"""The one driver: what happens to a sample before and around a filter's step, for every engine alike.

These are kernels: plain Python runs them as they stand, Numba compiles the same source. ``init``, ``step``,
``output``, ``gains``, ``loosen``, ``loosen_heading`` and ``calm`` are the filter's own, ``look`` is what stands in
front of it; ``binding.bind`` binds them. Arrays are flat (row after row), so that Python lists and NumPy arrays are
indexed by the same line.
"""

from typing import Any, NamedTuple

from levelhead.filters.contract import Gains, Output
from levelhead.filters.doubt import SPELL, Doubt, at_start, judged, waited
from levelhead.filters.doubt import sigma as doubted
from levelhead.filters.guard import BEFORE, Guard, Look, Rest, Watch, first_field
from levelhead.filters.health import (
    ACC_MISSING,
    AT_REST,
    GAP,
    GYR_MISSING,
    GYR_SATURATED,
    GYR_STUCK,
    MAG_LEARNED,
    MAG_MISSING,
)
from levelhead.kernels.jit import kernel
from levelhead.kernels.quat import Quat, up
from levelhead.kernels.tilt import GAP_SECONDS, TURN, present
from levelhead.kernels.vec3 import ZERO, Vec3, add

NO_READING = 1e9  # rad/s, m/s², µT: no sensor says that; NaN and infinity fail the comparison as well
ALL_THERE = NO_READING * NO_READING  # a sum of squares below that has no missing reading in it
BLIND = GYR_MISSING | GYR_SATURATED | GYR_STUCK  # the rate is a guess
LOST = 0.1  # rad that a body may have turned unseen before the filter is told
FIRST_FIELD = 0.6  # rad², of a heading that was relative until now: 45°
NEW_FIELD = 0.002  # rad², of a heading when another field is taken for the earth's: 2.6°
BEYOND = 0.5  # of the full scale, 1σ: how much faster a body turns than a clipped gyroscope says


class Settings(NamedTuple):
    """What a human sets: the filter's parameters, and those of what stands in front of it."""

    filter: Any
    guard: Guard


class Carry(NamedTuple):
    """What goes from one sample to the next."""

    state: Any  # the filter's
    gyr: Vec3  # last good rate
    started: bool
    health: int
    watch: Watch
    doubt: Doubt
    blind: float  # s since the last rate that could be believed


def unbound(*_: Any) -> Any:
    """Stands where a filter's kernel will be bound."""
    raise RuntimeError("bind the driver to a filter first")


init = step = output = gains = loosen = loosen_heading = calm = look = unbound
OWN_SIGMA = False
TAKES_BIAS = True  # the bias read off at rest is taken away before the filter sees the rate


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
def no_gains(params: Any, state: Any, dt: float) -> Gains:
    """Of a filter that carries its own σ."""
    return Gains(0.0, 0.0, 0.0, 0.0)


@kernel
def firm(params: Any, state: Any, variance: float) -> Any:
    """``loosen`` and ``loosen_heading`` of a filter that has nothing to loosen."""
    return state


@kernel
def as_before(params: Any, state: Any) -> Any:
    """``calm`` of a filter that carries no σ of its own."""
    return state


@kernel
def unguarded(
    guard: Guard, watch: Watch, attitude: Quat, own: Vec3, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float
) -> Look:
    """``look`` of a filter that is to see all there is."""
    return Look(gyr, acc, mag, 0, watch)


class Unseen(NamedTuple):
    """Seconds since the last rate that could be believed, and the variance of the turn in this sample (rad²)."""

    blind: float
    lost: float


@kernel
def unseen(health: int, blind: float, full: float, dt: float) -> Unseen:
    """How far the body may have turned while the rate was a guess; nothing as long as that is little."""
    if health & BLIND == 0:
        return Unseen(0.0, 0.0)
    reach = BEYOND * full if health & GYR_SATURATED else TURN
    before = reach * blind
    after = reach * (blind + dt)
    if after <= LOST:
        return Unseen(blind + dt, 0.0)
    return Unseen(blind + dt, after * after - (before * before if before > LOST else 0.0))


@kernel
def begin(settings: Settings) -> Carry:
    """Before the first sample: level, not started."""
    return Carry(init(settings.filter, ZERO, ZERO, ZERO), ZERO, False, 0, BEFORE, at_start(ZERO, ZERO), 0.0)


@kernel
def started(params: Any, gyr: Vec3, acc: Vec3, mag: Vec3, health: int) -> Carry:
    """At the first sample; the filter has started once it has an accelerometer reading."""
    state = init(params, gyr, acc, mag)
    _, fast, hard, gyr_repeat, acc_repeat, out, _ = BEFORE
    said: Output = output(params, state)
    field = first_field(up(said.quat), mag)
    watch = Watch(Rest(gyr, acc, 0.0, ZERO, ZERO, ZERO, 0.0), fast, hard, gyr_repeat, acc_repeat, out, field)
    return Carry(state, gyr, present(acc), health, watch, at_start(acc, mag), 0.0)


@kernel
def advance(settings: Settings, carry: Carry, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> Carry:
    """One sample through the filter; NaN marks a missing reading, the zero vector a sensor that does not exist.

    A missing rate is replaced by the last one, for a while; any other missing reading corrects nothing.
    """
    params, guard = settings
    state, last, has_started, _, watch, doubt, blind = carry
    health = absent(gyr, acc, mag)
    if health != 0:
        gyr = last if health & GYR_MISSING else gyr
        acc = ZERO if health & ACC_MISSING else acc
        mag = ZERO if health & MAG_MISSING else mag
    if not has_started:
        return started(params, gyr, acc, mag, health)
    last = gyr
    said: Output = output(params, state)
    own = said.bias
    taken = watch.rest.bias if TAKES_BIAS else ZERO
    if dt > GAP_SECONDS or (health & GYR_MISSING and blind > GAP_SECONDS):
        gyr = add(own, taken)  # reads as "did not turn"
    if dt > GAP_SECONDS:
        health |= GAP
    had_field = watch.field.norm > 0.0
    seen: Look = look(guard, watch, said.quat, own if TAKES_BIAS else ZERO, gyr, acc, mag, dt)
    gyr, acc, mag, found, watch = seen
    health |= found
    if health & GYR_MISSING:
        health -= health & GYR_STUCK  # it is the held rate that repeats itself
    blind, lost = unseen(health, blind, watch.fast.up, dt)
    if lost > 0.0:
        state = loosen(params, state, lost)
    if health & AT_REST:
        state = calm(params, state)
    if health & MAG_LEARNED:
        state = loosen_heading(params, state, NEW_FIELD if had_field else FIRST_FIELD)
    state = step(params, state, gyr, acc, mag, dt)
    if not OWN_SIGMA:
        doubt = waited(doubt, acc, mag, dt)
        if doubt.spell >= SPELL or lost > 0.0:
            doubt = judged(doubt, gains(params, state, doubt.spell), gyr, acc, health & AT_REST != 0, lost)
    return Carry(state, last, True, health, watch, doubt, blind)


@kernel
def result(settings: Settings, carry: Carry) -> Output:
    """The filter's output, with what the driver knows: the bias read off at rest, σ, health."""
    params, _ = settings
    state, _, _, found, watch, doubt, _ = carry
    said: Output = output(params, state)
    quat, (x, y, z), sigma, health = said
    a, b, c = watch.rest.bias if TAKES_BIAS else ZERO
    if not OWN_SIGMA:
        sigma = doubted(doubt)
    return Output(quat, Vec3(x + a, y + b, z + c), sigma, health | found)


@kernel
def run(
    settings: Settings, carry: Carry, last: float, t: Any, gyr: Any, acc: Any, mag: Any,
    quat: Any, bias: Any, sigma: Any, health: Any,
) -> Carry:  # fmt: skip
    """A stretch of samples: reads t (n), gyr, acc (3n), mag (3n or 0); fills quat (4n), bias, sigma (3n), health (n).

    ``last`` is the time of the sample before; the returned carry continues exactly where this stretch ends.
    """
    field = ZERO
    for i in range(len(t)):
        j = 3 * i
        if len(mag) > 0:
            field = Vec3(mag[j], mag[j + 1], mag[j + 2])
        carry = advance(
            settings,
            carry,
            Vec3(gyr[j], gyr[j + 1], gyr[j + 2]),
            Vec3(acc[j], acc[j + 1], acc[j + 2]),
            field,
            t[i] - last,
        )
        last = t[i]
        q, b, s, health[i] = result(settings, carry)
        k = 4 * i
        quat[k], quat[k + 1], quat[k + 2], quat[k + 3] = q
        bias[j], bias[j + 1], bias[j + 2] = b
        sigma[j], sigma[j + 1], sigma[j + 2] = s
    return carry
