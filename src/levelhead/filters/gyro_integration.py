"""GyroIntegration: the gyroscope alone, which drifts. Its rate is integrated from the first sample's tilt."""

from math import inf
from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import Filter, Gains, Output, Settling
from levelhead.filters.parameters import parameters
from levelhead.kernels import quat, triad
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import ZERO, Vec3


@parameters()
class GyroIntegration(NamedTuple):
    """Attitude by integrating the angular rate, never corrected: smooth at once, wrong after a while."""


class State(NamedTuple):
    """The attitude, sensor to earth."""

    quat: Quat


@kernel
def init(params: GyroIntegration, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample."""
    return State(triad.initial_attitude(acc, mag))


@kernel
def step(params: GyroIntegration, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """q ← q ⊗ exp(ω dt), exact while the rate is constant over dt (Savage 1998, eq. 12 with no coning)."""
    return State(quat.integrate(state.quat, gyr, dt))


@kernel
def output(params: GyroIntegration, state: State) -> Output:
    """Attitude only."""
    return Output(quat=state.quat, bias=ZERO, sigma=ZERO, health=0)


@kernel
def gains(params: GyroIntegration, state: State, dt: float) -> Gains:
    """Corrects nothing."""
    return Gains(tilt=0.0, tilt_bias=0.0, heading=0.0, heading_bias=0.0)


FILTER = Filter(
    name="GyroIntegration",
    params=GyroIntegration,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt"}),
    uses=frozenset({"gyr"}),
    citation="P. G. Savage, Strapdown Inertial Navigation Integration Algorithm Design Part 1: Attitude Algorithms, "
    "Journal of Guidance, Control, and Dynamics 21(1), 1998",
    gains=gains,
    settles=Settling(inf, inf),
)
