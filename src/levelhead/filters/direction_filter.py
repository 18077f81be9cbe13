"""The common part of ``Mahony`` and ``Madgwick``: filters that rotate the attitude towards measured directions.

Their state is the attitude, a bias and an age: until it reaches a time constant, gains are those of a running mean.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import Output
from levelhead.filters.parameters import Params
from levelhead.kernels import triad
from levelhead.kernels.lowpass import inflate_age
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import ZERO, Vec3
from levelhead.kernels.vector_error import rotate

DIP_SHARE = 0.2  # cos² of the field's dip in middle Europe: the share of a heading error that the whole field shows


class State(NamedTuple):
    """Attitude (sensor to earth), bias (rad/s, sensor frame), and the age (s) of the estimate since start or gap."""

    quat: Quat
    bias: Vec3
    age: float


@kernel
def init(params: Params, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample."""
    return State(triad.initial_attitude(acc, mag), ZERO, 0.0)


@kernel
def integrate(state: State, gyr: Vec3, dt: float) -> Quat:
    """The attitude after ``dt`` seconds at the rate ``gyr`` (rad/s) without the bias."""
    bx, by, bz = state.bias
    gx, gy, gz = gyr
    return rotate(state.quat, (gx - bx) * dt, (gy - by) * dt, (gz - bz) * dt)


@kernel
def inflate(params: Params, state: State, variance: float) -> State:
    """Gains grow as much as the variance (rad²) of the attitude does; after a large one they are those of a start."""
    return State(state.quat, state.bias, inflate_age(state.age, variance))


@kernel
def output(params: Params, state: State) -> Output:
    """Attitude and bias."""
    return Output(quat=state.quat, bias=state.bias, sigma=ZERO, health=0)
