"""The one driver: what happens to a sample before and around a filter's step, for every engine alike.

These are kernels: plain Python runs them as they stand, Numba compiles the same source. ``init``, ``step``, ``due``,
``correct``, ``output``, ``gains``, ``loosen``, ``loosen_heading``, ``calm`` and ``again`` are the filter's own,
``look`` is what stands in front of it; ``binding.bind`` binds them. Arrays are flat (row after row), so that Python
lists and NumPy arrays are indexed by the same line.

A sample goes through in phases. ``conditioning.condition`` comes first and needs the readings only; all others take
the conditioned sample and what one run carries. ``advance`` calls them in turn; ``engine.lanes`` calls each for all of
its runs at once, and skips it for all where the sample does not need it. That is why rare work is a phase of its own.
"""

from typing import Any, NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.engine.conditioning import NO_SAMPLE, ConditionedSample, sigma_due
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


class FilterRun(NamedTuple):
    """What one filter with its parameters carries from one sample to the next."""

    state: Any  # the filter's
    health: int
    watch: Watch
    doubt: Doubt


class Carry(NamedTuple):
    """What goes from one sample to the next."""

    sample: ConditionedSample
    run: FilterRun


def unbound(*_: Any) -> Any:
    """Stands where a filter's kernel will be bound."""
    raise RuntimeError("bind the driver to a filter first")


init = again = step = due = correct = output = gains = loosen = loosen_heading = calm = look = condition = unbound
aid = place = unbound
OWN_SIGMA = False
TAKES_BIAS = True  # the bias read off at rest is taken away before the filter sees the rate


@kernel
def no_gains(params: Any, state: Any, dt: float) -> Gains:
    """Of a filter that carries its own σ."""
    return Gains(0.0, 0.0, 0.0, 0.0)


@kernel
def keep_variance(params: Any, state: Any, variance: float) -> Any:
    """``loosen`` and ``loosen_heading`` of a filter that has nothing to loosen."""
    return state


@kernel
def keep_state(params: Any, state: Any) -> Any:
    """``calm`` of a filter that carries no σ of its own."""
    return state


@kernel
def never_due(params: Any, state: Any) -> bool:
    """``due`` of a filter that does everything at every sample."""
    return False


@kernel
def keep_uncorrected(params: Any, state: Any, dt: float) -> Any:
    """``correct`` of such a filter."""
    return state


@kernel
def default_restart(params: Any, before: Any, gyr: Vec3, acc: Vec3, mag: Vec3) -> Any:
    """``again`` of a filter that knows nothing of earlier runs."""
    return init(params, gyr, acc, mag)


@kernel
def no_gate(guard: Guard, watch: Watch, attitude: Quat, gyr: Vec3, mag: Vec3, dt: float) -> Look:
    """``look`` of a filter that is to see all there is."""
    return Look(mag, 0, watch)


@kernel
def begin(settings: Settings) -> Carry:
    """Before the first sample: level, not started."""
    return Carry(NO_SAMPLE, FilterRun(init(settings.filter, ZERO, ZERO, ZERO), 0, BEFORE, at_start(ZERO, ZERO)))


@kernel
def start(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """At the first sample, and at those after it as long as there was no accelerometer reading."""
    params, _ = settings
    state = again(params, run.state, sample.gyr, sample.acc, sample.mag)
    still, bias, out, _ = BEFORE
    said: Output = output(params, state)
    watch = Watch(still, bias, out, first_field(up(said.quat), sample.mag))
    return FilterRun(state, sample.health, watch, at_start(sample.acc, sample.mag))


@kernel
def update_rest(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """After each spell in which rest is looked for."""
    params, guard = settings
    state, health, watch, doubt = run
    said: Output = output(params, state)
    mean, _, quiet = sample.sensors.calm
    watch = rested(guard, watch, said.bias if TAKES_BIAS else ZERO, mean, quiet, sample.sensors.sum.spell)
    if resting(guard, watch):
        state = calm(params, state)
    return FilterRun(state, health, watch, doubt)


@kernel
def inflate(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """Where the body may have turned unseen."""
    state, health, watch, doubt = run
    return FilterRun(loosen(settings.filter, state, sample.unmeasured), health, watch, doubt)


@kernel
def unbiased_rate(sample: ConditionedSample, watch: Watch, own: Vec3) -> Vec3:
    """The rate without the bias read off at rest; where nothing is known of it the one that reads as "did not turn"."""
    if sample.rate_unknown:
        return own
    return sub(sample.gyr, watch.bias) if TAKES_BIAS else sample.gyr


@kernel
def step_gated(settings: Settings, sample: ConditionedSample, run: FilterRun, acc: Vec3) -> FilterRun:
    """One sample: what the filter may see of it, and the filter's step."""
    params, guard = settings
    state, found, watch, doubt = run
    said: Output = output(params, state)
    gyr = unbiased_rate(sample, watch, said.bias)
    seen: Look = look(guard, watch, said.quat, gyr, sample.mag, sample.dt)
    mag, health, watch = seen
    return FilterRun(step(params, state, gyr, acc, mag, sample.dt), found | health, watch, doubt)


@kernel
def step_accelerated(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """A sample whose specific force has another norm than g, or follows upon one."""
    params, guard = settings
    state, _, watch, doubt = run
    said: Output = output(params, state)
    gyr = unbiased_rate(sample, watch, said.bias)
    watch = pushed(guard, watch, said.quat, gyr, sample.acc, sample.sensors.odd, sample.dt)
    if present(sample.acc) and refusing(guard, watch):
        return step_gated(settings, sample, FilterRun(state, sample.health | ACC_REJECTED, watch, doubt), ZERO)
    return step_gated(settings, sample, FilterRun(state, sample.health, watch, doubt), sample.acc)


@kernel
def step_plain(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """Any other sample."""
    state, _, watch, doubt = run
    return step_gated(settings, sample, FilterRun(state, sample.health, watch, doubt), sample.acc)


@kernel
def correction_due(settings: Settings, run: FilterRun) -> bool:
    """Whether ``apply_correction`` has anything to do."""
    return run.health & MAG_LEARNED != 0 or due(settings.filter, run.state)


@kernel
def apply_correction(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """What a filter does now and then only."""
    params, _ = settings
    state, health, watch, doubt = run
    if health & MAG_LEARNED:
        state = loosen_heading(params, state, NEW_FIELD if sample.had_field else FIRST_FIELD)
    if due(params, state):
        state = correct(params, state, sample.dt)
    return FilterRun(state, health, watch, doubt)


@kernel
def update_sigma(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """After each spell in which σ waits to be judged."""
    params, guard = settings
    state, health, watch, doubt = run
    seen = sample.corrected_by
    acc = sample.acc
    if refusing(guard, watch):
        seen = seen & 2
        acc = ZERO
    if watch.field.out > 0.0:
        seen = seen & 1
    gyr = unbiased_rate(sample, watch, ZERO)
    rest = resting(guard, watch)
    doubt = judged(
        doubt, gains(params, state, sample.since_sigma), gyr, acc, rest, sample.unmeasured, seen, sample.since_sigma
    )
    return FilterRun(state, health, watch, doubt)


PHASES = (start, update_rest, inflate, step_accelerated, step_plain, correction_due, apply_correction, update_sigma)


@kernel
def advance(settings: Settings, carry: Carry, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> Carry:
    """One sample through the filter; NaN marks a missing reading, the zero vector a sensor that does not exist."""
    before, run = carry
    sample: ConditionedSample = condition(settings.guard, before, gyr, acc, mag, dt)
    if not before.started:
        return Carry(sample, start(settings, sample, run))
    if sample.sensors.sum.spell >= detectors.SPELL:
        run = update_rest(settings, sample, run)
    if sample.unmeasured > 0.0:
        run = inflate(settings, sample, run)
    if sample.sensors.odd or sample.sensors.was_odd:
        run = step_accelerated(settings, sample, run)
    else:
        run = step_plain(settings, sample, run)
    if correction_due(settings, run):
        run = apply_correction(settings, sample, run)
    if not OWN_SIGMA and sigma_due(sample):
        run = update_sigma(settings, sample, run)
    return Carry(sample, run)


@kernel
def result(settings: Settings, run: FilterRun) -> Output:
    """The filter's output, with what the driver knows: the bias read off at rest, σ, health."""
    state, found, watch, doubt = run
    said: Output = output(settings.filter, state)
    quat, (x, y, z), sigma, health = said
    a, b, c = watch.bias if TAKES_BIAS else ZERO
    if not OWN_SIGMA:
        sigma = doubted(doubt)
    return Output(quat, Vec3(x + a, y + b, z + c), sigma, health | found)


@kernel
def process_row(settings: Settings, carry: Carry, i: int, gyr: Any, acc: Any, mag: Any, dt: float) -> Carry:
    """Row i of the arrays through the filter."""
    j = 3 * i
    field = ZERO
    if len(mag) > 0:
        field = Vec3(mag[j], mag[j + 1], mag[j + 2])
    rate = Vec3(gyr[j], gyr[j + 1], gyr[j + 2])
    return advance(settings, carry, rate, Vec3(acc[j], acc[j + 1], acc[j + 2]), field, dt)


@kernel
def write_row(settings: Settings, carry: Carry, i: int, quat: Any, bias: Any, sigma: Any, health: Any) -> None:
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
        carry = process_row(settings, carry, i, gyr, acc, mag, t[i] - last)
        last = t[i]
        write_row(settings, carry, i, quat, bias, sigma, health)
    return carry


@kernel
def update_aiding(settings: Settings, carry: Carry, row: int, value: float, deviation: float, age: float) -> Carry:
    """One number of position, velocity or height with its 1σ, ``age`` seconds older than the last sample."""
    sample, run = carry
    if not sample.started:
        return carry
    state, health, watch, doubt = run
    return Carry(sample, FilterRun(aid(settings.filter, state, row, value, deviation, age), health, watch, doubt))


@kernel
def run_with_aiding(
    settings: Settings, carry: Carry, last: float, t: Any, gyr: Any, acc: Any, mag: Any,
    first: Any, row: Any, value: Any, deviation: Any, age: Any,
    quat: Any, bias: Any, sigma: Any, health: Any, places: Any,
) -> Carry:  # fmt: skip
    """The same, with what else was seen: of sample i the numbers from ``first[i]`` to before ``first[i + 1]``.

    Fills places (12n) as well: position, velocity, 1σ of position, 1σ of velocity.
    """
    for i in range(len(t)):
        carry = process_row(settings, carry, i, gyr, acc, mag, t[i] - last)
        last = t[i]
        for k in range(first[i], first[i + 1]):
            carry = update_aiding(settings, carry, row[k], value[k], deviation[k], age[k])
        write_row(settings, carry, i, quat, bias, sigma, health)
        j = 12 * i
        p, v, sp, sv, _ = place(settings.filter, carry.run.state)
        places[j], places[j + 1], places[j + 2] = p
        places[j + 3], places[j + 4], places[j + 5] = v
        places[j + 6], places[j + 7], places[j + 8] = sp
        places[j + 9], places[j + 10], places[j + 11] = sv
    return carry
