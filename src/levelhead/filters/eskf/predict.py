"""The covariance of ``ESKF`` at the end of a block, before anything is measured: F, eq. 3 there, and Q."""

from math import sqrt

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import aiding
from levelhead.filters.eskf.params import ESKF
from levelhead.filters.eskf.preintegration import begin_block
from levelhead.filters.eskf.state import (
    ACC,
    AGE,
    AIDED,
    AIR,
    BARE,
    BIAS,
    CUT,
    DRIVEN,
    EAST,
    GONE,
    GYR,
    HEARD,
    HERE,
    IRON,
    LOST,
    LOST_Z,
    MAG,
    MEAN,
    PUSHED,
    ROTATED,
    ROW,
    SCALED,
    SHOVED,
    SPEED,
    SPELL,
    TURN,
    TURN_Z,
    WOUND,
    F,
    N,
    P,
    carry_place,
    independent,
    propagate,
    variance,
    vector,
    widen,
)
from levelhead.kernels.angle import DEGREE
from levelhead.kernels.arrays import Floats
from levelhead.kernels.tilt import GRAVITY, after_gap

ROUNDING = 2e-7  # share of a variance that corrections in single precision may get wrong in a block
UNSUPPORTED = 5.0  # m/s², 1σ of the acceleration of a body whose accelerometer is silent
FIRST_SPEED = 0.3  # m/s
VAGUE = 0.1  # rad, 1σ of a heading that may be learned from velocity,
CLEAR = 5.0  # times what of the horizontal force may be tilt
IMPACT = 300.0  # m/s²: a blow about which samples tell little


@kernel
def drive(m: Floats) -> None:
    """F − 1 of the driven states over a block, by rows v, θ."""
    for i in range(DRIVEN * ROW):
        m[F + i] = 0.0
    for i in range(3):
        v = F + i * ROW
        t = v + 3 * ROW
        for k in range(3):
            m[v + ACC + k] = -m[ROTATED + 3 * i + k]
            m[t + BIAS + k] = -m[ROTATED + 3 * i + k]
        for k in range(9):
            m[t + GYR + k] = -m[SCALED + 9 * i + k]
    x, y, z = vector(m, PUSHED)
    m[F + TURN + 1] = z
    m[F + TURN + 2] = -y
    m[F + ROW + TURN] = -z
    m[F + ROW + TURN + 2] = x
    m[F + 2 * ROW + TURN] = y
    m[F + 2 * ROW + TURN + 1] = -x


@kernel
def elsewhere(params: ESKF, m: Floats, spell: float) -> None:
    """The field's east component after a while, n of eq. 5 there: a first-order Gauss-Markov process."""
    left = params.place_time / (params.place_time + spell)
    m[GONE] = 1.0 - (1.0 - m[GONE]) * left
    m[MEAN + EAST] = m[MEAN + EAST] * left
    for i in range(N):
        m[P + EAST * ROW + i] = m[P + EAST * ROW + i] * left
    for i in range(N):
        m[P + i * ROW + EAST] = m[P + i * ROW + EAST] * left
    widen(m, EAST, 1, params.mag_place * params.mag_place * (1.0 - left * left))


@kernel
def unsure_of_heading(m: Floats) -> None:
    """What F, of first order, must not say of heading to whoever sees velocity.

    v goes along the tangent of a turn by θ_z, and the arc differs from it by θ_z²/2 ∫f dt. A horizontal force that may
    be gravity, tilted by what is not known of tilt, has no direction that could tell heading: both are noise.
    """
    x, y, _ = vector(m, PUSHED)
    push = x * x + y * y
    doubt = variance(m, TURN_Z)
    tilted = (variance(m, TURN) + variance(m, TURN + 1)) * GRAVITY * GRAVITY * m[SPELL] * m[SPELL]
    noise = 0.5 * doubt * doubt * push
    if doubt > VAGUE * VAGUE and push < CLEAR * CLEAR * tilted:
        m[F + TURN_Z] = 0.0
        m[F + ROW + TURN_Z] = 0.0
        noise += doubt * push
    widen(m, SPEED, 2, noise)


@kernel
def walked(params: ESKF, m: Floats, with_field: bool) -> None:
    """Process noise of a block."""
    spell = m[SPELL]
    noise = params.gyr_noise * DEGREE
    widen(m, TURN, 3, noise * noise * spell + params.gyr_share * params.gyr_share * m[WOUND] + m[LOST])
    widen(m, TURN_Z, 1, m[LOST_Z])
    silent = spell - m[HEARD]
    push = params.acc_noise * params.acc_noise * m[HEARD]
    blow = m[SHOVED] / (IMPACT * IMPACT * spell)
    push += min(blow * blow, 1.0) * m[SHOVED] * spell
    widen(m, SPEED, 3, push + UNSUPPORTED * UNSUPPORTED * silent * spell)
    widen(m, ACC, 3, params.acc_walk * params.acc_walk * spell)
    walk = params.bias_walk * DEGREE
    widen(m, BIAS, 3, walk * walk * spell)
    widen(m, GYR, 9, params.scale_walk * params.scale_walk * spell)
    for i in range(N):
        widen(m, i, 1, ROUNDING * variance(m, i))
    if with_field:
        widen(m, MAG, 2, params.field_walk * params.field_walk * spell)
        widen(m, IRON, 3, params.offset_walk * params.offset_walk * spell)
        elsewhere(params, m, spell)


@noinline
def across_gap(m: Floats, gap: float) -> None:
    """A time in which anything may have happened: attitude and velocity are lost, and tell nothing."""
    if m[AIDED] != 0.0:
        aiding.lost_sight(m, gap)
    else:
        still_here(m)
    level = sqrt(after_gap(max(variance(m, TURN), variance(m, TURN + 1)), gap))
    heading = sqrt(after_gap(variance(m, TURN_Z), gap))
    independent(m, TURN, 2, level)
    independent(m, TURN_Z, 1, heading)
    begin_block(m)
    m[CUT] = gap


@kernel
def still_here(m: Floats) -> None:
    """No velocity, as at the start."""
    independent(m, SPEED, 3, FIRST_SPEED)
    for i in range(3):
        m[MEAN + SPEED + i] = 0.0


@noinline
def predict(params: ESKF, m: Floats, n: int) -> None:
    """The covariance at the end of the block."""
    drive(m)
    if n > HERE:
        unsure_of_heading(m)
        carry_place(m, n, 0.5 * m[SPELL])
    propagate(m, n)
    if n > HERE:
        carry_place(m, n, 0.5 * m[SPELL])
        widen(m, AIR, 1, params.baro_walk * params.baro_walk * m[SPELL])
    walked(params, m, n > BARE)
    m[AGE] += m[SPELL]
