"""What ``ESKF`` measures in a block, row by row: eqs. 4 to 6 there, and whether it is believed."""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import aiding
from levelhead.filters.eskf.params import ESKF
from levelhead.filters.eskf.state import (
    BIAS,
    COUNT,
    DELAY,
    EAST,
    FIELD,
    GYR,
    HERE,
    IRON,
    LATE,
    MAG,
    MEAN,
    PUSHED,
    SEEN,
    SPEED,
    SPELL,
    TURN,
    TURN_Z,
    TURNED,
    WOUND,
    H,
    P,
    X,
    measure,
    take_along,
    variance,
    vector,
)
from levelhead.kernels.angle import DEGREE
from levelhead.kernels.arrays import Floats
from levelhead.kernels.tilt import GRAVITY
from levelhead.kernels.vec3 import ZERO, Vec3, dot, scale

REST_SPEED = 0.02  # m/s, 1σ at rest
REST_RATE = 0.05 * DEGREE  # rad/s, at least, by which a body at rest may turn
REST_TAU = 1.0  # s, for so long
GATE = 25.0  # σ² of a velocity that is not believed,
HALT = 9.0  # σ² within which it may be zero,
HALTING = 0.3  # m/s², with no more acceleration than tilt and bias pretend
ASTRAY = 0.94  # cos 20°, of a heading far off
UNHEARD = 1e6  # so many times: it is not listened to
REJECTED = 10.0  # times its variance: a field that counts so little is none
FITTING = 3.0  # and one whose norm and dip are right: no offset makes such a one point elsewhere


@kernel
def halted(m: Floats, i: int) -> bool:
    """Whether a body that was seen to move may stand still: smooth travel and smooth braking look like rest."""
    v = m[MEAN + SPEED + i]
    a = m[PUSHED + i] / m[SPELL] - (GRAVITY if i == 2 else 0.0)
    return v * v <= HALT * (variance(m, SPEED + i) + REST_SPEED * REST_SPEED) and a * a <= HALTING * HALTING


@kernel
def speed_noise(params: ESKF, m: Floats, still: bool, i: int) -> float:
    """Variance of a body's mean velocity over the block."""
    if still and halted(m, i):
        return REST_SPEED * REST_SPEED
    return (params.speed * params.speed + aiding.density(m, i)) / m[SPELL]


@noinline
def runaway(params: ESKF, m: Floats, still: bool) -> bool:
    """Whether velocity is beyond what the filter thinks possible, where nobody sees it."""
    worst = 0.0
    for i in range(3):
        if not aiding.aided(m, i):
            v = m[MEAN + SPEED + i]
            worst = max(worst, v * v / (variance(m, SPEED + i) + speed_noise(params, m, still, i)))
    return worst > GATE


@noinline
def see_speed(params: ESKF, m: Floats, still: bool, n: int) -> None:
    """A body stays in the room: its velocity is zero, give or take, where nobody sees it.

    Zero has no direction, so that it must tell nothing of heading: a turn by θ_z takes v along, to v + θ_z × v, which
    the rows of east and north do not see.
    """
    for i in range(3):
        if not aiding.aided(m, i):
            noise = speed_noise(params, m, still, i)
            m[H + SPEED + i] = 1.0
            if i < 2:
                m[H + TURN_Z] = m[MEAN + SPEED + 1] if i == 0 else -m[MEAN + SPEED]
            measure(m, n, 0, -m[MEAN + SPEED + i], noise)


@noinline
def see_rest(m: Floats, n: int) -> None:
    """At rest the mean rate is the bias, as far as it does not vary: (1 − S) ω − b = 0."""
    one = 1.0 / m[SPELL]
    rate = scale(vector(m, TURNED), one)
    varied = max(m[WOUND] * one - dot(rate, rate), 0.0)
    noise = (varied + REST_RATE * REST_RATE) * REST_TAU * one
    for i in range(3):
        g = GYR + 3 * i
        m[H + BIAS + i] = 1.0
        m[H + g] = rate.x
        m[H + g + 1] = rate.y
        m[H + g + 2] = rate.z
        explained = m[MEAN + g] * rate.x + m[MEAN + g + 1] * rate.y + m[MEAN + g + 2] * rate.z + m[MEAN + BIAS + i]
        measure(m, n, 0, m[TURNED + i] * one - explained, noise)


class Fit(NamedTuple):
    """Of a field, earth frame: whether norm or dip are not those learned, and whether heading is not; and whether
    something of position and velocity was refused."""

    refused: bool
    turned: bool
    field: Vec3
    astray: bool


@noinline
def see_field(params: ESKF, m: Floats, steady: bool, n: int) -> Fit:
    """The three rows of the field, and whether they fit; ``steady``: they have not for a while, in one way."""
    one = 1.0 / m[COUNT]
    field = scale(vector(m, FIELD), one)
    x, y, z = field
    level = m[MEAN + MAG]
    up = m[MEAN + MAG + 1]
    strength2 = level * level + up * up
    strength = sqrt(x * x + y * y)
    off = strength - level
    misfit2 = (off * off + (z - up) * (z - up)) / strength2
    doubt = 1.0 + misfit2 / (params.mag_gate * params.mag_gate)
    refused = doubt > REJECTED
    sure = min(GATE * variance(m, TURN_Z), 0.5)
    turned = y < ASTRAY * strength and (y < 0.0 or x * x > sure * strength * strength)
    if turned:
        doubt = UNHEARD if steady or doubt < FITTING else max(doubt, REJECTED)
    noise = params.mag_noise * params.mag_noise * strength2 * doubt / m[SPELL]
    m[H + TURN + 1] = z
    m[H + TURN_Z] = -y
    m[H + EAST] = -1.0
    aside(m, 0, one)
    measure(m, n, TURN_Z, m[MEAN + EAST] - x, noise)
    m[H + TURN] = -z
    m[H + TURN_Z] = x
    m[H + MAG] = -1.0
    aside(m, 1, one)
    measure(m, n, TURN_Z, level - y, noise)
    m[H + TURN] = y
    m[H + TURN + 1] = -x
    m[H + MAG + 1] = -1.0
    aside(m, 2, one)
    measure(m, n, TURN_Z, up - z, noise)
    return Fit(refused, turned, field, False)


@kernel
def aside(m: Floats, row: int, one: float) -> None:
    """What offset and delay do to a row of the field."""
    for k in range(3):
        m[H + IRON + k] = -m[SEEN + 3 * row + k] * one
    m[H + DELAY] = -m[LATE + row] * one


@noinline
def see_all(params: ESKF, m: Floats, still: bool, believed: bool, steady: bool, n: int) -> Fit:
    """x and P from all that was seen in a block, and the mean with x added."""
    fit = Fit(False, False, ZERO, False)
    if believed:
        see_speed(params, m, still, n)
    if still:
        see_rest(m, n)
    if m[COUNT] > 0.0:
        fit = see_field(params, m, steady, n)
    if n > HERE:
        fit = Fit(fit.refused, fit.turned, fit.field, aiding.see_places(m, n))
    for i in range(n):
        m[MEAN + i] += m[X + i]
    if not (aiding.aided(m, 0) or aiding.aided(m, 1)):  # who sees velocity from outside says where it points
        take_along(m, P, n, m[X + SPEED], m[X + SPEED + 1])
    return fit
