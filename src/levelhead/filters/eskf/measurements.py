"""Measurement updates of ``ESKF`` at the end of a block: velocity, zero rate and magnetic field, eqs. 14 to 20."""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import aiding
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.adaptation import adapt_place, mean_travel
from levelhead.filters.eskf.covariance import rotate_velocity_error, state_variance, update_scalar, vector
from levelhead.filters.eskf.params import ESKF
from levelhead.kernels.arrays import Floats
from levelhead.kernels.trig import atan2
from levelhead.kernels.vec3 import ZERO, Vec3, dot, scale, sub
from levelhead.units import DEGREE, GRAVITY

REST_SPEED = 0.02  # m/s, 1σ at rest
REST_RATE = 0.05 * DEGREE  # rad/s, 1σ at least, by which a body at rest turns
REST_TIME = 1.0  # s for which it does
RATE_TIME = 0.5  # s, time constant of the mean rate
WHITE = 0.015  # share of the scatter within a block that lasts as long as that; the rest is white
DRIFT = 0.2  # share of the square by which the rate has left its mean: a rest may be ending
PAST = 0.02  # share of it in the mean rate
VELOCITY_BOUND = 1.0  # σ: the influence of a velocity is bounded beyond,
RATE_BOUND = 3.0  # of a rate at rest, which may be the beginning of a motion,
UNBOUNDED = 1e9
CLOSE = 0.05  # rad: a heading that was far off has been corrected
HEADING_BOUND = 2.0  # and of a heading that is far off
FIELD_MEMORY = 20.0  # s over which a field is compared with itself
SLOW_MISFIT = 0.1  # beyond this share the mean follows more slowly,
SLOWEST = 10.0  # up to so many times
GATE = 25.0  # σ²: a velocity, or a heading, beyond this is rejected
STOP_GATE = 9.0  # σ² within which a velocity may be zero
STOP_ACC = 0.3  # m/s², the acceleration that tilt error and bias may pretend
HEADING_COSINE = 0.94  # cos 20°: a heading that is farther off is rejected
FIRST_ORDER_COSINE = 0.7  # cos 45°: beyond, the rows of the field are not of first order in heading
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
    possible = v * v <= STOP_GATE * (state_variance(m, at.VELOCITY + i) + REST_SPEED * REST_SPEED)
    return possible and a * a <= STOP_ACC * STOP_ACC


@kernel
def velocity_variance(params: ESKF, m: Floats, resting: bool, i: int) -> float:
    """Variance of the mean velocity of a block along axis i, (m/s)², r of eqs. 14 and 20."""
    if resting and may_stand(m, i):
        return REST_SPEED * REST_SPEED
    return (m[at.DENSITY + (1 if i == 2 else 0)] + aiding.velocity_density(m, i)) / m[at.BLOCK_TIME]


@noinline
def update_velocity(params: ESKF, m: Floats, resting: bool, n: int) -> None:
    """Measures along each axis without aiding that velocity is that of travel, eq. 20, or zero at rest, eq. 14.

    This has no direction, and must not correct heading: a turn by θ_z changes v by θ_z × v, which the rows of east and
    north leave out. The influence of a single block is bounded (P. J. Huber, Robust Statistics, 1981): beyond
    ``VELOCITY_BOUND`` σ the variance grows with the innovation. So a wrong tilt is corrected step by step.
    """
    for i in range(3):
        if not aiding.is_aided(m, i):
            noise = velocity_variance(params, m, resting, i)
            m[at.H + at.VELOCITY + i] = 1.0
            if i < 2:
                m[at.H + at.HEADING] = m[at.MEAN + at.VELOCITY + 1] if i == 0 else -m[at.MEAN + at.VELOCITY]
            y = -m[at.MEAN + at.VELOCITY + i]
            if noise > REST_SPEED * REST_SPEED:
                y += mean_travel(m, i)
                for k in range(3):
                    m[at.H + at.TRAVEL + k] = -m[at.INT_R + 3 * i + k] / m[at.BLOCK_TIME]
            s = state_variance(m, at.VELOCITY + i) + noise
            beyond = abs(y - m[at.X + at.VELOCITY + i]) / sqrt(s) / VELOCITY_BOUND - 1.0
            update_scalar(m, n, 0, y, noise + s * max(0.0, beyond))


@kernel
def average_rate(m: Floats, resting: bool) -> None:
    """The mean rate of the last half second, for the beginning of a rest."""
    weight = m[at.BLOCK_TIME] / max(min(RATE_TIME + m[at.BLOCK_TIME], m[at.RUN_TIME]), m[at.BLOCK_TIME])
    for i in range(3):
        m[at.MEAN_RATE + i] += weight * (m[at.INT_RATE + i] / m[at.BLOCK_TIME] - m[at.MEAN_RATE + i])
    if not resting:
        m[at.REST_KNOWN] = 0.0


@noinline
def update_zero_rate(m: Floats, n: int) -> None:
    """Measures at rest that the mean rate is zero, eq. 15, with the variance of the rate within the block.

    The guard finds rest when it has lasted for a while: the first time the mean rate of that while is measured.
    """
    one = 1.0 / m[at.BLOCK_TIME]
    rate = scale(vector(m, at.INT_RATE), one)
    scatter = max(m[at.INT_RATE2] * one - dot(rate, rate), 0.0)
    off = sub(rate, vector(m, at.MEAN_RATE))
    drift2 = dot(off, off)
    noise = (WHITE * scatter + REST_RATE * REST_RATE + DRIFT * drift2) * REST_TIME * one
    bound = RATE_BOUND
    if m[at.REST_KNOWN] == 0.0:
        rate = vector(m, at.MEAN_RATE)
        noise = REST_RATE * REST_RATE + PAST * scatter + drift2
        bound = UNBOUNDED
        m[at.REST_KNOWN] = 1.0
    for i in range(3):
        h = at.H + at.GYR_MATRIX + 3 * i
        m[at.H + at.GYR_BIAS + i] = 1.0
        m[h] = rate.x
        m[h + 1] = rate.y
        m[h + 2] = rate.z
        s = at.MEAN + at.GYR_MATRIX + 3 * i
        explained = m[s] * rate.x + m[s + 1] * rate.y + m[s + 2] * rate.z + m[at.MEAN + at.GYR_BIAS + i]
        measured = rate.x if i == 0 else (rate.y if i == 1 else rate.z)
        y = measured - explained
        s2 = state_variance(m, at.GYR_BIAS + i) + noise
        beyond = abs(y - m[at.X + at.GYR_BIAS + i]) / sqrt(s2) / bound - 1.0
        update_scalar(m, n, 0, y, noise + s2 * max(0.0, beyond) * REST_TIME * one)


@noinline
def update_field(params: ESKF, m: Floats, steady: bool, n: int) -> FieldFit:
    """Measures the three components of the block's mean field, eq. 16.

    Their variance grows with the square of the misfit of norm and dip. A field whose heading is far off is measured by
    ``update_heading`` if it fits otherwise, else it has next to no weight. ``steady``: the field has not fitted for a
    while, and has been the same in the earth frame.
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
    inflation += field_departure(params, m, strength, z, norm2) / (params.field_gate * params.field_gate)
    sine2 = min(GATE * state_variance(m, at.HEADING), 0.5)
    heading_off = y < HEADING_COSINE * strength and (y < 0.0 or x * x > sine2 * strength * strength)
    if heading_off or y < FIRST_ORDER_COSINE * strength:
        m[at.HEADING_FAR] = 1.0
    elif y > 0.0 and abs(x - m[at.MEAN + at.FIELD_EAST]) < CLOSE * strength:
        m[at.HEADING_FAR] = 0.0
    if m[at.HEADING_FAR] > 0.0 and inflation < REJECTED:
        update_heading(params, m, field, inflation * norm2, n)
        return FieldFit(False, False, field)
    if heading_off:
        inflation = IGNORED if steady or inflation < ACCEPTED else max(inflation, REJECTED)
    noise = params.mag_noise * params.mag_noise * norm2 * inflation / m[at.BLOCK_TIME]
    m[at.H + at.ATTITUDE + 1] = z
    m[at.H + at.HEADING] = -y
    m[at.H + at.FIELD_EAST] = -1.0
    set_sensor_columns(m, 0, one)
    update_scalar(m, n, at.HEADING, m[at.MEAN + at.FIELD_EAST] - x, noise)
    m[at.H + at.ATTITUDE] = -z
    m[at.H + at.HEADING] = x
    m[at.H + at.FIELD] = -1.0
    set_sensor_columns(m, 1, one)
    update_scalar(m, n, at.HEADING, level - y, noise)
    m[at.H + at.ATTITUDE] = y
    m[at.H + at.ATTITUDE + 1] = -x
    m[at.H + at.FIELD + 1] = -1.0
    set_sensor_columns(m, 2, one)
    update_scalar(m, n, at.HEADING, up - z, noise)
    return FieldFit(mismatch, heading_off, field)


@noinline
def update_field_undirected(params: ESKF, m: Floats, steady: bool, n: int) -> FieldFit:
    """``update_field``, which takes a velocity without direction along as it turns heading.

    Such a velocity is known relative to the sensor: its error contains θ_z × v. Without that part P is the covariance
    that a magnetometer may leave as it is, and v turns with heading.
    """
    if aiding.is_aided(m, 0) or aiding.is_aided(m, 1):
        return update_field(params, m, steady, n)
    x, y, _ = vector(m, at.MEAN + at.VELOCITY)
    before = m[at.X + at.HEADING]
    rotate_velocity_error(m, at.P, n, -x, -y)
    fit = update_field(params, m, steady, n)
    rotate_velocity_error(m, at.P, n, x, y)
    turn = m[at.X + at.HEADING] - before
    m[at.X + at.VELOCITY] -= turn * y
    m[at.X + at.VELOCITY + 1] += turn * x
    return fit


@kernel
def field_departure(params: ESKF, m: Floats, strength: float, up: float, norm2: float) -> float:
    """Square of the share by which strength and dip are off their mean over ``FIELD_MEMORY``, which follows them."""
    if m[at.FIELD_TIME] == 0.0:
        m[at.MEAN_FIELD] = strength
        m[at.MEAN_FIELD + 1] = up
    level = strength - m[at.MEAN_FIELD]
    rise = up - m[at.MEAN_FIELD + 1]
    departure2 = (level * level + rise * rise) / norm2
    m[at.FIELD_TIME] = min(m[at.FIELD_TIME] + m[at.BLOCK_TIME], FIELD_MEMORY)
    adapt_place(params, m, departure2)
    slower = 1.0 + min(departure2 / (SLOW_MISFIT * SLOW_MISFIT), SLOWEST)
    weight = m[at.BLOCK_TIME] / (m[at.FIELD_TIME] * slower)
    m[at.MEAN_FIELD] += weight * level
    m[at.MEAN_FIELD + 1] += weight * rise
    return departure2


@kernel
def correct_heading(m: Floats, n: int, h: float, innovation: float, s: float) -> None:
    """One scalar measurement that corrects heading alone; h is its element for heading, −1 that of the eastern part."""
    z = at.P + at.HEADING * at.ROW
    innovation -= h * m[at.X + at.HEADING] - m[at.X + at.FIELD_EAST]
    for j in range(n):
        m[at.U + j] = h * m[z + j] - m[at.P + at.FIELD_EAST * at.ROW + j]
    gain = m[at.U + at.HEADING] / s
    m[at.X + at.HEADING] += gain * innovation
    own = m[z + at.HEADING] - gain * m[at.U + at.HEADING]
    for j in range(n):
        m[z + j] -= gain * m[at.U + j]
        m[at.P + j * at.ROW + at.HEADING] = m[z + j]
    m[z + at.HEADING] = own


@noinline
def update_heading(params: ESKF, m: Floats, field: Vec3, norm2: float, n: int) -> None:
    """Measures a heading that is far off by its angle, with bounded influence.

    The field is right in strength and dip, so it is not the sensor's iron; no single block moves heading by more than
    two of its σ. All other states are considered only: so large an error is not theirs. ``norm2`` is the square of the
    field's norm, inflated.
    """
    x, y, _ = field
    strength = sqrt(x * x + y * y)
    angle = atan2(x - m[at.MEAN + at.FIELD_EAST], y)
    noise = params.mag_noise * params.mag_noise * norm2 / m[at.BLOCK_TIME]
    s = strength * strength * state_variance(m, at.HEADING) + state_variance(m, at.FIELD_EAST) + noise
    noise = s * max(0.0, abs(strength * angle) / sqrt(s) / HEADING_BOUND - 1.0)
    correct_heading(m, n, -strength, -strength * angle, s + noise)


@kernel
def set_sensor_columns(m: Floats, row: int, one: float) -> None:
    """The elements of offset and delay in a row of eq. 16; ``one`` is 1 over the number of samples."""
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
