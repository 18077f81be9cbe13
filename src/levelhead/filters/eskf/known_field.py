"""The earth's field of the place as a prior of the field H that ``ESKF`` estimates: strength and dip, not direction.

With B_h the level part of the known field and B_z its upward one, both with the σ that buildings and ground give it,

    B_z = H_z,   variance σ²                                                                                     (37)
    √(B_h² − P_tt) = dᵀ H,   variance σ² + P_tt²/(2 B_h²)                                                        (38)

d is the direction of the level part of H and P_tt its variance across d: E |H|² is (dᵀ H)² + P_tt. An H whose azimuth
is unknown, P_tt > B_h², learns nothing from (38). As d turns and P_tt shrinks, the information of the old (38) is
taken out of x and P, and that of the new one takes its place: the exchange is exact, as that of a prior (26). The
prior corrects the field and the magnetometer alone, β = 0 in (19): it turns no orientation.
"""

from math import sqrt

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import clear, multiply_row, update_partial
from levelhead.filters.eskf.params import ESKF
from levelhead.kernels.arrays import Floats, add_scaled
from levelhead.kernels.tilt import NO_LENGTH
from levelhead.kernels.trig import sincos
from levelhead.units import DEGREE

NARROWER = 1.1  # times a variance, at least, for an exchange
SAME_DIRECTION = 0.998  # cosine of the angle within which d has not turned
UNBOUNDED = 1e9  # σ of an innovation
LEAST_LEFT = 1e-3  # share of r − h P hᵀ in r, below which rounding would be all that is left of the old information


@kernel
def set_known_field(params: ESKF, m: Floats, unit: float) -> None:
    """B_h and B_z as shares of the first field's norm, ``unit`` in µT."""
    down, level = sincos(params.field_dip * DEGREE)
    m[at.KNOWN_LEVEL] = params.field_strength / unit * level
    m[at.KNOWN_UP] = -params.field_strength / unit * down


@kernel
def forget_known_field(m: Floats) -> None:
    """H begins anew, without the prior."""
    m[at.KNOWN_VARIANCE] = 0.0
    m[at.KNOWN_UP_SET] = 0.0


@noinline
def take_out(m: Floats, n: int, innovation: float, noise: float) -> None:
    """Takes the information of a scalar measurement with row h out of x and P; h is zero afterwards."""
    clear(m, at.U, n)
    multiply_row(m, at.U, at.FIELD, at.FIELD + 2, n)
    left = noise
    for j in range(at.FIELD, at.FIELD + 2):
        left -= m[at.H + j] * m[at.U + j]
        innovation -= m[at.H + j] * m[at.X + j]
        m[at.H + j] = 0.0
    one = 1.0 / sqrt(max(left, LEAST_LEFT * noise))
    for i in range(n):
        m[at.U + i] = m[at.U + i] * one
    add_scaled(m, at.X + at.FIELD, -innovation * one, at.U + at.FIELD, n - at.FIELD)
    for i in range(n):
        start = at.FIELD if i < at.FIELD else 0
        add_scaled(m, at.P + i * at.ROW + start, m[at.U + i], at.U + start, n - start)


@kernel
def level_innovation(m: Floats, east: float, north: float, target: float) -> float:
    """Innovation of (38) along a direction, whose row it sets."""
    m[at.H + at.FIELD] = east
    m[at.H + at.FIELD + 1] = north
    return target - east * m[at.MEAN + at.FIELD] - north * m[at.MEAN + at.FIELD + 1]


@noinline
def update_known_field(params: ESKF, m: Floats, n: int) -> None:
    """(37) once, and (38) as often as it has changed."""
    level, up = m[at.KNOWN_LEVEL], m[at.KNOWN_UP]
    sigma2 = params.field_sigma * params.field_sigma * (level * level + up * up)
    if m[at.KNOWN_UP_SET] == 0.0:
        m[at.KNOWN_UP_SET] = 1.0
        m[at.H + at.FIELD + 2] = 1.0
        update_partial(m, n, 0.0, up - m[at.MEAN + at.FIELD + 2], sigma2, UNBOUNDED)
    x = m[at.MEAN + at.FIELD] + m[at.X + at.FIELD]
    y = m[at.MEAN + at.FIELD + 1] + m[at.X + at.FIELD + 1]
    one = 1.0 / sqrt(max(x * x + y * y, NO_LENGTH))
    east, north = x * one, y * one
    p = at.P + at.FIELD * at.ROW + at.FIELD
    across = north * north * m[p] - 2.0 * east * north * m[p + 1] + east * east * m[p + at.ROW + 1]
    if across >= level * level:
        return
    variance = sigma2 + 0.5 * across * across / (level * level)
    before = m[at.KNOWN_VARIANCE]
    same = east * m[at.KNOWN_EAST] + north * m[at.KNOWN_NORTH] > SAME_DIRECTION
    if before > 0.0 and same and NARROWER * variance > before:
        return
    target = sqrt(level * level - across)
    update_partial(m, n, 0.0, level_innovation(m, east, north, target), variance, UNBOUNDED)
    if before > 0.0:
        take_out(m, n, level_innovation(m, m[at.KNOWN_EAST], m[at.KNOWN_NORTH], m[at.KNOWN_TARGET]), before)
    m[at.KNOWN_EAST], m[at.KNOWN_NORTH] = east, north
    m[at.KNOWN_TARGET], m[at.KNOWN_VARIANCE] = target, variance
