"""BiasRateKalman: angle, bias and bias rate, for a gyroscope whose bias runs with temperature.

State x = (angle, bias, bias rate), measurement z = angle + noise of variance r:

    F = [[1, −dt, −dt²/2], [0, 1, dt], [0, 0, 1]],   Q = diag(q_angle, q_bias, q_bias_rate)·dt                  (1)
    angle ← angle + dt (rate − bias) − dt²/2 · bias rate,   bias ← bias + dt · bias rate,   P ← F P Fᵀ + Q      (2)
    S = P₀₀ + r,   K = P Hᵀ/S,   x ← x + K (z − angle),   P ← P − K Kᵀ S   (symmetric by construction)          (3)

A Kalman filter with bias alone lags behind a ramp of the bias for ever; this one does not.
"""

from typing import Annotated, NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import AxisFilter, Filter, Inflation, Output, Settling
from levelhead.filters.health import NEAR_VERTICAL
from levelhead.filters.kalman import DEG2, earth_sigma
from levelhead.filters.parameters import nonnegative, parameters, positive
from levelhead.kernels import mat3, quat, tilt, triad
from levelhead.kernels.angle import wrap
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GAP_SECONDS, after_gap, bias_after_gap
from levelhead.kernels.vec3 import ZERO, Vec3, add, scale, sub


@parameters()
class BiasRateKalman(NamedTuple):
    """Three-state Kalman filter (angle, bias, bias rate), per axis; variances in degrees when it runs on an IMU."""

    q_angle: Annotated[float, nonnegative("deg²/s", "process noise density of the angle", 1e-05, 1.0)] = 0.001
    q_bias: Annotated[float, nonnegative("(deg/s)²/s", "process noise density of the bias", 1e-06, 1.0)] = 0.003
    q_bias_rate: Annotated[float, nonnegative("(deg/s²)²/s", "process noise density of its rate", 1e-10, 0.01)] = 1e-7
    r_measure: Annotated[float, positive("deg²", "variance of the measured angle", 0.1, 100.0)] = 1.0
    r_heading: Annotated[float, positive("deg²", "variance of the magnetometer's heading", 0.1, 10000.0)] = 9.0
    p_angle: Annotated[float, nonnegative("deg²", "variance of the first angle", 0.01, 100.0)] = 1.0
    p_bias: Annotated[float, nonnegative("(deg/s)²", "variance of the bias at the start", 0.01, 100.0)] = 1.0
    p_bias_rate: Annotated[float, nonnegative("(deg/s²)²", "variance of the bias rate at the start", 1e-06, 1.0)] = 1e-4


class Axis(NamedTuple):
    """One axis: level, bias-free rate, bias, bias rate, last innovation, and P of (level, bias, bias rate)."""

    level: float
    rate: float
    bias: float
    bias_rate: float
    innovation: float
    p: Mat3


class Report(NamedTuple):
    """The state of one axis: estimates, variances (diagonal of P) and innovation."""

    level: float
    rate: float
    bias: float
    bias_rate: float
    p_level: float
    p_bias: float
    p_bias_rate: float
    innovation: float


class State(NamedTuple):
    """The attitude, bias (rad/s) and its rate in the sensor frame, P of each axis in radians, and health."""

    quat: Quat
    bias: Vec3
    bias_rate: Vec3
    roll: Mat3
    pitch: Mat3
    heading: Mat3
    health: int


@kernel
def diagonal(x: float, y: float, z: float) -> Mat3:
    """diag(x, y, z)"""
    return Mat3(x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z)


@kernel
def predict(params: BiasRateKalman, p: Mat3, dt: float, unit: float) -> Mat3:
    """P ← F P Fᵀ + Q of eq. 2; ``unit`` = (unit of the parameters in units of the level)²."""
    f = Mat3(1.0, -dt, -0.5 * dt * dt, 0.0, 1.0, dt, 0.0, 0.0, 1.0)
    share = unit * dt
    q = diagonal(params.q_angle * share, params.q_bias * share, params.q_bias_rate * share)
    return mat3.add(mat3.mul(mat3.mul(f, p), mat3.transpose(f)), q)


@kernel
def predict_turn(params: BiasRateKalman, p: Mat3, dt: float) -> Mat3:
    """``predict`` for an angle of an IMU: across a gap the angle is lost, and the bias is not run on."""
    if dt > GAP_SECONDS:
        bias = bias_after_gap(p.yy, params.q_bias * DEG2 * dt, params.p_bias * DEG2)
        bias_rate = bias_after_gap(p.zz, params.q_bias_rate * DEG2 * dt, params.p_bias_rate * DEG2)
        return diagonal(after_gap(p.xx, dt), bias, bias_rate)
    return predict(params, p, dt, DEG2)


@kernel
def gain(p: Mat3, r: float) -> Vec3:
    """K = P Hᵀ/S of eq. 3, for level, bias and bias rate."""
    s = p.xx + r
    return Vec3(p.xx / s, p.xy / s, p.xz / s)


@kernel
def correct(p: Mat3, k: Vec3) -> Mat3:
    """P − K Kᵀ S of eq. 3 = P − K H P."""
    xy = p.xy - k.x * p.xy
    xz = p.xz - k.x * p.xz
    yz = p.yz - k.y * p.xz
    return Mat3(p.xx - k.x * p.xx, xy, xz, xy, p.yy - k.y * p.xy, yz, xz, yz, p.zz - k.z * p.xz)


@kernel
def axis_init(params: BiasRateKalman, level: float) -> Axis:
    """Starts at the first measured level, without bias."""
    return Axis(
        level=level,
        rate=0.0,
        bias=0.0,
        bias_rate=0.0,
        innovation=0.0,
        p=diagonal(params.p_angle, params.p_bias, params.p_bias_rate),
    )


@kernel
def axis_step(params: BiasRateKalman, axis: Axis, level: float, rate: float, dt: float, period: float) -> Axis:
    """One sample of a level and its rate, in the unit of the parameters; the innovation is taken on the circle."""
    free = rate - axis.bias - 0.5 * dt * axis.bias_rate  # the bias runs on while it is subtracted
    ahead = wrap(axis.level + dt * free, period)
    p = predict(params, axis.p, dt, 1.0)
    k = gain(p, params.r_measure)
    innovation = wrap(level - ahead, period)
    return Axis(
        level=wrap(ahead + k.x * innovation, period),
        rate=free,
        bias=axis.bias + dt * axis.bias_rate + k.y * innovation,
        bias_rate=axis.bias_rate + k.z * innovation,
        innovation=innovation,
        p=correct(p, k),
    )


@kernel
def axis_read(axis: Axis) -> Report:
    """The estimates without the covariances between them."""
    return Report(
        level=axis.level,
        rate=axis.rate,
        bias=axis.bias,
        bias_rate=axis.bias_rate,
        p_level=axis.p.xx,
        p_bias=axis.p.yy,
        p_bias_rate=axis.p.zz,
        innovation=axis.innovation,
    )


@kernel
def init(params: BiasRateKalman, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample; a relative heading starts at 0 and is certain by definition."""
    p_bias = params.p_bias * DEG2
    p_bias_rate = params.p_bias_rate * DEG2
    tilted = diagonal(params.p_angle * DEG2, p_bias, p_bias_rate)
    headed = diagonal(params.r_heading * DEG2 if tilt.is_present(mag) else 0.0, p_bias, p_bias_rate)
    return State(
        quat=triad.initial_attitude(acc, mag),
        bias=ZERO,
        bias_rate=ZERO,
        roll=tilted,
        pitch=tilted,
        heading=headed,
        health=0,
    )


@kernel
def step(params: BiasRateKalman, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """Eqs. 1 to 3 on each axis; the attitude is turned as a whole, the bias is corrected in the sensor frame."""
    running = 0.0 if dt > GAP_SECONDS else dt
    mean_bias = add(state.bias, scale(state.bias_rate, 0.5 * running))
    attitude = quat.integrate(state.quat, sub(gyr, mean_bias), dt)
    up = quat.up(attitude)
    roll = predict_turn(params, state.roll, dt)
    pitch = predict_turn(params, state.pitch, dt)
    heading = predict_turn(params, state.heading, dt)
    bias = add(state.bias, scale(state.bias_rate, running))
    bias_rate = state.bias_rate
    health = 0
    if tilt.is_present(acc):
        k_pitch = gain(pitch, params.r_measure * DEG2)
        y_pitch = tilt.pitch_innovation(up, acc)
        pitch = correct(pitch, k_pitch)
        k_roll = Vec3(0.0, 0.0, 0.0)
        y_roll = 0.0
        if tilt.steep(acc):
            health = NEAR_VERTICAL
        else:
            k_roll = gain(roll, params.r_measure * DEG2 / tilt.roll_weight(up))
            y_roll = tilt.roll_innovation(up, acc)
            roll = correct(roll, k_roll)
        axis = tilt.pitch_axis(up)
        attitude = tilt.add_roll_pitch(attitude, axis, k_roll.x * y_roll, k_pitch.x * y_pitch)
        bias = add(bias, tilt.in_sensor(axis, k_roll.y * y_roll, k_pitch.y * y_pitch))
        bias_rate = add(bias_rate, tilt.in_sensor(axis, k_roll.z * y_roll, k_pitch.z * y_pitch))
    if tilt.is_present(mag) and health == 0:
        k_heading = gain(heading, params.r_heading * DEG2)
        y_heading = tilt.heading_innovation(attitude, mag)
        heading = correct(heading, k_heading)
        attitude = tilt.add_yaw(attitude, k_heading.x * y_heading)
        bias = add(bias, scale(up, k_heading.y * y_heading))
        bias_rate = add(bias_rate, scale(up, k_heading.z * y_heading))
    return State(quat=attitude, bias=bias, bias_rate=bias_rate, roll=roll, pitch=pitch, heading=heading, health=health)


@kernel
def inflate_angle(p: Mat3, variance: float) -> Mat3:
    """An angle less certain, without its correlation with the bias and its rate."""
    return Mat3(p.xx + variance, 0.0, 0.0, 0.0, p.yy, p.yz, 0.0, p.zy, p.zz)


@kernel
def inflate(params: BiasRateKalman, state: State, variance: float) -> State:
    """Every axis less sure."""
    attitude, bias, rate = state.quat, state.bias, state.bias_rate
    roll, pitch, heading = state.roll, state.pitch, state.heading
    health = state.health
    roll = inflate_angle(roll, variance)
    pitch = inflate_angle(pitch, variance)
    heading = inflate_angle(heading, variance)
    return State(quat=attitude, bias=bias, bias_rate=rate, roll=roll, pitch=pitch, heading=heading, health=health)


@kernel
def output(params: BiasRateKalman, state: State) -> Output:
    """Attitude, bias, σ and health."""
    return Output(
        quat=state.quat,
        bias=state.bias,
        sigma=earth_sigma(state.roll.xx, state.pitch.xx, state.heading.xx, state.quat),
        health=state.health,
    )


FILTER = Filter(
    name="BiasRateKalman",
    params=BiasRateKalman,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "heading", "bias", "sigma"}),
    uses=frozenset({"gyr", "acc", "mag"}),
    citation="Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, "
    "section 6.3 (the same model for a range, its rate and acceleration)",
    inflation=Inflation(inflate),
    settles=Settling(10.0, 60.0),
    axis=AxisFilter(init=axis_init, step=axis_step, read=axis_read, report=Report),
)
