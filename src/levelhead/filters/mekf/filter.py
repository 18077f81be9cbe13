"""The state of ``EKF`` and the functions that the driver calls; equations in ``__init__``."""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import Output
from levelhead.filters.health import ACC_REJECTED, MAG_REJECTED
from levelhead.filters.mekf.covariance import Correction, Cov, across_gap, diagonal, inflate_attitude, predict
from levelhead.filters.mekf.measurements import NO_SAMPLES, Sums, add_sample, lowpass_force, update_heading, update_tilt
from levelhead.filters.mekf.params import EKF
from levelhead.kernels import quat, tilt, triad, vector_error
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.lowpass import advance_age
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GAP_SECONDS, UNIFORM
from levelhead.kernels.vec3 import ZERO, Vec3
from levelhead.units import DEGREE

REST_VARIANCE = (0.05 * DEGREE) * (0.05 * DEGREE)  # (rad/s)², of a bias read off at rest
SMALL_TURN = 1e-4  # rad²
FIRST_HEADING = (60.0 * DEGREE) * (60.0 * DEGREE)  # rad², of one reading of a magnetometer indoors


class State(NamedTuple):
    """Attitude, bias (rad/s), covariance, and the low-passed specific force in the earth frame (g)."""

    quat: Quat
    bias: Vec3
    p: Cov
    force: Vec3
    age: float  # s over which that is averaged
    sums: Sums
    acc_rejected: float  # s for which the innovation has been beyond the gate
    mag_rejected: float
    health: int


@kernel
def init(params: EKF, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample; a relative heading starts at 0 and is right by definition."""
    attitude = params.tilt_start * DEGREE
    bias = params.bias_start * DEGREE
    heading = FIRST_HEADING if tilt.is_present(mag) else 0.0
    p = diagonal(attitude * attitude, heading, bias * bias)
    return State(
        quat=triad.initial_attitude(acc, mag),
        bias=ZERO,
        p=p,
        force=Vec3(0.0, 0.0, 1.0),
        age=0.0,
        sums=NO_SAMPLES,
        acc_rejected=0.0,
        mag_rejected=0.0,
        health=0,
    )


@kernel
def predict_block(params: EKF, p: Cov, attitude: Quat, sums: Sums, dt: float) -> Cov:
    """P at the end of a block, whose last sample came after ``dt`` seconds."""
    if dt > GAP_SECONDS:
        return across_gap(params, p, dt)
    noise = params.gyr_noise * DEGREE
    walk = params.bias_walk * DEGREE
    time = sums.time
    turn = noise * noise * time + params.gyr_noise_per_rate * params.gyr_noise_per_rate * sums.int_rate2
    return predict(p, quat.matrix(attitude), turn, walk * walk * time, time)


@kernel
def step(params: EKF, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """Integrates the attitude over one sample, and adds the sample to the sums for the next correction."""
    attitude, bias, p = state.quat, state.bias, state.p
    force, age, sums = state.force, state.age, state.sums
    acc_rejected, mag_rejected, health = state.acc_rejected, state.mag_rejected, state.health
    x, y, z = gyr
    a, b, c = bias
    attitude = vector_error.rotate(attitude, (x - a) * dt, (y - b) * dt, (z - c) * dt)
    age = advance_age(age, dt)
    sums = add_sample(sums, attitude, gyr, acc, mag, dt)
    if tilt.is_present(acc):
        force = lowpass_force(params, force, attitude, acc, age, dt)
    return State(
        quat=attitude,
        bias=bias,
        p=p,
        force=force,
        age=age,
        sums=sums,
        acc_rejected=acc_rejected,
        mag_rejected=mag_rejected,
        health=health,
    )


@kernel
def due(params: EKF, state: State, dt: float) -> bool:
    """Whether a block has ended with a sample of ``dt`` seconds."""
    return has_elapsed(state.sums.time, dt, params.block)


@kernel
def correct(params: EKF, state: State, dt: float) -> State:
    """Eqs. 3 to 8 at the end of every block, whose last sample came after ``dt`` seconds."""
    attitude, bias, p = state.quat, state.bias, state.p
    force, age, sums = state.force, state.age, state.sums
    acc_rejected, mag_rejected, health = state.acc_rejected, state.mag_rejected, state.health
    health = 0
    correction = Correction(ZERO, bias, predict_block(params, p, attitude, sums, dt))
    if sums.acc_time > 0.0:
        correction, acc_rejected = update_tilt(params, correction, force, sums, acc_rejected)
        if acc_rejected > 0.0:
            health = ACC_REJECTED
    if sums.east != 0.0 or sums.north != 0.0:
        correction, mag_rejected = update_heading(params, correction, sums, mag_rejected)
        if mag_rejected > 0.0:
            health |= MAG_REJECTED
    swing = quat.exp(correction.turn)
    force = rotate_force(force, correction.turn, swing)
    return State(
        quat=quat.compose(swing, attitude),
        bias=correction.bias,
        p=correction.p,
        force=force,
        age=age,
        sums=NO_SAMPLES,
        acc_rejected=acc_rejected,
        mag_rejected=mag_rejected,
        health=health,
    )


@kernel
def rotate_force(force: Vec3, turn: Vec3, swing: Quat) -> Vec3:
    """The low-passed force turned with the corrected attitude; to first order where the turn is small."""
    x, y, _ = turn
    if x * x + y * y < SMALL_TURN:
        a, b, c = force
        return Vec3(a + y * c, b - x * c, c)
    return quat.rotate(swing, force)


@kernel
def inflate(params: EKF, state: State, variance: float) -> State:
    """Adds a variance (rad²) about each axis; the low-pass starts again, as the force was turned with the error."""
    attitude, bias, p = state.quat, state.bias, state.p
    force, sums, acc_rejected = state.force, state.sums, state.acc_rejected
    mag_rejected, health = state.mag_rejected, state.health
    return State(
        quat=attitude,
        bias=bias,
        p=inflate_attitude(p, variance, variance),
        force=force,
        age=0.0,
        sums=sums,
        acc_rejected=acc_rejected,
        mag_rejected=mag_rejected,
        health=health,
    )


@kernel
def inflate_heading(params: EKF, state: State, variance: float) -> State:
    """Adds a variance (rad²) about the vertical."""
    attitude, bias, p = state.quat, state.bias, state.p
    force, age, sums = state.force, state.age, state.sums
    acc_rejected, mag_rejected, health = state.acc_rejected, state.mag_rejected, state.health
    return State(
        quat=attitude,
        bias=bias,
        p=inflate_attitude(p, 0.0, variance),
        force=force,
        age=age,
        sums=sums,
        acc_rejected=acc_rejected,
        mag_rejected=mag_rejected,
        health=health,
    )


@kernel
def at_rest(params: EKF, state: State) -> State:
    """Bounds the variance of the bias: the guard has read it off at rest, so that 0.05 °/s (1σ) are left, at most."""
    attitude, bias, p = state.quat, state.bias, state.p
    force, age, sums = state.force, state.age, state.sums
    acc_rejected, mag_rejected, health = state.acc_rejected, state.mag_rejected, state.health
    if p.bxx + p.byy + p.bzz <= 6.0 * REST_VARIANCE:
        return state
    known = Cov(
        p.axx, p.axy, p.axz, p.ayy, p.ayz, p.azz,
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        REST_VARIANCE, 0.0, 0.0, REST_VARIANCE, 0.0, REST_VARIANCE,
    )  # fmt: skip
    return State(
        quat=attitude,
        bias=bias,
        p=known,
        force=force,
        age=age,
        sums=sums,
        acc_rejected=acc_rejected,
        mag_rejected=mag_rejected,
        health=health,
    )


@kernel
def output(params: EKF, state: State) -> Output:
    """Attitude, bias, σ and health."""
    p = state.p
    return Output(
        quat=state.quat,
        bias=state.bias,
        sigma=Vec3(
            min(sqrt(max(p.axx, 0.0)), UNIFORM),
            min(sqrt(max(p.ayy, 0.0)), UNIFORM),
            min(sqrt(max(p.azz, 0.0)), UNIFORM),
        ),
        health=state.health,
    )
