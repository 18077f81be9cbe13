"""Matrices of 2×2 numbers, by rows."""

from typing import NamedTuple

from levelhead.compiler.mark import kernel


class Mat2(NamedTuple):
    """Element ``xy`` is in row x, column y."""

    xx: float
    xy: float
    yx: float
    yy: float


class Vec2(NamedTuple):
    """Two components."""

    x: float
    y: float


class Inverse2(NamedTuple):
    """An inverse and whether it exists; ``matrix`` is zero when it does not."""

    matrix: Mat2
    ok: bool


@kernel
def add(a: Mat2, b: Mat2) -> Mat2:
    """A + B"""
    return Mat2(a.xx + b.xx, a.xy + b.xy, a.yx + b.yx, a.yy + b.yy)


@kernel
def sub(a: Mat2, b: Mat2) -> Mat2:
    """A − B"""
    return Mat2(a.xx - b.xx, a.xy - b.xy, a.yx - b.yx, a.yy - b.yy)


@kernel
def mul(a: Mat2, b: Mat2) -> Mat2:
    """A·B"""
    return Mat2(
        a.xx * b.xx + a.xy * b.yx,
        a.xx * b.xy + a.xy * b.yy,
        a.yx * b.xx + a.yy * b.yx,
        a.yx * b.xy + a.yy * b.yy,
    )


@kernel
def apply(a: Mat2, v: Vec2) -> Vec2:
    """A·v"""
    return Vec2(a.xx * v.x + a.xy * v.y, a.yx * v.x + a.yy * v.y)


@kernel
def transpose(a: Mat2) -> Mat2:
    """Aᵀ"""
    return Mat2(a.xx, a.yx, a.xy, a.yy)


@kernel
def det(a: Mat2) -> float:
    """The determinant."""
    return a.xx * a.yy - a.xy * a.yx


@kernel
def inverse(a: Mat2) -> Inverse2:
    """A⁻¹ by the adjugate; a matrix singular to working precision is reported, never divided through.

    Singular means |det A| ≤ 1e-14 · (sum of the magnitudes of the determinant's terms).
    """
    d = det(a)
    terms = abs(a.xx * a.yy) + abs(a.xy * a.yx)
    if abs(d) > 1e-14 * terms:
        return Inverse2(Mat2(a.yy / d, -a.xy / d, -a.yx / d, a.xx / d), True)
    return Inverse2(Mat2(0.0, 0.0, 0.0, 0.0), False)
