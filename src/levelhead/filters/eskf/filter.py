"""The state of ``ESKF`` and the functions that the driver calls; model and equations in ``__init__``."""

from collections.abc import Mapping
from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.contract import NavState, Output
from levelhead.filters.eskf import aiding, coarse_heading
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.adaptation import (
    MOST_ACC_BIAS,
    MOST_GYR_BIAS,
    SURE,
    SURE_OPEN,
    adapt_bias_walk,
    adapt_motion,
    found_prior,
    is_upside_down,
    narrow_prior,
    note_bias,
    set_prior_widths,
    widen_prior,
)
from levelhead.filters.eskf.calibration import Estimate, estimates, set_prior
from levelhead.filters.eskf.coarse_heading import LARGE_HEADING
from levelhead.filters.eskf.covariance import (
    set_independent,
    start_inertial,
    start_magnetic,
    state_variance,
    vector,
)
from levelhead.filters.eskf.known_field import set_known_field
from levelhead.filters.eskf.measurements import (
    add_correction,
    average_rate,
    update_field_undirected,
    update_velocity,
    update_zero_rate,
)
from levelhead.filters.eskf.north import point_north, turn_to_north
from levelhead.filters.eskf.params import ESKF
from levelhead.filters.eskf.predict import decay_place, predict, predict_gap
from levelhead.filters.eskf.preintegration import add_imu, add_mag, calibrated_rate, reset_block
from levelhead.filters.eskf.reinitialise import (
    forget_lost_force,
    note_rotation,
    reinitialise_heading,
    reinitialise_tilt,
)
from levelhead.filters.eskf.sigma import attitude_sigma
from levelhead.filters.health import AID_REJECTED, MAG_REJECTED, TURN_MISSED
from levelhead.kernels import quat, tilt, triad
from levelhead.kernels.arrays import Floats, zeros
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.quat import IDENTITY, Quat
from levelhead.kernels.tilt import GAP_SECONDS, UNIFORM
from levelhead.kernels.vec3 import Vec3, norm, scale
from levelhead.units import GRAVITY

LARGE_TILT = 0.25  # rad²: a larger variance of tilt cannot be corrected to first order
READING_TIME = 1.0 / sqrt(12.0)  # of an interval, 1σ of the time that a reading is of: uniform in ± half of it, eq. 40
GAP_SAMPLE = 1e-3  # s that the sample after a gap lasts


class State(NamedTuple):
    """Attitude; ``memory`` has all other estimates, at the places of ``state``."""

    quat: Quat
    field_norm: float  # µT, of the first field; 0: there was none
    resting: bool  # the guard has found the sensor at rest in this block
    block_end: bool  # with the last sample
    health: int
    memory: Floats


@noinline
def init(params: ESKF, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample; a relative heading starts at 0 and is right by definition."""
    m = zeros(at.SIZE)
    return start(params, m, acc, mag)


@noinline
def restart(params: ESKF, before: State, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """The same with the prior of ``before``, whose memory is used again."""
    m = before.memory
    for i in range(at.PRIOR_MEAN):
        m[i] = 0.0
    for i in range(at.RUN_TIME, at.SIZE):
        m[i] = 0.0
    return start(params, m, acc, mag)


@noinline
def start(params: ESKF, m: Floats, acc: Vec3, mag: Vec3) -> State:
    """The state of the first sample, in a memory that is zero but for a prior."""
    start_inertial(params, m, 1.0)
    set_prior_widths(params, m)
    m[at.MEAN_UP] = GRAVITY
    m[at.BODY_VELOCITY_VARIANCE] = params.body_velocity * params.body_velocity
    attitude = triad.initial_attitude(acc, mag)
    field_norm = 0.0
    if tilt.is_present(mag):
        field_norm = start_field(params, m, mag)
    return State(attitude, field_norm, resting=False, block_end=False, health=0, memory=m)


@noinline
def start_field(params: ESKF, m: Floats, mag: Vec3) -> float:
    """Starts the magnetometer's states with its first sample (µT), whose norm it returns."""
    field_norm = norm(mag)
    start_magnetic(params, m, field_norm)
    m[at.PLACE_VARIANCE] = params.mag_place * params.mag_place
    if params.field_strength > 0.0:
        set_known_field(params, m, field_norm)
    if params.north_rate > 0.0:
        m[at.NORTH_EXCESS] = UNIFORM * UNIFORM
    return field_norm


@kernel
def step(params: ESKF, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """Integrates attitude and velocity over one sample, and adds the sample to the integrals of the block."""
    attitude, field_norm, m = state.quat, state.field_norm, state.memory
    if state.block_end:
        reset_block(m)
    rate = calibrated_rate(m, gyr)
    attitude = quat.integrate(attitude, rate, dt)
    if dt > GAP_SECONDS:
        predict_gap(m, dt)
        if field_norm > 0.0:
            decay_place(params, m, dt)
        dt = GAP_SAMPLE
    m[at.HALF_TURN], m[at.HALF_TURN + 1], m[at.HALF_TURN + 2] = scale(rate, READING_TIME * dt)
    r = quat.matrix(attitude)
    if m[at.AIDED] != 0.0:
        aiding.propagate_mean(m, 0.5 * dt)
    add_imu(m, r, gyr, acc, dt)
    if m[at.AIDED] != 0.0:
        aiding.propagate_mean(m, 0.5 * dt)
    if tilt.is_present(mag):
        if field_norm == 0.0:
            field_norm = start_field(params, m, mag)
        add_mag(m, r, rate, mag, field_norm)
    return State(attitude, field_norm, resting=state.resting, block_end=False, health=state.health, memory=m)


@kernel
def due(params: ESKF, state: State, dt: float) -> bool:
    """Whether a block has ended with a sample of ``dt`` seconds."""
    return has_elapsed(state.memory[at.BLOCK_TIME], GAP_SAMPLE if dt > GAP_SECONDS else dt, params.block)


@kernel
def state_count(state: State) -> int:
    """How many states at the front of a row are computed, so that all that exist are among them."""
    if state.memory[at.AIDED] != 0.0:
        return at.ROW
    return at.N_MAGNETIC if state.field_norm > 0.0 else at.N_INERTIAL


@noinline
def correct(params: ESKF, state: State, dt: float) -> State:
    """Prediction and measurements at the end of a block."""
    predict(params, state.memory, state.resting, state_count(state))
    return update(params, state)


class Loss(NamedTuple):
    """Of which part of the attitude so little is known that corrections of first order are worth nothing."""

    tilt: bool
    heading: bool
    upside_down: bool  # gravity contradicts the tilt


@noinline
def find_loss(m: Floats) -> Loss:
    """The sums that end with a block."""
    upside_down = is_upside_down(m)
    variance = state_variance(m, at.ATTITUDE) + state_variance(m, at.ATTITUDE + 1)
    tilt_lost = m[at.ACC_TIME] > 0.0 and (upside_down or variance > LARGE_TILT)
    heading_lost = m[at.MAG_COUNT] > 0.0 and state_variance(m, at.HEADING) > LARGE_HEADING
    return Loss(tilt_lost, heading_lost, upside_down)


@noinline
def correct_lost(params: ESKF, m: Floats, lost: Loss) -> Quat:
    """The rotation that corrects tilt, or heading, or both, beyond first order."""
    rotation = reinitialise_tilt(params, m, lost.upside_down) if lost.tilt else IDENTITY
    if m[at.MAG_COUNT] > 0.0 and state_variance(m, at.HEADING) > LARGE_HEADING:
        rotation = reinitialise_heading(params, m, rotation)
    if lost.tilt and m[at.LOST_TIME] > m[at.ACC_TIME]:
        note_rotation(m, rotation)
    else:
        m[at.REINITIALISED] = 1.0
    m[at.MEAN_UP] = GRAVITY
    return rotation


@noinline
def find_course(m: Floats, has_field: bool) -> float:
    """The angle by which a receiver's velocity turns heading where that was unknown, rad; 0: it does not."""
    forget_lost_force(m)
    if m[at.AIDED] == 0.0 or has_field:
        return 0.0
    course = coarse_heading.correct_course(m)
    if not course.clear:
        return 0.0
    m[at.REINITIALISED] = 1.0
    return course.angle


class Reinitialisation(NamedTuple):
    """An attitude that took the place of a lost one."""

    done: bool  # nothing else is measured in this block
    attitude: Quat
    health: int


@noinline
def reinitialise(params: ESKF, state: State) -> Reinitialisation:
    """Tilt or heading that is lost, from the mean readings of the block or from a receiver's velocity."""
    m = state.memory
    lost = find_loss(m)
    if lost.tilt or lost.heading:
        health = TURN_MISSED if lost.upside_down else 0
        return Reinitialisation(True, quat.compose(correct_lost(params, m, lost), state.quat), health)
    course = find_course(m, state.field_norm > 0.0)
    if course != 0.0:
        return Reinitialisation(True, tilt.add_yaw(state.quat, course), 0)
    return Reinitialisation(False, state.quat, 0)


@noinline
def measure(params: ESKF, m: Floats, resting: bool, n: int) -> int:
    """All measurements of a block, with the noise that motion has by now; returns bits of health."""
    adapt_motion(params, m)
    health = TURN_MISSED if m[at.EXCESS] > 0.0 else 0
    note_bias(m)
    update_velocity(params, m, resting, n)
    if resting:
        update_zero_rate(m, n)
    if m[at.MAG_COUNT] > 0.0 and update_field_undirected(params, m, resting, n):
        health |= MAG_REJECTED
    if n > at.N_MAGNETIC and aiding.update(m, n):
        health |= AID_REJECTED
    return health


@noinline
def adapt_priors(params: ESKF, m: Floats, n: int) -> None:
    """The random walk of the gyroscope's bias, and the widths of the priors of both biases."""
    adapt_bias_walk(m)
    sure = SURE
    if m[at.GYR_PRIOR_OPEN] != 0.0:
        narrow_prior(params, m, n)
        sure = SURE_OPEN
    widen_prior(m, n, at.GYR_BIAS, MOST_GYR_BIAS, sure)
    if m[at.EXCESS] == 0.0:  # or the accelerometer's bias would explain the tilt
        widen_prior(m, n, at.ACC_BIAS, MOST_ACC_BIAS, SURE)


@kernel
def apply_correction(m: Floats, n: int, attitude: Quat) -> Quat:
    """Adds x to the mean of the first ``n`` states; returns the attitude corrected by it, eq. 1."""
    add_correction(m, n)
    return quat.compose(quat.exp(vector(m, at.X + at.ATTITUDE)), attitude)


@noinline
def update(params: ESKF, state: State) -> State:
    """The end of a block: a lost attitude is found anew; else measurements correct it."""
    m = state.memory
    n = state_count(state)
    average_rate(m, state.resting)
    found = reinitialise(params, state)
    if found.done:
        return end_block(state, found.attitude, found.health)
    health = measure(params, m, state.resting, n)
    adapt_priors(params, m, n)
    attitude = apply_correction(m, n, state.quat)
    if state.field_norm > 0.0:
        point_north(params, m)
    return end_block(state, attitude, health)


@kernel
def end_block(state: State, attitude: Quat, health: int) -> State:
    """The state behind the end of a block."""
    return State(attitude, state.field_norm, resting=False, block_end=True, health=health, memory=state.memory)


@kernel
def inflate(params: ESKF, state: State, variance: float) -> State:
    """Adds a variance (rad²) about each axis at the end of the block."""
    state.memory[at.ADDED_VARIANCE] += variance
    return state


@kernel
def inflate_heading(params: ESKF, state: State, variance: float) -> State:
    """Adds a variance (rad²) about the vertical at the end of the block."""
    state.memory[at.ADDED_HEADING_VARIANCE] += variance
    return state


@kernel
def inflate_velocity(params: ESKF, state: State, variance: float) -> State:
    """Adds a variance (m²/s²) to each component of velocity at the end of the block."""
    state.memory[at.ADDED_VELOCITY_VARIANCE] += variance
    return state


@kernel
def at_rest(params: ESKF, state: State) -> State:
    """The guard has found the sensor at rest: the block will measure a zero rate."""
    return State(
        state.quat, state.field_norm, resting=True, block_end=state.block_end, health=state.health, memory=state.memory
    )


@kernel
def output(params: ESKF, state: State) -> Output:
    """Attitude, bias, σ and health."""
    m = state.memory
    attitude = turn_to_north(m, state.quat)
    turn = quat.rotate(attitude, vector(m, at.HALF_TURN))
    sigma = attitude_sigma(m, at.P, m[at.NORTH_EXCESS], found_prior(m), turn)
    return Output(quat=attitude, bias=vector(m, at.MEAN + at.GYR_BIAS), sigma=sigma, health=state.health)


@kernel
def update_aiding(params: ESKF, state: State, row: int, value: float, sigma: float, age: float) -> State:
    """One number of position, velocity or height, see ``aiding``; the first that has a direction makes heading unknown,
    which was relative."""
    m = state.memory
    before = aiding.has_direction(m)
    before_velocity = aiding.has_velocity(m)
    aiding.add_reading(params, m, row, value, sigma, age)
    if aiding.has_direction(m) and not before:  # the frame is the earth's from now on
        set_independent(m, at.HEADING, 1, at.UNKNOWN if state.field_norm == 0.0 else UNIFORM)
    first = aiding.has_velocity(m) and not before_velocity
    if state.field_norm == 0.0 and first and state_variance(m, at.HEADING) >= LARGE_HEADING:
        set_independent(m, at.HEADING, 1, UNIFORM)
    return state


@kernel
def nav_state(params: ESKF, state: State) -> NavState:
    """Position and velocity with their 1σ."""
    return aiding.nav_state(state.memory)


def estimate(params: ESKF, state: State) -> dict[str, Estimate]:
    """The estimates of the sensor's errors; plain Python."""
    return estimates(params, state.memory, state.field_norm)


def with_prior(state: State, known: Mapping[str, Estimate]) -> State:
    """A state before its first sample with the estimates of an earlier run, for ``restart``; plain Python."""
    m = list(state.memory)
    set_prior(m, known)
    return state._replace(memory=m)
