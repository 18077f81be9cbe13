"""The guard: bad readings are held back before a filter sees them, once, and the same for all filters.

``detectors`` needs the readings alone: full scale, axes that hang, force that is not gravity. ``rest`` decides whether
the sensor is at rest and reads the gyroscope's bias off; ``iron`` finds the offset of a raw magnetometer, ``field``
estimates the earth's field. The gates here also
need the filter's attitude: accelerations that are not gravity and fields that are not the earth's are held back,
for a bounded time. Each gate reports its reason by a bit of ``filters.health``.
"""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.health import AT_REST, IRON_FOUND, MAG_LEARNED, MAG_REJECTED
from levelhead.guard.field import NO_FIELD, Field, update_field
from levelhead.guard.iron import NO_IRON, MagOffset, update_iron
from levelhead.guard.params import Guard
from levelhead.guard.rest import Rest, is_resting
from levelhead.kernels import quat
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import is_present
from levelhead.kernels.vec3 import ZERO, Vec3, sub
from levelhead.units import DEGREE

GATES_FIELD = True  # False for a filter that gates the field itself


class GuardState(NamedTuple):
    """The guard's memory of one run of a filter."""

    rest: Rest
    acc_rejected: float  # s for which the specific force has not been gravity
    field: Field
    iron: MagOffset


class Gated(NamedTuple):
    """A magnetometer reading (µT; the zero vector where it is held back), health bits, and the guard after it."""

    mag: Vec3
    health: int
    state: GuardState


NO_SAMPLES = GuardState(
    rest=Rest(time=0.0, bias=ZERO, moved=False, known=False), acc_rejected=0.0, field=NO_FIELD, iron=NO_IRON
)


@kernel
def set_field(state: GuardState, field: Field) -> GuardState:
    """The state with this field."""
    return GuardState(rest=state.rest, acc_rejected=state.acc_rejected, field=field, iron=state.iron)


@kernel
def reject_force(state: GuardState, seconds: float) -> GuardState:
    """The state in which the specific force has not been gravity for so long."""
    return GuardState(rest=state.rest, acc_rejected=seconds, field=state.field, iron=state.iron)


@kernel
def is_accelerating(guard: Guard, state: GuardState, dt: float) -> bool:
    """Whether the accelerometer is held back at a sample of ``dt`` seconds."""
    return state.acc_rejected > 0.0 and not has_elapsed(state.acc_rejected, dt, guard.acc_time)


@kernel
def predict_up(attitude: Quat, gyr: Vec3, dt: float) -> Vec3:
    """The vertical in the sensor frame, ``dt`` after it had this attitude, to first order."""
    x, y, z = quat.up(attitude)
    a, b, c = gyr
    return Vec3(x + dt * (y * c - z * b), y + dt * (z * a - x * c), z + dt * (x * b - y * a))


@kernel
def gate_force(
    guard: Guard, state: GuardState, attitude: Quat, gyr: Vec3, acc: Vec3, far_from_g: bool, dt: float
) -> GuardState:
    """For how long the specific force has not been gravity: its norm is ``far_from_g``, and its direction is more than
    ``acc_angle`` from the vertical that the filter predicts."""
    if not is_present(acc):
        return state
    if not far_from_g:
        return reject_force(state, 0.0)
    x, y, z = acc
    a, b, c = predict_up(attitude, gyr, dt)
    cosine = 1.0 - 0.5 * guard.acc_angle * guard.acc_angle * (DEGREE * DEGREE)
    off = a * x + b * y + c * z < sqrt(x * x + y * y + z * z) * cosine
    return reject_force(state, state.acc_rejected + dt if off else 0.0)


@kernel
def gate(guard: Guard, state: GuardState, attitude: Quat, gyr: Vec3, mag: Vec3, dt: float) -> Gated:
    """The magnetometer reading that the filter gets.

    ``attitude`` is the filter's, one sample old; ``gyr`` (rad/s) is without the bias that was read off at rest.
    """
    health = 0
    if is_resting(guard, state.rest):
        health = AT_REST
    if GATES_FIELD and guard.iron > 0.0:
        field, iron = state.field, update_iron(guard, state.iron, quat.up(attitude), gyr, mag, dt)
        if iron.known and is_present(mag):
            mag = sub(mag, iron.offset)
            if not state.iron.known:
                health |= IRON_FOUND
                field = NO_FIELD
        state = GuardState(rest=state.rest, acc_rejected=state.acc_rejected, field=field, iron=iron)
    if GATES_FIELD and is_present(mag):
        field = update_field(guard, state.field, predict_up(attitude, gyr, dt), mag, dt)
        state = set_field(state, field)
        if field.rejected > 0.0:
            health |= MAG_REJECTED
            mag = ZERO
        elif field.age <= dt:
            health |= MAG_LEARNED
    return Gated(mag, health, state)


__all__ = ["NO_SAMPLES", "Gated", "Guard", "GuardState", "gate", "gate_force", "is_accelerating", "set_field"]
