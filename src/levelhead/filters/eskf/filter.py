"""The state of ``ESKF`` and the functions that the driver calls; equations in ``__init__``."""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.contract import NavState, Output
from levelhead.filters.eskf import aiding
from levelhead.filters.eskf.calibration import Learned, tell
from levelhead.filters.eskf.calibration import estimate as part
from levelhead.filters.eskf.measurements import runaway, see_all
from levelhead.filters.eskf.params import ESKF, MILLI
from levelhead.filters.eskf.predict import FIRST_SPEED, across_gap, elsewhere, predict
from levelhead.filters.eskf.preintegration import begin_block, feel, look
from levelhead.filters.eskf.reinitialise import (
    FIRST_FIELD,
    NOTHING_ODD,
    Odd,
    found_north,
    found_up,
    new_place,
    odd_for,
    take_field,
)
from levelhead.filters.eskf.state import (
    ACC,
    AGE,
    AIDED,
    BARE,
    BIAS,
    COUNT,
    DELAY,
    FOUND,
    GYR,
    HEARD,
    HERE,
    IRON,
    KNOWN,
    LOST,
    LOST_Z,
    MAG,
    MEAN,
    ROW,
    SIZE,
    SPEED,
    SPELL,
    TURN,
    TURN_Z,
    X,
    independent,
    recall,
    variance,
    vector,
)
from levelhead.filters.health import ACC_REJECTED, AID_REJECTED, MAG_LEARNED, MAG_REJECTED
from levelhead.kernels import quat, tilt, triad
from levelhead.kernels.angle import DEGREE
from levelhead.kernels.arrays import Floats, zeros
from levelhead.kernels.quat import IDENTITY, Quat
from levelhead.kernels.tilt import GAP_SECONDS, UNIFORM
from levelhead.kernels.vec3 import Vec3, norm, scale, sub

LOST_TILT = 0.25  # rad²: beyond, tilt is taken from the sensors as at the start, not corrected
UNKNOWN = 1.0  # rad, 1σ of a heading that means nothing
AGREED = 1e-4  # rad, of a relative heading at its start
GATE_TIME = 1.0  # s, for at most so long
BRIEF = 1e-3  # s that a sample after a gap counts for
ODD_TIME = 1.0  # s


class State(NamedTuple):
    """Attitude; everything else that is estimated stands in ``memory``, see ``error_state``."""

    quat: Quat
    unit: float  # µT, the first norm of the field; 0: none seen yet
    still: bool  # at rest
    out: float  # s for which velocity has not been believed
    odd: Odd
    blocks: int  # that have ended
    fresh: bool  # the last sample ended one
    health: int
    memory: Floats


@noinline
def init(params: ESKF, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample; a relative heading starts at 0 and is right by definition."""
    m = zeros(SIZE)
    return begun(params, m, acc, mag)


@noinline
def restart(params: ESKF, before: State, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """The same, with what ``before`` has been told of an earlier run."""
    m = before.memory
    for i in range(KNOWN):
        m[i] = 0.0
    for i in range(AGE, SIZE):
        m[i] = 0.0
    return begun(params, m, acc, mag)


@noinline
def begun(params: ESKF, m: Floats, acc: Vec3, mag: Vec3) -> State:
    """A start in memory that is zero but for what is known."""
    independent(m, ACC, 3, params.acc_bias)
    independent(m, SPEED, 3, FIRST_SPEED)
    independent(m, TURN, 2, UNKNOWN)
    independent(m, BIAS, 3, params.bias_start * DEGREE)
    independent(m, GYR, 9, params.scale_start)
    recall(m, ACC, 3, 1.0)
    recall(m, BIAS, 3, 1.0)
    recall(m, GYR, 9, 1.0)
    independent(m, TURN_Z, 1, AGREED)
    attitude = triad.initial_attitude(acc, mag)
    unit = 0.0
    if tilt.present(mag):
        unit = first_field(params, m, attitude, mag)
        independent(m, TURN_Z, 1, UNKNOWN)
    return State(attitude, unit, False, 0.0, NOTHING_ODD, 0, False, 0, m)


@noinline
def first_field(params: ESKF, m: Floats, attitude: Quat, mag: Vec3) -> float:
    """The field of the first sample that has one; returns its norm."""
    new_place(params, m)
    independent(m, IRON, 3, params.mag_offset)
    independent(m, DELAY, 1, params.mag_delay * MILLI)
    unit = norm(mag)
    recall(m, IRON, 3, unit)
    recall(m, DELAY, 1, 1.0)
    east, north, up = quat.rotate(attitude, sub(scale(mag, 1.0 / unit), vector(m, MEAN + IRON)))
    m[MEAN + MAG] = sqrt(east * east + north * north)
    m[MEAN + MAG + 1] = up
    return unit


@kernel
def step(params: ESKF, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """The attitude at every sample, and what the next correction is made of."""
    attitude, unit, still, out, odd, blocks, fresh, health, m = state
    if fresh:
        begin_block(m)
    x, y, z = gyr
    g = MEAN + GYR
    rate = Vec3(
        x - m[MEAN + BIAS] - (m[g] * x + m[g + 1] * y + m[g + 2] * z),
        y - m[MEAN + BIAS + 1] - (m[g + 3] * x + m[g + 4] * y + m[g + 5] * z),
        z - m[MEAN + BIAS + 2] - (m[g + 6] * x + m[g + 7] * y + m[g + 8] * z),
    )
    attitude = quat.integrate(attitude, rate, dt)
    if dt > GAP_SECONDS:
        across_gap(m, dt)
        if unit > 0.0:
            elsewhere(params, m, dt)
        dt = BRIEF
    r = quat.matrix(attitude)
    if m[AIDED] != 0.0:
        aiding.carried(m, 0.5 * dt)
    feel(m, r, gyr, acc, dt)
    if m[AIDED] != 0.0:
        aiding.carried(m, 0.5 * dt)
    if tilt.present(mag):
        if unit == 0.0:
            unit = first_field(params, m, attitude, mag)
            independent(m, TURN_Z, 1, UNKNOWN)
        look(m, r, rate, mag, unit)
    return State(attitude, unit, still, out, odd, blocks, False, health, m)


@kernel
def due(params: ESKF, state: State) -> bool:
    """Whether a block has ended."""
    return state.memory[SPELL] >= params.block


@kernel
def known(state: State) -> int:
    """How much of a row is computed: what exists."""
    if state.memory[AIDED] != 0.0:
        return ROW
    return HERE if state.unit > 0.0 else BARE


@noinline
def correct(params: ESKF, state: State, dt: float) -> State:
    """Covariance and corrections at the end of a block."""
    predict(params, state.memory, known(state))
    return corrected(params, state)


@noinline
def corrected(params: ESKF, state: State) -> State:
    """Corrections, the covariance being that of the end of the block."""
    attitude, unit, still, out, odd, blocks, _, _, m = state
    n = known(state)
    out = out + m[SPELL] if runaway(params, m, still) else 0.0
    up_lost = m[HEARD] > 0.0 and (out > GATE_TIME or variance(m, TURN) + variance(m, TURN + 1) > LOST_TILT)
    if up_lost or (m[COUNT] > 0.0 and variance(m, TURN_Z) > UNKNOWN * UNKNOWN):
        swing = found_up(params, m) if up_lost else IDENTITY
        if m[COUNT] > 0.0 and variance(m, TURN_Z) > UNKNOWN * UNKNOWN:
            swing = found_north(params, m, swing)
        m[FOUND] = 1.0
        return State(quat.compose(swing, attitude), unit, False, 0.0, NOTHING_ODD, blocks + 1, True, 0, m)
    fit = see_all(params, m, still, out == 0.0, odd.spell > ODD_TIME, n)
    swing = quat.exp(vector(m, X + TURN))
    health = ACC_REJECTED if out > 0.0 else 0
    if fit.refused or fit.turned:
        health |= MAG_REJECTED
    if fit.astray:
        health |= AID_REJECTED
    odd = odd_for(m, odd, fit)
    if odd.spell > params.mag_time:  # the room was changed, not the moment
        take_field(params, m, odd.field)
        independent(m, TURN_Z, 1, UNKNOWN)
        health |= MAG_LEARNED
        odd = NOTHING_ODD
    return State(quat.compose(swing, attitude), unit, False, out, odd, blocks + 1, True, health, m)


@kernel
def inflate(params: ESKF, state: State, variance: float) -> State:
    """The whole attitude less sure."""
    state.memory[LOST] += variance
    return state


@kernel
def inflate_heading(params: ESKF, state: State, variance: float) -> State:
    """Heading less sure."""
    state.memory[LOST_Z] += variance
    return state


@kernel
def at_rest(params: ESKF, state: State) -> State:
    """The sensor is at rest."""
    attitude, unit, _, out, odd, blocks, fresh, health, m = state
    return State(attitude, unit, True, out, odd, blocks, fresh, health, m)


@kernel
def deviation(m: Floats, i: int) -> float:
    """σ of an angle."""
    return min(sqrt(max(variance(m, i), 0.0)), UNIFORM)


@kernel
def output(params: ESKF, state: State) -> Output:
    """Attitude, bias, σ and health."""
    m = state.memory
    sigma = Vec3(deviation(m, TURN), deviation(m, TURN + 1), deviation(m, TURN_Z))
    return Output(state.quat, vector(m, MEAN + BIAS), sigma, state.health)


def estimate(params: ESKF, state: State) -> Learned:
    """What the filter knows of its sensor by now."""
    m, unit = state.memory, state.unit
    bias = part(m, BIAS, 3, params.bias_start * DEGREE, params.bias_walk * DEGREE)
    matrix = part(m, GYR, 9, params.scale_start, params.scale_walk)
    force = part(m, ACC, 3, params.acc_bias, params.acc_walk)
    if unit == 0.0:
        return Learned(matrix, bias, force)
    offset = part(m, IRON, 3, params.mag_offset, params.offset_walk, unit)
    late = part(m, DELAY, 1, params.mag_delay * MILLI, 0.0)
    return Learned(matrix, bias, force, offset, late, part(m, MAG, 2, FIRST_FIELD, params.field_walk, unit))


def with_prior(state: State, known: Learned) -> State:
    """A state before its first sample that knows what an earlier run has learned, for ``restart``."""
    m = list(state.memory)
    tell(m, GYR, known.gyr_matrix)
    tell(m, BIAS, known.gyr_bias)
    tell(m, ACC, known.acc_bias)
    tell(m, IRON, known.mag_offset)
    tell(m, DELAY, known.mag_delay)
    return state._replace(memory=m)


@kernel
def aid(params: ESKF, state: State, row: int, value: float, sigma: float, age: float) -> State:
    """One number of position, velocity or height, see ``aiding``; what has a direction ends a relative heading."""
    m = state.memory
    before = aiding.oriented(m)
    aiding.sight(m, row, value, sigma, age)
    if state.unit == 0.0 and aiding.oriented(m) and not before:
        independent(m, TURN_Z, 1, UNKNOWN)
    return state


@kernel
def nav_state(params: ESKF, state: State) -> NavState:
    """Where the body is and how it moves."""
    return aiding.nav_state(state.memory)
