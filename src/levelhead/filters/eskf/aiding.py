"""Aiding of ``ESKF``: measurements of position and velocity (GNSS), of height (barometer) and of standing still.

Readings come at any time, one number of one row at a time. The innovation of each is computed at once, and averaged by
weight until the block ends: at most seven scalar measurements a block, whatever the rate of the sensor.

    y = z − p + a v,    y = z − v + a v̇,    y = z − (p_z + β) + a v_z

with a the age of the reading, v̇ the mean acceleration of the block and β the barometer's offset; z = 0 of a body on
the ground (I. Skog, P. Händel, J.-O. Nilsson, J. Rantakokko, IEEE Trans. Biomed. Eng. 57(11), 2010), independent of
heading and never rejected: far from it, velocity was wrong, by an impact. Position is 0 at the first reading of any
row, until a reading of position sets it. Along an axis with recent readings eq. 22 is left out. When the readings end
it returns with a larger density: a body that moved at V for some τ = 10 s is a process of density 2 V² τ (A. Gelb,
Applied Optimal Estimation, 1974, section 3.6: exponentially correlated), added to ``velocity_density``².
"""

from math import sqrt

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.contract import HEIGHT, POSITION, VELOCITY, ZERO_VELOCITY, NavState
from levelhead.filters.eskf import coarse_heading
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import (
    add_variance,
    set_independent,
    start_aided,
    state_variance,
    update_scalar,
    vector,
)
from levelhead.filters.eskf.params import ESKF
from levelhead.kernels.arrays import Floats
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.vec3 import Vec3
from levelhead.units import GRAVITY

NEVER = 1e9  # s
LARGEST = 1e8  # m, m/s: no sensor measures more; NaN and infinity fail the comparison as well
GATE = 25.0  # σ²: an innovation beyond this is rejected
GATE_TIME = 3.0  # s, for at most so long
SHORTEST = 1e-9  # s of rejection, at the first rejected reading; of a block
RECENT = 1.5  # s for which an axis is aided after a reading; receivers give one a second
EXTENT_TIME = 10.0  # s, τ
SPEED_MEMORY = 60.0  # s over which V decays
LEAST_SPEED = 0.3  # m/s, 1σ at least, of a velocity after a gap


@kernel
def propagate_mean(m: Floats, dt: float) -> None:
    """Moves the mean position by the mean velocity for ``dt`` seconds."""
    m[at.MEAN + at.POSITION] += m[at.MEAN + at.VELOCITY] * dt
    m[at.MEAN + at.POSITION + 1] += m[at.MEAN + at.VELOCITY + 1] * dt
    m[at.MEAN + at.POSITION + 2] += m[at.MEAN + at.VELOCITY + 2] * dt


@kernel
def velocity_of(row: int) -> int:
    """The state that a row of velocity, measured or zero, is about."""
    return at.VELOCITY + (row - VELOCITY if row < ZERO_VELOCITY else row - ZERO_VELOCITY)


@kernel
def is_initialised(m: Floats, row: int) -> bool:
    """Whether there was any reading of a row."""
    return m[at.AID_AGE + row] < NEVER


@kernel
def is_recent(m: Floats, row: int) -> bool:
    """Whether a reading of a row was accepted within the last 1.5 s."""
    return not has_elapsed(m[at.AID_AGE + row], m[at.BLOCK_TIME], RECENT)


@kernel
def has_direction(m: Floats) -> bool:
    """Whether there was any reading of a horizontal position or velocity, which has a direction."""
    if m[at.AIDED] == 0.0:
        return False
    return (
        is_initialised(m, POSITION)
        or is_initialised(m, POSITION + 1)
        or is_initialised(m, VELOCITY)
        or is_initialised(m, VELOCITY + 1)
    )


@kernel
def has_velocity(m: Floats) -> bool:
    """Whether there was any reading of horizontal velocity."""
    if m[at.AIDED] == 0.0:
        return False
    return is_initialised(m, VELOCITY) or is_initialised(m, VELOCITY + 1)


@kernel
def is_aided(m: Floats, axis: int) -> bool:
    """Whether velocity along an axis is observed by recent readings."""
    if m[at.AIDED] == 0.0:
        return False
    return (
        is_recent(m, POSITION + axis)
        or is_recent(m, VELOCITY + axis)
        or is_recent(m, ZERO_VELOCITY + axis)
        or (axis == 2 and is_recent(m, HEIGHT))
    )


@noinline
def start_aiding(params: ESKF, m: Floats) -> None:
    """Position and the barometer's offset become 0 by definition, before the first reading of any row."""
    m[at.AIDED] = 1.0
    for row in range(at.AID_ROWS):
        m[at.AID_AGE + row] = NEVER
    start_aided(params, m, 1.0)
    for i in range(at.POSITION, at.N):
        m[at.MEAN + i] = 0.0


@noinline
def initialise_row(m: Floats, row: int, value: float, sigma: float) -> None:
    """Sets the state of a row by its first reading; height sets the barometer's offset."""
    if row == HEIGHT:
        m[at.MEAN + at.BARO_OFFSET] = value - m[at.MEAN + at.POSITION + 2]
        set_independent(m, at.BARO_OFFSET, 1, sigma)
    elif row >= VELOCITY:
        m[at.MEAN + velocity_of(row)] = value
        set_independent(m, velocity_of(row), 1, sigma)
    else:
        if row == POSITION + 2 and is_initialised(m, HEIGHT):
            m[at.MEAN + at.BARO_OFFSET] += m[at.MEAN + at.POSITION + row] - value
            set_independent(m, at.BARO_OFFSET, 1, sigma)
        m[at.MEAN + at.POSITION + row] = value
        set_independent(m, at.POSITION + row, 1, sigma)


@kernel
def predict_reading(m: Floats, row: int) -> float:
    """The reading of a row that the mean state predicts."""
    if VELOCITY <= row < HEIGHT:
        return m[at.MEAN + velocity_of(row)]
    if row == HEIGHT:
        return m[at.MEAN + at.POSITION + 2] + m[at.MEAN + at.BARO_OFFSET]
    return m[at.MEAN + at.POSITION + row]


@kernel
def change_since(m: Floats, row: int, age: float) -> float:
    """By how much (m, m/s) a row's state has changed since a reading of that age (s)."""
    if VELOCITY <= row < HEIGHT:
        i = velocity_of(row) - at.VELOCITY
        change = m[at.INT_FORCE + i] - (GRAVITY * m[at.ACC_TIME] if i == 2 else 0.0)
        return change / max(m[at.BLOCK_TIME], SHORTEST) * age
    return m[at.MEAN + at.VELOCITY + (2 if row == HEIGHT else row)] * age


@kernel
def reading_variance(m: Floats, row: int) -> float:
    """The variance of the predicted reading."""
    if VELOCITY <= row < HEIGHT:
        return state_variance(m, velocity_of(row))
    if row == HEIGHT:
        common = m[at.P + (at.POSITION + 2) * at.ROW + at.BARO_OFFSET]
        return state_variance(m, at.POSITION + 2) + state_variance(m, at.BARO_OFFSET) + 2.0 * common
    return state_variance(m, at.POSITION + row)


@noinline
def inflate_row(m: Floats, row: int, square: float) -> None:
    """Adds the squared innovation of a reading that was rejected for ``GATE_TIME`` to the variance of its state."""
    if VELOCITY <= row < HEIGHT:
        add_variance(m, velocity_of(row), 1, square)
    elif row == HEIGHT:
        add_variance(m, at.BARO_OFFSET, 1, square)
    else:
        add_variance(m, at.POSITION + row, 1, square)


@noinline
def add_reading(params: ESKF, m: Floats, row: int, value: float, sigma: float, age: float) -> None:
    """Adds one reading of a row (m or m/s), with its 1σ and its age in seconds; NaN: none."""
    if not (-LARGEST < value < LARGEST and 0.0 < sigma < LARGEST and -LARGEST < age < LARGEST):
        return
    if m[at.AIDED] == 0.0:
        start_aiding(params, m)
    coarse_heading.note_fix(m, row, value, sigma)
    value += change_since(m, row, age)
    if not is_initialised(m, row):
        initialise_row(m, row, value, sigma)
        m[at.AID_AGE + row] = 0.0
        return
    noise = sigma * sigma
    y = value - predict_reading(m, row)
    if y * y > GATE * (reading_variance(m, row) + noise):
        certain = ZERO_VELOCITY <= row < HEIGHT
        if not (certain or has_elapsed(m[at.AID_REJECTED + row], m[at.BLOCK_TIME], GATE_TIME)):
            m[at.AID_REJECTED + row] = max(m[at.AID_REJECTED + row], SHORTEST)
            return
        inflate_row(m, row, y * y)
        m[at.AID_REJECTED + row] = 0.0
    if m[at.AID_REJECTED + row] > SHORTEST:  # a rejection in this block stays until its end, which flags it
        m[at.AID_REJECTED + row] = 0.0
    m[at.AID_AGE + row] = 0.0
    m[at.SUM_INNOVATION + row] += y / noise
    m[at.SUM_WEIGHT + row] += 1.0 / noise


@noinline
def update(m: Floats, n: int) -> bool:
    """Corrects with the averages of the block; returns whether any row is rejected."""
    rejected = False
    for row in range(at.AID_ROWS):
        if m[at.SUM_WEIGHT + row] > 0.0:
            if VELOCITY <= row < HEIGHT:
                m[at.H + velocity_of(row)] = 1.0
            elif row == HEIGHT:
                m[at.H + at.POSITION + 2] = 1.0
                m[at.H + at.BARO_OFFSET] = 1.0
            else:
                m[at.H + at.POSITION + row] = 1.0
            update_scalar(m, n, m[at.SUM_INNOVATION + row] / m[at.SUM_WEIGHT + row], 1.0 / m[at.SUM_WEIGHT + row])
        m[at.SUM_INNOVATION + row] = 0.0
        m[at.SUM_WEIGHT + row] = 0.0
        if m[at.AID_REJECTED + row] > 0.0:
            m[at.AID_REJECTED + row] += m[at.BLOCK_TIME]
            rejected = True
        m[at.AID_AGE + row] += m[at.BLOCK_TIME]
    for i in range(3):
        if is_aided(m, i):
            v = m[at.MEAN + at.VELOCITY + i] + m[at.X + at.VELOCITY + i]
            left = 1.0 - m[at.BLOCK_TIME] / (SPEED_MEMORY + m[at.BLOCK_TIME])
            m[at.AIDED_SPEED2 + i] = max(v * v, m[at.AIDED_SPEED2 + i] * left)
    return rejected


@noinline
def inflate_nav_state(m: Floats, gap: float) -> None:
    """Across a gap of so many seconds the body may have kept its velocity, stopped or turned."""
    coarse_heading.forget_fixes(m)
    for i in range(3):
        v = m[at.MEAN + at.VELOCITY + i]
        square = v * v + LEAST_SPEED * LEAST_SPEED
        position2 = state_variance(m, at.POSITION + i) + square * gap * gap
        set_independent(m, at.VELOCITY + i, 1, sqrt(square))
        set_independent(m, at.POSITION + i, 1, sqrt(position2))


@kernel
def aided_density(m: Floats, axis: int) -> float:
    """2 V² τ, (m/s)²·s, of a velocity that was aided before."""
    return 2.0 * EXTENT_TIME * m[at.AIDED_SPEED2 + axis]


@kernel
def sigma_of(m: Floats, i: int) -> float:
    """1σ of a state, in its unit."""
    return sqrt(max(state_variance(m, i), 0.0))


@kernel
def nav_state(m: Floats) -> NavState:
    """Position and velocity with their 1σ."""
    return NavState(
        position=vector(m, at.MEAN + at.POSITION),
        velocity=vector(m, at.MEAN + at.VELOCITY),
        sigma_position=Vec3(sigma_of(m, at.POSITION), sigma_of(m, at.POSITION + 1), sigma_of(m, at.POSITION + 2)),
        sigma_velocity=Vec3(sigma_of(m, at.VELOCITY), sigma_of(m, at.VELOCITY + 1), sigma_of(m, at.VELOCITY + 2)),
        aided=m[at.AIDED] != 0.0,
    )
