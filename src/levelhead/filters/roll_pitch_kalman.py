"""RollPitchKalman: roll, pitch and two gyroscope biases in one extended Kalman filter.

State x = (φ, θ, b_x, b_y). With p = ω_x − b_x, q = ω_y − b_y, r = ω_z, the Euler kinematics are (Titterton & Weston,
2nd ed., eq. 3.51)

    φ' = p + (q sin φ + r cos φ) tan θ,   θ' = q cos φ − r sin φ                                                 (1)

so that F = [[A, B], [0, I]] with

    A = I + dt [[(q cos φ − r sin φ) tan θ, (q sin φ + r cos φ)/cos² θ], [−q sin φ − r cos φ, 0]]                (2)
    B = −dt [[1, sin φ tan θ], [0, cos φ]]                                                                       (3)

and the covariance in 2×2 blocks P = [[P_a, C], [Cᵀ, P_b]] is propagated by

    P_a ← A P_a Aᵀ + A C Bᵀ + B Cᵀ Aᵀ + B P_b Bᵀ + q_angle dt I                                                  (4)
    C ← A C + B P_b,   P_b ← P_b + q_bias dt I                                                                   (5)

The accelerometer measures φ and θ: S = P_a + R, K_a = P_a S⁻¹, K_b = Cᵀ S⁻¹, P ← P − K S Kᵀ, with
R = r_measure·diag(1/cos² θ, 1), because a given acceleration error turns roll the more the steeper the pitch.       (6)

Unlike two filters side by side this one models that the biases of both axes act on roll as soon as the sensor is
pitched. Its limit is the same: (1) divides by cos θ. Beyond 78° of pitch roll is not corrected, the divisor is held at
cos 85°, and ``health`` has a bit for it; use a quaternion filter for motion near it. Yaw is the integrated rate.
"""

from math import inf, sqrt
from typing import Annotated, NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import Filter, Inflation, Output, Settling
from levelhead.filters.health import NEAR_VERTICAL
from levelhead.filters.kalman import DEG2, earth_sigma
from levelhead.filters.parameters import nonnegative, parameters, positive
from levelhead.kernels import mat2, quat, tilt, triad
from levelhead.kernels.mat2 import Mat2, Vec2
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GAP_SECONDS, after_gap, bias_after_gap
from levelhead.kernels.vec3 import Vec3


@parameters()
class RollPitchKalman(NamedTuple):
    """Four-state extended Kalman filter (roll, pitch, two biases) for pitch well inside ±90°."""

    q_angle: Annotated[float, nonnegative("deg²/s", "process noise density of the angles", 1e-05, 1.0)] = 0.001
    q_bias: Annotated[float, nonnegative("(deg/s)²/s", "process noise density of the biases", 1e-06, 1.0)] = 1e-4
    r_measure: Annotated[float, positive("deg²", "variance of the measured angles", 0.1, 1000.0)] = 4.0
    p_angle: Annotated[float, nonnegative("deg²", "variance of the first angles", 0.01, 100.0)] = 1.0
    p_bias: Annotated[float, nonnegative("(deg/s)²", "variance of the biases at the start", 0.01, 100.0)] = 1.0


class State(NamedTuple):
    """The attitude, biases (rad/s), covariance blocks, seconds that yaw has coasted, and health."""

    quat: Quat
    bias: Vec2
    angles: Mat2
    cross: Mat2
    biases: Mat2
    coasted: float
    health: int


@kernel
def diagonal(x: float, y: float) -> Mat2:
    """diag(x, y)"""
    return Mat2(x, 0.0, 0.0, y)


@kernel
def symmetric(m: Mat2) -> Mat2:
    """(M + Mᵀ)/2: rounding must not make a covariance lopsided."""
    mean = 0.5 * (m.xy + m.yx)
    return Mat2(m.xx, mean, mean, m.yy)


@kernel
def init(params: RollPitchKalman, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample, no bias."""
    p_angle = params.p_angle * DEG2
    p_bias = params.p_bias * DEG2
    return State(
        quat=triad.initial_attitude(acc, mag),
        bias=Vec2(0.0, 0.0),
        angles=diagonal(p_angle, p_angle),
        cross=diagonal(0.0, 0.0),
        biases=diagonal(p_bias, p_bias),
        coasted=0.0,
        health=0,
    )


@kernel
def predict(params: RollPitchKalman, state: State, gyr: Vec3, dt: float) -> State:
    """Eqs. 1 to 5; the attitude itself is turned exactly, through the quaternion."""
    p = gyr.x - state.bias.x
    q = gyr.y - state.bias.y
    r = gyr.z
    up = quat.up(state.quat)
    cp = sqrt(tilt.roll_weight(up))
    sr = up.y / cp
    cr = up.z / cp
    tp = -up.x / cp
    a = Mat2(1.0 + dt * (q * cr - r * sr) * tp, dt * (q * sr + r * cr) / (cp * cp), -dt * (q * sr + r * cr), 1.0)
    b = Mat2(-dt, -dt * sr * tp, 0.0, -dt * cr)
    acb = mat2.mul(mat2.mul(a, state.cross), mat2.transpose(b))
    q_angle = params.q_angle * DEG2 * dt
    q_bias = params.q_bias * DEG2 * dt
    biases = mat2.add(state.biases, diagonal(q_bias, q_bias))
    attitude = quat.integrate(state.quat, Vec3(p, q, r), dt)
    if dt > GAP_SECONDS:  # the angles are lost, and show nothing of the biases afterwards
        lost = diagonal(after_gap(state.angles.xx, dt), after_gap(state.angles.yy, dt))
        known = diagonal(
            bias_after_gap(state.biases.xx, q_bias, params.p_bias * DEG2),
            bias_after_gap(state.biases.yy, q_bias, params.p_bias * DEG2),
        )
        return State(
            quat=attitude,
            bias=state.bias,
            angles=lost,
            cross=diagonal(0.0, 0.0),
            biases=known,
            coasted=state.coasted + dt,
            health=0,
        )
    angles = mat2.add(
        mat2.add(mat2.mul(mat2.mul(a, state.angles), mat2.transpose(a)), mat2.add(acb, mat2.transpose(acb))),
        mat2.add(mat2.mul(mat2.mul(b, state.biases), mat2.transpose(b)), diagonal(q_angle, q_angle)),
    )
    return State(
        quat=attitude,
        bias=state.bias,
        angles=symmetric(angles),
        cross=mat2.add(mat2.mul(a, state.cross), mat2.mul(b, state.biases)),
        biases=biases,
        coasted=state.coasted + dt,
        health=0,
    )


@kernel
def correct(state: State, acc: Vec3, r: float) -> State:
    """Eq. 6 with the accelerometer's roll and pitch, unless the roll axis is nearly vertical; then a health bit."""
    up = quat.up(state.quat)
    s = mat2.inverse(mat2.add(state.angles, diagonal(r / tilt.roll_weight(up), r)))
    if tilt.steep(acc) or not s.ok:
        return State(
            quat=state.quat,
            bias=state.bias,
            angles=state.angles,
            cross=state.cross,
            biases=state.biases,
            coasted=state.coasted,
            health=NEAR_VERTICAL,
        )
    gain_a = mat2.mul(state.angles, s.matrix)
    gain_b = mat2.mul(mat2.transpose(state.cross), s.matrix)
    innovation = Vec2(tilt.roll_innovation(up, acc), tilt.pitch_innovation(up, acc))
    turn = mat2.apply(gain_a, innovation)
    bias = mat2.apply(gain_b, innovation)
    return State(
        quat=tilt.add_roll_pitch(state.quat, tilt.pitch_axis(up), turn.x, turn.y),
        bias=Vec2(state.bias.x + bias.x, state.bias.y + bias.y),
        angles=symmetric(mat2.sub(state.angles, mat2.mul(gain_a, state.angles))),
        cross=mat2.sub(state.cross, mat2.mul(gain_a, state.cross)),
        biases=symmetric(mat2.sub(state.biases, mat2.mul(gain_b, state.cross))),
        coasted=state.coasted,
        health=state.health,
    )


@kernel
def step(params: RollPitchKalman, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """Predict, then correct by the accelerometer if there is one."""
    ahead = predict(params, state, gyr, dt)
    if tilt.is_present(acc):
        return correct(ahead, acc, params.r_measure * DEG2)
    return ahead


@kernel
def inflate(params: RollPitchKalman, state: State, variance: float) -> State:
    """Both angles less certain, without their correlation with the biases."""
    attitude, bias, biases = state.quat, state.bias, state.biases
    coasted, health = state.coasted, state.health
    xx, xy, yx, yy = state.angles
    angles = Mat2(xx + variance, xy, yx, yy + variance)
    return State(
        quat=attitude,
        bias=bias,
        angles=angles,
        cross=Mat2(0.0, 0.0, 0.0, 0.0),
        biases=biases,
        coasted=coasted,
        health=health,
    )


@kernel
def output(params: RollPitchKalman, state: State) -> Output:
    """Attitude, the two biases, σ and health; nothing measures yaw's bias, so its variance is p_bias t² + q_angle t."""
    p_yaw = (params.p_bias * state.coasted + params.q_angle) * state.coasted * DEG2
    return Output(
        quat=state.quat,
        bias=Vec3(state.bias.x, state.bias.y, 0.0),
        sigma=earth_sigma(state.angles.xx, state.angles.yy, p_yaw, state.quat),
        health=state.health,
    )


FILTER = Filter(
    name="RollPitchKalman",
    params=RollPitchKalman,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "bias", "sigma"}),
    uses=frozenset({"gyr", "acc"}),
    citation="D. Simon, Optimal State Estimation, 2006, section 13.2.3 (the extended Kalman filter), with the Euler "
    "kinematics of D. Titterton and J. Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, eq. 3.51",
    inflation=Inflation(inflate),
    settles=Settling(10.0, inf),
)
