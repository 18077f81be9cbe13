"""North, a property of the field that ``ESKF`` estimates, and how the orientation is turned to it.

The frame of the filter is the gyroscope's: heading is right by definition at the start, and the field H of the
surroundings may point anywhere in it. With its level part (H_x, H_y) north is at the azimuth

    α = atan2(H_x, H_y),   σ_α² = var(gᵀ δH + θ_z),   g = (H_y, −H_x)/(H_x² + H_y²)                            (18)

clockwise from y. The orientation that comes out is turned about the vertical by ν, which follows α with
``north_rate`` beyond σ_α, and the more slowly the nearer within:

    ν ← ν + sgn(α − ν) min(|α − ν|, ``north_rate`` T min(1, |α − ν|/σ_α))                                      (39)

In the first second of a field ν is α. With ``north_rate`` = 0 it stays so, and heading is relative to this start. With
aiding that has a direction the frame is the earth's, and ν is zero.
"""

from math import pi, sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import aiding
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import state_variance
from levelhead.filters.eskf.params import ESKF
from levelhead.kernels.angle import wrap
from levelhead.kernels.arrays import Floats
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.quat import Quat, unit
from levelhead.kernels.tilt import NO_LENGTH, UNIFORM
from levelhead.kernels.trig import atan2, sincos
from levelhead.units import DEGREE

START_TIME = 1.0  # s of a field, in which the orientation begins at its north


@kernel
def north_variance(m: Floats, p: int, x: float, y: float) -> float:
    """σ_α² of eq. 18 (rad²) with the covariance at ``p`` and the level part (x, y) of H."""
    level2 = max(x * x + y * y, NO_LENGTH)
    east, north = y / level2, -x / level2
    first = p + at.FIELD * at.ROW
    heading = p + at.HEADING * at.ROW
    own = east * east * m[first + at.FIELD] + north * north * m[first + at.ROW + at.FIELD + 1]
    common = east * m[heading + at.FIELD] + north * m[heading + at.FIELD + 1]
    common += east * north * m[first + at.FIELD + 1]
    return min(own + 2.0 * common + m[heading + at.HEADING], UNIFORM * UNIFORM)


class North(NamedTuple):
    """The direction of magnetic north in the orientation that comes out."""

    azimuth: float  # rad, clockwise from its y axis
    variance: float  # rad²


@kernel
def north_of(m: Floats) -> North:
    """North by now; before the first field any direction."""
    if m[at.NORTH_VARIANCE] <= 0.0:
        return North(0.0, UNIFORM * UNIFORM)
    return North(wrap(m[at.NORTH] - m[at.NORTH_TURN], 2.0 * pi), m[at.NORTH_VARIANCE])


@noinline
def point_north(params: ESKF, m: Floats) -> None:
    """Eqs. 18 and 39 at the end of a block."""
    x, y = m[at.MEAN + at.FIELD], m[at.MEAN + at.FIELD + 1]
    m[at.NORTH] = atan2(x, y)
    m[at.NORTH_VARIANCE] = north_variance(m, at.P, x, y)
    at_start = not has_elapsed(m[at.NORTH_TIME], m[at.BLOCK_TIME], START_TIME)
    m[at.NORTH_TIME] += m[at.BLOCK_TIME]
    if aiding.has_direction(m) or (params.north_rate == 0.0 and not at_start):
        return
    off = wrap(m[at.NORTH] - m[at.NORTH_TURN], 2.0 * pi)
    rate = params.north_rate * DEGREE * m[at.BLOCK_TIME]
    sigmas = abs(off) / sqrt(max(m[at.NORTH_VARIANCE], NO_LENGTH))
    step = abs(off) if at_start else min(abs(off), rate * min(1.0, sigmas))
    turn = wrap(m[at.NORTH_TURN] + (step if off > 0.0 else -step), 2.0 * pi)
    off = wrap(m[at.NORTH] - turn, 2.0 * pi)
    m[at.NORTH_TURN] = turn
    m[at.NORTH_S], m[at.NORTH_C] = sincos(0.5 * turn)
    if params.north_rate > 0.0:
        m[at.NORTH_EXCESS] = m[at.NORTH_VARIANCE] - state_variance(m, at.HEADING) + off * off


@kernel
def turn_to_north(m: Floats, q: Quat) -> Quat:
    """The attitude in the frame of the gyroscope as the orientation that comes out."""
    s = m[at.NORTH_S]
    if s == 0.0:
        return q
    c = m[at.NORTH_C]
    return unit(c * q.w - s * q.z, c * q.x - s * q.y, c * q.y + s * q.x, c * q.z + s * q.w)
