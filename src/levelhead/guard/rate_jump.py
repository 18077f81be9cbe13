"""Spikes of a gyroscope: single rates that the samples before and after them do not know.

A bus that loses a bit gives one rate that is far off, and a filter integrates it. Which rate is a spike only the next
sample tells: a rate that jumps is held back, and the last one stands for it. If the next rate is nearer to the one that
was held back, the body did jump, and what was held back is returned with that rate, so that no rotation is lost.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.kernels.vec3 import ZERO, Vec3

JUMP = 3.0  # times the largest change of late, from one sample to the next, is a jump,
JUMP_ANGLE = 0.02  # rad, if it also turns the body by so much
USUAL_TIME = 1.0  # s in which the largest change of late fades
MOST_SPIKES = 3  # in a row; more are a motion
MOST_RETURN = 3.0  # times: a held rate lasts at most so much longer than the sample it is returned with


class Jump(NamedTuple):
    """The last rate that was believed (rad/s), and what was held back."""

    rate: Vec3
    usual2: float  # (rad/s)², square of the largest change of late
    held: Vec3  # rad/s, by which the held rate is beyond ``rate``
    held_time: float  # s that the held rate lasted; 0: none is held back
    returned: Vec3  # rad/s, that was held back of the sample before, as a rate of this one
    spikes: int  # in a row until now: what was held back of the sample before was one


NO_JUMP = Jump(ZERO, 0.0, ZERO, 0.0, ZERO, 0)


@kernel
def first_rate(gyr: Vec3) -> Jump:
    """After the first rate."""
    return Jump(gyr, 0.0, ZERO, 0.0, ZERO, 0)


@kernel
def is_jump(change2: float, usual2: float, dt: float) -> bool:
    """Whether a rate has changed by so much (square, (rad/s)²) that it may be a spike."""
    return change2 > JUMP * JUMP * usual2 and change2 * dt * dt > JUMP_ANGLE * JUMP_ANGLE


@kernel
def update_jump(jump: Jump, gyr: Vec3, plausible: bool, dt: float) -> Jump:
    """After a rate (rad/s) that stands for ``dt`` seconds.

    ``plausible``: it is no spike, however large: at a known full scale, or after samples that were lost.
    """
    (a, b, c), usual2, held, held_time, _, spikes = jump
    x, y, z = gyr
    u = x - a
    v = y - b
    w = z - c
    change2 = u * u + v * v + w * w
    if held_time > 0.0:
        p, q, r = held
        if (u - p) * (u - p) + (v - q) * (v - q) + (w - r) * (w - r) < change2:
            share = min(held_time, MOST_RETURN * dt) / dt
            returned = Vec3(share * p, share * q, share * r)
            return Jump(gyr, max(p * p + q * q + r * r, usual2), ZERO, 0.0, returned, 0)
        spikes += 1
    else:
        spikes = 0
    if not plausible and spikes < MOST_SPIKES and is_jump(change2, usual2, dt):
        return Jump(jump.rate, usual2, Vec3(u, v, w), dt, ZERO, spikes)
    usual2 = usual2 * USUAL_TIME / (USUAL_TIME + 2.0 * dt)
    return Jump(gyr, max(change2, usual2), ZERO, 0.0, ZERO, spikes)
