"""BiasRateKalman: angle, bias and bias rate, for a gyroscope whose bias runs with temperature.

State x = (angle, bias, bias rate), measurement z = angle + noise of variance r:

    F = [[1, −dt, −dt²/2], [0, 1, dt], [0, 0, 1]],   Q = diag(q_angle, q_bias, q_bias_rate)·dt                  (1)
    angle ← angle + dt (rate − bias) − dt²/2 · bias rate,   bias ← bias + dt · bias rate,   P ← F P Fᵀ + Q      (2)
    S = P₀₀ + r,   K = P Hᵀ/S,   x ← x + K (z − angle),   P ← P − K Kᵀ S   (symmetric by construction)          (3)

A Kalman filter with bias alone lags behind a ramp of the bias for ever; this one does not.
"""

from typing import Annotated, NamedTuple

from levelhead.filters.contract import AxisFilter, Filter, Output, Param, parameters
from levelhead.filters.health import NEAR_VERTICAL
from levelhead.filters.kalman import DEG2, earth_sigma
from levelhead.kernels import mat3, quat, tilt
from levelhead.kernels.angle import ON_A_LINE, wrap
from levelhead.kernels.jit import kernel
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import ZERO, Vec3, add, scale, sub


@parameters()
class BiasRateKalman(NamedTuple):
    """Three-state Kalman filter (angle, bias, bias rate), per axis; variances in degrees when it runs on an IMU."""

    q_angle: Annotated[
        float, Param("deg²/s", "process noise density of the angle", low=0.0, sweep=(1e-5, 1.0), log=True)
    ] = 0.001
    q_bias: Annotated[
        float, Param("(deg/s)²/s", "process noise density of the bias", low=0.0, sweep=(1e-6, 1.0), log=True)
    ] = 0.003
    q_bias_rate: Annotated[
        float, Param("(deg/s²)²/s", "process noise density of the bias rate", low=0.0, sweep=(1e-10, 1e-2), log=True)
    ] = 1e-7
    r_measure: Annotated[
        float, Param("deg²", "variance of the measured angle", low=0.0, low_open=True, sweep=(0.1, 100.0), log=True)
    ] = 1.0
    r_heading: Annotated[
        float,
        Param("deg²", "variance of the magnetometer's heading", low=0.0, low_open=True, sweep=(0.1, 1e4), log=True),
    ] = 9.0
    p_angle: Annotated[float, Param("deg²", "variance of the first angle", low=0.0, sweep=(0.01, 100.0), log=True)] = (
        1.0
    )
    p_bias: Annotated[
        float, Param("(deg/s)²", "variance of the bias at the start", low=0.0, sweep=(0.01, 100.0), log=True)
    ] = 1.0
    p_bias_rate: Annotated[
        float, Param("(deg/s²)²", "variance of the bias rate at the start", low=0.0, sweep=(1e-6, 1.0), log=True)
    ] = 1e-4


class Axis(NamedTuple):
    """One axis: level, bias-free rate, bias, bias rate and the covariance of (level, bias, bias rate)."""

    level: float
    rate: float
    bias: float
    bias_rate: float
    innovation: float
    p: Mat3


class Report(NamedTuple):
    """What one axis tells: estimates, variances (diagonal of P) and innovation."""

    level: float
    rate: float
    bias: float
    bias_rate: float
    p_level: float
    p_bias: float
    p_bias_rate: float
    innovation: float


class State(NamedTuple):
    """The attitude, bias (rad/s) and its rate in the sensor frame, each axis relative to these, in radians, health."""

    quat: Quat
    bias: Vec3
    bias_rate: Vec3
    roll: Axis
    pitch: Axis
    heading: Axis
    health: int


@kernel
def begin(params: BiasRateKalman, level: float, p_level: float, unit: float) -> Axis:
    """The first level, no bias; ``unit`` = (unit of the parameters in units of the level)²."""
    p = Mat3(p_level, 0.0, 0.0, 0.0, params.p_bias * unit, 0.0, 0.0, 0.0, params.p_bias_rate * unit)
    return Axis(level, 0.0, 0.0, 0.0, 0.0, p)


@kernel
def predict(params: BiasRateKalman, axis: Axis, level: float, rate: float, dt: float, unit: float) -> Axis:
    """Eq. 2; ``level`` is the level after dt at the bias-free ``rate``."""
    f = Mat3(1.0, -dt, -0.5 * dt * dt, 0.0, 1.0, dt, 0.0, 0.0, 1.0)
    share = unit * dt
    q = Mat3(params.q_angle * share, 0.0, 0.0, 0.0, params.q_bias * share, 0.0, 0.0, 0.0, params.q_bias_rate * share)
    p = mat3.add(mat3.mul(mat3.mul(f, axis.p), mat3.transpose(f)), q)
    return Axis(level, rate, axis.bias + dt * axis.bias_rate, axis.bias_rate, 0.0, p)


@kernel
def correct(axis: Axis, level: float, r: float, period: float) -> Axis:
    """Eq. 3 with the measured ``level``, on the circle of ``period``."""
    p = axis.p
    s = p.xx + r
    k0 = p.xx / s
    k1 = p.xy / s
    k2 = p.xz / s
    xy = p.xy - k0 * p.xy
    xz = p.xz - k0 * p.xz
    yz = p.yz - k1 * p.xz
    innovation = wrap(level - axis.level, period)
    return Axis(
        wrap(axis.level + k0 * innovation, period),
        axis.rate,
        axis.bias + k1 * innovation,
        axis.bias_rate + k2 * innovation,
        innovation,
        Mat3(p.xx - k0 * p.xx, xy, xz, xy, p.yy - k1 * p.xy, yz, xz, yz, p.zz - k2 * p.xz),
    )


@kernel
def free_rate(axis: Axis, rate: float, dt: float) -> float:
    """The mean bias-free rate over dt: the bias runs on while it is subtracted (eq. 2)."""
    return rate - axis.bias - 0.5 * dt * axis.bias_rate


@kernel
def axis_init(params: BiasRateKalman, level: float) -> Axis:
    """Starts at the first measured level."""
    return begin(params, level, params.p_angle, 1.0)


@kernel
def axis_step(params: BiasRateKalman, axis: Axis, level: float, rate: float, dt: float, period: float) -> Axis:
    """One sample of a level and its rate, in the unit of the parameters."""
    free = free_rate(axis, rate, dt)
    ahead = predict(params, axis, wrap(axis.level + dt * free, period), free, dt, 1.0)
    return correct(ahead, level, params.r_measure, period)


@kernel
def axis_read(axis: Axis) -> Report:
    """The estimates without the covariances between them."""
    return Report(axis.level, axis.rate, axis.bias, axis.bias_rate, axis.p.xx, axis.p.yy, axis.p.zz, axis.innovation)


@kernel
def begin_again(axis: Axis) -> Axis:
    """The axis with bias and bias rate counted from zero again."""
    return Axis(axis.level, axis.rate, 0.0, 0.0, axis.innovation, axis.p)


@kernel
def init(params: BiasRateKalman, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample; a relative heading starts at 0 and is certain by definition."""
    euler = tilt.compass(acc, mag)
    p_angle = params.p_angle * DEG2
    p_heading = params.r_heading * DEG2 if tilt.present(mag) else 0.0
    return State(
        quat.from_euler(euler),
        ZERO,
        ZERO,
        begin(params, 0.0, p_angle, DEG2),
        begin(params, 0.0, p_angle, DEG2),
        begin(params, 0.0, p_heading, DEG2),
        0,
    )


@kernel
def step(params: BiasRateKalman, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """Eqs. 1 to 3 on each axis; the attitude is turned as a whole, and what is learned is added in the sensor frame."""
    mean_bias = add(state.bias, scale(state.bias_rate, 0.5 * dt))
    attitude = quat.integrate(state.quat, sub(gyr, mean_bias), dt)
    up = quat.up(attitude)
    roll = predict(params, begin_again(state.roll), 0.0, 0.0, dt, DEG2)
    pitch = predict(params, begin_again(state.pitch), 0.0, 0.0, dt, DEG2)
    heading = predict(params, begin_again(state.heading), 0.0, 0.0, dt, DEG2)
    health = 0
    if tilt.present(acc):
        pitch = correct(pitch, tilt.pitch_innovation(up, acc), params.r_measure * DEG2, ON_A_LINE)
        if tilt.steep(acc):
            health = NEAR_VERTICAL
        else:
            r_roll = params.r_measure * DEG2 / tilt.roll_weight(up)
            roll = correct(roll, tilt.roll_innovation(up, acc), r_roll, ON_A_LINE)
        attitude = tilt.add_roll_pitch(attitude, up, roll.level, pitch.level)
    if tilt.present(mag) and health == 0:
        heading = correct(heading, tilt.heading_innovation(attitude, mag), params.r_heading * DEG2, ON_A_LINE)
        attitude = tilt.add_yaw(attitude, heading.level)
    bias = add(state.bias, scale(state.bias_rate, dt))
    learned = tilt.in_sensor(up, roll.bias, pitch.bias, heading.bias)
    learned_rate = tilt.in_sensor(up, roll.bias_rate, pitch.bias_rate, heading.bias_rate)
    return State(attitude, add(bias, learned), add(state.bias_rate, learned_rate), roll, pitch, heading, health)


@kernel
def output(params: BiasRateKalman, state: State) -> Output:
    """Attitude, bias per sensor axis, σ and health."""
    return Output(
        state.quat,
        state.bias,
        earth_sigma(state.roll.p.xx, state.pitch.p.xx, state.heading.p.xx, state.quat),
        state.health,
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
    axis=AxisFilter(axis_init, axis_step, axis_read, Report),
)
