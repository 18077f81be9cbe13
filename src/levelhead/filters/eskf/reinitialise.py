"""What ``ESKF`` takes from the sensors anew, where correcting to first order would not do: tilt, heading, field."""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import aiding
from levelhead.filters.eskf.measurements import Fit
from levelhead.filters.eskf.params import ESKF
from levelhead.filters.eskf.predict import still_here
from levelhead.filters.eskf.state import (
    AIDED,
    COUNT,
    EAST,
    FIELD,
    MAG,
    MEAN,
    PUSHED,
    SPELL,
    TURN,
    TURN_Z,
    WOUND,
    independent,
    variance,
    vector,
)
from levelhead.kernels import quat, tilt
from levelhead.kernels.angle import DEGREE
from levelhead.kernels.arrays import Floats
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GRAVITY
from levelhead.kernels.trig import atan2
from levelhead.kernels.vec3 import ZERO, Vec3, add, dot, normalize, scale, sub

FIRST_HEADING = 0.3  # rad
SWINGING = 0.7  # m/s, 1σ of what turns: its force is off by as much times its rate
STEADY = 0.2  # share by which a new field may vary in the earth frame
TURNING = 0.1  # rad/s, at least, for the difference to show
NEARLY_DOWN = -0.999999
FIRST_FIELD = 0.25  # share


class Odd(NamedTuple):
    """A field that does not fit, but is steady in the earth frame while the sensor turns: its mean, for how long."""

    field: Vec3
    spell: float


NOTHING_ODD = Odd(ZERO, 0.0)


@noinline
def odd_for(m: Floats, odd: Odd, fit: Fit) -> Odd:
    """Whether the field that does not fit is one of the room: a magnet on the sensor turns with it."""
    if not (fit.refused or fit.turned):
        return NOTHING_ODD
    spell = m[SPELL]
    off = sub(fit.field, odd.field)
    if odd.spell == 0.0 or dot(off, off) > STEADY * STEADY * dot(fit.field, fit.field):
        return Odd(fit.field, spell)
    if fit.refused and m[WOUND] < TURNING * TURNING * spell:
        return odd
    weight = spell / (odd.spell + spell)
    return Odd(add(odd.field, scale(off, weight)), odd.spell + spell)


@noinline
def new_place(params: ESKF, m: Floats) -> None:
    """Nothing is known of the field."""
    independent(m, MAG, 2, FIRST_FIELD)
    m[MEAN + EAST] = 0.0
    independent(m, EAST, 1, params.mag_place)


@noinline
def take_field(params: ESKF, m: Floats, field: Vec3) -> None:
    """This field is the earth's from now on; of its heading see ``found_north``."""
    new_place(params, m)
    x, y, z = field
    m[MEAN + MAG] = sqrt(x * x + y * y)
    m[MEAN + MAG + 1] = z


@kernel
def upright(force: Vec3) -> Quat:
    """The shortest turn that brings a force to the vertical."""
    x, y, z = normalize(force)
    if z < NEARLY_DOWN:
        return Quat(0.0, 1.0, 0.0, 0.0)
    return quat.normalize(Quat(1.0 + z, y, -x, 0.0))


@noinline
def found_up(params: ESKF, m: Floats) -> Quat:
    """The turn that brings the block's mean force to the vertical, as at the start."""
    swing = upright(vector(m, PUSHED))
    turn = 2.0 * sqrt(swing.x * swing.x + swing.y * swing.y)
    heading = sqrt(variance(m, TURN_Z) + turn * turn)
    start = params.tilt_start * DEGREE
    swung = SWINGING / GRAVITY
    independent(m, TURN, 2, sqrt(start * start + swung * swung * m[WOUND] / m[SPELL]))
    independent(m, TURN_Z, 1, heading)
    if m[AIDED] != 0.0:
        aiding.lost_sight(m, 0.0)
    else:
        still_here(m)
    return swing


@noinline
def found_north(params: ESKF, m: Floats, swing: Quat) -> Quat:
    """The same turn, and one about the vertical that brings the block's mean field north."""
    field = quat.rotate(swing, scale(vector(m, FIELD), 1.0 / m[COUNT]))
    take_field(params, m, field)
    independent(m, TURN_Z, 1, FIRST_HEADING)
    return tilt.add_yaw(swing, atan2(field.x, field.y))
