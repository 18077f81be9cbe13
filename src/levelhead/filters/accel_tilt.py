"""AccelTilt: the accelerometer alone, which jitters. Roll and pitch of every single accelerometer sample, yaw 0."""

from math import inf
from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import Filter, Gains, Output, Settling
from levelhead.filters.parameters import parameters
from levelhead.kernels import tilt, triad
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import ZERO, Vec3


@parameters()
class AccelTilt(NamedTuple):
    """Roll and pitch straight from the accelerometer: right on average at rest, wrong at every bump; no heading."""


class State(NamedTuple):
    """The attitude, sensor to earth."""

    quat: Quat


@kernel
def init(params: AccelTilt, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt of the first sample."""
    return State(triad.initial_attitude(acc, ZERO))


@kernel
def step(params: AccelTilt, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """φ = atan2(a_y, a_z), θ = atan2(−a_x, √(a_y² + a_z²)); a missing sample keeps the last attitude."""
    if tilt.is_present(acc):
        return init(params, gyr, acc, mag)
    return state


@kernel
def output(params: AccelTilt, state: State) -> Output:
    """Attitude only."""
    return Output(quat=state.quat, bias=ZERO, sigma=ZERO, health=0)


@kernel
def gains(params: AccelTilt, state: State, dt: float) -> Gains:
    """Believes every sample."""
    return Gains(tilt=1.0, tilt_bias=0.0, heading=0.0, heading_bias=0.0)


FILTER = Filter(
    name="AccelTilt",
    params=AccelTilt,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt"}),
    uses=frozenset({"acc"}),
    citation="M. Pedley, Tilt Sensing Using a Three-Axis Accelerometer, Freescale AN3461, rev. 6, 2013, eqs. 25 and 26",
    gains=gains,
    settles=Settling(0.0, inf),
)
