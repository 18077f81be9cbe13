"""Matrices of 3×3 numbers, by rows."""

from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.kernels.vec3 import Vec3


class Mat3(NamedTuple):
    """Element ``xy`` is in row x, column y."""

    xx: float
    xy: float
    xz: float
    yx: float
    yy: float
    yz: float
    zx: float
    zy: float
    zz: float


class Inverse3(NamedTuple):
    """An inverse and whether it exists; ``matrix`` is zero when it does not."""

    matrix: Mat3
    ok: bool


@kernel
def add(a: Mat3, b: Mat3) -> Mat3:
    """A + B"""
    return Mat3(
        a.xx + b.xx, a.xy + b.xy, a.xz + b.xz,
        a.yx + b.yx, a.yy + b.yy, a.yz + b.yz,
        a.zx + b.zx, a.zy + b.zy, a.zz + b.zz,
    )  # fmt: skip


@kernel
def sub(a: Mat3, b: Mat3) -> Mat3:
    """A − B"""
    return Mat3(
        a.xx - b.xx, a.xy - b.xy, a.xz - b.xz,
        a.yx - b.yx, a.yy - b.yy, a.yz - b.yz,
        a.zx - b.zx, a.zy - b.zy, a.zz - b.zz,
    )  # fmt: skip


@kernel
def mul(a: Mat3, b: Mat3) -> Mat3:
    """A·B"""
    return Mat3(
        a.xx * b.xx + a.xy * b.yx + a.xz * b.zx,
        a.xx * b.xy + a.xy * b.yy + a.xz * b.zy,
        a.xx * b.xz + a.xy * b.yz + a.xz * b.zz,
        a.yx * b.xx + a.yy * b.yx + a.yz * b.zx,
        a.yx * b.xy + a.yy * b.yy + a.yz * b.zy,
        a.yx * b.xz + a.yy * b.yz + a.yz * b.zz,
        a.zx * b.xx + a.zy * b.yx + a.zz * b.zx,
        a.zx * b.xy + a.zy * b.yy + a.zz * b.zy,
        a.zx * b.xz + a.zy * b.yz + a.zz * b.zz,
    )


@kernel
def apply(a: Mat3, v: Vec3) -> Vec3:
    """A·v"""
    return Vec3(
        a.xx * v.x + a.xy * v.y + a.xz * v.z,
        a.yx * v.x + a.yy * v.y + a.yz * v.z,
        a.zx * v.x + a.zy * v.y + a.zz * v.z,
    )


@kernel
def transpose(a: Mat3) -> Mat3:
    """Aᵀ"""
    return Mat3(a.xx, a.yx, a.zx, a.xy, a.yy, a.zy, a.xz, a.yz, a.zz)


@kernel
def det(a: Mat3) -> float:
    """The determinant."""
    return a.xx * (a.yy * a.zz - a.yz * a.zy) - a.xy * (a.yx * a.zz - a.yz * a.zx) + a.xz * (a.yx * a.zy - a.yy * a.zx)


@kernel
def inverse(a: Mat3) -> Inverse3:
    """A⁻¹ by the adjugate; a matrix singular to working precision is reported, never divided through.

    Singular means |det A| ≤ 1e-14 · (sum of the magnitudes of the determinant's terms).
    """
    d = det(a)
    terms = (
        abs(a.xx) * (abs(a.yy * a.zz) + abs(a.yz * a.zy))
        + abs(a.xy) * (abs(a.yx * a.zz) + abs(a.yz * a.zx))
        + abs(a.xz) * (abs(a.yx * a.zy) + abs(a.yy * a.zx))
    )
    if abs(d) > 1e-14 * terms:
        adjugate_over_det = Mat3(
            (a.yy * a.zz - a.yz * a.zy) / d,
            (a.xz * a.zy - a.xy * a.zz) / d,
            (a.xy * a.yz - a.xz * a.yy) / d,
            (a.yz * a.zx - a.yx * a.zz) / d,
            (a.xx * a.zz - a.xz * a.zx) / d,
            (a.xz * a.yx - a.xx * a.yz) / d,
            (a.yx * a.zy - a.yy * a.zx) / d,
            (a.xy * a.zx - a.xx * a.zy) / d,
            (a.xx * a.yy - a.xy * a.yx) / d,
        )
        return Inverse3(adjugate_over_det, True)
    return Inverse3(Mat3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), False)
