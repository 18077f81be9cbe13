"""Kalman: angle and gyroscope bias, the two-state filter of the well-known lesson.

State x = (angle, bias), F = [[1, −dt], [0, 1]], measurement z = angle + noise of variance r:

    angle ← angle + dt (rate − bias),   P ← F P Fᵀ + Q                                                          (1)
    S = P₀₀ + r,   K = (P₀₀, P₀₁)ᵀ / S                                                                          (2)
    x ← x + K (z − angle)                                                                                       (3)
    P ← (I − K H) P,   or Joseph's form   P ← (I − K H) P (I − K H)ᵀ + K r Kᵀ                                   (4)

Lessons write Q two ways. Here ``q_angle`` and ``q_bias`` are densities: Q = diag(q_angle, q_bias)·dt, which means the
same at every sample rate. ``q_per_sample=True`` adds diag(q_angle, q_bias) at every sample instead.

The one-axis kernels work in any unit. With an IMU the same filter runs side by side for roll, pitch and, if there is a
magnetometer, heading; its parameters are then in degrees, as in the lesson.
"""

from math import sqrt
from typing import Annotated, NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import AxisFilter, Filter, Inflation, Output, Settling
from levelhead.filters.health import NEAR_VERTICAL
from levelhead.filters.parameters import Param, nonnegative, parameters, positive
from levelhead.kernels import quat, tilt, triad
from levelhead.kernels.angle import wrap
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GAP_SECONDS, UNIFORM, after_gap, bias_after_gap
from levelhead.kernels.two_state import Covariance, Gain, correct, joseph, predict
from levelhead.kernels.vec3 import ZERO, Vec3, add, scale, sub
from levelhead.units import DEGREE

DEG2 = DEGREE * DEGREE  # (°)² in rad²


@parameters()
class Kalman(NamedTuple):
    """Two-state Kalman filter (angle, gyroscope bias), per axis; variances in degrees when it runs on an IMU."""

    q_angle: Annotated[float, nonnegative("deg²/s", "process noise density of the angle", 1e-05, 1.0)] = 0.001
    q_bias: Annotated[float, nonnegative("(deg/s)²/s", "process noise density of the bias", 1e-06, 1.0)] = 0.003
    r_measure: Annotated[float, positive("deg²", "variance of the measured angle", 0.1, 100.0)] = 0.03
    r_heading: Annotated[float, positive("deg²", "variance of the magnetometer's heading", 0.1, 10000.0)] = 9.0
    p_angle: Annotated[float, nonnegative("deg²", "variance of the first angle", 0.01, 100.0)] = 1.0
    p_bias: Annotated[float, nonnegative("(deg/s)²", "variance of the bias at the start", 0.01, 100.0)] = 1.0
    q_per_sample: Annotated[bool, Param("", "add q_angle and q_bias at every sample instead of times dt")] = False
    joseph: Annotated[bool, Param("", "Joseph's form of the covariance update (eq. 4, right)")] = False


class Axis(NamedTuple):
    """One axis after a sample: level, bias-free rate, bias, their covariance, and the last gain and innovation."""

    level: float
    rate: float
    bias: float
    p_level: float
    p_cross: float
    p_bias: float
    gain_level: float
    gain_bias: float
    innovation: float


class Noise(NamedTuple):
    """Variances for one sample, in the unit of the level: of level, bias and measurement."""

    level: float
    bias: float
    measurement: float


class State(NamedTuple):
    """The attitude, the bias (rad/s, sensor frame), the covariance of each axis in radians, and health."""

    quat: Quat
    bias: Vec3
    roll: Covariance
    pitch: Covariance
    heading: Covariance
    health: int


@kernel
def noise(params: Kalman, dt: float, unit: float) -> Noise:
    """Q of one sample and r, with ``unit`` = (unit of the parameters in units of the level)²."""
    share = unit if params.q_per_sample else unit * dt
    return Noise(params.q_angle * share, params.q_bias * share, params.r_measure * unit)


@kernel
def predict_turn(params: Kalman, p: Covariance, dt: float, w: Noise) -> Covariance:
    """``predict`` for an angle of an IMU: across a gap the angle is lost, and shows nothing of the bias after it."""
    if dt > GAP_SECONDS:
        return Covariance(after_gap(p.level, dt), 0.0, bias_after_gap(p.bias, w.bias, params.p_bias * DEG2))
    return predict(p, dt, w.level, w.bias)


@kernel
def gain(p: Covariance, r: float) -> Gain:
    """Eq. 2."""
    s = p.level + r
    return Gain(p.level / s, p.cross / s)


@kernel
def correct_covariance(p: Covariance, k: Gain, r: float, with_joseph: bool) -> Covariance:
    """Eq. 4."""
    return joseph(p, k, r) if with_joseph else correct(p, k)


@kernel
def axis_init(params: Kalman, level: float) -> Axis:
    """Starts at the first measured level, without bias."""
    return Axis(
        level=level,
        rate=0.0,
        bias=0.0,
        p_level=params.p_angle,
        p_cross=0.0,
        p_bias=params.p_bias,
        gain_level=0.0,
        gain_bias=0.0,
        innovation=0.0,
    )


@kernel
def axis_step(params: Kalman, axis: Axis, level: float, rate: float, dt: float, period: float) -> Axis:
    """One sample of a level and its rate, in the unit of the parameters; the innovation is taken on the circle."""
    w = noise(params, dt, 1.0)
    free = rate - axis.bias
    ahead = wrap(axis.level + dt * free, period)
    p = predict(Covariance(axis.p_level, axis.p_cross, axis.p_bias), dt, w.level, w.bias)
    k = gain(p, w.measurement)
    innovation = wrap(level - ahead, period)
    p = correct_covariance(p, k, w.measurement, params.joseph)
    return Axis(
        level=wrap(ahead + k.level * innovation, period),
        rate=free,
        bias=axis.bias + k.bias * innovation,
        p_level=p.level,
        p_cross=p.cross,
        p_bias=p.bias,
        gain_level=k.level,
        gain_bias=k.bias,
        innovation=innovation,
    )


@kernel
def axis_read(axis: Axis) -> Axis:
    """The full state of the axis."""
    return axis


@kernel
def init(params: Kalman, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample; a relative heading starts at 0 and is certain by definition."""
    tilted = Covariance(params.p_angle * DEG2, 0.0, params.p_bias * DEG2)
    p_heading = params.r_heading * DEG2 if tilt.is_present(mag) else 0.0
    headed = Covariance(p_heading, 0.0, params.p_bias * DEG2)
    return State(quat=triad.initial_attitude(acc, mag), bias=ZERO, roll=tilted, pitch=tilted, heading=headed, health=0)


@kernel
def step(params: Kalman, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """Eqs. 1 to 4 on each axis; the attitude is turned as a whole, so the axes share the right kinematics.

    The axes' corrections of the bias are added in the sensor frame, where a bias stays put while the sensor turns.
    """
    w = noise(params, dt, DEG2)
    attitude = quat.integrate(state.quat, sub(gyr, state.bias), dt)
    up = quat.up(attitude)
    roll = predict_turn(params, state.roll, dt, w)
    pitch = predict_turn(params, state.pitch, dt, w)
    heading = predict_turn(params, state.heading, dt, w)
    bias = state.bias
    health = 0
    if tilt.is_present(acc):
        k_pitch = gain(pitch, w.measurement)
        y_pitch = tilt.pitch_innovation(up, acc)
        pitch = correct_covariance(pitch, k_pitch, w.measurement, params.joseph)
        k_roll = Gain(0.0, 0.0)
        y_roll = 0.0
        if tilt.steep(acc):
            health = NEAR_VERTICAL
        else:
            r_roll = w.measurement / tilt.roll_weight(up)
            k_roll = gain(roll, r_roll)
            y_roll = tilt.roll_innovation(up, acc)
            roll = correct_covariance(roll, k_roll, r_roll, params.joseph)
        axis = tilt.pitch_axis(up)
        attitude = tilt.add_roll_pitch(attitude, axis, k_roll.level * y_roll, k_pitch.level * y_pitch)
        bias = add(bias, tilt.in_sensor(axis, k_roll.bias * y_roll, k_pitch.bias * y_pitch))
    if tilt.is_present(mag) and health == 0:
        r_heading = params.r_heading * DEG2
        k_heading = gain(heading, r_heading)
        y_heading = tilt.heading_innovation(attitude, mag)
        heading = correct_covariance(heading, k_heading, r_heading, params.joseph)
        attitude = tilt.add_yaw(attitude, k_heading.level * y_heading)
        bias = add(bias, scale(up, k_heading.bias * y_heading))
    return State(quat=attitude, bias=bias, roll=roll, pitch=pitch, heading=heading, health=health)


@kernel
def inflate_angle(p: Covariance, variance: float) -> Covariance:
    """An angle less certain, without its correlation with the bias."""
    return Covariance(p.level + variance, 0.0, p.bias)


@kernel
def inflate(params: Kalman, state: State, variance: float) -> State:
    """Every axis less sure."""
    attitude, bias, roll = state.quat, state.bias, state.roll
    pitch, heading, health = state.pitch, state.heading, state.health
    return State(
        quat=attitude,
        bias=bias,
        roll=inflate_angle(roll, variance),
        pitch=inflate_angle(pitch, variance),
        heading=inflate_angle(heading, variance),
        health=health,
    )


@kernel
def earth_sigma(p_roll: float, p_pitch: float, p_heading: float, attitude: Quat) -> Vec3:
    """1σ about east, north and up from the variances of roll, pitch and heading (rad²), small tilt.

    An angle of which nothing is known has σ = π/√3: no doubt is larger than that.
    """
    x, y, _ = quat.forward(attitude)
    level = x * x + y * y
    c = x * x / level if level > 0.0 else 1.0  # cos² and sin² of yaw
    s = 1.0 - c
    return Vec3(
        min(sqrt(max(c * p_roll + s * p_pitch, 0.0)), UNIFORM),
        min(sqrt(max(s * p_roll + c * p_pitch, 0.0)), UNIFORM),
        min(sqrt(max(p_heading, 0.0)), UNIFORM),
    )


@kernel
def output(params: Kalman, state: State) -> Output:
    """Attitude, bias, σ and health."""
    return Output(
        quat=state.quat,
        bias=state.bias,
        sigma=earth_sigma(state.roll.level, state.pitch.level, state.heading.level, state.quat),
        health=state.health,
    )


FILTER = Filter(
    name="Kalman",
    params=Kalman,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "heading", "bias", "sigma"}),
    uses=frozenset({"gyr", "acc", "mag"}),
    citation="K. Lauszus, A practical approach to Kalman filter and how to implement it, TKJ Electronics, 2012; "
    "R. E. Kalman, A New Approach to Linear Filtering and Prediction Problems, J. Basic Engineering 82(1), 1960",
    inflation=Inflation(inflate),
    settles=Settling(10.0, 60.0),
    axis=AxisFilter(init=axis_init, step=axis_step, read=axis_read, report=Axis),
)
