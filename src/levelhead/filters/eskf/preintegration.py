"""Integrals of ``ESKF`` over a block of samples, from which eqs. 7, 15 and 16 are made."""

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import clear
from levelhead.kernels import mat3, tilt
from levelhead.kernels.arrays import Floats
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.vec3 import Vec3, cross, scale, sub
from levelhead.units import GRAVITY


@kernel
def calibrated_rate(m: Floats, gyr: Vec3) -> Vec3:
    """w = ω − S ω − b, rad/s, eq. 2."""
    x, y, z = gyr
    b = at.MEAN + at.GYR_BIAS
    s = at.MEAN + at.GYR_MATRIX
    return Vec3(
        x - m[b] - (m[s] * x + m[s + 1] * y + m[s + 2] * z),
        y - m[b + 1] - (m[s + 3] * x + m[s + 4] * y + m[s + 5] * z),
        z - m[b + 2] - (m[s + 6] * x + m[s + 7] * y + m[s + 8] * z),
    )


@kernel
def add_rotation(m: Floats, k: int, weight: float, gyr: Vec3) -> None:
    """Adds to element k of ∫ R dt and of ∫ R ⊗ ω dt; ``weight`` is R_k dt (s), ``gyr`` in rad/s."""
    x, y, z = gyr
    m[at.INT_R + k] += weight
    m[at.INT_R_RATE + 3 * k] += weight * x
    m[at.INT_R_RATE + 3 * k + 1] += weight * y
    m[at.INT_R_RATE + 3 * k + 2] += weight * z


@noinline
def add_imu(m: Floats, r: Mat3, gyr: Vec3, acc: Vec3, dt: float) -> None:
    """Adds a sample of gyroscope (rad/s) and accelerometer (m/s²) that lasts ``dt`` s; ``r`` is sensor to earth.

    The bias of the force, eq. 3, is a state that drives velocity, so that the integral holds the reading.
    """
    x, y, z = gyr
    add_rotation(m, 0, r.xx * dt, gyr)
    add_rotation(m, 1, r.xy * dt, gyr)
    add_rotation(m, 2, r.xz * dt, gyr)
    add_rotation(m, 3, r.yx * dt, gyr)
    add_rotation(m, 4, r.yy * dt, gyr)
    add_rotation(m, 5, r.yz * dt, gyr)
    add_rotation(m, 6, r.zx * dt, gyr)
    add_rotation(m, 7, r.zy * dt, gyr)
    add_rotation(m, 8, r.zz * dt, gyr)
    m[at.INT_RATE] += x * dt
    m[at.INT_RATE + 1] += y * dt
    m[at.INT_RATE + 2] += z * dt
    m[at.INT_RATE2] += (x * x + y * y + z * z) * dt
    m[at.BLOCK_TIME] += dt
    if tilt.is_present(acc):
        x, y, z = acc
        bias = at.MEAN + at.ACC_BIAS
        x, y, z = mat3.apply(r, Vec3(x - m[bias], y - m[bias + 1], z - m[bias + 2]))
        m[at.INT_FORCE] += x * dt
        m[at.INT_FORCE + 1] += y * dt
        m[at.INT_FORCE + 2] += z * dt
        z -= GRAVITY
        m[at.MEAN + at.VELOCITY] += x * dt
        m[at.MEAN + at.VELOCITY + 1] += y * dt
        m[at.MEAN + at.VELOCITY + 2] += z * dt
        m[at.INT_VELOCITY] -= 0.5 * x * dt * dt
        m[at.INT_VELOCITY + 1] -= 0.5 * y * dt * dt
        m[at.INT_VELOCITY + 2] -= 0.5 * z * dt * dt
        m[at.INT_ACC2] += (x * x + y * y + z * z) * dt
        m[at.ACC_TIME] += dt
    m[at.INT_VELOCITY] += m[at.MEAN + at.VELOCITY] * dt
    m[at.INT_VELOCITY + 1] += m[at.MEAN + at.VELOCITY + 1] * dt
    m[at.INT_VELOCITY + 2] += m[at.MEAN + at.VELOCITY + 2] * dt


@noinline
def add_mag(m: Floats, r: Mat3, rate: Vec3, mag: Vec3, norm: float) -> None:
    """Adds a magnetometer sample: e = R (h − d w × h + d²/2 w × (w × h)), eq. 16, with h = mag/norm − o, eq. 4.

    ``rate`` is w (rad/s), ``mag`` in µT, ``norm`` that of the first field (µT).
    """
    x, y, z = mag
    one = 1.0 / norm
    offset = at.MEAN + at.MAG_OFFSET
    x, y, z = x * one, y * one, z * one
    m[at.SUM_MAG] += x
    m[at.SUM_MAG + 1] += y
    m[at.SUM_MAG + 2] += z
    s = at.MEAN + at.SOFT_IRON
    h = Vec3(
        x - m[offset] - (m[s] * x + m[s + 2] * y + m[s + 3] * z),
        y - m[offset + 1] - (m[s + 2] * x + m[s + 1] * y + m[s + 4] * z),
        z - m[offset + 2] - (m[s + 3] * x + m[s + 4] * y - (m[s] + m[s + 1]) * z),
    )
    x, y, z = mat3.apply(r, h)
    delay = m[at.MEAN + at.MAG_DELAY]
    field_rate = cross(rate, h)  # −dh/dt of a constant field
    a, b, c = mat3.apply(r, sub(field_rate, scale(cross(rate, field_rate), 0.5 * delay)))
    m[at.SUM_FIELD] += x - delay * a
    m[at.SUM_FIELD + 1] += y - delay * b
    m[at.SUM_FIELD + 2] += z - delay * c
    a, b, c = mat3.apply(r, sub(field_rate, scale(cross(rate, field_rate), delay)))
    m[at.SUM_R_CROSS] += a
    m[at.SUM_R_CROSS + 1] += b
    m[at.SUM_R_CROSS + 2] += c
    m[at.SUM_R] += r.xx
    m[at.SUM_R + 1] += r.xy
    m[at.SUM_R + 2] += r.xz
    m[at.SUM_R + 3] += r.yx
    m[at.SUM_R + 4] += r.yy
    m[at.SUM_R + 5] += r.yz
    m[at.SUM_R + 6] += r.zx
    m[at.SUM_R + 7] += r.zy
    m[at.SUM_R + 8] += r.zz
    m[at.MAG_COUNT] += 1.0


@noinline
def reset_block(m: Floats) -> None:
    """Sets the integrals of the block, and the correction x, to zero."""
    clear(m, at.INT_R, at.SIZE - at.INT_R)
    clear(m, at.X, at.N)
