"""Unit quaternions wxyz that rotate sensor-frame vectors into the earth frame: v_earth = q v q*."""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.trig import atan2, sincos
from levelhead.kernels.vec3 import Vec3


class Quat(NamedTuple):
    """A quaternion, scalar first."""

    w: float
    x: float
    y: float
    z: float


class HalfAngle(NamedTuple):
    """Sine and cosine of the half of an angle (rad), the sine as a share of the angle."""

    sinc: float
    cos: float


class Euler(NamedTuple):
    """Intrinsic z-y-x angles in radians: turn by yaw about z, then pitch about the new y, then roll about the new x."""

    roll: float
    pitch: float
    yaw: float


IDENTITY = Quat(1.0, 0.0, 0.0, 0.0)
SHORT = 1e-3  # rad², (angle/2)² up to which two terms behind the first are exact to the last bit or two
SMALL = 0.01  # the same of three


@kernel
def multiply(p: Quat, q: Quat) -> Quat:
    """Hamilton's product p q: first q, then p."""
    return Quat(
        p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z,
        p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
        p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x,
        p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w,
    )


@kernel
def conjugate(q: Quat) -> Quat:
    """q*, for a unit quaternion the inverse rotation."""
    return Quat(q.w, -q.x, -q.y, -q.z)


@kernel
def normalize(q: Quat) -> Quat:
    """q/|q|; a zero quaternion becomes the identity."""
    w, x, y, z = q
    n = sqrt(w * w + x * x + y * y + z * z)
    if n > 0.0:
        return Quat(w / n, x / n, y / n, z / n)
    return Quat(1.0, 0.0, 0.0, 0.0)


@kernel
def unit(w: float, x: float, y: float, z: float) -> Quat:
    """A quaternion that rounding moved off the unit sphere by some 1e-16, unit again: scaled by (3 − |q|²)/2.

    That is the first step of Newton's method for 1/|q|. The error left behind is the square of the one before, without
    a root or a division.
    """
    s = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
    return Quat(w * s, x * s, y * s, z * s)


@kernel
def compose(p: Quat, q: Quat) -> Quat:
    """The product p q of unit quaternions, ``unit`` again."""
    pw, px, py, pz = p  # unpacked, because plain Python takes long to look up a field
    qw, qx, qy, qz = q
    return unit(
        pw * qw - px * qx - py * qy - pz * qz,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
    )


@kernel
def rotate(q: Quat, v: Vec3) -> Vec3:
    """q v q*: a sensor-frame vector seen in the earth frame."""
    w, x, y, z = q
    vx, vy, vz = v
    tx = 2.0 * (y * vz - z * vy)
    ty = 2.0 * (z * vx - x * vz)
    tz = 2.0 * (x * vy - y * vx)
    return Vec3(vx + w * tx + y * tz - z * ty, vy + w * ty + z * tx - x * tz, vz + w * tz + x * ty - y * tx)


@kernel
def half_angle(square: float) -> HalfAngle:
    """sin(angle/2)/angle (1/rad) and cos(angle/2) of square = (angle/2)² (rad²).

    From one sample to the next a body seldom turns by more than 0.06 rad; up to there short Taylor series do, free of
    0/0. Every filter waits for this before it can correct.
    """
    if square > SHORT:
        return half_angle_far(square)
    fourth = square * square
    return HalfAngle(
        (0.5 - square * (1.0 / 12.0)) + fourth * (1.0 / 240.0 - square * (1.0 / 10080.0)),
        (1.0 - square * 0.5) + fourth * (1.0 / 24.0 - square * (1.0 / 720.0)),
    )


@noinline
def half_angle_far(square: float) -> HalfAngle:
    """``half_angle`` beyond ``SHORT``."""
    if square < SMALL:
        fourth = square * square
        third = 1.0 / 240.0 - square * (1.0 / 10080.0) + fourth * (1.0 / 725760.0)
        other = 1.0 / 24.0 - square * (1.0 / 720.0) + fourth * (1.0 / 40320.0)
        return HalfAngle(0.5 - square * (1.0 / 12.0) + fourth * third, 1.0 - 0.5 * square + fourth * other)
    half = sqrt(square)
    s, c = sincos(half)
    return HalfAngle(0.5 * s / half, c)


@kernel
def exp(rotation: Vec3) -> Quat:
    """The quaternion of a rotation vector (axis times angle, rad): (cos |v|/2, sin(|v|/2)/|v| · v)."""
    x, y, z = rotation
    s, c = half_angle(0.25 * (x * x + y * y + z * z))
    return Quat(c, x * s, y * s, z * s)


@kernel
def log(q: Quat) -> Vec3:
    """The rotation vector (rad, at most π long) of a unit quaternion: the inverse of ``exp``."""
    n = sqrt(q.x * q.x + q.y * q.y + q.z * q.z)
    if n > 1e-10:
        sign = 1.0 if q.w >= 0.0 else -1.0
        s = 2.0 * sign * atan2(n, abs(q.w)) / n
    else:
        s = 2.0 if q.w >= 0.0 else -2.0
    return Vec3(q.x * s, q.y * s, q.z * s)


@kernel
def from_euler(euler: Euler) -> Quat:
    """q = q_z(yaw) q_y(pitch) q_x(roll)."""
    sr, cr = sincos(0.5 * euler.roll)
    sp, cp = sincos(0.5 * euler.pitch)
    sy, cy = sincos(0.5 * euler.yaw)
    return Quat(
        cy * cp * cr + sy * sp * sr,
        cy * cp * sr - sy * sp * cr,
        cy * sp * cr + sy * cp * sr,
        sy * cp * cr - cy * sp * sr,
    )


@kernel
def to_euler(q: Quat) -> Euler:
    """Roll, pitch and yaw in radians, pitch within ±π/2.

    At pitch ±π/2 only yaw ∓ roll is defined; roll and yaw are finite there but each for itself means nothing.
    """
    vertical = up(q)
    ahead = forward(q)
    return Euler(
        atan2(vertical.y, vertical.z),
        atan2(-vertical.x, sqrt(ahead.x * ahead.x + ahead.y * ahead.y)),
        atan2(ahead.y, ahead.x),
    )


@kernel
def matrix(q: Quat) -> Mat3:
    """The rotation matrix of a unit quaternion: R v = q v q*."""
    w, x, y, z = q
    return Mat3(
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
        2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y),
    )  # fmt: skip


@kernel
def from_matrix(m: Mat3) -> Quat:
    """The quaternion of a rotation matrix, by its largest component, which is positive.

    S. W. Shepperd, Quaternion from Rotation Matrix, J. Guidance and Control 1(3), 1978: 4w² = 1 + trace, 4x² = 1 + 2 xx
    − trace and so on; the largest of these is at least 1, so that dividing by its root loses nothing.
    """
    xx, xy, xz, yx, yy, yz, zx, zy, zz = m
    trace = xx + yy + zz
    if trace >= xx and trace >= yy and trace >= zz:
        scaled = Quat(1.0 + trace, zy - yz, xz - zx, yx - xy)
    elif xx >= yy and xx >= zz:
        scaled = Quat(zy - yz, 1.0 + 2.0 * xx - trace, xy + yx, xz + zx)
    elif yy >= zz:
        scaled = Quat(xz - zx, xy + yx, 1.0 + 2.0 * yy - trace, yz + zy)
    else:
        scaled = Quat(yx - xy, xz + zx, yz + zy, 1.0 + 2.0 * zz - trace)
    return normalize(scaled)


@kernel
def integrate(q: Quat, gyr: Vec3, dt: float) -> Quat:
    """q turned for ``dt`` seconds at the sensor-frame rate ``gyr`` (rad/s), exact for a constant rate; unit again."""
    return compose(q, exp(Vec3(gyr.x * dt, gyr.y * dt, gyr.z * dt)))


@kernel
def up(q: Quat) -> Vec3:
    """The earth's vertical in the sensor frame: (−sin θ, sin φ cos θ, cos φ cos θ) with roll φ and pitch θ."""
    w, x, y, z = q
    return Vec3(2.0 * (x * z - w * y), 2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))


@kernel
def forward(q: Quat) -> Vec3:
    """The sensor's x axis in the earth frame: (cos ψ cos θ, sin ψ cos θ, −sin θ) with yaw ψ and pitch θ."""
    w, x, y, z = q
    return Vec3(1.0 - 2.0 * (y * y + z * z), 2.0 * (w * z + x * y), 2.0 * (x * z - w * y))
