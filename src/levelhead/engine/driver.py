"""The one driver: what happens to a sample before and around a filter's step, for every engine alike.

These are kernels: plain Python runs them as they stand, Numba compiles the same source. ``init``, ``step``, ``due``,
``correct``, ``output``, ``gains``, ``loosen``, ``loosen_heading``, ``calm`` and ``again`` are the filter's own,
``look`` is what stands in front of it; ``binding.bind`` binds them. Arrays are flat (row after row), so that Python
lists and NumPy arrays are indexed by the same line.

A sample goes through in phases. What the recording says by itself comes first (``scene.perceived``); all others take
the scene and what one run carries. ``advance`` calls them in turn, ``engine.lanes`` each for all of its runs at once,
which is why what few samples bring is a phase of its own: lanes then skip it for all.
"""

from typing import Any, NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.engine.conditioning import EMPTY, Scene, judging
from levelhead.filters.contract import Gains, Output
from levelhead.filters.health import ACC_REJECTED, MAG_LEARNED
from levelhead.filters.observer_covariance import Doubt, at_start, judged
from levelhead.filters.observer_covariance import sigma as doubted
from levelhead.guard import BEFORE, Guard, Look, Watch, detectors, first_field, pushed, refusing, rested, resting
from levelhead.kernels.quat import Quat, up
from levelhead.kernels.tilt import present
from levelhead.kernels.vec3 import ZERO, Vec3, sub

FIRST_FIELD = 0.6  # rad², of a heading that was relative until now: 45°
NEW_FIELD = 0.002  # rad², of a heading when another field is taken for the earth's: 2.6°


class Settings(NamedTuple):
    """What a human sets: the filter's parameters, and those of what stands in front of it."""

    filter: Any
    guard: Guard


class Run(NamedTuple):
    """What one filter with its parameters carries from one sample to the next."""

    state: Any  # the filter's
    health: int
    watch: Watch
    doubt: Doubt


class Carry(NamedTuple):
    """What goes from one sample to the next."""

    scene: Scene
    run: Run


def unbound(*_: Any) -> Any:
    """Stands where a filter's kernel will be bound."""
    raise RuntimeError("bind the driver to a filter first")


init = again = step = due = correct = output = gains = loosen = loosen_heading = calm = look = perceived = unbound
aid = place = unbound
OWN_SIGMA = False
TAKES_BIAS = True  # the bias read off at rest is taken away before the filter sees the rate


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
def never(params: Any, state: Any) -> bool:
    """``due`` of a filter that does everything at every sample."""
    return False


@kernel
def as_it_is(params: Any, state: Any, dt: float) -> Any:
    """``correct`` of such a filter."""
    return state


@kernel
def afresh(params: Any, before: Any, gyr: Vec3, acc: Vec3, mag: Vec3) -> Any:
    """``again`` of a filter that knows nothing of earlier runs."""
    return init(params, gyr, acc, mag)


@kernel
def unguarded(guard: Guard, watch: Watch, attitude: Quat, gyr: Vec3, mag: Vec3, dt: float) -> Look:
    """``look`` of a filter that is to see all there is."""
    return Look(mag, 0, watch)


@kernel
def begin(settings: Settings) -> Carry:
    """Before the first sample: level, not started."""
    return Carry(EMPTY, Run(init(settings.filter, ZERO, ZERO, ZERO), 0, BEFORE, at_start(ZERO, ZERO)))


@kernel
def started(settings: Settings, scene: Scene, run: Run) -> Run:
    """At the first sample, and at those after it as long as there was no accelerometer reading."""
    params, _ = settings
    state = again(params, run.state, scene.gyr, scene.acc, scene.mag)
    still, bias, out, _ = BEFORE
    said: Output = output(params, state)
    watch = Watch(still, bias, out, first_field(up(said.quat), scene.mag))
    return Run(state, scene.health, watch, at_start(scene.acc, scene.mag))


@kernel
def calmed(settings: Settings, scene: Scene, run: Run) -> Run:
    """After each spell in which rest is looked for."""
    params, guard = settings
    state, health, watch, doubt = run
    said: Output = output(params, state)
    mean, _, quiet = scene.sensors.calm
    watch = rested(guard, watch, said.bias if TAKES_BIAS else ZERO, mean, quiet, scene.sensors.sum.spell)
    if resting(guard, watch):
        state = calm(params, state)
    return Run(state, health, watch, doubt)


@kernel
def loosened(settings: Settings, scene: Scene, run: Run) -> Run:
    """Where the body may have turned unseen."""
    state, health, watch, doubt = run
    return Run(loosen(settings.filter, state, scene.lost), health, watch, doubt)


@kernel
def rate(scene: Scene, watch: Watch, own: Vec3) -> Vec3:
    """The rate without the bias read off at rest; where nothing is known of it the one that reads as "did not turn"."""
    if scene.idle:
        return own
    return sub(scene.gyr, watch.bias) if TAKES_BIAS else scene.gyr


@kernel
def stepped(settings: Settings, scene: Scene, run: Run, acc: Vec3) -> Run:
    """One sample: what the filter may see of it, and the filter's step."""
    params, guard = settings
    state, found, watch, doubt = run
    said: Output = output(params, state)
    gyr = rate(scene, watch, said.bias)
    seen: Look = look(guard, watch, said.quat, gyr, scene.mag, scene.dt)
    mag, health, watch = seen
    return Run(step(params, state, gyr, acc, mag, scene.dt), found | health, watch, doubt)


@kernel
def accelerated(settings: Settings, scene: Scene, run: Run) -> Run:
    """A sample whose specific force has another norm than g, or follows upon one."""
    params, guard = settings
    state, _, watch, doubt = run
    said: Output = output(params, state)
    gyr = rate(scene, watch, said.bias)
    watch = pushed(guard, watch, said.quat, gyr, scene.acc, scene.sensors.odd, scene.dt)
    if present(scene.acc) and refusing(guard, watch):
        return stepped(settings, scene, Run(state, scene.health | ACC_REJECTED, watch, doubt), ZERO)
    return stepped(settings, scene, Run(state, scene.health, watch, doubt), scene.acc)


@kernel
def moved(settings: Settings, scene: Scene, run: Run) -> Run:
    """Any other sample."""
    state, _, watch, doubt = run
    return stepped(settings, scene, Run(state, scene.health, watch, doubt), scene.acc)


@kernel
def now_due(settings: Settings, run: Run) -> bool:
    """Whether ``corrected`` has anything to do."""
    return run.health & MAG_LEARNED != 0 or due(settings.filter, run.state)


@kernel
def corrected(settings: Settings, scene: Scene, run: Run) -> Run:
    """What a filter does now and then only."""
    params, _ = settings
    state, health, watch, doubt = run
    if health & MAG_LEARNED:
        state = loosen_heading(params, state, NEW_FIELD if scene.had_field else FIRST_FIELD)
    if due(params, state):
        state = correct(params, state, scene.dt)
    return Run(state, health, watch, doubt)


@kernel
def doubted_anew(settings: Settings, scene: Scene, run: Run) -> Run:
    """After each spell in which σ waits to be judged."""
    params, guard = settings
    state, health, watch, doubt = run
    seen = scene.seen
    acc = scene.acc
    if refusing(guard, watch):
        seen = seen & 2
        acc = ZERO
    if watch.field.out > 0.0:
        seen = seen & 1
    gyr = rate(scene, watch, ZERO)
    rest = resting(guard, watch)
    doubt = judged(doubt, gains(params, state, scene.spell), gyr, acc, rest, scene.lost, seen, scene.spell)
    return Run(state, health, watch, doubt)


PHASES = (started, calmed, loosened, accelerated, moved, now_due, corrected, doubted_anew)


@kernel
def advance(settings: Settings, carry: Carry, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> Carry:
    """One sample through the filter; NaN marks a missing reading, the zero vector a sensor that does not exist."""
    before, run = carry
    scene: Scene = perceived(settings.guard, before, gyr, acc, mag, dt)
    if not before.started:
        return Carry(scene, started(settings, scene, run))
    if scene.sensors.sum.spell >= detectors.SPELL:
        run = calmed(settings, scene, run)
    if scene.lost > 0.0:
        run = loosened(settings, scene, run)
    if scene.sensors.odd or scene.sensors.was_odd:
        run = accelerated(settings, scene, run)
    else:
        run = moved(settings, scene, run)
    if now_due(settings, run):
        run = corrected(settings, scene, run)
    if not OWN_SIGMA and judging(scene):
        run = doubted_anew(settings, scene, run)
    return Carry(scene, run)


@kernel
def result(settings: Settings, run: Run) -> Output:
    """The filter's output, with what the driver knows: the bias read off at rest, σ, health."""
    state, found, watch, doubt = run
    said: Output = output(settings.filter, state)
    quat, (x, y, z), sigma, health = said
    a, b, c = watch.bias if TAKES_BIAS else ZERO
    if not OWN_SIGMA:
        sigma = doubted(doubt)
    return Output(quat, Vec3(x + a, y + b, z + c), sigma, health | found)


@kernel
def fed(settings: Settings, carry: Carry, i: int, gyr: Any, acc: Any, mag: Any, dt: float) -> Carry:
    """Row i of the arrays through the filter."""
    j = 3 * i
    field = ZERO
    if len(mag) > 0:
        field = Vec3(mag[j], mag[j + 1], mag[j + 2])
    rate = Vec3(gyr[j], gyr[j + 1], gyr[j + 2])
    return advance(settings, carry, rate, Vec3(acc[j], acc[j + 1], acc[j + 2]), field, dt)


@kernel
def told(settings: Settings, carry: Carry, i: int, quat: Any, bias: Any, sigma: Any, health: Any) -> None:
    """Row i of the result."""
    q, b, s, health[i] = result(settings, carry.run)
    j = 3 * i
    k = 4 * i
    quat[k], quat[k + 1], quat[k + 2], quat[k + 3] = q
    bias[j], bias[j + 1], bias[j + 2] = b
    sigma[j], sigma[j + 1], sigma[j + 2] = s


@kernel
def run(
    settings: Settings, carry: Carry, last: float, t: Any, gyr: Any, acc: Any, mag: Any,
    quat: Any, bias: Any, sigma: Any, health: Any,
) -> Carry:  # fmt: skip
    """A stretch of samples: reads t (n), gyr, acc (3n), mag (3n or 0); fills quat (4n), bias, sigma (3n), health (n).

    ``last`` is the time of the sample before; the returned carry continues exactly where this stretch ends.
    """
    for i in range(len(t)):
        carry = fed(settings, carry, i, gyr, acc, mag, t[i] - last)
        last = t[i]
        told(settings, carry, i, quat, bias, sigma, health)
    return carry


@kernel
def aided(settings: Settings, carry: Carry, row: int, value: float, deviation: float, age: float) -> Carry:
    """One number of position, velocity or height with its 1σ, ``age`` seconds older than the last sample."""
    scene, run = carry
    if not scene.started:
        return carry
    state, health, watch, doubt = run
    return Carry(scene, Run(aid(settings.filter, state, row, value, deviation, age), health, watch, doubt))


@kernel
def run_aided(
    settings: Settings, carry: Carry, last: float, t: Any, gyr: Any, acc: Any, mag: Any,
    first: Any, row: Any, value: Any, deviation: Any, age: Any,
    quat: Any, bias: Any, sigma: Any, health: Any, places: Any,
) -> Carry:  # fmt: skip
    """The same, with what else was seen: of sample i the numbers from ``first[i]`` to before ``first[i + 1]``.

    Fills places (12n) as well: position, velocity, 1σ of position, 1σ of velocity.
    """
    for i in range(len(t)):
        carry = fed(settings, carry, i, gyr, acc, mag, t[i] - last)
        last = t[i]
        for k in range(first[i], first[i + 1]):
            carry = aided(settings, carry, row[k], value[k], deviation[k], age[k])
        told(settings, carry, i, quat, bias, sigma, health)
        j = 12 * i
        p, v, sp, sv, _ = place(settings.filter, carry.run.state)
        places[j], places[j + 1], places[j + 2] = p
        places[j + 3], places[j + 4], places[j + 5] = v
        places[j + 6], places[j + 7], places[j + 8] = sp
        places[j + 9], places[j + 10], places[j + 11] = sv
    return carry
