"""The measurements of ``EKF``, eq. 6 of the package: tilt by specific force, heading by the field."""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.mekf.covariance import Correction, Cov, inflate_attitude, update
from levelhead.filters.mekf.params import EKF
from levelhead.kernels import quat, tilt
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.lowpass import lowpass_weight
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import ZERO, Vec3
from levelhead.units import DEGREE, GRAVITY

PER_G = 1.0 / GRAVITY
HALF_PER_G2 = 0.5 / (GRAVITY * GRAVITY)
LONGEST_INTERVAL = 0.1  # s: samples further apart than this count as one measurement each, not more
LINEAR = 0.04  # squared tangent of the angle up to which a sine is its angle


class Sums(NamedTuple):
    """Sums over the samples since the last correction."""

    time: float  # s
    int_rate2: float  # ∫ |rate|² dt, rad²/s
    acc_time: float  # s for which there were accelerometer readings
    int_deviation2: float  # ∫ (|a|/g − 1)² dt over this time, s
    east: float  # sum of the magnetometer's readings in the earth frame, µT
    north: float


class Gated(NamedTuple):
    """The correction after a measurement, and for how long (s) the measurement has been rejected; 0: it is accepted."""

    correction: Correction
    rejected: float


NO_SAMPLES = Sums(time=0.0, int_rate2=0.0, acc_time=0.0, int_deviation2=0.0, east=0.0, north=0.0)


@kernel
def add_sample(sums: Sums, attitude: Quat, rate: Vec3, acc: Vec3, mag: Vec3, dt: float) -> Sums:
    """Adds one sample of ``dt`` seconds."""
    acc_time, int_deviation2 = sums.acc_time, sums.int_deviation2
    east, north = sums.east, sums.north
    if tilt.is_present(acc):
        x, y, z = acc
        off = HALF_PER_G2 * (x * x + y * y + z * z) - 0.5  # |a|/g − 1 to first order
        acc_time += dt
        int_deviation2 += off * off * dt
    if tilt.is_present(mag):
        x, y, z = quat.rotate(attitude, mag)
        east += x
        north += y
    return Sums(
        time=sums.time + dt,
        int_rate2=sums.int_rate2 + (rate.x * rate.x + rate.y * rate.y + rate.z * rate.z) * dt,
        acc_time=acc_time,
        int_deviation2=int_deviation2,
        east=east,
        north=north,
    )


@kernel
def lowpass_force(params: EKF, force: Vec3, attitude: Quat, acc: Vec3, age: float, dt: float) -> Vec3:
    """Low-pass of the specific force in the earth frame, in g; ``age`` seconds have been averaged so far."""
    x, y, z = quat.rotate(attitude, acc)
    a, b, c = force
    weight = lowpass_weight(params.acc_tau, age, dt)
    return Vec3(a + weight * (x * PER_G - a), b + weight * (y * PER_G - b), c + weight * (z * PER_G - c))


@kernel
def tilt_innovation(force: Vec3) -> Vec3:
    """Innovations of θ_x and θ_y (rad), eq. 6; for large angles the arcsine (its series up to the ninth power).

    Beyond 90° they grow on, to 2 when the estimate is upside down, so that this is not an equilibrium.
    """
    x, y, z = force
    square = x * x + y * y
    if z > 0.0:
        if square <= LINEAR * z * z:
            return Vec3(y, -x, 0.0)
        s = square / (square + z * z)
        longer = 1.0 + s * (1.0 / 6.0 + s * (3.0 / 40.0 + s * (15.0 / 336.0 + s * (105.0 / 3456.0))))
        return Vec3(y * longer, -x * longer, 0.0)
    level = sqrt(square)
    if level == 0.0:
        return Vec3(2.0, 0.0, 0.0)
    longer = max(2.0 / level - 0.7, 1.3)
    return Vec3(y * longer, -x * longer, 0.0)


@kernel
def heading_innovation(x: float, y: float) -> float:
    """Innovation of θ_z (rad), eq. 6, from the field's eastern and northern part; 1 beyond 90°."""
    level = sqrt(x * x + y * y)
    if level == 0.0:
        return 0.0
    if y >= 0.0:
        return x / level
    return 1.0 if x >= 0.0 else -1.0


@kernel
def update_tilt(params: EKF, correction: Correction, force: Vec3, sums: Sums, rejected: float) -> Gated:
    """Corrects with the two rows of tilt, unless the innovation is beyond the gate; ``force`` in g, earth frame."""
    p = correction.p
    x, y, _ = tilt_innovation(force)
    still = params.acc_noise * PER_G
    acc_time = min(sums.acc_time, LONGEST_INTERVAL)
    r = (still * still + params.acc_motion * params.acc_motion * sums.int_deviation2 / sums.acc_time) / acc_time
    square = x * x + y * y
    beyond = square > params.gate * params.gate * (max(p.axx, p.ayy) + r)
    rejected += sums.time
    if beyond and not has_elapsed(rejected, sums.time, params.gate_time):
        return Gated(correction, rejected)
    if beyond:
        p = inflate_attitude(p, square, square)  # an estimate with such a tilt error has no heading either
    correction = update(Correction(ZERO, correction.bias, p), p.axx, p.axy, p.axz, p.cxx, p.cxy, p.cxz, p.axx + r, x)
    p = correction.p
    return Gated(update(correction, p.axy, p.ayy, p.ayz, p.cyx, p.cyy, p.cyz, p.ayy + r, y - correction.turn.y), 0.0)


@kernel
def update_heading(params: EKF, correction: Correction, sums: Sums, rejected: float) -> Gated:
    """Corrects with the row of heading, unless the innovation is beyond the gate."""
    p = correction.p
    innovation = heading_innovation(sums.east, sums.north) - correction.turn.z
    r = params.mag_noise * params.mag_noise * (DEGREE * DEGREE) / min(sums.time, LONGEST_INTERVAL)
    square = innovation * innovation
    beyond = square > params.gate * params.gate * (p.azz + r)
    rejected += sums.time
    if beyond and not has_elapsed(rejected, sums.time, params.gate_time):
        return Gated(correction, rejected)
    if beyond:
        p = inflate_attitude(p, 0.0, square)
        correction = Correction(correction.turn, correction.bias, p)
    after = update(correction, p.axz, p.ayz, p.azz, p.czx, p.czy, p.czz, p.azz + r, innovation)
    return Gated(keep_tilt(correction, after), 0.0)


@kernel
def keep_tilt(before: Correction, after: Correction) -> Correction:
    """The update with the gains of tilt set to zero, eq. 8: it is eq. 7 but for tilt and the block of P of tilt."""
    x, y, _ = before.turn
    p = after.p
    old = before.p
    return Correction(
        Vec3(x, y, after.turn.z),
        after.bias,
        Cov(
            old.axx, old.axy, p.axz, old.ayy, p.ayz, p.azz,
            p.cxx, p.cxy, p.cxz, p.cyx, p.cyy, p.cyz, p.czx, p.czy, p.czz,
            p.bxx, p.bxy, p.bxz, p.byy, p.byz, p.bzz,
        ),
    )  # fmt: skip
