"""Reinitialisation of ``ESKF``: tilt and heading from the mean readings, where errors are not of first order.

**Tilt.** An attitude with a σ above half a radian is corrected on the sphere. Let σ₀² be the variance of tilt
about either axis when that began, and F the integral of the specific force over the time T since, in the earth frame of
the estimate of then: g T upwards and a change of velocity, which is the less of it the longer T. With the rotation
vector ρ that brings F to the vertical, and r its variance (of a start, of the forces of a body that turns, of that
change of velocity), the estimate of then is rotated by

    θ = ρ/(1 + r k),   of variance r/(1 + r k),   k = 1/σ₀² − 1/``UNKNOWN``²                                   (43)

k is the information in it: nothing is left of an estimate of which nothing was known, and one of which something was
known moves by its share. As F grows with each block, θ takes the place of the one before until tilt is known by it.
"""

from math import sqrt

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import aiding
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import (
    add_variance,
    rotate_velocity_error,
    set_independent,
    state_variance,
    vector,
)
from levelhead.filters.eskf.known_field import forget_known_field
from levelhead.filters.eskf.params import ESKF
from levelhead.filters.eskf.predict import reset_velocity
from levelhead.kernels import quat, tilt
from levelhead.kernels.arrays import Floats
from levelhead.kernels.quat import IDENTITY, Quat
from levelhead.kernels.trig import atan2
from levelhead.kernels.vec3 import Vec3, add, norm, normalize, scale
from levelhead.units import DEGREE, GRAVITY

FIRST_HEADING = 0.3  # rad, at least,
MOST_FIRST_HEADING = 0.95  # and at most: it is known
SWING_SPEED = 0.7  # m/s, 1σ: the force of a body that turns is off by this times its rate
SHAKE_TIME = 0.3  # s for which a force that is not gravity pushes one way
LARGE_TURN = 0.01  # rad² in a block, beyond which nothing carries its forces into the next
UNCLEAR = 0.5  # share of the square of its level part beyond which the variance of a field has no meaning
NEARLY_DOWN = -0.999999


@kernel
def rotation_to_vertical(force: Vec3) -> Quat:
    """The shortest rotation that brings a force (earth frame) to the vertical."""
    x, y, z = normalize(force)
    if z < NEARLY_DOWN:
        return Quat(0.0, 1.0, 0.0, 0.0)
    return quat.normalize(Quat(1.0 + z, y, -x, 0.0))


@kernel
def forget_lost_force(m: Floats) -> None:
    """Tilt is known: the next time that it is lost, F of eq. 43 begins anew."""
    for i in range(at.LOST_FORCE, at.LOST_VARIANCE):
        m[i] = 0.0


@kernel
def add_lost_force(m: Floats, upside_down: bool) -> None:
    """Adds the block to F of eq. 43; notes σ₀² with the first one: nothing is known where gravity contradicts."""
    if m[at.ADDED_VARIANCE] > LARGE_TURN:
        forget_lost_force(m)
    if upside_down:
        m[at.LOST_VARIANCE] = at.UNKNOWN * at.UNKNOWN
    elif m[at.LOST_TIME] == 0.0:
        m[at.LOST_VARIANCE] = 0.5 * (state_variance(m, at.ATTITUDE) + state_variance(m, at.ATTITUDE + 1))
    force = quat.rotate(quat.conjugate(lost_turn(m)), vector(m, at.INT_FORCE))
    m[at.LOST_FORCE], m[at.LOST_FORCE + 1], m[at.LOST_FORCE + 2] = add(vector(m, at.LOST_FORCE), force)
    m[at.LOST_FORCE2] += m[at.INT_ACC2] + 2.0 * GRAVITY * m[at.INT_FORCE + 2] - GRAVITY * GRAVITY * m[at.ACC_TIME]
    m[at.LOST_TIME] += m[at.ACC_TIME]


@kernel
def lost_turn(m: Floats) -> Quat:
    """The rotation θ of eq. 43 in force."""
    return quat.exp(Vec3(m[at.LOST_TURN], m[at.LOST_TURN + 1], 0.0))


@kernel
def turn_lost_force(m: Floats, turn: Quat) -> None:
    """Takes F and θ of eq. 43 along as heading is turned."""
    m[at.LOST_FORCE], m[at.LOST_FORCE + 1], m[at.LOST_FORCE + 2] = quat.rotate(turn, vector(m, at.LOST_FORCE))
    m[at.LOST_TURN], m[at.LOST_TURN + 1], _ = quat.rotate(turn, Vec3(m[at.LOST_TURN], m[at.LOST_TURN + 1], 0.0))


@kernel
def speed_variance(m: Floats) -> float:
    """Variance of the velocity of a body whose forces have had this scatter since tilt was lost, (m/s)²."""
    mean = norm(vector(m, at.LOST_FORCE)) / m[at.LOST_TIME]
    scatter = max(m[at.LOST_FORCE2] / m[at.LOST_TIME] - mean * mean, 0.0)
    off = mean - GRAVITY
    return SHAKE_TIME * SHAKE_TIME * (scatter + 0.5 * off * off)


@kernel
def note_rotation(m: Floats, rotation: Quat) -> None:
    """Keeps in x, for the smoother, the turn of a block's attitude that was unknown before it too."""
    x, y, z = quat.log(rotation)
    m[at.X + at.ATTITUDE] = x
    m[at.X + at.ATTITUDE + 1] = y
    m[at.X + at.HEADING] = z


@noinline
def reinitialise_tilt(params: ESKF, m: Floats, upside_down: bool) -> Quat:
    """Returns the rotation that brings the estimate from the θ of eq. 43 in force to the next one.

    Sets σ of attitude and velocity.
    """
    add_lost_force(m, upside_down)
    shake2 = speed_variance(m)
    start = params.tilt_start * DEGREE
    swing = SWING_SPEED / GRAVITY
    push = 2.0 * shake2 / (GRAVITY * GRAVITY * m[at.LOST_TIME] * m[at.LOST_TIME])
    variance = start * start + swing * swing * m[at.INT_RATE2] / m[at.BLOCK_TIME] + push
    known = max(1.0 / m[at.LOST_VARIANCE] - 1.0 / (at.UNKNOWN * at.UNKNOWN), 0.0)
    share = 1.0 / (1.0 + known * variance)
    before = lost_turn(m)
    x, y, _ = quat.log(rotation_to_vertical(vector(m, at.LOST_FORCE)))
    m[at.LOST_TURN] = share * x
    m[at.LOST_TURN + 1] = share * y
    rotation = quat.compose(lost_turn(m), quat.conjugate(before))
    turn = 2.0 * sqrt(rotation.x * rotation.x + rotation.y * rotation.y)
    heading = sqrt(state_variance(m, at.HEADING) + turn * turn)
    set_independent(m, at.ATTITUDE, 2, min(sqrt(share * variance), at.UNKNOWN))
    set_independent(m, at.HEADING, 1, heading)
    if m[at.AIDED] != 0.0:
        aiding.inflate_nav_state(m, 0.0)
    else:
        for i in range(3):
            m[at.X + at.VELOCITY + i] = -m[at.MEAN + at.VELOCITY + i]
        reset_velocity(m)
        add_variance(m, at.VELOCITY, 3, shake2)
    return rotation


@noinline
def reinitialise_heading(params: ESKF, m: Floats, rotation: Quat) -> Quat:
    """Returns ``rotation``, and after it one about the vertical that brings the block's mean field to H and s; sets σ.

    Where the direction of H is not known the field begins anew, without information on heading. With aiding that
    has a direction the frame is the earth's, in which H points north.
    """
    field = quat.rotate(rotation, scale(vector(m, at.SUM_FIELD), 1.0 / m[at.MAG_COUNT]))
    if aiding.has_direction(m):
        start_north(params, m, field)
    known = add(vector(m, at.MEAN + at.FIELD), vector(m, at.MEAN + at.PLACE))
    level2 = known.x * known.x + known.y * known.y
    if not aiding.has_direction(m) and state_variance(m, at.FIELD) + state_variance(m, at.FIELD + 1) > UNCLEAR * level2:
        set_independent(m, at.FIELD, 3, at.FIRST_FIELD)
        if params.field_strength > 0.0:
            forget_known_field(m)
        m[at.MEAN + at.FIELD], m[at.MEAN + at.FIELD + 1], m[at.MEAN + at.FIELD + 2] = field
        set_independent(m, at.HEADING, 1, MOST_FIRST_HEADING)
        return rotation
    angle = atan2(field.x * known.y - field.y * known.x, field.x * known.x + field.y * known.y)
    turn_lost_force(m, tilt.add_yaw(IDENTITY, angle))
    sigma = first_heading(m, field)
    if m[at.AIDED] != 0.0:
        set_independent(m, at.HEADING, 1, sigma)
    else:
        set_heading(m, tilt.add_yaw(IDENTITY, angle), sigma)
    return tilt.add_yaw(rotation, angle)


@noinline
def start_north(params: ESKF, m: Floats, field: Vec3) -> None:
    """H is this field, with its level part to the north, and a σ of its eastern part as a place has it."""
    x, y, z = field
    set_independent(m, at.FIELD, 1, params.mag_place)
    set_independent(m, at.FIELD + 1, 2, at.FIRST_FIELD)
    set_independent(m, at.PLACE, 3, params.mag_place)
    if params.field_strength > 0.0:
        forget_known_field(m)
    for i in range(3):
        m[at.MEAN + at.PLACE + i] = 0.0
    m[at.MEAN + at.FIELD] = 0.0
    m[at.MEAN + at.FIELD + 1] = sqrt(x * x + y * y)
    m[at.MEAN + at.FIELD + 2] = z


@kernel
def first_heading(m: Floats, field: Vec3) -> float:
    """1σ of a heading (rad) that is taken from a field (earth frame): a tilt turns its vertical part into the level."""
    x, y, z = field
    level = max(x * x + y * y, tilt.NO_LENGTH)
    level_tilt = 0.5 * (state_variance(m, at.ATTITUDE) + state_variance(m, at.ATTITUDE + 1))
    offset = 0.5 * (state_variance(m, at.MAG_OFFSET) + state_variance(m, at.MAG_OFFSET + 1)) / level
    return min(sqrt(FIRST_HEADING * FIRST_HEADING + z * z / level * level_tilt + offset), MOST_FIRST_HEADING)


@kernel
def set_heading(m: Floats, turn: Quat, sigma: float) -> None:
    """Takes a velocity without direction along as heading turns; its part relative to the sensor stays."""
    x, y, z = vector(m, at.MEAN + at.VELOCITY)
    rotate_velocity_error(m, at.P, at.N, -x, -y)
    set_independent(m, at.HEADING, 1, sigma)
    x, y, z = quat.rotate(turn, Vec3(x, y, z))
    rotate_velocity_error(m, at.P, at.N, x, y)
    m[at.MEAN + at.VELOCITY] = x
    m[at.MEAN + at.VELOCITY + 1] = y
