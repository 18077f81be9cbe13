"""Spikes of a gyroscope: single rates without support in the samples before and after them.

A bus that loses a bit gives one rate that is far off, and a filter integrates it. A rate that jumps is held back, and
the last one replaces it. The next sample decides. If its rate is nearer to the one that was held back, the body did
jump, and the difference is returned with that rate, so no rotation is lost.

The accelerometer decides too. A body that changes its rate by Δω in dt turns with the acceleration Δω/dt. A sensor
at the distance ``LEVER`` from the axis feels that as a change of its specific force

    |Δf| = ``LEVER`` |Δω|/dt                                                                                     (1)

Where the force changes by more, at the jump or after it, the jump is the body's: a heel that strikes the ground, a ball
that is hit.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.kernels.vec3 import ZERO, Vec3, dot, scale, sub

JUMP = 3.0  # times the largest change of late, from one sample to the next, is a jump,
JUMP_ANGLE = 0.02  # rad, if it also turns the body by so much
USUAL_TIME = 1.0  # s in which the largest change of late fades
LEVER = 0.01  # m, from the sensor to the axis about which a blow turns it, at least
MOST_SPIKES = 3  # in a row; more are a motion
MOST_RETURN = 3.0  # times: a held rate lasts at most so much longer than the sample it is returned with


class Jump(NamedTuple):
    """The last rate that was accepted (rad/s), and the difference that was held back."""

    rate: Vec3
    usual2: float  # (rad/s)², square of the largest change of late
    held: Vec3  # rad/s, by which the held rate is, or the last one that was held, beyond ``rate``
    held_time: float  # s that the held rate lasted; 0: none is held back
    returned: Vec3  # rad/s, that was held back of the sample before, as a rate of this one
    spikes: int  # in a row until now: the difference held back at the sample before was one
    force: Vec3  # m/s², the last specific force


NO_JUMP = Jump(rate=ZERO, usual2=0.0, held=ZERO, held_time=0.0, returned=ZERO, spikes=0, force=ZERO)


@kernel
def first_rate(gyr: Vec3, acc: Vec3) -> Jump:
    """After the first rate and specific force."""
    return Jump(rate=gyr, usual2=0.0, held=ZERO, held_time=0.0, returned=ZERO, spikes=0, force=acc)


@kernel
def is_jump(change2: float, usual2: float, dt: float) -> bool:
    """Whether a rate has changed by so much (square, (rad/s)²) that it may be a spike."""
    return change2 > JUMP * JUMP * usual2 and change2 * dt * dt > JUMP_ANGLE * JUMP_ANGLE


@kernel
def is_felt(change2: float, force2: float, dt: float) -> bool:
    """Eq. 1: whether the accelerometer feels a change of the rate, from both changes squared ((rad/s)², (m/s²)²)."""
    return force2 * dt * dt > LEVER * LEVER * change2


@kernel
def update_jump(jump: Jump, gyr: Vec3, acc: Vec3, plausible: bool, dt: float) -> Jump:
    """After a rate (rad/s) and a specific force (m/s²) that stand for ``dt`` seconds.

    ``plausible``: it is not a spike, however large: at a known full scale, or after samples that were lost.
    """
    change = sub(gyr, jump.rate)
    change2 = dot(change, change)
    push = sub(acc, jump.force)
    force2 = dot(push, push)
    spikes = 0
    if jump.held_time > 0.0:
        held2 = dot(jump.held, jump.held)
        back = sub(change, jump.held)
        if dot(back, back) < change2 or is_felt(held2, force2, dt):
            returned = scale(jump.held, min(jump.held_time, MOST_RETURN * dt) / dt)
            usual2 = max(held2, jump.usual2)
            return Jump(rate=gyr, usual2=usual2, held=jump.held, held_time=0.0, returned=returned, spikes=0, force=acc)
        spikes = jump.spikes + 1
    if (
        not plausible
        and spikes < MOST_SPIKES
        and is_jump(change2, jump.usual2, dt)
        and not is_felt(change2, force2, dt)
    ):
        return Jump(
            rate=jump.rate, usual2=jump.usual2, held=change, held_time=dt, returned=ZERO, spikes=spikes, force=acc
        )
    usual2 = max(change2, jump.usual2 * USUAL_TIME / (USUAL_TIME + 2.0 * dt))
    return Jump(rate=gyr, usual2=usual2, held=jump.held, held_time=0.0, returned=ZERO, spikes=spikes, force=acc)
