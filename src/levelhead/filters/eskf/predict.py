"""Prediction of ``ESKF`` over a block of samples: F (eq. 7), Q (eqs. 8 to 12, 28 and 29), and the growth in a gap."""

from math import pi, sqrt

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import aiding, coarse_heading
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.adaptation import AT_REST, INNOVATION_TIME
from levelhead.filters.eskf.covariance import (
    add_covariance,
    add_variance,
    decay,
    field_scale,
    propagate,
    propagate_position,
    rotate_velocity_error,
    set_independent,
    state_variance,
    vector,
    walk_aided,
    walk_inertial,
    walk_magnetic,
)
from levelhead.filters.eskf.params import ESKF
from levelhead.filters.eskf.preintegration import reset_block
from levelhead.kernels.arrays import Floats
from levelhead.kernels.tilt import UNIFORM, after_gap
from levelhead.units import DEGREE, GRAVITY

ROUNDING = 2e-7  # share of a variance that corrections in single precision may get wrong in a block
UNMEASURED_ACC = 5.0  # m/s², 1σ of the acceleration of a body without accelerometer readings
LARGE_HEADING = 0.1  # rad, 1σ of heading beyond which velocity may correct heading only
CLEAR_FORCE = 5.0  # if the horizontal force is so many times that of the tilt error
SHAKEN = 0.005  # √s, noise density of specific force as a share of the sensor's shaking
WHOLE_TURN = 2.0 * pi  # rad
MOST_SPEED = 50.0  # m/s, 1σ without aiding
IMPACT = 300.0  # m/s²: of a blow of this size the integral of the samples is worth nothing


@kernel
def set_transition(m: Floats) -> None:
    """1 − F of the driven states over a block, by rows v, θ."""
    for i in range(at.DRIVEN * at.ROW):
        m[at.F + i] = 0.0
    for i in range(3):
        v = at.F + i * at.ROW
        t = v + 3 * at.ROW
        for k in range(3):
            m[v + at.ACC_BIAS + k] = m[at.INT_R + 3 * i + k]
            m[t + at.GYR_BIAS + k] = m[at.INT_R + 3 * i + k]
        for k in range(9):
            m[t + at.GYR_MATRIX + k] = m[at.INT_R_RATE + 9 * i + k]
    x, y, z = vector(m, at.INT_FORCE)
    m[at.F + at.ATTITUDE + 1] = -z
    m[at.F + at.ATTITUDE + 2] = y
    m[at.F + at.ROW + at.ATTITUDE] = z
    m[at.F + at.ROW + at.ATTITUDE + 2] = -x
    m[at.F + 2 * at.ROW + at.ATTITUDE] = -y
    m[at.F + 2 * at.ROW + at.ATTITUDE + 1] = x


@kernel
def decay_place(params: ESKF, m: Floats, time: float) -> None:
    """The field's part s of the place after ``time`` seconds in motion: a first-order Gauss-Markov process, eq. 11."""
    left = params.place_time / (params.place_time + time)
    m[at.PLACE_DECAY] = 1.0 - (1.0 - m[at.PLACE_DECAY]) * left
    for i in range(3):
        decay(m, at.PLACE + i, left)
    add_variance(m, at.PLACE, 3, m[at.PLACE_VARIANCE] * field_scale(m) * (1.0 - left * left))


@kernel
def decay_travel(params: ESKF, m: Floats, time: float) -> None:
    """Body velocity u after ``time`` seconds: such a process with the variance that was found, eq. 12."""
    left = params.body_velocity_time / (params.body_velocity_time + time)
    m[at.BODY_VELOCITY_DECAY] = 1.0 - (1.0 - m[at.BODY_VELOCITY_DECAY]) * left
    for i in range(3):
        decay(m, at.BODY_VELOCITY + i, left)
    add_variance(m, at.BODY_VELOCITY, 3, m[at.BODY_VELOCITY_VARIANCE] * (1.0 - left * left))


@kernel
def limit_heading_coupling(m: Floats) -> None:
    """Keeps F, which is of first order, from teaching heading too much where velocity is measured.

    A turn by θ_z moves v along an arc, and F along its tangent: the difference, θ_z²/2 ∫f dt, is noise. A horizontal
    force that may be gravity seen with a tilt error has no direction that could correct heading: the coupling is zero.
    """
    x, y, _ = vector(m, at.INT_FORCE)
    force2 = x * x + y * y
    heading = state_variance(m, at.HEADING)
    time = m[at.BLOCK_TIME]
    pretended = (state_variance(m, at.ATTITUDE) + state_variance(m, at.ATTITUDE + 1)) * GRAVITY * GRAVITY * time * time
    noise = 0.5 * heading * heading * force2
    if coarse_heading.is_open(m):
        push2 = m[at.VELOCITY_GAIN] * m[at.VELOCITY_GAIN] + m[at.VELOCITY_GAIN + 1] * m[at.VELOCITY_GAIN + 1]
        east, north = m[at.VELOCITY_GAIN] + x, m[at.VELOCITY_GAIN + 1] + y
        m[at.F + at.HEADING] = 0.0
        m[at.F + at.ROW + at.HEADING] = 0.0
        noise = max(east * east + north * north - push2, 0.0)
    elif heading > LARGE_HEADING * LARGE_HEADING and force2 < CLEAR_FORCE * CLEAR_FORCE * pretended:
        m[at.F + at.HEADING] = 0.0
        m[at.F + at.ROW + at.HEADING] = 0.0
        noise += heading * force2
    add_variance(m, at.VELOCITY, 2, noise)


@kernel
def add_process_noise(params: ESKF, m: Floats, resting: bool, n: int) -> None:
    """Q of a block: noise of the readings on attitude and velocity, and the random walks of all other states."""
    time = m[at.BLOCK_TIME]
    noise = params.gyr_noise * DEGREE
    share = params.gyr_noise_per_rate
    add_variance(m, at.ATTITUDE, 3, noise * noise * time + share * share * m[at.INT_RATE2] + m[at.ADDED_VARIANCE])
    add_variance(m, at.HEADING, 1, m[at.ADDED_HEADING_VARIANCE])
    without = time - m[at.ACC_TIME]
    force = params.acc_noise * params.acc_noise * m[at.ACC_TIME]
    blow = m[at.INT_ACC2] / (IMPACT * IMPACT * time)
    force += SHAKEN * SHAKEN * m[at.INT_ACC2]
    force += min(blow * blow, 1.0) * m[at.INT_ACC2] * time
    force += m[at.ADDED_VELOCITY_VARIANCE]
    add_variance(m, at.VELOCITY, 3, force + UNMEASURED_ACC * UNMEASURED_ACC * without * time)
    walk_inertial(params, m, 1.0)
    faster = m[at.BIAS_WALK] * time
    add_variance(m, at.GYR_BIAS, 3, faster)
    for i in range(at.GYR_BIAS, at.GYR_BIAS + 3):  # or P would come near the variance of the prior, eq. 26
        m[at.PRIOR_VARIANCE + i] += faster
    decay_travel(params, m, time)
    if n > at.N_MAGNETIC:
        walk_aided(params, m, 1.0)
    for i in range(at.N):
        add_variance(m, i, 1, ROUNDING * state_variance(m, i))
    if n > at.N_INERTIAL:
        walk_magnetic(params, m, sqrt(field_scale(m)))
        decay_place(params, m, time / AT_REST if resting else time)


@noinline
def add_missed_turn(m: Floats, n: int) -> None:
    """Q of a missed turn or force by the velocity, eq. 28, with the velocity that the turn has caused.

    A turn about the vertical takes the error of velocity along, or velocity would seem to measure heading. It may be as
    large as both others together.
    """
    share = m[at.BLOCK_TIME] / INNOVATION_TIME
    speed = GRAVITY * INNOVATION_TIME
    caused = share * m[at.EXCESS]
    turn = 3.0 * caused / (speed * speed)
    x, y, _ = vector(m, at.MEAN + at.VELOCITY)
    rotate_velocity_error(m, at.P, n, -x, -y)
    add_variance(m, at.ATTITUDE, 2, turn)
    add_variance(m, at.HEADING, 1, 2.0 * turn)
    add_variance(m, at.VELOCITY, 2, 2.0 * caused)
    add_covariance(m, at.VELOCITY, at.ATTITUDE + 1, caused / speed)
    add_covariance(m, at.VELOCITY + 1, at.ATTITUDE, -caused / speed)
    rotate_velocity_error(m, at.P, n, x, y)
    add_variance(m, at.VELOCITY + 2, 1, share * m[at.EXCESS + 1])


@kernel
def level_velocity_variance(m: Floats) -> float:
    """Variance of the horizontal velocity, (m/s)²."""
    return state_variance(m, at.VELOCITY) + state_variance(m, at.VELOCITY + 1)


@noinline
def forget_heading(m: Floats, n: int) -> None:
    """A heading whose σ is beyond a whole turn has no meaning: it becomes uniform on the circle, with a health bit.

    To first order it would go on to multiply a velocity's error without end, and P would lose its digits. Where it has
    done so, and no aiding measures velocity, that means nothing either.
    """
    x, y, _ = vector(m, at.MEAN + at.VELOCITY)
    undirected = not (aiding.is_aided(m, 0) or aiding.is_aided(m, 1))
    if undirected:
        rotate_velocity_error(m, at.P, n, -x, -y)
    set_independent(m, at.HEADING, 1, UNIFORM)
    if undirected:
        rotate_velocity_error(m, at.P, n, x, y)
    if m[at.AIDED] == 0.0 and level_velocity_variance(m) > MOST_SPEED * MOST_SPEED:
        reset_velocity(m)
    m[at.REINITIALISED] = 1.0


@noinline
def predict_gap(m: Floats, gap: float) -> None:
    """Across a gap of so many seconds: attitude and velocity may be any, and are independent of the calibration."""
    if m[at.AIDED] != 0.0:
        aiding.inflate_nav_state(m, gap)
    else:
        reset_velocity(m)
    level = sqrt(after_gap(max(state_variance(m, at.ATTITUDE), state_variance(m, at.ATTITUDE + 1)), gap))
    heading = sqrt(after_gap(state_variance(m, at.HEADING), gap))
    set_independent(m, at.ATTITUDE, 2, level)
    set_independent(m, at.HEADING, 1, heading)
    reset_block(m)
    m[at.GAP_TIME] = gap


@kernel
def reset_velocity(m: Floats) -> None:
    """Velocity zero with its σ at the start; its evidence of a missed turn ends."""
    set_independent(m, at.VELOCITY, 3, at.FIRST_SPEED)
    for i in range(3):
        m[at.MEAN + at.VELOCITY + i] = 0.0
        m[at.MEAN_INNOVATION + i] = 0.0
    m[at.EXCESS] = 0.0
    m[at.EXCESS + 1] = 0.0


@noinline
def predict(params: ESKF, m: Floats, resting: bool, n: int) -> None:
    """The covariance of the first ``n`` states at the end of the block."""
    set_transition(m)
    if n > at.N_MAGNETIC:
        limit_heading_coupling(m)
        propagate_position(m, n, 0.5 * m[at.BLOCK_TIME])
    propagate(m, n)
    if n > at.N_MAGNETIC:
        propagate_position(m, n, 0.5 * m[at.BLOCK_TIME])
    add_process_noise(params, m, resting, n)
    if m[at.EXCESS] + m[at.EXCESS + 1] > 0.0:
        add_missed_turn(m, n)
    velocity = level_velocity_variance(m) if m[at.AIDED] == 0.0 else 0.0
    if state_variance(m, at.HEADING) > WHOLE_TURN * WHOLE_TURN or velocity > MOST_SPEED * MOST_SPEED:
        forget_heading(m, n)
    m[at.RUN_TIME] += m[at.BLOCK_TIME]
