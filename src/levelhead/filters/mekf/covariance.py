"""The covariance of ``EKF``: eqs. 3 to 5 and 7 of the package, written out for the upper triangle of P."""

from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.mekf.params import EKF
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.tilt import after_gap, bias_after_gap
from levelhead.kernels.vec3 import Vec3
from levelhead.units import DEGREE


class Cov(NamedTuple):
    """Upper triangle of P: a attitude (rad²), b bias ((rad/s)²), c attitude (rows) with bias (columns)."""

    axx: float
    axy: float
    axz: float
    ayy: float
    ayz: float
    azz: float
    cxx: float
    cxy: float
    cxz: float
    cyx: float
    cyy: float
    cyz: float
    czx: float
    czy: float
    czz: float
    bxx: float
    bxy: float
    bxz: float
    byy: float
    byz: float
    bzz: float


class Correction(NamedTuple):
    """Rotation vector of the corrections so far (rad, earth frame), the corrected bias (rad/s), and P after them."""

    turn: Vec3
    bias: Vec3
    p: Cov


@kernel
def diagonal(attitude: float, heading: float, bias: float) -> Cov:
    """P of independent errors with these variances (rad², rad², (rad/s)²)."""
    return Cov(
        attitude, 0.0, 0.0, attitude, 0.0, heading,
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        bias, 0.0, 0.0, bias, 0.0, bias,
    )  # fmt: skip


@kernel
def predict(p: Cov, r: Mat3, turn: float, walk: float, dt: float) -> Cov:
    """Eqs. 3 to 5, with q_θ Δt and q_β Δt; eq. 4 as A − Δt/2 (E Rᵀ + R Eᵀ), E = C before + C after."""
    axx, axy, axz, ayy, ayz, azz, cxx, cxy, cxz, cyx, cyy, cyz, czx, czy, czz, bxx, bxy, bxz, byy, byz, bzz = p
    rxx, rxy, rxz, ryx, ryy, ryz, rzx, rzy, rzz = r
    h = 0.5 * dt
    hxx = h * rxx
    hxy = h * rxy
    hxz = h * rxz
    hyx = h * ryx
    hyy = h * ryy
    hyz = h * ryz
    hzx = h * rzx
    hzy = h * rzy
    hzz = h * rzz
    exx = cxx - (hxx * bxx + hxy * bxy + hxz * bxz)
    exy = cxy - (hxx * bxy + hxy * byy + hxz * byz)
    exz = cxz - (hxx * bxz + hxy * byz + hxz * bzz)
    eyx = cyx - (hyx * bxx + hyy * bxy + hyz * bxz)
    eyy = cyy - (hyx * bxy + hyy * byy + hyz * byz)
    eyz = cyz - (hyx * bxz + hyy * byz + hyz * bzz)
    ezx = czx - (hzx * bxx + hzy * bxy + hzz * bxz)
    ezy = czy - (hzx * bxy + hzy * byy + hzz * byz)
    ezz = czz - (hzx * bxz + hzy * byz + hzz * bzz)
    return Cov(
        axx - 4.0 * (exx * hxx + exy * hxy + exz * hxz) + turn,
        axy - 2.0 * (exx * hyx + exy * hyy + exz * hyz + eyx * hxx + eyy * hxy + eyz * hxz),
        axz - 2.0 * (exx * hzx + exy * hzy + exz * hzz + ezx * hxx + ezy * hxy + ezz * hxz),
        ayy - 4.0 * (eyx * hyx + eyy * hyy + eyz * hyz) + turn,
        ayz - 2.0 * (eyx * hzx + eyy * hzy + eyz * hzz + ezx * hyx + ezy * hyy + ezz * hyz),
        azz - 4.0 * (ezx * hzx + ezy * hzy + ezz * hzz) + turn,
        2.0 * exx - cxx,
        2.0 * exy - cxy,
        2.0 * exz - cxz,
        2.0 * eyx - cyx,
        2.0 * eyy - cyy,
        2.0 * eyz - cyz,
        2.0 * ezx - czx,
        2.0 * ezy - czy,
        2.0 * ezz - czz,
        bxx + walk,
        bxy,
        bxz,
        byy + walk,
        byz,
        bzz + walk,
    )


@noinline
def across_gap(params: EKF, p: Cov, dt: float) -> Cov:
    """P after a gap of ``dt`` seconds: the attitude may have changed by any turn, and is independent of the bias."""
    start = params.bias_start * DEGREE
    walk = params.bias_walk * DEGREE
    bias = bias_after_gap(max(p.bxx, p.byy, p.bzz), walk * walk * dt, start * start)
    return diagonal(after_gap(max(p.axx, p.ayy), dt), after_gap(p.azz, dt), bias)


@kernel
def update(
    correction: Correction, x: float, y: float, z: float, u: float, v: float, w: float, s: float, innovation: float
) -> Correction:
    """Eq. 7 with P hᵀ = (x, y, z, u, v, w) and s = h P hᵀ + r."""
    (tx, ty, tz), (bx, by, bz), p = correction
    axx, axy, axz, ayy, ayz, azz, cxx, cxy, cxz, cyx, cyy, cyz, czx, czy, czz, bxx, bxy, bxz, byy, byz, bzz = p
    one = 1.0 / s
    kx = x * one
    ky = y * one
    kz = z * one
    ku = u * one
    kv = v * one
    kw = w * one
    return Correction(
        Vec3(tx + kx * innovation, ty + ky * innovation, tz + kz * innovation),
        Vec3(bx + ku * innovation, by + kv * innovation, bz + kw * innovation),
        Cov(
            axx - kx * x, axy - kx * y, axz - kx * z, ayy - ky * y, ayz - ky * z, azz - kz * z,
            cxx - kx * u, cxy - kx * v, cxz - kx * w,
            cyx - ky * u, cyy - ky * v, cyz - ky * w,
            czx - kz * u, czy - kz * v, czz - kz * w,
            bxx - ku * u, bxy - ku * v, bxz - ku * w, byy - kv * v, byz - kv * w, bzz - kw * w,
        ),
    )  # fmt: skip


@noinline
def inflate_attitude(p: Cov, tilt_variance: float, heading_variance: float) -> Cov:
    """Adds these variances (rad²) to tilt and heading, and makes attitude and bias independent."""
    return Cov(
        p.axx + tilt_variance, p.axy, p.axz, p.ayy + tilt_variance, p.ayz, p.azz + heading_variance,
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        p.bxx, p.bxy, p.bxz, p.byy, p.byz, p.bzz,
    )  # fmt: skip
