"""What ``ESKF`` gathers at every sample of a block: integrals that drive its error states, eqs. 2 and 3 there."""

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf.state import (
    ACC,
    COUNT,
    DELAY,
    FIELD,
    HEARD,
    IRON,
    LATE,
    MEAN,
    PUSHED,
    ROTATED,
    SCALED,
    SEEN,
    SHOVED,
    SIZE,
    SPEED,
    SPELL,
    TURNED,
    WOUND,
    N,
    X,
)
from levelhead.kernels import mat3, tilt
from levelhead.kernels.arrays import Floats
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.tilt import GRAVITY
from levelhead.kernels.vec3 import Vec3, cross, scale, sub


@kernel
def turned(m: Floats, k: int, weight: float, gyr: Vec3) -> None:
    """Element k of ∫ R dt and of ∫ R ⊗ ω dt."""
    x, y, z = gyr
    m[ROTATED + k] += weight
    m[SCALED + 3 * k] += weight * x
    m[SCALED + 3 * k + 1] += weight * y
    m[SCALED + 3 * k + 2] += weight * z


@noinline
def feel(m: Floats, r: Mat3, gyr: Vec3, acc: Vec3, dt: float) -> None:
    """Gyroscope and accelerometer of one more sample in the block."""
    x, y, z = gyr
    turned(m, 0, r.xx * dt, gyr)
    turned(m, 1, r.xy * dt, gyr)
    turned(m, 2, r.xz * dt, gyr)
    turned(m, 3, r.yx * dt, gyr)
    turned(m, 4, r.yy * dt, gyr)
    turned(m, 5, r.yz * dt, gyr)
    turned(m, 6, r.zx * dt, gyr)
    turned(m, 7, r.zy * dt, gyr)
    turned(m, 8, r.zz * dt, gyr)
    m[TURNED] += x * dt
    m[TURNED + 1] += y * dt
    m[TURNED + 2] += z * dt
    m[WOUND] += (x * x + y * y + z * z) * dt
    m[SPELL] += dt
    if tilt.present(acc):
        x, y, z = acc
        f = mat3.apply(r, Vec3(x - m[MEAN + ACC], y - m[MEAN + ACC + 1], z - m[MEAN + ACC + 2]))
        x, y, z = f
        m[PUSHED] += x * dt
        m[PUSHED + 1] += y * dt
        m[PUSHED + 2] += z * dt
        z -= GRAVITY
        m[MEAN + SPEED] += x * dt
        m[MEAN + SPEED + 1] += y * dt
        m[MEAN + SPEED + 2] += z * dt
        m[SHOVED] += (x * x + y * y + z * z) * dt
        m[HEARD] += dt


@noinline
def look(m: Floats, r: Mat3, rate: Vec3, mag: Vec3, unit: float) -> None:
    """Magnetometer of one more sample in the block: e = R (h − d ω × h + d²/2 ω × (ω × h)), h = m/unit − o."""
    x, y, z = mag
    one = 1.0 / unit
    h = Vec3(x * one - m[MEAN + IRON], y * one - m[MEAN + IRON + 1], z * one - m[MEAN + IRON + 2])
    x, y, z = mat3.apply(r, h)
    delay = m[MEAN + DELAY]
    swept = cross(rate, h)
    a, b, c = mat3.apply(r, sub(swept, scale(cross(rate, swept), 0.5 * delay)))
    m[FIELD] += x - delay * a
    m[FIELD + 1] += y - delay * b
    m[FIELD + 2] += z - delay * c
    a, b, c = mat3.apply(r, sub(swept, scale(cross(rate, swept), delay)))
    m[LATE] += a
    m[LATE + 1] += b
    m[LATE + 2] += c
    m[SEEN] += r.xx
    m[SEEN + 1] += r.xy
    m[SEEN + 2] += r.xz
    m[SEEN + 3] += r.yx
    m[SEEN + 4] += r.yy
    m[SEEN + 5] += r.yz
    m[SEEN + 6] += r.zx
    m[SEEN + 7] += r.zy
    m[SEEN + 8] += r.zz
    m[COUNT] += 1.0


@noinline
def begin_block(m: Floats) -> None:
    """Nothing integrated yet, nothing to correct."""
    for i in range(ROTATED, SIZE):
        m[i] = 0.0
    for i in range(N):
        m[X + i] = 0.0
