"""Complementary: the gyroscope for fast changes, the accelerometer (and magnetometer) for slow ones.

One axis, with α = τ/(τ + dt):

    angle ← α (angle + rate·dt) + (1 − α) measured angle                                                        (1)
          = predicted angle + (1 − α) (measured angle − predicted angle)

which low-passes the measured angle and high-passes the integrated rate at the same corner 1/(2πτ). τ is stored: α alone
would mean another filter at every sample rate.

An IMU, with the weight w = dt/(min(τ, age) + dt) in place of 1 − α, on the sphere in place of the circle:

    q ← q ⊗ exp(ω dt)                                                                                           (2)
    q ← slerp(q, q levelled by the accelerometer, w) = exp(w φ n) q                                             (3)
    q ← slerp(q, q pointed north by the field, w_heading)                                                       (4)

with φ n the shortest turn that brings the measured specific force up (``kernels/slerp.py`` has it in full). The force
is averaged in the earth frame, where accelerations that change their sign cancel, and no attitude is singular. ``age``
counts from a gap, and for heading from the first field measured, so a new estimate begins as a running mean. Tilt
starts as in eq. 1, which copies the first sample.
"""

from typing import TYPE_CHECKING, Annotated, NamedTuple, Self

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import AxisFilter, Filter, Gains, Inflation, Output, Settling
from levelhead.filters.parameters import Derived, Param, nonnegative, parameters
from levelhead.kernels import quat, slerp, triad
from levelhead.kernels.angle import blend, wrap
from levelhead.kernels.lowpass import STEADY_AGE, advance_age, inflate_age, lowpass_weight
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import is_present
from levelhead.kernels.vec3 import ZERO, Vec3, norm
from levelhead.units import GRAVITY

NEVER = -1.0  # s, the heading age before there was any field
LESSON_DT = 0.01  # s: the 100 Hz at which the α of tutorials is meant


def tau_of_alpha(alpha: float, dt: float = LESSON_DT) -> float:
    """τ = α·dt/(1 − α), seconds: the time constant of α at the sample interval ``dt``."""
    return alpha * dt / (1.0 - alpha)


def alpha_of_tau(tau: float, dt: float = LESSON_DT) -> float:
    """α = τ/(τ + dt)."""
    return tau / (tau + dt)


ALPHA = Param(
    "",
    "weight of the gyroscope in eq. 1 at 100 Hz, or at the interval given as dt; another name for tau",
    low=0.0,
    high=1.0,
    high_open=True,
    sweep=(0.80, 0.99),
)


class Values(NamedTuple):
    """The fields of ``Complementary``."""

    tau: Annotated[float, nonnegative("s", "time constant: below it the gyroscope is trusted", 0.04, 10.0)] = 0.49
    tau_heading: Annotated[float, nonnegative("s", "time constant towards the magnetometer's heading", 0.1, 30.0)] = 5.0
    adaptive: Annotated[bool, Param("", "raise alpha while the body accelerates, by | |a| − g |")] = False
    alpha_max: Annotated[
        float, Param("", "adaptive: highest alpha at 100 Hz", low=0.0, high=1.0, high_open=True, sweep=(0.99, 0.9999))
    ] = 0.999
    alpha_slope: Annotated[
        float, Param("1/(m/s²)", "adaptive: alpha at 100 Hz gained per m/s² away from g", low=0.0, sweep=(0.001, 0.1))
    ] = 0.005


@parameters(alpha=Derived(param=ALPHA, field="tau", forward=tau_of_alpha, back=alpha_of_tau))
class Complementary(Values):
    """Complementary filter for an attitude (quaternion slerp), or for one axis.

    Set it by time constant, ``Complementary(tau=0.49)``, or by the tutorials' weight, ``Complementary(alpha=0.98)``,
    which means 100 Hz unless the interval is given too: ``Complementary(alpha=0.98, dt=0.005)``.
    """

    __slots__ = ()

    if TYPE_CHECKING:  # ``parameters`` adds alpha and dt at run time; type checkers read them here

        def __new__(
            cls,
            tau: float = ...,
            tau_heading: float = ...,
            adaptive: bool = ...,
            alpha_max: float = ...,
            alpha_slope: float = ...,
            *,
            alpha: float = ...,
            dt: float = LESSON_DT,
        ) -> Self:
            """``alpha`` at the interval ``dt`` in s sets ``tau``."""

        @property
        def alpha(self) -> float:
            """The weight of ``tau`` at 100 Hz."""


class Level(NamedTuple):
    """One axis: the level, its rate and (always zero) the rate's bias, in the units fed in."""

    level: float
    rate: float
    bias: float


class State(NamedTuple):
    """The attitude, sensor to earth, and for how many seconds its tilt and its heading have been heading_age."""

    quat: Quat
    age: float
    heading_age: float


@kernel
def level_init(params: Complementary, level: float) -> Level:
    """Starts at the first measured level."""
    return Level(level, 0.0, 0.0)


@kernel
def level_step(params: Complementary, state: Level, level: float, rate: float, dt: float, period: float) -> Level:
    """Eq. 1 on the circle of ``period`` (0: on a line)."""
    predicted = wrap(state.level + rate * dt, period)
    return Level(blend(predicted, level, dt / (params.tau + dt), period), rate, 0.0)


@kernel
def level_read(state: Level) -> Level:
    """The full state of the axis."""
    return state


@kernel
def trust_time(params: Complementary, acc: Vec3) -> float:
    """The time constant for this sample: τ, or more the further |a| is from g.

    α(100 Hz) = min(α₀ + slope·| |a| − g |, α_max), never below α₀                                              (5)
    """
    if params.adaptive:
        alpha = params.tau / (params.tau + LESSON_DT)
        raised = max(alpha, min(alpha + params.alpha_slope * abs(norm(acc) - GRAVITY), params.alpha_max))
        return raised * LESSON_DT / (1.0 - raised)
    return params.tau


@kernel
def init(params: Complementary, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample."""
    return State(triad.initial_attitude(acc, mag), STEADY_AGE, 0.0 if is_present(mag) else NEVER)


@kernel
def heading_age(state: State, mag: Vec3, dt: float) -> float:
    """Seconds since the first field, or a gap: a magnetometer may come later than the accelerometer."""
    if state.heading_age < 0.0:
        return 0.0 if is_present(mag) else NEVER
    return advance_age(state.heading_age, dt)


@kernel
def step(params: Complementary, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """Eq. 2, then eq. 3 against gravity and eq. 4 against the field, as far as they were measured."""
    attitude = quat.integrate(state.quat, gyr, dt)
    age = advance_age(state.age, dt)
    headed = heading_age(state, mag, dt)
    if is_present(acc):
        attitude = slerp.level(attitude, acc, lowpass_weight(trust_time(params, acc), age, dt))
    if is_present(mag):
        attitude = slerp.turn_north(attitude, mag, lowpass_weight(params.tau_heading, headed, dt))
    return State(attitude, age, headed)


@kernel
def inflate(params: Complementary, state: State, variance: float) -> State:
    """Follows from the start again, as after a gap."""
    heading_age = state.heading_age if state.heading_age < 0.0 else inflate_age(state.heading_age, variance)
    return State(state.quat, inflate_age(state.age, variance), heading_age)


@kernel
def output(params: Complementary, state: State) -> Output:
    """Attitude; this filter estimates neither bias nor σ."""
    return Output(quat=state.quat, bias=ZERO, sigma=ZERO, health=0)


@kernel
def gains(params: Complementary, state: State, dt: float) -> Gains:
    """The weights of eqs. 3 and 4 at the sample that led to this state; ``adaptive`` lowers the first below this."""
    heading = lowpass_weight(params.tau_heading, max(state.heading_age, 0.0), dt)
    return Gains(tilt=lowpass_weight(params.tau, state.age, dt), tilt_bias=0.0, heading=heading, heading_bias=0.0)


FILTER = Filter(
    name="Complementary",
    params=Complementary,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "heading"}),
    uses=frozenset({"gyr", "acc", "mag"}),
    citation="W. T. Higgins, A Comparison of Complementary and Kalman Filtering, IEEE Transactions on Aerospace and "
    "Electronic Systems AES-11(3), 1975; R. G. Valenti, I. Dryanovski, J. Xiao, Keeping a Good Attitude: A "
    "Quaternion-Based Orientation Filter for IMUs and MARGs, Sensors 15(8), 2015; K. Shoemake, Animating Rotation with "
    "Quaternion Curves, SIGGRAPH 1985",
    settles=Settling(3.0, 25.0),
    gains=gains,
    inflation=Inflation(inflate),
    axis=AxisFilter(init=level_init, step=level_step, read=level_read, report=Level),
)
