"""Coarse heading of ``ESKF`` from a receiver's velocity, where there is no magnetometer: in-motion alignment.

To first order heading can be corrected by some tens of degrees only (eq. 7), and a start may point backwards. But the
velocity V of the receiver changes between two fixes by the integral of the force, P = ∫ f dt, which ``ESKF`` has in an
earth frame whose heading is off by ψ. With both as complex numbers east + i north,

    ΔV = γ P + c + noise,   γ = |γ| exp(iψ)                                                                      (32)

whatever ψ is (M. Wu, Y. Wu, Velocity/position integration formula, IEEE Transactions on Aerospace and Electronic
Systems 49(2), 2013). The constant c is the level part of gravity by a tilt error. Linear regression gives, with sums of
P and ΔV without their means,

    γ = Σ P* ΔV / Σ |P|²,   s² = (Σ |ΔV|² − |γ|² Σ |P|²) / (2 n − 4),   var ψ = s² / (|γ|² Σ |P|²)                 (33)

and |γ| is 1, or something else than heading is wrong. Sums decay with 60 s, for the gyroscope turns ψ meanwhile.
"""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.contract import VELOCITY
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import set_independent, state_variance
from levelhead.kernels.arrays import Floats
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.trig import atan2
from levelhead.units import GRAVITY

MEMORY = 60.0  # s
LEAST_FIXES = 4.0
LEAST_GAIN = 0.5  # of |γ|,
MOST_GAIN = 2.0  # and at most
CLEAR = 0.35  # rad, 1σ of ψ that is good enough for corrections of first order
CORRELATED = 1.25  # factor of σ on (33): the contribution of tilt errors is not white
FAR = 5.0  # σ that a heading has to be off before one that seemed known is replaced
LARGE_HEADING = 1.0  # rad²: a larger variance of heading cannot be corrected to first order


class HeadingFit(NamedTuple):
    """The regression's result for heading."""

    angle: float  # rad, ψ, by which the estimate has to be turned
    sigma: float  # rad
    clear: bool


NOT_CLEAR = HeadingFit(0.0, 0.0, False)


@kernel
def is_open(m: Floats) -> bool:
    """Whether heading waits for the regression."""
    return m[at.FIX_KNOWN] != 0.0 and state_variance(m, at.HEADING) > LARGE_HEADING


@kernel
def forget_fixes(m: Floats) -> None:
    """Regression begins anew: after a gap, or where tilt was set."""
    for i in range(at.VELOCITY_GAIN, at.FIX_SUMS_END):
        m[i] = 0.0


@kernel
def note_fix(m: Floats, row: int, value: float, sigma: float) -> None:
    """Keeps a horizontal velocity (m/s) with its 1σ until the block ends, even where it is rejected as far off."""
    if row == VELOCITY or row == VELOCITY + 1:
        axis = row - VELOCITY
        m[at.GNSS_VELOCITY + axis] = value
        m[at.GNSS_VARIANCE + axis] = sigma * sigma


@kernel
def add_pair(m: Floats, time: float, x: float, y: float) -> None:
    """Adds to the sums the change (x, y) of the receiver's velocity over ``time`` seconds."""
    east, north = m[at.VELOCITY_GAIN], m[at.VELOCITY_GAIN + 1]
    left = MEMORY / (MEMORY + time)
    for i in range(at.FIX_SUMS, at.FIX_SUMS_END):
        m[i] = m[i] * left
    m[at.FIX_SUMS] += 1.0
    m[at.FIX_SUMS + 1] += east
    m[at.FIX_SUMS + 2] += north
    m[at.FIX_SUMS + 3] += x
    m[at.FIX_SUMS + 4] += y
    m[at.FIX_SUMS + 5] += east * east + north * north
    m[at.FIX_SUMS + 6] += x * x + y * y
    m[at.FIX_SUMS + 7] += east * x + north * y
    m[at.FIX_SUMS + 8] += east * y - north * x


@noinline
def add_block(m: Floats) -> bool:
    """Adds the force of a block of samples, and the fix in it; returns whether there was one."""
    m[at.VELOCITY_GAIN] += m[at.INT_FORCE]
    m[at.VELOCITY_GAIN + 1] += m[at.INT_FORCE + 1]
    m[at.GAIN_TIME] += m[at.BLOCK_TIME]
    if m[at.GNSS_VARIANCE] == 0.0 or m[at.GNSS_VARIANCE + 1] == 0.0:
        return False
    x, y = m[at.GNSS_VELOCITY] - m[at.FIX_BEFORE], m[at.GNSS_VELOCITY + 1] - m[at.FIX_BEFORE + 1]
    noise = m[at.GNSS_VARIANCE] + m[at.GNSS_VARIANCE + 1]
    if m[at.FIX_KNOWN] != 0.0:
        push = sqrt(m[at.VELOCITY_GAIN] * m[at.VELOCITY_GAIN] + m[at.VELOCITY_GAIN + 1] * m[at.VELOCITY_GAIN + 1])
        tilt = state_variance(m, at.ATTITUDE) + state_variance(m, at.ATTITUDE + 1)
        fall = GRAVITY * m[at.GAIN_TIME]
        off = sqrt(x * x + y * y) - push
        long = has_elapsed(m[at.GAIN_TIME], m[at.BLOCK_TIME], MEMORY)
        if off * off < FAR * FAR * (2.0 * noise + tilt * fall * fall) and not long:
            add_pair(m, m[at.GAIN_TIME], x, y)
    m[at.FIX_BEFORE] = m[at.GNSS_VELOCITY]
    m[at.FIX_BEFORE + 1] = m[at.GNSS_VELOCITY + 1]
    m[at.FIX_NOISE] = noise
    m[at.FIX_KNOWN] = 1.0
    m[at.VELOCITY_GAIN] = 0.0
    m[at.VELOCITY_GAIN + 1] = 0.0
    m[at.GAIN_TIME] = 0.0
    m[at.GNSS_VARIANCE] = 0.0
    m[at.GNSS_VARIANCE + 1] = 0.0
    return True


@noinline
def regress(m: Floats) -> HeadingFit:
    """Eq. 33."""
    n = m[at.FIX_SUMS]
    if n < LEAST_FIXES:
        return NOT_CLEAR
    east, north, x, y = m[at.FIX_SUMS + 1], m[at.FIX_SUMS + 2], m[at.FIX_SUMS + 3], m[at.FIX_SUMS + 4]
    push2 = m[at.FIX_SUMS + 5] - (east * east + north * north) / n
    change2 = m[at.FIX_SUMS + 6] - (x * x + y * y) / n
    real = m[at.FIX_SUMS + 7] - (east * x + north * y) / n
    imaginary = m[at.FIX_SUMS + 8] - (east * y - north * x) / n
    common2 = real * real + imaginary * imaginary
    gain2 = common2 / (push2 * push2) if push2 > 0.0 else 0.0
    if gain2 < LEAST_GAIN * LEAST_GAIN or gain2 > MOST_GAIN * MOST_GAIN:
        return NOT_CLEAR
    scatter2 = max((change2 - common2 / push2) / (2.0 * n - 4.0), m[at.FIX_NOISE])
    sigma = CORRELATED * sqrt(scatter2 * push2 / common2)
    return HeadingFit(atan2(imaginary, real), sigma, sigma < CLEAR)


@noinline
def correct_course(m: Floats) -> HeadingFit:
    """Adds a block of samples; where heading was open, or is wrong beyond doubt, sets the σ of the new one."""
    found = regress(m) if add_block(m) else NOT_CLEAR
    variance = state_variance(m, at.HEADING)
    far = found.angle * found.angle > FAR * FAR * (variance + found.sigma * found.sigma)
    if not (found.clear and (variance > LARGE_HEADING or far)):
        return NOT_CLEAR
    take_course(m, found.sigma)
    return found


@noinline
def take_course(m: Floats, sigma: float) -> None:
    """Heading has the σ (rad) of the regression, and velocity is the receiver's."""
    set_independent(m, at.HEADING, 1, sigma)
    for i in range(2):
        m[at.MEAN + at.VELOCITY + i] = m[at.FIX_BEFORE + i]
    set_independent(m, at.VELOCITY, 2, sqrt(m[at.FIX_NOISE]))
    for row in range(at.AID_ROWS):
        m[at.SUM_INNOVATION + row] = 0.0
        m[at.SUM_WEIGHT + row] = 0.0
        m[at.AID_REJECTED + row] = 0.0
        m[at.AID_AGE + row] += m[at.BLOCK_TIME]
    for i in range(at.FIX_SUMS, at.FIX_SUMS_END):
        m[i] = 0.0
