"""A sensor beyond its full scale: the reading beyond it, from the slope with which it came there.

A reading that leaves the range with the slope a and comes back after T as a parabola was a T/4 beyond at most, and
a T²/6 in the integral of all that is beyond; growing with time t, that is a t/3. A rate that is clipped is of a body
that turns on, and a specific force that is clipped of one that is pushed: left out, a runner would weigh too little at
every step.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.guard.detectors import Extreme
from levelhead.kernels.vec3 import ZERO, Vec3, norm, scale, sub

AT_FULL_SCALE = 0.97  # of the full scale: an axis that reads so much is clipped, if any is
RATE_SHARE = 0.4  # 1σ of the angle beyond full scale, as a share of it
FORCE_SHARE = 1.0  # and of the velocity: a blow has no parabola
LEAST_SLOPE = 0.8  # of a slope is that of the next sample: the one that reaches full scale is cut off
STEEPER = 2.0  # at most


class Approach(NamedTuple):
    """How a sensor has come near its full scale, in its unit (u)."""

    last: Vec3  # its last reading
    slope: Vec3  # u/s, when it was last below full scale; where an axis is clipped that of its beginning
    time: float  # s since it reached full scale; 0: it is below


NO_APPROACH = Approach(ZERO, ZERO, 0.0)


@kernel
def axis_slope(slope: float, last: float, reading: float, full: float, first: bool, dt: float) -> float:
    """Slope of one axis as it reached full scale, u/s; 0 where it is below.

    ``slope`` is that of the sample before, and of a body that was hit it has no meaning.
    """
    if -full < reading < full:
        return 0.0
    if not first:
        return slope
    sign = 1.0 if reading > 0.0 else -1.0
    before = max(sign * slope, 0.0)
    return sign * max(before, min(sign * (reading - last) / dt, STEEPER * before))


@noinline
def clipped_slope(approach: Approach, share: float, reading: Vec3, full: float, first: bool, dt: float) -> Vec3:
    """The same of all axes; the slopes of the sample before count as this share of them."""
    slope, last = approach.slope, approach.last
    return Vec3(
        axis_slope(share * slope.x, last.x, reading.x, full, first, dt),
        axis_slope(share * slope.y, last.y, reading.y, full, first, dt),
        axis_slope(share * slope.z, last.z, reading.z, full, first, dt),
    )


@kernel
def update_approach(approach: Approach, reading: Vec3, extreme: Extreme, dt: float) -> Approach:
    """After a reading that lasts ``dt`` seconds; a plateau is known for full scale only when it has lasted."""
    if extreme.stay < 0.0 and not extreme.clipped:
        return Approach(reading, scale(sub(reading, approach.last), 1.0 / dt), 0.0)
    share, first, time = 1.0, True, 0.0
    if extreme.clipped:
        first = approach.time == 0.0
        time = max(approach.time, extreme.stay) + dt
    elif extreme.stay == 0.0:
        share = LEAST_SLOPE
    full = AT_FULL_SCALE * min(extreme.up, extreme.down)
    return Approach(reading, clipped_slope(approach, share, reading, full, first, dt), time)


@noinline
def mean_beyond(approach: Approach, dt: float) -> Vec3:
    """The mean excess that the last reading, of ``dt`` seconds, beyond full scale, leaves out; at most as much as it
    reads."""
    beyond = scale(approach.slope, (approach.time - 0.5 * dt) / 3.0)
    size, most = norm(beyond), norm(approach.last)
    return scale(beyond, most / size) if size > most else beyond


@kernel
def squared_excess(approach: Approach, time: float) -> float:
    """u² s², square of the integral a T²/6 of the excess, ``time`` seconds after full scale was reached."""
    x, y, z = approach.slope
    missed = time * time / 6.0
    return missed * missed * (x * x + y * y + z * z)


@kernel
def unmeasured_angle(rate: Approach, before: float) -> float:
    """rad², variance of the rotation beyond full scale since ``before`` seconds after it was reached.

    On RepoIMU's clipped recordings (T from 0.05 to 0.5 s) the angle a T²/6 is right to ``RATE_SHARE``.
    """
    return RATE_SHARE * RATE_SHARE * (squared_excess(rate, rate.time) - squared_excess(rate, before))


@kernel
def unmeasured_velocity(force: Approach, dt: float) -> float:
    """m²/s², variance of the velocity by the excess over full scale in the last ``dt`` seconds.

    A phone of ± 2 g in a runner's hand is clipped at each step. Begun in the run, its tilt was beyond 4σ for 68 % of
    the time without this variance and is for 1 % with it (``benchmarks/accuracy/changed.py``).
    """
    return FORCE_SHARE * FORCE_SHARE * (squared_excess(force, force.time) - squared_excess(force, force.time - dt))
