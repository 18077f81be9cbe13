"""The error between measured and expected directions as a rotation vector, and small corrections of an attitude.

Turning an attitude q by a small rotation vector ρ (rad, sensor frame: q ⊗ exp(ρ)) turns the direction ŝ, in which the
sensor should see a vector of the earth, by −ρ × ŝ. So ½|ŝ − s|² falls fastest along ρ = s × ŝ, whose length is the
sine of the angle between both.
"""

from math import sqrt

from levelhead.compiler.mark import kernel
from levelhead.kernels import quat
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import SHORTEST, ZERO, Vec3, normalize

NO_AXIS = 1e-9  # sine below which opposite directions leave the axis of rotation undetermined
NEAR_UNIT = 1e-5  # |q|² − 1 up to which a series is exact to 1e-15


@kernel
def direction_error(measured: Vec3, expected: Vec3) -> Vec3:
    """s × ŝ of unit vectors; beyond a right angle of length one.

    There the sine would fall again although the error grows, and vanish at 180°, an unstable equilibrium in which
    every filter with this correction would stay. Opposite directions turn about any axis.
    """
    sx, sy, sz = measured
    ex, ey, ez = expected
    x = sy * ez - sz * ey
    y = sz * ex - sx * ez
    z = sx * ey - sy * ex
    if sx * ex + sy * ey + sz * ez < 0.0:
        return obtuse_error(expected, x, y, z)
    return Vec3(x, y, z)


@kernel
def obtuse_error(expected: Vec3, x: float, y: float, z: float) -> Vec3:
    """``direction_error`` beyond a right angle: the cross product (x, y, z) at length one."""
    n = sqrt(x * x + y * y + z * z)
    if n < NO_AXIS:
        return perpendicular(expected)
    return Vec3(x / n, y / n, z / n)


@kernel
def perpendicular(v: Vec3) -> Vec3:
    """A unit vector perpendicular to the unit vector ``v``."""
    if abs(v.x) < 0.8:
        n = sqrt(v.y * v.y + v.z * v.z)
        return Vec3(0.0, v.z / n, -v.y / n)
    n = sqrt(v.x * v.x + v.y * v.y)
    return Vec3(v.y / n, -v.x / n, 0.0)


@kernel
def rotate(q: Quat, x: float, y: float, z: float) -> Quat:
    """q ⊗ exp(v) with v = (x, y, z) rad, of unit length to rounding; ``correct`` keeps the rounding from piling up."""
    s, c = quat.half_angle(0.25 * (x * x + y * y + z * z))
    x *= s
    y *= s
    z *= s
    qw, qx, qy, qz = q
    return Quat(
        (qw * c - qx * x) - (qy * y + qz * z),
        (qw * x + qx * c) + (qy * z - qz * y),
        (qw * y + qy * c) + (qz * x - qx * z),
        (qw * z + qz * c) + (qx * y - qy * x),
    )


@kernel
def correct(q: Quat, rotation: Vec3) -> Quat:
    """q ⊗ (1, ½ρ), made unit again, with ρ the rotation vector (rad, sensor frame).

    The step q + ½ q ⊗ ρ of the papers; it turns by 2 atan ½|ρ|. Nearly every ρ is so small that a series gives
    1/|q|: 1/√(1 + ε) = 1 − ε/2 + 3ε²/8.
    """
    qw, qx, qy, qz = q
    x, y, z = rotation
    x *= 0.5
    y *= 0.5
    z *= 0.5
    nw = qw - (qx * x + qy * y + qz * z)
    nx = qx + (qw * x + (qy * z - qz * y))
    ny = qy + (qw * y + (qz * x - qx * z))
    nz = qz + (qw * z + (qx * y - qy * x))
    excess = (nw * nw + nx * nx) + (ny * ny + nz * nz) - 1.0
    s = 1.0 - excess * (0.5 - 0.375 * excess)
    if excess > NEAR_UNIT:
        s = unit_scale(excess)
    return Quat(nw * s, nx * s, ny * s, nz * s)


@kernel
def unit_scale(excess: float) -> float:
    """1/|q| of a quaternion with |q|² = 1 + excess."""
    return 1.0 / sqrt(1.0 + excess)


@kernel
def heading_error(attitude: Quat, up: Vec3, mag: Vec3) -> Vec3:
    """The error of heading: ``up`` times the sine of the angle between the field's horizontal part and north.

    With h = R m, (h_x, h_y, 0)/√(h_x² + h_y²) × (0, 1, 0) = (0, 0, h_x/√(h_x² + h_y²)); beyond a right angle ±1. A
    field without a horizontal part gives zero.
    """
    w, x, y, z = attitude
    mx, my, mz = mag
    tx = 2.0 * (y * mz - z * my)
    ty = 2.0 * (z * mx - x * mz)
    tz = 2.0 * (x * my - y * mx)
    east = (mx + w * tx) + (y * tz - z * ty)
    north = (my + w * ty) + (z * tx - x * tz)
    square = east * east + north * north
    if square < SHORTEST:
        return ZERO
    sine = east / sqrt(square)
    if north < 0.0:
        sine = 1.0 if east >= 0.0 else -1.0
    return Vec3(sine * up.x, sine * up.y, sine * up.z)


@kernel
def reference(attitude: Quat, mag: Vec3) -> Vec3:
    """The unit field in the earth frame if the attitude is right: its own dip, and north."""
    h = quat.rotate(attitude, mag)
    return Vec3(0.0, sqrt(h.x * h.x + h.y * h.y), h.z)


@kernel
def field_error(attitude: Quat, mag: Vec3) -> Vec3:
    """The error of the whole field, dip included, against its reference."""
    measured = normalize(mag)
    return direction_error(measured, quat.rotate(quat.conjugate(attitude), reference(attitude, measured)))
