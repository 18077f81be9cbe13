"""A filter is data: parameters that explain themselves, pure functions, and facts.

    class Kalman(NamedTuple):                       settings; each field an Annotated[float, Param(...)]
    class State(NamedTuple):                        numbers of one sample for the next; floats, NamedTuples of floats
    init(params, gyr, acc, mag) -> State            start from the first sample
    step(params, state, gyr, acc, mag, dt) -> State
    output(params, state) -> Output                 orientation, bias, σ and health of a state

``gyr`` rad/s, ``acc`` m/s², ``mag`` µT are ``Vec3`` in the sensor frame, ``dt`` seconds; an absent sensor is the zero
vector. Abilities of some filters are groups of further functions, each of them optional: ``Schedule``,
``Inflation``, ``Aiding``, ``SelfCalibration``, ``Smoothing``, ``AxisFilter``. This file imports no filter.
"""

from collections.abc import Callable
from typing import NamedTuple

from levelhead.compiler.mark import KernelFunction
from levelhead.compiler.tree import Tree
from levelhead.filters.parameters import Params
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import Vec3

FilterState = Tree  # the state of a filter: a NamedTuple that every filter defines for itself
AxisReport = Tree  # a NamedTuple of floats, or of arrays: level, rate, bias, and further estimates of an axis filter


class NavState(NamedTuple):
    """Position (m) and velocity (m/s) of the body in the earth frame, and 1σ of both."""

    position: Vec3
    velocity: Vec3
    sigma_position: Vec3
    sigma_velocity: Vec3
    aided: bool  # whether any reading of position, velocity or height was used so far


class Output(NamedTuple):
    """The filter's estimates at one instant."""

    quat: Quat  # sensor -> earth
    bias: Vec3  # gyroscope bias, rad/s, sensor frame
    sigma: Vec3  # 1σ of the attitude error about east, north and up, rad; zero when the filter does not estimate it
    health: int  # Health bits


class Gains(NamedTuple):
    """How much of an innovation a filter with set gains takes at a sample, linearised around the right attitude.

    With these the driver computes the filter's σ: the covariance of an observer whose gain is given, optimal or not.
    """

    tilt: float  # share of a tilt innovation that turns the attitude, 0 to 1
    tilt_bias: float  # its correction of the bias, (rad/s)/rad, not negative; 0 without a bias state
    heading: float
    heading_bias: float


class Settling(NamedTuple):
    """Seconds at rest, with default parameters, after which the error of any start or fault is below 2°.

    ``inf``: never, the filter does not correct that angle.
    """

    tilt: float
    heading: float


class Schedule(NamedTuple):
    """Of a filter that corrects at the end of blocks of samples, and not at every sample."""

    due: Callable[..., bool]  # (params, state, dt) -> bool: whether ``correct`` is to be called after this step
    correct: KernelFunction  # (params, state, dt) -> state


class Inflation(NamedTuple):
    """How a filter's uncertainty grows with an unmeasured motion: each adds a variance, the first two in rad².

    A covariance grows by it; a running mean of the readings starts again.
    """

    attitude: KernelFunction  # (params, state, variance) -> state: about each of the three axes
    heading: KernelFunction | None = None  # (params, state, variance) -> state: about the vertical only
    velocity: KernelFunction | None = None  # the same in m²/s², of each component


# Rows of an aiding measurement: the first of three axes (east, north, up), or the only one
POSITION = 0  # m
VELOCITY = 3  # m/s
ZERO_VELOCITY = 6  # m/s, of a body on the ground, which has no direction
HEIGHT = 9  # m, by barometer


class Aiding(NamedTuple):
    """Of a filter that takes measurements of position, velocity and height; rows are counted as above."""

    update: KernelFunction  # (params, state, row, value, sigma, age) -> state; sigma in the value's unit, age in s
    nav_state: Callable[..., NavState]  # (params, state) -> NavState


class AxisFilter(NamedTuple):
    """A filter on one pair of a noisy level and its drifting rate, in any unit."""

    init: KernelFunction  # (params, level) -> state
    step: KernelFunction  # (params, state, level, rate, dt, period) -> state
    read: KernelFunction  # (state) -> report
    report: type  # NamedTuple of floats: level, rate (bias-free), bias, and further estimates


class SelfCalibration(NamedTuple):
    """Of a filter that estimates the errors of its sensor; the last two are plain Python."""

    restart: KernelFunction  # (params, before, gyr, acc, mag) -> state: ``init`` with the prior that ``before`` has
    with_prior: KernelFunction  # (state, prior) -> state that uses the calibration of an earlier run
    estimate: KernelFunction  # (params, state) -> calibration, of the type that ``with_prior`` takes


class Smoothing(NamedTuple):
    """Of a filter whose estimates a backward run corrects by all that follows, see ``engine.smoothing``.

    Of each block the forward run keeps ``width`` numbers, in one row of floats: ``first`` is where they begin.
    """

    offline: KernelFunction  # (params) -> params for a forward run, plain Python
    init: KernelFunction  # those of the forward run
    correct: KernelFunction
    width: int
    is_block_end: Callable[..., bool]  # (state) -> bool: whether a block ended with the last sample
    keep_start: Callable[..., None]  # (state, kept): the block before a stretch, as the first of its blocks
    keep: Callable[..., None]  # (state, kept, first): the block that has just ended
    memory: int  # numbers that the backward run works with
    begin: Callable[..., None]  # (state, memory): at the end of the recording
    back: Callable[..., None]  # (kept, first, memory): one step, to that block from the one behind it
    read: KernelFunction  # (kept, first, memory) -> (turn, bias, sigma): rotation vector (rad), rad/s, rad, 3 each
    rotation: Callable[..., Quat]  # (kept, first) -> by the correction at the end of the block, earth frame
    is_restart: Callable[..., bool]  # (kept, first) -> bool: the attitude is independent of that in the block before
    turn_north: Callable[..., float]  # (params, state) -> rad about the vertical, of all attitudes; plain Python


class AidedSmoothing(NamedTuple):
    """The same of a filter with ``Aiding``, for recordings that have any: position and velocity are smoothed too."""

    parts: Smoothing
    restart: KernelFunction  # of the forward run, as in ``SelfCalibration``
    update: KernelFunction  # of the forward run, as in ``Aiding``
    read_nav: Callable[..., NavState]  # (kept, first, memory) -> corrections of position and velocity, 1σ of both
    nav_change: Callable[..., NavState]  # (kept, first) -> by which the end of the block changed both
    is_set: Callable[..., bool]  # (kept, first, i) -> whether number i of both has no past before the block
    turn_start: Callable[..., Tree | None]  # (begin, end) -> the state from which to run again, or None; plain Python


class Filter(NamedTuple):
    """One published algorithm."""

    name: str
    params: type[Params]
    init: KernelFunction
    step: KernelFunction
    output: Callable[..., Output]
    estimates: frozenset[str]  # of "tilt", "heading", "bias", "sigma"
    uses: frozenset[str]  # of "gyr", "acc", "mag": its inputs; the start takes tilt and heading from the present ones
    citation: str
    settles: Settling
    gains: Callable[..., Gains] | None = None  # (params, state, dt) -> Gains, for filters without a σ of their own
    inflation: Inflation | None = None
    at_rest: KernelFunction | None = None  # (params, state) -> state: the guard has found the sensor at rest
    schedule: Schedule | None = None
    aiding: Aiding | None = None
    handles: frozenset[str] = frozenset()  # of "bias", "field": its own estimates, which the guard leaves to it
    axis: AxisFilter | None = None
    with_known_bias: KernelFunction | None = None  # (params, sigma) -> params: bias subtracted, 1σ left in rad/s
    with_known_field: KernelFunction | None = None  # (params, µT, degrees) -> params: strength and dip of the place
    calibration: SelfCalibration | None = None
    smoothing: Smoothing | None = None
    aided_smoothing: AidedSmoothing | None = None
