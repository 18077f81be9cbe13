"""The guard's estimate of the earth's magnetic field: norm and dip, and whether a reading is of it."""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.guard.params import Guard
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.lowpass import lowpass_weight
from levelhead.kernels.tilt import is_present
from levelhead.kernels.vec3 import Vec3, dot, norm
from levelhead.units import DEGREE

FIRST_AGE = 1e-3  # s for which the first reading counts
FIELD_TIME = 20.0  # s, time constant of norm and dip


class Field(NamedTuple):
    """The reference field."""

    norm: float  # µT
    dip: float  # sine of its angle above the horizon
    age: float  # s over which it was averaged; 0: there is none
    rejected: float  # s for which readings have not fitted


NO_FIELD = Field(norm=0.0, dip=0.0, age=0.0, rejected=0.0)


@kernel
def initial_field(up: Vec3, mag: Vec3) -> Field:
    """The reference at the start, from which the heading was taken; ``up`` is the vertical in the sensor frame."""
    if not is_present(mag):
        return NO_FIELD
    n = norm(mag)
    return Field(norm=n, dip=dot(up, mag) / n, age=FIRST_AGE, rejected=0.0)


@kernel
def update_field(guard: Guard, field: Field, up: Vec3, mag: Vec3, dt: float) -> Field:
    """The reference after a reading (µT); ``rejected`` > 0: the reading is not of the earth's field.

    A reading whose norm and dip are within the bounds is averaged into the reference. Readings that stay outside for
    ``mag_time`` become the new reference: the room was changed, not the moment. A younger reference, which may come
    from a wrong attitude, is replaced after as many seconds as it is old.
    """
    strength, dip, age = field.norm, field.dip, field.age
    rejected = field.rejected
    x, y, z = mag
    n = sqrt(x * x + y * y + z * z)
    a, b, c = up
    d = (a * x + b * y + c * z) * (1.0 / n)
    if age == 0.0 or (rejected > 0.0 and has_elapsed(rejected, dt, min(guard.mag_time, age))):
        return Field(norm=n, dip=d, age=dt, rejected=0.0)
    if abs(n - strength) > guard.mag_gate * strength or abs(d - dip) > guard.mag_angle * DEGREE:
        return Field(norm=strength, dip=dip, age=age, rejected=rejected + dt)
    weight = lowpass_weight(FIELD_TIME, age, dt)
    return Field(
        norm=strength + weight * (n - strength),
        dip=dip + weight * (d - dip),
        age=min(age + dt, FIELD_TIME),
        rejected=0.0,
    )
