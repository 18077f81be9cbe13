"""Unit quaternions wxyz that rotate sensor-frame vectors into the earth frame: v_earth = q v q*."""

from math import atan2, cos, sin, sqrt
from typing import NamedTuple

from levelhead.kernels.jit import kernel
from levelhead.kernels.vec3 import Vec3


class Quat(NamedTuple):
    """A quaternion, scalar first."""

    w: float
    x: float
    y: float
    z: float


class Euler(NamedTuple):
    """Intrinsic z-y-x angles in radians: turn by yaw about z, then pitch about the new y, then roll about the new x."""

    roll: float
    pitch: float
    yaw: float


IDENTITY = Quat(1.0, 0.0, 0.0, 0.0)
SMALL = 0.01  # (angle/2)² below which series take over


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
    n = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z)
    if n > 0.0:
        return Quat(q.w / n, q.x / n, q.y / n, q.z / n)
    return Quat(1.0, 0.0, 0.0, 0.0)


@kernel
def compose(p: Quat, q: Quat) -> Quat:
    """The product p q of unit quaternions, unit again: scaled by (3 − |pq|²)/2.

    That is the first step of Newton's method for 1/|pq|. Rounding has moved |pq| by some 1e-16; the error left behind
    is the square of that, without a root or a division.
    """
    pw, px, py, pz = p  # unpacked, because plain Python takes long to look up a field
    qw, qx, qy, qz = q
    w = pw * qw - px * qx - py * qy - pz * qz
    x = pw * qx + px * qw + py * qz - pz * qy
    y = pw * qy - px * qz + py * qw + pz * qx
    z = pw * qz + px * qy - py * qx + pz * qw
    s = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
    return Quat(w * s, x * s, y * s, z * s)


@kernel
def rotate(q: Quat, v: Vec3) -> Vec3:
    """q v q*: a sensor-frame vector seen in the earth frame."""
    tx = 2.0 * (q.y * v.z - q.z * v.y)
    ty = 2.0 * (q.z * v.x - q.x * v.z)
    tz = 2.0 * (q.x * v.y - q.y * v.x)
    return Vec3(
        v.x + q.w * tx + q.y * tz - q.z * ty,
        v.y + q.w * ty + q.z * tx - q.x * tz,
        v.z + q.w * tz + q.x * ty - q.y * tx,
    )


@kernel
def cos_half(square: float) -> float:
    """cos(angle/2) of square = (angle/2)².

    Below 0.2 rad, where nearly every sample lies, this and ``sinc_half`` are Taylor series, exact to the last bit or
    two: faster, free of 0/0, and the same bits on any machine, whatever its libm.
    """
    if square < SMALL:
        return 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0 - square / 40320.0)))
    return cos(sqrt(square))


@kernel
def sinc_half(square: float) -> float:
    """sin(angle/2)/angle of square = (angle/2)²."""
    if square < SMALL:
        return 0.5 - square * (1.0 / 12.0 - square * (1.0 / 240.0 - square * (1.0 / 10080.0 - square / 725760.0)))
    half = sqrt(square)
    return 0.5 * sin(half) / half


@kernel
def exp(rotation: Vec3) -> Quat:
    """The quaternion of a rotation vector (axis times angle, rad): (cos |v|/2, sin(|v|/2)/|v| · v)."""
    x, y, z = rotation
    square = 0.25 * (x * x + y * y + z * z)
    s = sinc_half(square)
    return Quat(cos_half(square), x * s, y * s, z * s)


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
    cr = cos(0.5 * euler.roll)
    sr = sin(0.5 * euler.roll)
    cp = cos(0.5 * euler.pitch)
    sp = sin(0.5 * euler.pitch)
    cy = cos(0.5 * euler.yaw)
    sy = sin(0.5 * euler.yaw)
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
