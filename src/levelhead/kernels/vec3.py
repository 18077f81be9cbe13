"""Vectors of three numbers."""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel


class Vec3(NamedTuple):
    """Three components along x, y and z."""

    x: float
    y: float
    z: float


ZERO = Vec3(0.0, 0.0, 0.0)
SHORTEST = 1e-140  # below, squares underflow and a norm means nothing


@kernel
def add(a: Vec3, b: Vec3) -> Vec3:
    """a + b"""
    return Vec3(a.x + b.x, a.y + b.y, a.z + b.z)


@kernel
def sub(a: Vec3, b: Vec3) -> Vec3:
    """a − b"""
    return Vec3(a.x - b.x, a.y - b.y, a.z - b.z)


@kernel
def scale(a: Vec3, s: float) -> Vec3:
    """s·a"""
    return Vec3(a.x * s, a.y * s, a.z * s)


@kernel
def add_scaled(a: Vec3, b: Vec3, s: float) -> Vec3:
    """a + s·b"""
    ax, ay, az = a
    bx, by, bz = b
    return Vec3(ax + bx * s, ay + by * s, az + bz * s)


@kernel
def dot(a: Vec3, b: Vec3) -> float:
    """a·b"""
    return a.x * b.x + a.y * b.y + a.z * b.z


@kernel
def cross(a: Vec3, b: Vec3) -> Vec3:
    """a × b"""
    ax, ay, az = a  # unpacked, because plain Python takes long to look up a field
    bx, by, bz = b
    return Vec3(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)


@kernel
def norm(a: Vec3) -> float:
    """|a|"""
    x, y, z = a
    return sqrt(x * x + y * y + z * z)


@kernel
def normalize(a: Vec3) -> Vec3:
    """a/|a|; zero for the zero vector (an absent sensor) and for one too short to have a direction."""
    x, y, z = a
    n = sqrt(x * x + y * y + z * z)
    if n > SHORTEST:
        one = 1.0 / n  # a division takes as long as four products
        return Vec3(x * one, y * one, z * one)
    return Vec3(0.0, 0.0, 0.0)
