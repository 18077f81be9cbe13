"""Vectors of three numbers."""

from math import sqrt
from typing import NamedTuple

from levelhead.kernels.jit import kernel


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
def dot(a: Vec3, b: Vec3) -> float:
    """a·b"""
    return a.x * b.x + a.y * b.y + a.z * b.z


@kernel
def cross(a: Vec3, b: Vec3) -> Vec3:
    """a × b"""
    return Vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@kernel
def norm(a: Vec3) -> float:
    """|a|"""
    return sqrt(a.x * a.x + a.y * a.y + a.z * a.z)


@kernel
def normalize(a: Vec3) -> Vec3:
    """a/|a|; the zero vector (an absent sensor), and what is too short to have a direction, gives the zero vector."""
    n = norm(a)
    if n > SHORTEST:
        return Vec3(a.x / n, a.y / n, a.z / n)
    return Vec3(0.0, 0.0, 0.0)
