"""Measurement updates of ``ESKF`` at the end of a block: velocity, zero rate and magnetic field, eqs. 4 to 6."""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import aiding
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import measure, rotate_velocity_error, variance, vector
from levelhead.filters.eskf.params import ESKF
from levelhead.kernels.arrays import Floats
from levelhead.kernels.vec3 import ZERO, Vec3, dot, scale
from levelhead.units import DEGREE, GRAVITY

REST_SPEED = 0.02  # m/s, 1σ at rest
REST_RATE = 0.05 * DEGREE  # rad/s, 1σ at least, by which a body at rest turns
REST_TIME = 1.0  # s for which it does
GATE = 25.0  # σ²: a velocity, or a heading, beyond this is rejected
STOP_GATE = 9.0  # σ² within which a velocity may be zero
STOP_ACC = 0.3  # m/s², the acceleration that tilt error and bias may pretend
HEADING_COSINE = 0.94  # cos 20°: a heading that is farther off is rejected
IGNORED = 1e6  # times its variance: such a measurement has no weight
REJECTED = 10.0  # times its variance: from here on a field counts as rejected
ACCEPTED = 3.0  # times its variance: norm and dip are right, and an offset is not why heading is wrong


class FieldFit(NamedTuple):
    """How the mean field of a block fits."""

    mismatch: bool  # norm or dip are not those of the field so far
    heading_off: bool  # its heading is too far from the estimate
    field: Vec3  # earth frame, in units of the first field's norm


NO_FIELD = FieldFit(False, False, ZERO)


@kernel
def may_stand(m: Floats, i: int) -> bool:
    """Whether the velocity along axis i may be zero; smooth travel and smooth braking look like rest to the guard."""
    v = m[at.MEAN + at.VELOCITY + i]
    a = m[at.INT_FORCE + i] / m[at.BLOCK_TIME] - (GRAVITY if i == 2 else 0.0)
    possible = v * v <= STOP_GATE * (variance(m, at.VELOCITY + i) + REST_SPEED * REST_SPEED)
    return possible and a * a <= STOP_ACC * STOP_ACC


@kernel
def velocity_variance(params: ESKF, m: Floats, resting: bool, i: int) -> float:
    """Variance of the mean velocity of a block along axis i, (m/s)², eq. 4."""
    if resting and may_stand(m, i):
        return REST_SPEED * REST_SPEED
    return (params.speed * params.speed + aiding.velocity_density(m, i)) / m[at.BLOCK_TIME]


@noinline
def velocity_diverged(params: ESKF, m: Floats, resting: bool) -> bool:
    """Whether the velocity along an axis without aiding is beyond 5 σ."""
    worst = 0.0
    for i in range(3):
        if not aiding.is_aided(m, i):
            v = m[at.MEAN + at.VELOCITY + i]
            worst = max(worst, v * v / (variance(m, at.VELOCITY + i) + velocity_variance(params, m, resting, i)))
    return worst > GATE


@noinline
def update_velocity(params: ESKF, m: Floats, resting: bool, n: int) -> None:
    """Measures zero velocity along each axis without aiding, eq. 4.

    Zero has no direction, so that this must not correct heading: a turn by θ_z changes v by θ_z × v, which the rows of
    east and north leave out.
    """
    for i in range(3):
        if not aiding.is_aided(m, i):
            noise = velocity_variance(params, m, resting, i)
            m[at.H + at.VELOCITY + i] = 1.0
            if i < 2:
                m[at.H + at.HEADING] = m[at.MEAN + at.VELOCITY + 1] if i == 0 else -m[at.MEAN + at.VELOCITY]
            measure(m, n, 0, -m[at.MEAN + at.VELOCITY + i], noise)


@noinline
def update_zero_rate(m: Floats, n: int) -> None:
    """Measures at rest that the mean rate is zero, eq. 6, with the variance of the rate within the block."""
    one = 1.0 / m[at.BLOCK_TIME]
    rate = scale(vector(m, at.INT_RATE), one)
    scatter = max(m[at.INT_RATE2] * one - dot(rate, rate), 0.0)
    noise = (scatter + REST_RATE * REST_RATE) * REST_TIME * one
    for i in range(3):
        h = at.H + at.GYR_MATRIX + 3 * i
        m[at.H + at.GYR_BIAS + i] = 1.0
        m[h] = rate.x
        m[h + 1] = rate.y
        m[h + 2] = rate.z
        s = at.MEAN + at.GYR_MATRIX + 3 * i
        explained = m[s] * rate.x + m[s + 1] * rate.y + m[s + 2] * rate.z + m[at.MEAN + at.GYR_BIAS + i]
        measure(m, n, 0, m[at.INT_RATE + i] * one - explained, noise)


@noinline
def update_field(params: ESKF, m: Floats, steady: bool, n: int) -> FieldFit:
    """Measures the three components of the block's mean field, eq. 5.

    Their variance grows with the square of the misfit of norm and dip; a field whose heading is too far off has next to
    no weight. ``steady``: the field has not fitted for a while, and has been the same in the earth frame.
    """
    one = 1.0 / m[at.MAG_COUNT]
    field = scale(vector(m, at.SUM_FIELD), one)
    x, y, z = field
    level = m[at.MEAN + at.FIELD]
    up = m[at.MEAN + at.FIELD + 1]
    norm2 = level * level + up * up
    strength = sqrt(x * x + y * y)
    off = strength - level
    misfit2 = (off * off + (z - up) * (z - up)) / norm2
    inflation = 1.0 + misfit2 / (params.mag_gate * params.mag_gate)
    mismatch = inflation > REJECTED
    sine2 = min(GATE * variance(m, at.HEADING), 0.5)
    heading_off = y < HEADING_COSINE * strength and (y < 0.0 or x * x > sine2 * strength * strength)
    if heading_off:
        inflation = IGNORED if steady or inflation < ACCEPTED else max(inflation, REJECTED)
    noise = params.mag_noise * params.mag_noise * norm2 * inflation / m[at.BLOCK_TIME]
    m[at.H + at.ATTITUDE + 1] = z
    m[at.H + at.HEADING] = -y
    m[at.H + at.FIELD_EAST] = -1.0
    set_sensor_columns(m, 0, one)
    measure(m, n, at.HEADING, m[at.MEAN + at.FIELD_EAST] - x, noise)
    m[at.H + at.ATTITUDE] = -z
    m[at.H + at.HEADING] = x
    m[at.H + at.FIELD] = -1.0
    set_sensor_columns(m, 1, one)
    measure(m, n, at.HEADING, level - y, noise)
    m[at.H + at.ATTITUDE] = y
    m[at.H + at.ATTITUDE + 1] = -x
    m[at.H + at.FIELD + 1] = -1.0
    set_sensor_columns(m, 2, one)
    measure(m, n, at.HEADING, up - z, noise)
    return FieldFit(mismatch, heading_off, field)


@kernel
def set_sensor_columns(m: Floats, row: int, one: float) -> None:
    """The elements of offset and delay in a row of eq. 5; ``one`` is 1 over the number of samples."""
    for k in range(3):
        m[at.H + at.MAG_OFFSET + k] = -m[at.SUM_R + 3 * row + k] * one
    m[at.H + at.MAG_DELAY] = -m[at.SUM_R_CROSS + row] * one


@kernel
def add_correction(m: Floats, n: int) -> None:
    """Adds x to the mean of the first ``n`` states.

    Where velocity along neither horizontal axis is measured it stays undirected, and θ_z goes on to turn it.
    """
    for i in range(n):
        m[at.MEAN + i] += m[at.X + i]
    if not (aiding.is_aided(m, 0) or aiding.is_aided(m, 1)):
        rotate_velocity_error(m, at.P, n, m[at.X + at.VELOCITY], m[at.X + at.VELOCITY + 1])
