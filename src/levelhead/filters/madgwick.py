"""Madgwick: gradient descent, at a set speed, to the attitude in which earth's vectors lie where the sensor sees them.

With unit vectors d of the earth and s of the sensor (equation numbers of the report; its R(q)ᵀ has 2(½ − q₃² − q₄²)):

    f(q, d, s) = R(q)ᵀ d − s,   ∇f = Jᵀ f                                                          (20), (21), (22)
    gravity    f_g, J_g: d = (0, 0, 1) up, s the specific force                                          (25), (26)
    field      f_b, J_b: d = (0, b_y, b_z), s the magnetic field                                         (29), (30)
    q' = ½ q ⊗ ω − β ∇f/|∇f|                                                                             (42), (43)
    h = R(q) m,   b = (0, √(h_x² + h_y²), h_z)                                                           (45), (46)
    ω_ε = 2 q* ⊗ ∇f/|∇f|,   ω_b = ζ Σ ω_ε dt,   ω_c = ω − ω_b                                    (47), (48), (49)

The field's reference is formed anew from every sample, so that magnets turn heading and hardly tilt. With both sensors
f and J are stacked, which adds the gradients. They need no matrices: with ŝ = R(q)ᵀ d, for |q| = |d| = |s| = 1,

    Jᵀ f = q ⊗ (2 (ŝ − s)·(ŝ − d), 2 ŝ × s)                                                                     (A)

exactly. The scalar part only changes the length of q, which is normalised away; it counts in |∇f|. Hence a step of (43)
turns by the rotation vector

    ρ = k Σ s × ŝ,   k = 4 β dt/|∇f|                                                                            (B)

A step of fixed length jumps to and fro about the minimum, so k is at most 1/n with n sensors. That is one over the
largest curvature of Σ ½|ŝ − s|² over ρ, and never leads uphill. Beyond a right angle (A) fades though the error grows,
and with both sensors there are false minima. While up is wrong by that much, gravity alone pulls, with a unit vector: a
field does not show north while the estimate of up points down. While north is, the field pulls about the vertical, with
a unit vector.

The gradient is taken at the attitude that the gyroscope predicts. The report takes it at the attitude of the sample
before, ω dt behind the measurement: at 100 Hz and 5 rad/s it would pull 3° back for ever.
"""

from math import sqrt
from typing import Annotated, NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import Filter, Gains, Inflation, Settling
from levelhead.filters.direction_filter import DIP_SHARE, State, inflate, init, integrate, output
from levelhead.filters.parameters import nonnegative, parameters, positive
from levelhead.kernels import quat, tilt
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.lowpass import advance_age, lowpass_weight
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import ZERO, Vec3, add, dot, normalize, scale
from levelhead.kernels.vector_error import correct, direction_error, heading_error

START = 3.0  # s: until then a step is at least that of a mean over all samples since the start
BIAS_LIMIT = 0.35  # rad/s, 20 °/s: the zero-rate tolerance of the worst consumer gyroscopes
NOISE = 0.1  # rad, 1σ per axis of measured directions, for `gains`: a hand that accelerates by 1 m/s²
SLOPE = 0.6267  # √(π/8): d E[unit vector of (x + n)]/dx at x = 0 is that over σ for n ~ N(0, σ²) in two dimensions
FLAT = 1e-30  # |∇f|² below which there is no direction to go


@parameters()
class Madgwick(NamedTuple):
    """Gradient descent orientation filter: one gain, by how much the gyroscope may be contradicted (eqs. 50, 51)."""

    beta: Annotated[float, positive("rad/s", "gain: √¾ × the gyroscope's error", 0.01, 1.0)] = 0.075
    zeta: Annotated[float, nonnegative("rad/s²", "bias gain: √¾ × how fast the bias drifts", 0.0001, 0.1)] = 0.0


class Slope(NamedTuple):
    """Of the objective."""

    error: Vec3  # Σ s × ŝ, in the sensor frame
    scalar: float  # half the scalar part of (A)


@kernel
def slope(seen: Vec3, expected: Vec3, earth: Vec3) -> Slope:
    """(A) for one sensor: s, ŝ and d, unit vectors."""
    sx, sy, sz = seen
    ex, ey, ez = expected
    dx, dy, dz = earth
    return Slope(
        Vec3(sy * ez - sz * ey, sz * ex - sx * ez, sx * ey - sy * ex),
        (ex - sx) * (ex - dx) + (ey - sy) * (ey - dy) + (ez - sz) * (ez - dz),
    )


@kernel
def descent_direction(attitude: Quat, acc: Vec3, mag: Vec3) -> Slope:
    """(A) summed over gravity (25), (26) and field (29), (30); an absent sensor adds nothing."""
    total = Slope(ZERO, 0.0)
    if tilt.is_present(acc):
        force = normalize(acc)
        up = quat.up(attitude)
        total = slope(force, up, Vec3(0.0, 0.0, 1.0))
        if dot(force, up) < 0.0:
            return Slope(direction_error(force, up), 0.0)
    if tilt.is_present(mag):
        seen = normalize(mag)
        h = quat.rotate(attitude, seen)
        if h.y < 0.0:
            return Slope(add(total.error, heading_error(attitude, quat.up(attitude), seen)), total.scalar)
        earth = Vec3(0.0, sqrt(h.x * h.x + h.y * h.y), h.z)
        down = slope(seen, quat.rotate(quat.conjugate(attitude), earth), earth)
        return Slope(add(total.error, down.error), total.scalar + down.scalar)
    return total


@kernel
def descent(params: Madgwick, slope: Slope, sensors: float, dt: float) -> float:
    """k of (B), bounded."""
    x, y, z = slope.error
    scalar = slope.scalar
    square = 4.0 * (x * x + y * y + z * z + scalar * scalar)
    if square < FLAT:
        return 0.0
    return min(4.0 * params.beta * dt / sqrt(square), 1.0 / sensors)


@kernel
def update_bias(params: Madgwick, bias: Vec3, slope: Slope, k: float) -> Vec3:
    """(47) and (48), as far as the step goes: ζ ω_ε dt = −(ζ/β) k Σ s × ŝ; within ±BIAS_LIMIT per axis."""
    step = params.zeta / params.beta * k
    return Vec3(
        max(-BIAS_LIMIT, min(bias.x - step * slope.error.x, BIAS_LIMIT)),
        max(-BIAS_LIMIT, min(bias.y - step * slope.error.y, BIAS_LIMIT)),
        max(-BIAS_LIMIT, min(bias.z - step * slope.error.z, BIAS_LIMIT)),
    )


@kernel
def step(params: Madgwick, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """(49), the gyroscope's turn, then (B); the bias waits until the start's error is gone."""
    bias = state.bias
    attitude = integrate(state, gyr, dt)
    age = advance_age(state.age, dt)
    down = descent_direction(attitude, acc, mag)
    sensors = 2.0 if tilt.is_present(mag) else 1.0
    k = descent(params, down, sensors, dt)
    if not has_elapsed(age, dt, START):
        k = max(k, min(lowpass_weight(START, age, dt), 1.0 / sensors))
    elif params.zeta > 0.0:
        bias = update_bias(params, bias, down, k)
    return State(correct(attitude, scale(down.error, k)), bias, age)


@kernel
def gains(params: Madgwick, state: State, dt: float) -> Gains:
    """The mean share of an innovation that a normalised step corrects, for a state after its sample.

    Its direction is mostly noise: of a small innovation x the mean of the unit vector along x + noise is √(π/8) x/σ, so
    that the share is 2 β dt √(π/8)/σ (the describing function of a two-dimensional relay), with σ = NOISE. Heading
    is seen through the field's horizontal part: cos² of its dip.
    """
    share_of_noise = 2.0 * params.beta * dt * SLOPE / NOISE
    k = min(share_of_noise, 1.0)
    bias = 0.0
    if not has_elapsed(state.age, dt, START):
        k = max(k, lowpass_weight(START, state.age, dt))
    else:
        bias = params.zeta / params.beta * k
    return Gains(tilt=k, tilt_bias=bias, heading=DIP_SHARE * k, heading_bias=DIP_SHARE * bias)


FILTER = Filter(
    name="Madgwick",
    params=Madgwick,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "heading"}),
    uses=frozenset({"gyr", "acc", "mag"}),
    citation="S. O. H. Madgwick, An efficient orientation filter for inertial and inertial/magnetic sensor arrays, "
    "internal report, University of Bristol, 2010",
    settles=Settling(50.0, 52.0),
    gains=gains,
    inflation=Inflation(inflate),
)
