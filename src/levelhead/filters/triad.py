"""Triad: the attitude from accelerometer and magnetometer alone, anew at every sample.

TRIAD (``kernels/triad.py``, eqs. 1 and 2) builds a frame from two directions. With gravity first it *is* the
tilt-compensated compass of the application notes,

    φ = atan2(a_y, a_z),   θ = atan2(−a_x, √(a_y² + a_z²))                                                      (3)
    ψ = atan2(m_x cos θ + (m_y sin φ + m_z cos φ) sin θ,  m_y cos φ − m_z sin φ)                                (4)

without their angles: the same attitude, also at θ = ±90°. With the field first, the attitude has the field's direction
exactly, and gravity only turns it about that direction. That needs the field's dip, which is a matter of the place.
"""

from typing import Annotated, NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import Filter, Gains, Output, Settling
from levelhead.filters.parameters import Param, parameters
from levelhead.kernels import tilt, triad
from levelhead.kernels.quat import Quat
from levelhead.kernels.trig import sincos
from levelhead.kernels.vec3 import ZERO, Vec3
from levelhead.units import DEGREE


@parameters()
class Triad(NamedTuple):
    """Compass with tilt: attitude from every single accelerometer and magnetometer sample; right on average at rest."""

    field_first: Annotated[bool, Param("", "use the whole field, and gravity only about it")] = False
    dip: Annotated[float, Param("deg", "field_first: the field's dip", low=-90.0, high=90.0, sweep=(-80, 80))] = 60.0


class State(NamedTuple):
    """The attitude, sensor to earth, and whether a field has ever been measured."""

    quat: Quat
    headed: bool


@kernel
def init(params: Triad, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """The attitude of the first sample."""
    if params.field_first and triad.distinct(mag, acc):
        sine, cosine = sincos(params.dip * DEGREE)
        return State(triad.attitude(mag, acc, Vec3(0.0, cosine, -sine), Vec3(0.0, 0.0, 1.0)), True)
    return State(triad.initial_attitude(acc, mag), tilt.is_present(mag))


@kernel
def step(params: Triad, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """The attitude of this sample; where something is missing that was there before, the last one is kept."""
    if tilt.is_present(acc) and (tilt.is_present(mag) or not state.headed):
        return init(params, gyr, acc, mag)
    return state


@kernel
def output(params: Triad, state: State) -> Output:
    """Attitude only."""
    return Output(quat=state.quat, bias=ZERO, sigma=ZERO, health=0)


@kernel
def gains(params: Triad, state: State, dt: float) -> Gains:
    """All of every innovation."""
    return Gains(tilt=1.0, tilt_bias=0.0, heading=1.0, heading_bias=0.0)


FILTER = Filter(
    name="Triad",
    params=Triad,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "heading"}),
    uses=frozenset({"acc", "mag"}),
    citation="H. D. Black, A Passive System for Determining the Attitude of a Satellite, AIAA Journal 2(7), 1964; "
    "M. D. Shuster, S. D. Oh, Three-Axis Attitude Determination from Vector Observations, Journal of Guidance and "
    "Control 4(1), 1981; T. Ozyagcilar, Implementing a Tilt-Compensated eCompass, Freescale AN4248, 2012",
    settles=Settling(0.0, 0.0),
    gains=gains,
)
