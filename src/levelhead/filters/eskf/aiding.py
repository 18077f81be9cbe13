"""What else sees where a body is: position and velocity (GNSS), height (barometer), as further rows of ``ESKF``.

Readings come at any time, one number of one row at a time. Each is compared with the mean state at once, and what is
left of it is averaged by weight until the block ends: a few rows a block, whatever the rate of the sensor.

    y = z − p + a v,    y = z − v,    y = z − (p_z + β) + a v_z                                                   (1)

with a the age of the reading and β the barometer's drift. Where position starts is 0 by definition, until a reading of
position says otherwise. An axis whose velocity is seen this way needs no assumption about it. When that ends, the
assumption returns with what was seen: a body that went at V for some τ = 10 s is a process of density 2 V² τ (A. Gelb,
Applied Optimal Estimation, 1974, section 3.6: exponentially correlated), added to what the filter assumes by itself.
"""

from math import sqrt

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.contract import HEIGHT, POSITION, VELOCITY, NavState
from levelhead.filters.eskf.state import (
    AIDED,
    AIR,
    MEAN,
    OUT,
    PLACE,
    ROW,
    ROWS,
    SIGHT,
    SINCE,
    SPEED,
    SPELL,
    SWIFT,
    WEIGHT,
    H,
    P,
    X,
    independent,
    measure,
    variance,
    widen,
)
from levelhead.kernels.arrays import Floats
from levelhead.kernels.vec3 import Vec3

NEVER = 1e9  # s
ABSURD = 1e8  # m, m/s: no sensor says that; NaN and infinity fail the comparison as well
GATE = 25.0  # σ² of a reading that is not believed,
GATE_TIME = 3.0  # s, for at most so long
JUST = 1e-9  # s: refused in this block for the first time
FRESH = 1.5  # s for which a reading aids: one a second, and some
FAST_TIME = 10.0  # s for which a body goes in one direction
FAST_FADE = 60.0  # s over which it is forgotten how fast
UNSEEN_SPEED = 0.3  # m/s, 1σ at least, of a velocity that was lost


@kernel
def carried(m: Floats, dt: float) -> None:
    """The mean position, of half a sample."""
    m[MEAN + PLACE] += m[MEAN + SPEED] * dt
    m[MEAN + PLACE + 1] += m[MEAN + SPEED + 1] * dt
    m[MEAN + PLACE + 2] += m[MEAN + SPEED + 2] * dt


@kernel
def ever(m: Floats, row: int) -> bool:
    """Whether a row was ever seen."""
    return m[SINCE + row] < NEVER


@kernel
def recent(m: Floats, row: int) -> bool:
    """Whether a row was believed a moment ago."""
    return m[SINCE + row] < FRESH


@kernel
def oriented(m: Floats) -> bool:
    """Whether anything was ever seen that has a direction."""
    if m[AIDED] == 0.0:
        return False
    return ever(m, POSITION) or ever(m, POSITION + 1) or ever(m, VELOCITY) or ever(m, VELOCITY + 1)


@kernel
def aided(m: Floats, axis: int) -> bool:
    """Whether velocity along an axis needs no assumption."""
    if m[AIDED] == 0.0:
        return False
    return recent(m, POSITION + axis) or recent(m, VELOCITY + axis) or (axis == 2 and recent(m, HEIGHT))


@noinline
def begin(m: Floats) -> None:
    """Position is 0 where the first reading comes."""
    m[AIDED] = 1.0
    for row in range(ROWS):
        m[SINCE + row] = NEVER
    independent(m, PLACE, 4, 0.0)
    for i in range(4):
        m[MEAN + PLACE + i] = 0.0


@noinline
def first_sight(m: Floats, row: int, value: float, sigma: float) -> None:
    """A first height tells the barometer's offset, a first position where the origin is, a first velocity itself."""
    if row == HEIGHT:
        m[MEAN + AIR] = value - m[MEAN + PLACE + 2]
        independent(m, AIR, 1, sigma)
    elif row >= VELOCITY:
        m[MEAN + SPEED + row - VELOCITY] = value
        independent(m, SPEED + row - VELOCITY, 1, sigma)
    else:
        if row == POSITION + 2 and ever(m, HEIGHT):
            m[MEAN + AIR] += m[MEAN + PLACE + row] - value
            independent(m, AIR, 1, sigma)
        m[MEAN + PLACE + row] = value
        independent(m, PLACE + row, 1, sigma)


@kernel
def expected(m: Floats, row: int) -> float:
    """What a row would read by the mean state."""
    if VELOCITY <= row < HEIGHT:
        return m[MEAN + SPEED + row - VELOCITY]
    if row == HEIGHT:
        return m[MEAN + PLACE + 2] + m[MEAN + AIR]
    return m[MEAN + PLACE + row]


@kernel
def travelled(m: Floats, row: int, age: float) -> float:
    """m since a reading of this row was taken."""
    if VELOCITY <= row < HEIGHT:
        return 0.0
    return m[MEAN + SPEED + (2 if row == HEIGHT else row)] * age


@kernel
def spread(m: Floats, row: int) -> float:
    """The variance of what a row would read."""
    if VELOCITY <= row < HEIGHT:
        return variance(m, SPEED + row - VELOCITY)
    if row == HEIGHT:
        return variance(m, PLACE + 2) + variance(m, AIR) + 2.0 * m[P + (PLACE + 2) * ROW + AIR]
    return variance(m, PLACE + row)


@noinline
def give_in(m: Floats, row: int, square: float) -> None:
    """What was refused for long is so: the state is as far off as the reading is."""
    if VELOCITY <= row < HEIGHT:
        widen(m, SPEED + row - VELOCITY, 1, square)
    elif row == HEIGHT:
        widen(m, AIR, 1, square)
    else:
        widen(m, PLACE + row, 1, square)


@noinline
def sight(m: Floats, row: int, value: float, sigma: float, age: float) -> None:
    """One reading of one row, eq. 1; what is no number is no reading."""
    if not (-ABSURD < value < ABSURD and 0.0 < sigma < ABSURD and -ABSURD < age < ABSURD):
        return
    if m[AIDED] == 0.0:
        begin(m)
    value += travelled(m, row, age)
    if not ever(m, row):
        first_sight(m, row, value, sigma)
        m[SINCE + row] = 0.0
        return
    noise = sigma * sigma
    y = value - expected(m, row)
    if y * y > GATE * (spread(m, row) + noise):
        if m[OUT + row] < GATE_TIME:
            m[OUT + row] = max(m[OUT + row], JUST)
            return
        give_in(m, row, y * y)
    m[OUT + row] = 0.0
    m[SINCE + row] = 0.0
    m[SIGHT + row] += y / noise
    m[WEIGHT + row] += 1.0 / noise


@noinline
def see_places(m: Floats, n: int) -> bool:
    """The rows of what was seen in the block; whether any was refused."""
    refused = False
    for row in range(ROWS):
        if m[WEIGHT + row] > 0.0:
            if VELOCITY <= row < HEIGHT:
                m[H + SPEED + row - VELOCITY] = 1.0
            elif row == HEIGHT:
                m[H + PLACE + 2] = 1.0
                m[H + AIR] = 1.0
            else:
                m[H + PLACE + row] = 1.0
            measure(m, n, 0, m[SIGHT + row] / m[WEIGHT + row], 1.0 / m[WEIGHT + row])
        m[SIGHT + row] = 0.0
        m[WEIGHT + row] = 0.0
        if m[OUT + row] > 0.0:
            m[OUT + row] += m[SPELL]
            refused = True
        m[SINCE + row] += m[SPELL]
    for i in range(3):
        if aided(m, i):
            v = m[MEAN + SPEED + i] + m[X + SPEED + i]
            m[SWIFT + i] = max(v * v, m[SWIFT + i] * (1.0 - m[SPELL] / (FAST_FADE + m[SPELL])))
    return refused


@noinline
def lost_sight(m: Floats, gap: float) -> None:
    """Nothing was seen for a while: the body went on, or did not."""
    for i in range(3):
        v = m[MEAN + SPEED + i]
        square = v * v + UNSEEN_SPEED * UNSEEN_SPEED
        away = variance(m, PLACE + i) + square * gap * gap
        independent(m, SPEED + i, 1, sqrt(square))
        independent(m, PLACE + i, 1, sqrt(away))


@kernel
def density(m: Floats, axis: int) -> float:
    """(m/s)²·s, of a velocity that is not seen any more."""
    return 2.0 * FAST_TIME * m[SWIFT + axis]


@kernel
def doubt(m: Floats, i: int) -> float:
    """σ of a state."""
    return sqrt(max(variance(m, i), 0.0))


@kernel
def nav_state(m: Floats) -> NavState:
    """Position and velocity with their σ."""
    return NavState(
        Vec3(m[MEAN + PLACE], m[MEAN + PLACE + 1], m[MEAN + PLACE + 2]),
        Vec3(m[MEAN + SPEED], m[MEAN + SPEED + 1], m[MEAN + SPEED + 2]),
        Vec3(doubt(m, PLACE), doubt(m, PLACE + 1), doubt(m, PLACE + 2)),
        Vec3(doubt(m, SPEED), doubt(m, SPEED + 1), doubt(m, SPEED + 2)),
        m[AIDED] != 0.0,
    )
