"""Mahony: the explicit complementary filter, a PI controller that pulls the attitude towards the measured directions.

Unit vectors v_i as measured and v̂_i = R̂ᵀ v₀ᵢ as the attitude expects them, all in the sensor frame:

    ω_mes = Σ k_i v_i × v̂_i                                                                                     (1)
    q̂' = ½ q̂ ⊗ (Ω − b̂ + k_P ω_mes)                                                                            (2)
    b̂' = −k_I ω_mes                                                                                             (3)

(R. Mahony, T. Hamel, J.-M. Pflimlin, 2008, eqs. 32a to 32c as quaternions.) Here v₁ is the specific force with k₁ = 1
and v₀₁ = up; v₂ is the horizontal part of the magnetic field with k₂ = k_mag and v₀₂ = north, so that

    v₂ × v̂₂ = sin δ · up,   sin δ = h_x/√(h_x² + h_y²),   h = R̂ m                                              (4)

where δ is how far the field misses north: a magnet turns heading, never the horizon. With ``whole_field`` v₂ is the
whole field and v₀₂ = (0, √(h_x² + h_y²), h_z), as in most programs.

In discrete time the attitude first turns with the gyroscope, exactly, and then by the share of ω_mes that a first-order
low-pass of the same corner takes, so that no interval is too long:

    ρ = K v₁ × v̂₁ + K₂ v₂ × v̂₂,   K = dt/(1/k_P + dt),   K₂ = dt/(1/(k_P k_mag) + dt)                           (5)

While the filter is younger than those time constants K and K₂ are those of a running mean, and the bias waits: the
correction is then due to the start's error, not the gyroscope's. Against wind-up every axis of the bias stays within
±max_bias, and from a pull that such a bias could not cause nothing is learned:

    k_P k_i |v_i × v̂_i| < max_bias                                                                            (6)
"""

from typing import Annotated, NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import Filter, Gains, Inflation, Settling
from levelhead.filters.direction_filter import DIP_SHARE, State, inflate, init, integrate, output
from levelhead.filters.parameters import Param, nonnegative, parameters, positive
from levelhead.kernels import quat, tilt
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.lowpass import advance_age, lowpass_weight
from levelhead.kernels.vec3 import ZERO, Vec3, normalize
from levelhead.kernels.vector_error import correct, direction_error, field_error, heading_error
from levelhead.units import DEGREE


@parameters()
class Mahony(NamedTuple):
    """Explicit complementary filter: proportional and integral feedback of cross products."""

    kp: Annotated[float, positive("1/s", "proportional gain towards gravity", 0.03, 3.0)] = 0.4
    ki: Annotated[float, Param("1/s²", "integral gain, for bias", low=0, high=1, sweep=(1e-4, 0.1), log=True)] = 0.003
    k_mag: Annotated[float, positive("", "weight of the magnetometer, 1 for the accelerometer", 0.03, 3.0)] = 0.5
    max_bias: Annotated[float, nonnegative("deg/s", "largest bias that is learned, per axis", 0.5, 30.0)] = 5.7
    whole_field: Annotated[bool, Param("", "compare the whole field; tilt follows it too")] = False


@kernel
def update_bias(params: Mahony, bias: Vec3, tilt_error: Vec3, yaw_error: Vec3, age: float, dt: float) -> Vec3:
    """Eq. 3, bounded by (6); each vector waits until its K is steady."""
    kp = params.kp
    k_mag = params.k_mag
    limit = params.max_bias * DEGREE
    step = params.ki * dt
    x, y, z = bias
    px, py, pz = tilt_error
    if has_elapsed(age, dt, 1.0 / kp) and kp * kp * (px * px + py * py + pz * pz) < limit * limit:
        x -= step * px
        y -= step * py
        z -= step * pz
    px, py, pz = yaw_error
    if (
        has_elapsed(age, dt, 1.0 / (kp * k_mag))
        and kp * kp * k_mag * k_mag * (px * px + py * py + pz * pz) < limit * limit
    ):
        step *= k_mag
        x -= step * px
        y -= step * py
        z -= step * pz
    if x * x + y * y + z * z > limit * limit:  # one of them may be beyond
        return Vec3(max(-limit, min(x, limit)), max(-limit, min(y, limit)), max(-limit, min(z, limit)))
    return Vec3(x, y, z)


@kernel
def step(params: Mahony, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """Eqs. 1 to 5."""
    attitude = integrate(state, gyr, dt)
    age = advance_age(state.age, dt)
    up = quat.up(attitude)
    tilt_error = direction_error(normalize(acc), up)
    kt = lowpass_weight(1.0 / params.kp, age, dt)
    yaw_error = ZERO
    if tilt.is_present(mag):
        kh = lowpass_weight(1.0 / (params.kp * params.k_mag), age, dt)
        if params.whole_field:
            yaw_error = field_error(attitude, mag)
            kt = min(kt, 1.0 / (1.0 + params.k_mag))  # two vectors may pull the same way: K Σ k_i ≤ 1
            kh = kt * params.k_mag
        else:
            yaw_error = heading_error(attitude, up, mag)
        rotation = Vec3(
            kt * tilt_error.x + kh * yaw_error.x,
            kt * tilt_error.y + kh * yaw_error.y,
            kt * tilt_error.z + kh * yaw_error.z,
        )
    else:
        rotation = Vec3(kt * tilt_error.x, kt * tilt_error.y, kt * tilt_error.z)
    return State(correct(attitude, rotation), update_bias(params, state.bias, tilt_error, yaw_error, age, dt), age)


@kernel
def gains(params: Mahony, state: State, dt: float) -> Gains:
    """K, K₂ of eq. 5 and k_I dt of eq. 3, for a state after its sample."""
    kt = lowpass_weight(1.0 / params.kp, state.age, dt)
    kh = lowpass_weight(1.0 / (params.kp * params.k_mag), state.age, dt)
    bt = params.ki * dt if has_elapsed(state.age, dt, 1.0 / params.kp) else 0.0
    bh = params.ki * params.k_mag * dt if has_elapsed(state.age, dt, 1.0 / (params.kp * params.k_mag)) else 0.0
    if params.whole_field:
        kt = min(kt, 1.0 / (1.0 + params.k_mag))
        return Gains(tilt=kt, tilt_bias=bt, heading=DIP_SHARE * kt * params.k_mag, heading_bias=DIP_SHARE * bh)
    return Gains(tilt=kt, tilt_bias=bt, heading=kh, heading_bias=bh)


FILTER = Filter(
    name="Mahony",
    params=Mahony,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "heading", "bias"}),
    uses=frozenset({"gyr", "acc", "mag"}),
    citation="R. Mahony, T. Hamel, J.-M. Pflimlin, Nonlinear Complementary Filters on the Special Orthogonal Group, "
    "IEEE Transactions on Automatic Control 53(5), 2008, eqs. 32a to 32c",
    settles=Settling(15.0, 35.0),
    gains=gains,
    inflation=Inflation(inflate),
)
