"""The one driver: the processing of a sample before and after a filter's step, for every filter and every engine.

These are kernels: plain Python runs them as they stand, Numba and the export to C translate the same source. A filter's
own functions and the guard's are called through ``hooks`` and ``aiding``; ``Hooks`` and ``AidingHooks`` declare them,
and ``binding.bind`` makes a copy of the driver in which they are one filter's. Arrays are flat (row after row), so that
Python lists and NumPy arrays are indexed by the same line.

A sample goes through in phases. ``conditioning.condition`` comes first and needs the readings only; all others take the
conditioned sample and the state of one run. ``advance`` calls them in turn; ``engine.lanes`` calls each for all of its
runs at once, and skips it for all where the sample does not need it. That is why rare work is a phase of its own.
"""

from typing import NamedTuple, Protocol

from levelhead.compiler.hooks import declare
from levelhead.compiler.mark import kernel, noinline
from levelhead.engine.conditioning import NO_SAMPLE, ConditionedSample, condition, sigma_due
from levelhead.engine.full_scale import unmeasured_velocity
from levelhead.filters.contract import FilterState, Gains, NavState, Output
from levelhead.filters.health import ACC_REJECTED, IRON_FOUND, MAG_LEARNED
from levelhead.filters.observer_covariance import ObserverCovariance, initial_covariance, update_covariance
from levelhead.filters.observer_covariance import sigma as observer_sigma
from levelhead.filters.parameters import Params
from levelhead.guard import NO_SAMPLES, Gated, Guard, GuardState, gate_force, is_accelerating, set_field
from levelhead.guard.field import initial_field
from levelhead.guard.rest import is_resting
from levelhead.guard.rest import update_rest as update_bias_at_rest
from levelhead.kernels.arrays import Floats
from levelhead.kernels.quat import Quat, up
from levelhead.kernels.tilt import is_present
from levelhead.kernels.vec3 import ZERO, Vec3, sub

FIRST_FIELD = 0.6  # rad², of a heading that was relative until now, or by a raw magnetometer: 45°
NEW_FIELD = 0.002  # rad², of a heading when another field is taken for the earth's: 2.6°


class Settings(NamedTuple):
    """The user's choice: the filter's parameters, and the guard's."""

    filter: Params
    guard: Guard


class FilterRun(NamedTuple):
    """The carry of one filter from one sample to the next."""

    state: FilterState  # the filter's
    health: int
    guard: GuardState
    covariance: ObserverCovariance


class Carry(NamedTuple):
    """The carry from one sample to the next, as in ``jax.lax.scan``."""

    sample: ConditionedSample
    run: FilterRun


class Hooks(Protocol):
    """The functions of a filter and of its guard that the driver calls.

    A hook that has a body is optional: the body runs without it. ``params`` are the filter's.
    """

    OWN_SIGMA: bool  # the filter's output has σ, so the driver computes none
    HAS_VELOCITY: bool  # the filter has a velocity: lanes are of filters without one
    TAKES_BIAS: bool  # the bias read off at rest is subtracted before the filter gets the rate

    @staticmethod
    def init(params: Params, gyr: Vec3, acc: Vec3, mag: Vec3) -> FilterState:
        """The state at the first sample."""
        ...

    @staticmethod
    def step(params: Params, state: FilterState, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> FilterState:
        """The state one sample (rad/s, m/s², µT) and ``dt`` seconds later."""
        ...

    @staticmethod
    def output(params: Params, state: FilterState) -> Output:
        """Orientation, bias, σ and health of a state."""
        ...

    @staticmethod
    @kernel
    def restart(params: Params, before: FilterState, gyr: Vec3, acc: Vec3, mag: Vec3) -> FilterState:
        """``init`` with the prior that the state ``before`` has."""
        return hooks.init(params, gyr, acc, mag)

    @staticmethod
    @kernel
    def due(params: Params, state: FilterState, dt: float) -> bool:
        """Whether ``correct`` is to be called after this step of ``dt`` seconds."""
        return False

    @staticmethod
    @kernel
    def correct(params: Params, state: FilterState, dt: float) -> FilterState:
        """The state after the part of the filter that does not run at every sample."""
        return state

    @staticmethod
    @kernel
    def gains(params: Params, state: FilterState, dt: float) -> Gains:
        """The share of an innovation that the filter takes; unused where ``OWN_SIGMA``."""
        return Gains(tilt=0.0, tilt_bias=0.0, heading=0.0, heading_bias=0.0)

    @staticmethod
    @kernel
    def inflate(params: Params, state: FilterState, variance: float) -> FilterState:
        """The state with ``variance`` (rad²) added to that of its attitude."""
        return state

    @staticmethod
    @kernel
    def inflate_heading(params: Params, state: FilterState, variance: float) -> FilterState:
        """The state with ``variance`` (rad²) added to that of its heading only."""
        return state

    @staticmethod
    @kernel
    def inflate_velocity(params: Params, state: FilterState, variance: float) -> FilterState:
        """The state with ``variance`` (m²/s²) added to that of its velocity."""
        return state

    @staticmethod
    @kernel
    def at_rest(params: Params, state: FilterState) -> FilterState:
        """The state when the guard has found the sensor at rest."""
        return state

    @staticmethod
    @kernel
    def gate(guard: Guard, state: GuardState, attitude: Quat, gyr: Vec3, mag: Vec3, dt: float) -> Gated:
        """The magnetometer reading that the filter gets, health bits, and the guard's next state."""
        return Gated(mag, 0, state)


class AidingHooks(Protocol):
    """The functions that the driver calls of a filter with position, velocity and height."""

    @staticmethod
    def update(params: Params, state: FilterState, row: int, value: float, sigma: float, age: float) -> FilterState:
        """The state after one number; ``row`` as in ``contract``, ``sigma`` in its unit, ``age`` in s."""
        ...

    @staticmethod
    def nav_state(params: Params, state: FilterState) -> NavState:
        """Position, velocity and their σ."""
        ...


hooks: Hooks = declare(Hooks)
aiding: AidingHooks = declare(AidingHooks)


@kernel
def begin(settings: Settings) -> Carry:
    """Before the first sample: level, not started."""
    state = hooks.init(settings.filter, ZERO, ZERO, ZERO)
    return Carry(
        NO_SAMPLE, FilterRun(state=state, health=0, guard=NO_SAMPLES, covariance=initial_covariance(ZERO, ZERO))
    )


@noinline
def start(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """At the first sample, and at every sample until the first accelerometer reading."""
    params, _ = settings
    state = hooks.restart(params, run.state, sample.gyr, sample.acc, sample.mag)
    estimate: Output = hooks.output(params, state)
    gates = set_field(NO_SAMPLES, initial_field(up(estimate.quat), sample.mag))
    return FilterRun(
        state=state, health=sample.health, guard=gates, covariance=initial_covariance(sample.acc, sample.mag)
    )


@kernel
def update_rest(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """At the end of each interval over which the detectors average: whether the sensor is at rest, and its bias."""
    params, guard = settings
    state, health, gates = run.state, run.health, run.guard
    covariance = run.covariance
    estimate: Output = hooks.output(params, state)
    own = estimate.bias if hooks.TAKES_BIAS else ZERO
    rest = update_bias_at_rest(guard, gates.rest, own, sample.detected.means, sample.detected.sums.time)
    if is_resting(guard, rest):
        state = hooks.at_rest(params, state)
    gates = GuardState(rest=rest, acc_rejected=gates.acc_rejected, field=gates.field, iron=gates.iron)
    return FilterRun(state=state, health=health, guard=gates, covariance=covariance)


@noinline
def inflate(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """At a sample part of whose rotation was not measured."""
    state, health, gates = run.state, run.health, run.guard
    covariance = run.covariance
    return FilterRun(
        state=hooks.inflate(settings.filter, state, sample.unmeasured),
        health=health,
        guard=gates,
        covariance=covariance,
    )


@noinline
def inflate_velocity(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """At a specific force beyond full scale, for a filter that has a velocity."""
    state, health, gates = run.state, run.health, run.guard
    covariance = run.covariance
    variance = unmeasured_velocity(sample.force, sample.dt)
    state = hooks.inflate_velocity(settings.filter, state, variance)
    return FilterRun(state=state, health=health, guard=gates, covariance=covariance)


@kernel
def unbiased_rate(sample: ConditionedSample, gates: GuardState, own: Vec3) -> Vec3:
    """The rate without the bias read off at rest; where the rotation is unknown, the rate that the filter takes for
    0."""
    if sample.rate_unknown:
        return own
    return sub(sample.gyr, gates.rest.bias) if hooks.TAKES_BIAS else sample.gyr


@noinline
def gate_acceleration(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """Before the step of a sample whose specific force has another norm than g, or follows such a sample: whether the
    filter takes it for gravity."""
    params, guard = settings
    state, health, gates = run.state, sample.health, run.guard
    covariance = run.covariance
    estimate: Output = hooks.output(params, state)
    gyr = unbiased_rate(sample, gates, estimate.bias)
    gates = gate_force(guard, gates, estimate.quat, gyr, sample.acc, sample.detected.far_from_g, sample.dt)
    if is_present(sample.acc) and is_accelerating(guard, gates, sample.dt):
        health |= ACC_REJECTED
    return FilterRun(state=state, health=health, guard=gates, covariance=covariance)


@kernel
def accept_force(sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """Before the step of every other sample."""
    state, gates, covariance = run.state, run.guard, run.covariance
    return FilterRun(state=state, health=sample.health, guard=gates, covariance=covariance)


@kernel
def step(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """One sample: the gate of the field, then the filter's step."""
    params, guard = settings
    state, found, gates = run.state, run.health, run.guard
    covariance = run.covariance
    estimate: Output = hooks.output(params, state)
    gyr = unbiased_rate(sample, gates, estimate.bias)
    acc = ZERO if found & ACC_REJECTED else sample.acc
    gated: Gated = hooks.gate(guard, gates, estimate.quat, gyr, sample.mag, sample.dt)
    mag, health, gates = gated
    return FilterRun(
        state=hooks.step(params, state, gyr, acc, mag, sample.dt),
        health=found | health,
        guard=gates,
        covariance=covariance,
    )


@kernel
def correction_due(settings: Settings, sample: ConditionedSample, run: FilterRun) -> bool:
    """Whether ``apply_correction`` has anything to do."""
    return run.health & MAG_LEARNED != 0 or hooks.due(settings.filter, run.state, sample.dt)


@kernel
def apply_correction(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """The part of the filter that does not run at every sample; a field that was learned anew inflates heading."""
    params, _ = settings
    state, health, gates = run.state, run.health, run.guard
    covariance = run.covariance
    if health & MAG_LEARNED:
        known = sample.had_field and health & IRON_FOUND == 0
        state = hooks.inflate_heading(params, state, NEW_FIELD if known else FIRST_FIELD)
    if hooks.due(params, state, sample.dt):
        state = hooks.correct(params, state, sample.dt)
    return FilterRun(state=state, health=health, guard=gates, covariance=covariance)


@kernel
def update_sigma(settings: Settings, sample: ConditionedSample, run: FilterRun) -> FilterRun:
    """At the end of each interval of σ: the observer's covariance, for a filter without its own."""
    params, guard = settings
    state, health, gates = run.state, run.health, run.guard
    covariance = run.covariance
    corrected_by = sample.corrected_by
    acc = sample.acc
    if is_accelerating(guard, gates, sample.dt):
        corrected_by = corrected_by & 2
        acc = ZERO
    if gates.field.rejected > 0.0:
        corrected_by = corrected_by & 1
    gyr = unbiased_rate(sample, gates, ZERO)
    rest = is_resting(guard, gates.rest)
    covariance = update_covariance(
        covariance,
        hooks.gains(params, state, sample.since_sigma),
        gyr,
        acc,
        rest,
        sample.unmeasured,
        corrected_by,
        sample.since_sigma,
    )
    return FilterRun(state=state, health=health, guard=gates, covariance=covariance)


@kernel
def advance(settings: Settings, carry: Carry, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> Carry:
    """One sample through the filter; NaN marks a missing reading, the zero vector a sensor that does not exist."""
    before, run = carry
    sample: ConditionedSample = condition(settings.guard, before, gyr, acc, mag, dt)
    if not before.started:
        return Carry(sample, start(settings, sample, run))
    if sample.detected.sums.complete:
        run = update_rest(settings, sample, run)
    if sample.unmeasured > 0.0:
        run = inflate(settings, sample, run)
    if hooks.HAS_VELOCITY and sample.force.time > 0.0:
        run = inflate_velocity(settings, sample, run)
    if sample.detected.far_from_g or sample.detected.was_far:
        run = gate_acceleration(settings, sample, run)
    else:
        run = accept_force(sample, run)
    run = step(settings, sample, run)
    if correction_due(settings, sample, run):
        run = apply_correction(settings, sample, run)
    if not hooks.OWN_SIGMA and sigma_due(sample):
        run = update_sigma(settings, sample, run)
    return Carry(sample, run)


@kernel
def result(settings: Settings, run: FilterRun) -> Output:
    """The filter's output with the bias read off at rest added, σ where the filter has none, and health."""
    state, found, gates = run.state, run.health, run.guard
    covariance = run.covariance
    estimate: Output = hooks.output(settings.filter, state)
    quat, (x, y, z), sigma, health = estimate
    a, b, c = gates.rest.bias if hooks.TAKES_BIAS else ZERO
    if not hooks.OWN_SIGMA:
        sigma = observer_sigma(covariance)
    return Output(quat=quat, bias=Vec3(x + a, y + b, z + c), sigma=sigma, health=health | found)


@kernel
def process_row(settings: Settings, carry: Carry, i: int, gyr: Floats, acc: Floats, mag: Floats, dt: float) -> Carry:
    """Row i of the arrays through the filter."""
    j = 3 * i
    field = ZERO
    if len(mag) > 0:
        field = Vec3(mag[j], mag[j + 1], mag[j + 2])
    rate = Vec3(gyr[j], gyr[j + 1], gyr[j + 2])
    return advance(settings, carry, rate, Vec3(acc[j], acc[j + 1], acc[j + 2]), field, dt)


@kernel
def write_row(
    settings: Settings, carry: Carry, i: int, quat: Floats, bias: Floats, sigma: Floats, health: list[int]
) -> None:
    """Row i of the result."""
    q, b, s, health[i] = result(settings, carry.run)
    j = 3 * i
    k = 4 * i
    quat[k], quat[k + 1], quat[k + 2], quat[k + 3] = q
    bias[j], bias[j + 1], bias[j + 2] = b
    sigma[j], sigma[j + 1], sigma[j + 2] = s


@kernel
def run(
    settings: Settings, carry: Carry, last: float, t: Floats, gyr: Floats, acc: Floats, mag: Floats,
    quat: Floats, bias: Floats, sigma: Floats, health: list[int],
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
    return Carry(
        sample,
        FilterRun(
            state=aiding.update(settings.filter, run.state, row, value, deviation, age),
            health=run.health,
            guard=run.guard,
            covariance=run.covariance,
        ),
    )


@kernel
def write_nav(settings: Settings, carry: Carry, i: int, nav: Floats) -> None:
    """Row i of position, velocity, 1σ of position and 1σ of velocity."""
    j = 12 * i
    found = aiding.nav_state(settings.filter, carry.run.state)
    nav[j], nav[j + 1], nav[j + 2] = found.position
    nav[j + 3], nav[j + 4], nav[j + 5] = found.velocity
    nav[j + 6], nav[j + 7], nav[j + 8] = found.sigma_position
    nav[j + 9], nav[j + 10], nav[j + 11] = found.sigma_velocity


@kernel
def run_with_aiding(
    settings: Settings, carry: Carry, last: float, t: Floats, gyr: Floats, acc: Floats, mag: Floats,
    first: list[int], row: list[int], value: Floats, deviation: Floats, age: Floats,
    quat: Floats, bias: Floats, sigma: Floats, health: list[int], nav: Floats,
) -> Carry:  # fmt: skip
    """``run`` with aiding: after sample i the numbers ``first[i]`` to ``first[i + 1]`` − 1; fills nav (12n) as well."""
    for i in range(len(t)):
        carry = process_row(settings, carry, i, gyr, acc, mag, t[i] - last)
        last = t[i]
        for k in range(first[i], first[i + 1]):
            carry = update_aiding(settings, carry, row[k], value[k], deviation[k], age[k])
        write_row(settings, carry, i, quat, bias, sigma, health)
        write_nav(settings, carry, i, nav)
    return carry
