"""Measurement updates of ``ESKF`` at the end of a block: velocity, zero rate and magnetic field, eqs. 14 to 22, 20."""

from math import sqrt

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import aiding
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.adaptation import AT_REST, adapt_field, mean_travel
from levelhead.filters.eskf.covariance import (
    add_partial,
    add_scalar,
    field_scale,
    rotate_velocity_error,
    set_independent,
    state_variance,
    subtract_partial_products,
    subtract_products,
    variance_after,
    vector,
)
from levelhead.filters.eskf.known_field import update_known_field
from levelhead.filters.eskf.params import ESKF
from levelhead.kernels.arrays import Floats
from levelhead.kernels.vec3 import dot, norm, scale, sub
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
FIELD_BOUND = 2.0  # and of a field
GATE = 25.0  # σ²: a field beyond this,
KNOWN_OFFSET = 0.25  # |H|, 1σ of the offset's level part with which a field corrects heading by half
FAR = 0.25  # and this share of itself, is far off
STOP_GATE = 9.0  # σ² within which a velocity may be zero
STOP_ACC = 0.3  # m/s², the acceleration that tilt error and bias may pretend


@kernel
def may_stand(m: Floats, i: int) -> bool:
    """Whether the velocity along axis i may be zero; smooth motion and smooth braking look like rest to the guard."""
    v = m[at.MEAN + at.VELOCITY + i]
    a = m[at.INT_FORCE + i] / m[at.BLOCK_TIME] - (GRAVITY if i == 2 else 0.0)
    possible = v * v <= STOP_GATE * (state_variance(m, at.VELOCITY + i) + REST_SPEED * REST_SPEED)
    return possible and a * a <= STOP_ACC * STOP_ACC


@kernel
def velocity_variance(params: ESKF, m: Floats, resting: bool, i: int) -> float:
    """Variance of the mean velocity of a block along axis i, (m/s)², r of eqs. 14 and 22."""
    if resting and may_stand(m, i):
        return REST_SPEED * REST_SPEED
    return (m[at.DENSITY + (1 if i == 2 else 0)] + aiding.aided_density(m, i)) / m[at.BLOCK_TIME]


@kernel
def set_force_columns(m: Floats, i: int) -> None:
    """The elements of tilt in row i of eq. 22, w × θ: the error of the mean velocity less that at the end.

    w is the integral of the force to the end of the block, less the mean of this integral over the block.
    """
    one = 1.0 / m[at.BLOCK_TIME]
    if i < 2:
        up = m[at.MEAN + at.VELOCITY + 2] - one * m[at.INT_VELOCITY + 2] + 0.5 * GRAVITY * m[at.ACC_TIME]
        m[at.H + at.ATTITUDE + 1 - i] = -up if i == 0 else up
    else:
        m[at.H + at.ATTITUDE] = one * m[at.INT_VELOCITY + 1] - m[at.MEAN + at.VELOCITY + 1]
        m[at.H + at.ATTITUDE + 1] = m[at.MEAN + at.VELOCITY] - one * m[at.INT_VELOCITY]


@noinline
def update_velocity(params: ESKF, m: Floats, resting: bool, n: int) -> None:
    """Measures along each axis without aiding that mean velocity is body velocity, eq. 22, or zero at rest, eq. 14.

    This has no direction, and must not correct heading: a turn by θ_z changes v by θ_z × v, which the rows of east and
    north leave out. The influence of a single block is bounded (P. J. Huber, Robust Statistics, 1981): beyond
    ``VELOCITY_BOUND`` σ the variance grows with the innovation. So a wrong tilt is corrected step by step.
    """
    count = 0
    for i in range(3):
        if not aiding.is_aided(m, i):
            noise = velocity_variance(params, m, resting, i)
            m[at.H + at.VELOCITY + i] = 1.0
            if i < 2:
                m[at.H + at.HEADING] = m[at.MEAN + at.VELOCITY + 1] if i == 0 else -m[at.MEAN + at.VELOCITY]
            y = -m[at.INT_VELOCITY + i] / m[at.BLOCK_TIME]
            set_force_columns(m, i)
            if noise > REST_SPEED * REST_SPEED:
                y += mean_travel(m, i)
                for k in range(3):
                    m[at.H + at.BODY_VELOCITY + k] = -m[at.INT_R + 3 * i + k] / m[at.BLOCK_TIME]
            s = variance_after(m, at.VELOCITY + i, count) + noise
            beyond = abs(y - m[at.X + at.VELOCITY + i]) / sqrt(s) / VELOCITY_BOUND - 1.0
            add_scalar(m, n, count, y, noise + s * max(0.0, beyond))
            count += 1
    subtract_products(m, n, count)


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
        s2 = variance_after(m, at.GYR_BIAS + i, i) + noise
        beyond = abs(y - m[at.X + at.GYR_BIAS + i]) / sqrt(s2) / bound - 1.0
        add_scalar(m, n, i, y, noise + s2 * max(0.0, beyond) * REST_TIME * one)
    subtract_products(m, n, 3)


@kernel
def field_noise(params: ESKF, m: Floats, resting: bool) -> float:
    """Variance of the mean field of a block, in units of the first field's norm, squared, eq. 17."""
    density = max(params.mag_noise * params.mag_noise * field_scale(m), m[at.FIELD_DENSITY])
    return density * (AT_REST if resting else 1.0) / m[at.BLOCK_TIME]


@kernel
def known_share(m: Floats, size2: float, one: float) -> float:
    """β = 1/(1 + q²) with q = σ_o²/(|H|/4)², eq. 20, from |H|² and 1 over the number of the block's samples.

    σ_o² is the variance of the offset's level part, the mean of east and north.
    """
    q = 0.0
    for i in range(2):
        a, b, c = scale(vector(m, at.SUM_R + 3 * i), one)
        p = at.P + at.MAG_OFFSET * at.ROW + at.MAG_OFFSET
        own = a * a * m[p] + b * b * m[p + at.ROW + 1] + c * c * m[p + 2 * at.ROW + 2]
        q += 0.5 * own + a * b * m[p + 1] + a * c * m[p + 2] + b * c * m[p + at.ROW + 2]
    q /= KNOWN_OFFSET * KNOWN_OFFSET * size2
    return 1.0 / (1.0 + q * q)


@noinline
def update_field(params: ESKF, m: Floats, resting: bool, n: int) -> bool:
    """Measures the three components of the block's mean field, eq. 16; returns whether it is far off.

    The influence of a single block is bounded, and that on heading, gyroscope and body velocity is the share β.
    """
    one = 1.0 / m[at.MAG_COUNT]
    e = scale(vector(m, at.SUM_FIELD), one)
    x, y, z = e
    if m[at.NORTH_TIME] == 0.0:  # H begins with the first mean field, so that nothing else explains it
        m[at.MEAN + at.FIELD], m[at.MEAN + at.FIELD + 1], m[at.MEAN + at.FIELD + 2] = e
        set_independent(m, at.PLACE, 3, params.mag_place * norm(e))
    noise = field_noise(params, m, resting)
    size2 = field_scale(m)
    share = known_share(m, size2, one)
    explained = 0.0
    far = False
    for i in range(3):
        if i == 0:
            m[at.H + at.ATTITUDE + 1] = z
            m[at.H + at.HEADING] = -y
        elif i == 1:
            m[at.H + at.ATTITUDE] = -z
            m[at.H + at.HEADING] = x
        else:
            m[at.H + at.ATTITUDE] = y
            m[at.H + at.ATTITUDE + 1] = -x
        m[at.H + at.FIELD + i] = -1.0
        m[at.H + at.PLACE + i] = -1.0
        set_sensor_columns(m, i, one)
        off = m[at.MEAN + at.FIELD + i] + m[at.MEAN + at.PLACE + i] - (x if i == 0 else (y if i == 1 else z))
        own = add_partial(m, n, i, share, off, noise, FIELD_BOUND)
        far = far or off * off > GATE * own + FAR * FAR * size2
        explained += own / 3.0
    subtract_partial_products(m, n, 3)
    adapt_field(params, m, e, explained, resting)
    if params.field_strength > 0.0:
        update_known_field(params, m, n)
    return far


@noinline
def update_field_undirected(params: ESKF, m: Floats, resting: bool, n: int) -> bool:
    """``update_field``, which takes a velocity without direction along as it turns heading.

    Such a velocity is known relative to the sensor: its error contains θ_z × v. Without that part P is the covariance
    that a magnetometer may leave as it is, and v turns with heading.
    """
    if aiding.is_aided(m, 0) or aiding.is_aided(m, 1):
        return update_field(params, m, resting, n)
    x, y, _ = vector(m, at.MEAN + at.VELOCITY)
    before = m[at.X + at.HEADING]
    rotate_velocity_error(m, at.P, n, -x, -y)
    far = update_field(params, m, resting, n)
    rotate_velocity_error(m, at.P, n, x, y)
    turn = m[at.X + at.HEADING] - before
    m[at.X + at.VELOCITY] -= turn * y
    m[at.X + at.VELOCITY + 1] += turn * x
    return far


@kernel
def set_sensor_columns(m: Floats, row: int, one: float) -> None:
    """The elements of offset, soft iron and delay in a row of eq. 16; ``one`` is 1 over the number of samples."""
    a, b, c = scale(vector(m, at.SUM_R + 3 * row), -one)
    m[at.H + at.MAG_OFFSET] = a
    m[at.H + at.MAG_OFFSET + 1] = b
    m[at.H + at.MAG_OFFSET + 2] = c
    x, y, z = scale(vector(m, at.SUM_MAG), one)
    m[at.H + at.SOFT_IRON] = a * x - c * z
    m[at.H + at.SOFT_IRON + 1] = b * y - c * z
    m[at.H + at.SOFT_IRON + 2] = a * y + b * x
    m[at.H + at.SOFT_IRON + 3] = a * z + c * x
    m[at.H + at.SOFT_IRON + 4] = b * z + c * y
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
