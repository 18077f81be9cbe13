"""ESKF: the filter that calibrates its sensor while it runs.

Beside attitude and velocity it estimates what gyroscope, accelerometer and magnetometer do wrong, in the error-state
form of J. Solà: with ^ on what is estimated, and ω, a, μ what the sensors say,

    R = exp([θ]×) R^,   everything else x = x^ + δx                                                             (1)
    rate (1 − S) ω − b,   force f = R (a − c),   field h = μ/u − o, later than the rate by d                    (2)

S is a whole matrix: scale factors and cross-axis terms; u the first norm of the field. At every sample attitude is
turned by (2) exactly and v by f − g. What the errors do is summed up over a block of T ≥ ``block`` s:

    θ ← θ − ∫R dt δb − ∫R ⊗ ω dt δS,   v ← v − [∫f dt]× θ − ∫R dt δc                                            (3)

which are the rows of F − 1 in P ← F P Fᵀ + Q; all else walks at random. Then rows are measured one after the other.
A body stays in the room, so that its mean velocity over T is zero but for what is left of a density ``speed``²:

    0 = v + δv − θ_z × v,   variance speed²/T                                                                   (4)

which is what makes tilt observable, without any test whether |a| is g; a turn by θ_z takes v along, so that (4) tells
nothing of heading. The block's mean field e = mean R (h − d ω × h)
has no eastern part, and strength and dip m:

    e + θ × e − mean R δo − mean R (ω × h) δd − (0, δm_h, δm_v) = (0, m_h, m_v)                                 (5)

with a variance that grows by the square of what norm and dip differ from m. A magnet must not tilt the horizon: the
gains of θ_x, θ_y, v and c are zero in (5) (the consider filter of S. F. Schmidt). At rest

    0 = mean ω − S mean ω − b                                                                                   (6)

What cannot be corrected to first order (tilt beyond half a radian, heading beyond one, a velocity 5 σ away for a
second) is taken from the block's mean force and field as at the start. A field that does not fit, but stands still in
the earth frame while the sensor turns for ``mag_time``, is taken for the earth's.

What was learned is ``Track.calibration``, the next run's ``prior``. All equations with their reasons:
docs/self-calibration.md.
"""

from math import pi, sqrt
from typing import Annotated, NamedTuple

from levelhead.filters import aiding
from levelhead.filters.contract import Filter, Output, Param, SelfCalibration, Settling, parameters
from levelhead.filters.error_state import (
    ACC,
    AGE,
    AIDED,
    AIR,
    BARE,
    BIAS,
    COUNT,
    CUT,
    DELAY,
    DRIVEN,
    FIELD,
    FOUND,
    GYR,
    HEARD,
    HERE,
    IRON,
    KNOWN,
    LATE,
    LOST,
    LOST_Z,
    MAG,
    MEAN,
    PUSHED,
    ROTATED,
    ROW,
    SCALED,
    SEEN,
    SHOVED,
    SIZE,
    SPEED,
    SPELL,
    SWIFT,
    TURN,
    TURN_Z,
    TURNED,
    WOUND,
    F,
    H,
    N,
    P,
    X,
    carry_place,
    independent,
    measure,
    propagate,
    recall,
    take_along,
    variance,
    widen,
)
from levelhead.filters.health import ACC_REJECTED, AID_REJECTED, MAG_LEARNED, MAG_REJECTED
from levelhead.filters.learned import Learned, estimate, tell
from levelhead.kernels import mat3, quat, tilt, triad
from levelhead.kernels.arrays import Floats, zeros
from levelhead.kernels.jit import kernel, rare
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.quat import IDENTITY, Quat
from levelhead.kernels.tilt import GAP_SECONDS, GRAVITY, UNIFORM, after_gap
from levelhead.kernels.trig import atan2
from levelhead.kernels.vec3 import ZERO, Vec3, add, cross, dot, norm, normalize, scale, sub

DEGREE = pi / 180.0
MILLI = 1e-3

ROUNDING = 2e-7  # share of a variance that corrections in single precision may get wrong in a block
REST_SPEED = 0.02  # m/s, 1σ at rest
REST_RATE = 0.05 * DEGREE  # rad/s, at least, by which a body at rest may turn
REST_TAU = 1.0  # s, for so long
UNSUPPORTED = 5.0  # m/s², 1σ of the acceleration of a body whose accelerometer is silent
FIRST_SPEED = 0.3  # m/s
FIRST_HEADING = 0.3  # rad
LOST_TILT = 0.25  # rad²: beyond, tilt is taken from the sensors as at the start, not corrected
SWINGING = 0.7  # m/s, 1σ of what turns: its force is off by as much times its rate
UNKNOWN = 1.0  # rad, 1σ of a heading that means nothing
AGREED = 1e-4  # rad, of a relative heading at its start
IMPACT = 300.0  # m/s²: a blow about which samples tell little
GATE = 25.0  # σ² of a velocity that is not believed,
HALT = 9.0  # σ² within which it may be zero,
HALTING = 0.3  # m/s², with no more acceleration than tilt and bias pretend
ASTRAY = 0.94  # cos 20°, of a heading far off
STEADY = 0.2  # share by which a new field may vary in the earth frame
TURNING = 0.1  # rad/s, at least, for the difference to show
NEARLY_DOWN = -0.999999
GATE_TIME = 1.0  # s, for at most so long
BRIEF = 1e-3  # s that a sample after a gap counts for
FIRST_FIELD = 0.25  # share
ODD_TIME = 1.0  # s
UNHEARD = 1e6  # so many times: it is not listened to
REJECTED = 10.0  # times its variance: a field that counts so little is none


@parameters()
class ESKF(NamedTuple):
    """Error-state Kalman filter that learns its sensor while it runs: attitude, velocity, field and calibration."""

    gyr_noise: Annotated[
        float, Param("(deg/s)/√Hz", "noise density of the rate", low=0.0, low_open=True, sweep=(0.005, 0.5), log=True)
    ] = 0.04
    gyr_share: Annotated[
        float, Param("√s", "noise density of the rate, as a share of the rate", low=0.0, sweep=(5e-5, 0.005), log=True)
    ] = 0.0005
    bias_walk: Annotated[
        float, Param("(deg/s)/√s", "random walk of the bias", low=0.0, sweep=(1e-4, 0.1), log=True)
    ] = 0.003
    bias_start: Annotated[
        float, Param("deg/s", "1σ of the bias at the start", low=0.0, sweep=(0.05, 20.0), log=True)
    ] = 10.0
    scale_start: Annotated[
        float, Param("", "1σ of the gyroscope's scale and cross-axis factors", low=0.0, sweep=(1e-4, 0.05), log=True)
    ] = 0.003
    scale_walk: Annotated[float, Param("1/√s", "random walk of these", low=0.0, sweep=(1e-7, 1e-3), log=True)] = 1e-5
    acc_noise: Annotated[
        float,
        Param("(m/s²)/√Hz", "noise density of specific force", low=0.0, low_open=True, sweep=(1e-3, 0.5), log=True),
    ] = 0.01
    acc_bias: Annotated[
        float, Param("m/s²", "1σ of the accelerometer's bias", low=0.0, sweep=(1e-3, 0.5), log=True)
    ] = 0.05
    acc_walk: Annotated[
        float, Param("(m/s²)/√s", "random walk of this bias", low=0.0, sweep=(1e-7, 1e-2), log=True)
    ] = 2e-5
    speed: Annotated[
        float,
        Param(
            "(m/s)·√s", "density of a body's velocity about zero", low=0.0, low_open=True, sweep=(0.05, 5.0), log=True
        ),
    ] = 0.4
    mag_noise: Annotated[
        float,
        Param(
            "√s", "density of the field's error, as a share of it", low=0.0, low_open=True, sweep=(1e-3, 0.5), log=True
        ),
    ] = 0.025
    mag_gate: Annotated[
        float,
        Param(
            "",
            "misfit of norm and dip, as a share of the field, that doubles this variance",
            low=0.0,
            low_open=True,
            sweep=(0.005, 0.5),
            log=True,
        ),
    ] = 0.04
    field_walk: Annotated[
        float,
        Param(
            "1/√s",
            "random walk of the field's strength and dip, as a share of it",
            low=0.0,
            sweep=(0.01, 1.0),
            log=True,
        ),
    ] = 0.15
    mag_offset: Annotated[
        float,
        Param(
            "",
            "1σ of the magnetometer's offset at the start, as a share of the field",
            low=0.0,
            sweep=(1e-3, 1.0),
            log=True,
        ),
    ] = 0.005
    offset_walk: Annotated[
        float, Param("1/√s", "random walk of this offset", low=0.0, sweep=(1e-5, 0.05), log=True)
    ] = 0.003
    mag_delay: Annotated[
        float,
        Param(
            "ms", "1σ of how much later than the gyroscope the magnetometer is", low=0.0, sweep=(1.0, 100.0), log=True
        ),
    ] = 15.0
    mag_time: Annotated[
        float,
        Param("s", "a field that does not fit is taken for the earth's after", low=0.0, sweep=(1.0, 100.0), log=True),
    ] = 20.0
    tilt_start: Annotated[
        float, Param("deg", "1σ of the tilt at the start", low=0.0, low_open=True, sweep=(0.5, 30.0), log=True)
    ] = 5.0
    baro_walk: Annotated[
        float,
        Param(
            "m/√s",
            "random walk of the barometer's height, by weather and warming",
            low=0.0,
            sweep=(1e-3, 1.0),
            log=True,
        ),
    ] = 0.03
    block: Annotated[
        float, Param("s", "time between two corrections; 0: at every sample", low=0.0, sweep=(0.005, 0.5), log=True)
    ] = 0.1


class Odd(NamedTuple):
    """A field that does not fit, but is steady in the earth frame while the sensor turns: its mean, for how long."""

    field: Vec3
    spell: float


class State(NamedTuple):
    """Attitude; everything else that is estimated stands in ``memory``, see ``error_state``."""

    quat: Quat
    unit: float  # µT, the first norm of the field; 0: none seen yet
    still: bool  # at rest
    out: float  # s for which velocity has not been believed
    odd: Odd
    blocks: int  # that have ended
    fresh: bool  # the last sample ended one
    health: int
    memory: Floats


NOTHING_ODD = Odd(ZERO, 0.0)


@kernel
def vector(m: Floats, at: int) -> Vec3:
    """Three numbers from memory."""
    return Vec3(m[at], m[at + 1], m[at + 2])


@rare
def init(params: ESKF, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample; a relative heading starts at 0 and is right by definition."""
    m = zeros(SIZE)
    return begun(params, m, acc, mag)


@rare
def again(params: ESKF, before: State, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """The same, with what ``before`` has been told of an earlier run."""
    m = before.memory
    for i in range(KNOWN):
        m[i] = 0.0
    for i in range(AGE, SIZE):
        m[i] = 0.0
    return begun(params, m, acc, mag)


@rare
def begun(params: ESKF, m: Floats, acc: Vec3, mag: Vec3) -> State:
    """A start in memory that is zero but for what is known."""
    independent(m, ACC, 3, params.acc_bias)
    independent(m, SPEED, 3, FIRST_SPEED)
    independent(m, TURN, 2, UNKNOWN)
    independent(m, BIAS, 3, params.bias_start * DEGREE)
    independent(m, GYR, 9, params.scale_start)
    recall(m, ACC, 3, 1.0)
    recall(m, BIAS, 3, 1.0)
    recall(m, GYR, 9, 1.0)
    independent(m, TURN_Z, 1, AGREED)
    attitude = triad.start(acc, mag)
    unit = 0.0
    if tilt.present(mag):
        unit = first_field(params, m, attitude, mag)
        independent(m, TURN_Z, 1, UNKNOWN)
    return State(attitude, unit, False, 0.0, NOTHING_ODD, 0, False, 0, m)


@rare
def first_field(params: ESKF, m: Floats, attitude: Quat, mag: Vec3) -> float:
    """The field of the first sample that has one; returns its norm."""
    independent(m, MAG, 2, FIRST_FIELD)
    independent(m, IRON, 3, params.mag_offset)
    independent(m, DELAY, 1, params.mag_delay * MILLI)
    unit = norm(mag)
    recall(m, IRON, 3, unit)
    recall(m, DELAY, 1, 1.0)
    east, north, up = quat.rotate(attitude, sub(scale(mag, 1.0 / unit), vector(m, MEAN + IRON)))
    m[MEAN + MAG] = sqrt(east * east + north * north)
    m[MEAN + MAG + 1] = up
    return unit


@kernel
def turned(m: Floats, k: int, weight: float, gyr: Vec3) -> None:
    """Element k of ∫ R dt and of ∫ R ⊗ ω dt."""
    x, y, z = gyr
    m[ROTATED + k] += weight
    m[SCALED + 3 * k] += weight * x
    m[SCALED + 3 * k + 1] += weight * y
    m[SCALED + 3 * k + 2] += weight * z


@rare
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


@rare
def look(m: Floats, r: Mat3, rate: Vec3, mag: Vec3, unit: float) -> None:
    """Magnetometer of one more sample in the block: e = R (h − d ω × h), h = m/unit − o."""
    x, y, z = mag
    one = 1.0 / unit
    h = Vec3(x * one - m[MEAN + IRON], y * one - m[MEAN + IRON + 1], z * one - m[MEAN + IRON + 2])
    x, y, z = mat3.apply(r, h)
    a, b, c = mat3.apply(r, cross(rate, h))
    delay = m[MEAN + DELAY]
    m[FIELD] += x - delay * a
    m[FIELD + 1] += y - delay * b
    m[FIELD + 2] += z - delay * c
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


@kernel
def drive(m: Floats) -> None:
    """F − 1 of the driven states over a block, by rows v, θ."""
    for i in range(DRIVEN * ROW):
        m[F + i] = 0.0
    for i in range(3):
        v = F + i * ROW
        t = v + 3 * ROW
        for k in range(3):
            m[v + ACC + k] = -m[ROTATED + 3 * i + k]
            m[t + BIAS + k] = -m[ROTATED + 3 * i + k]
        for k in range(9):
            m[t + GYR + k] = -m[SCALED + 9 * i + k]
    x, y, z = vector(m, PUSHED)
    m[F + TURN + 1] = z
    m[F + TURN + 2] = -y
    m[F + ROW + TURN] = -z
    m[F + ROW + TURN + 2] = x
    m[F + 2 * ROW + TURN] = y
    m[F + 2 * ROW + TURN + 1] = -x


@kernel
def walked(params: ESKF, m: Floats, with_field: bool) -> None:
    """Process noise of a block."""
    spell = m[SPELL]
    noise = params.gyr_noise * DEGREE
    widen(m, TURN, 3, noise * noise * spell + params.gyr_share * params.gyr_share * m[WOUND] + m[LOST])
    widen(m, TURN_Z, 1, m[LOST_Z])
    silent = spell - m[HEARD]
    push = params.acc_noise * params.acc_noise * m[HEARD]
    blow = m[SHOVED] / (IMPACT * IMPACT * spell)
    push += min(blow * blow, 1.0) * m[SHOVED] * spell
    widen(m, SPEED, 3, push + UNSUPPORTED * UNSUPPORTED * silent * spell)
    widen(m, ACC, 3, params.acc_walk * params.acc_walk * spell)
    walk = params.bias_walk * DEGREE
    widen(m, BIAS, 3, walk * walk * spell)
    widen(m, GYR, 9, params.scale_walk * params.scale_walk * spell)
    for i in range(N):
        widen(m, i, 1, ROUNDING * variance(m, i))
    if with_field:
        widen(m, MAG, 2, params.field_walk * params.field_walk * spell)
        widen(m, IRON, 3, params.offset_walk * params.offset_walk * spell)


@rare
def across_gap(m: Floats, gap: float) -> None:
    """A time in which anything may have happened: attitude and velocity are lost, and tell nothing."""
    if m[AIDED] != 0.0:
        aiding.lost_sight(m, gap)
    else:
        still_here(m)
    level = sqrt(after_gap(max(variance(m, TURN), variance(m, TURN + 1)), gap))
    heading = sqrt(after_gap(variance(m, TURN_Z), gap))
    independent(m, TURN, 2, level)
    independent(m, TURN_Z, 1, heading)
    begin_block(m)
    m[CUT] = gap


@kernel
def still_here(m: Floats) -> None:
    """No velocity, as at the start."""
    independent(m, SPEED, 3, FIRST_SPEED)
    for i in range(3):
        m[MEAN + SPEED + i] = 0.0


@rare
def predict(params: ESKF, m: Floats, n: int) -> None:
    """The covariance at the end of the block."""
    drive(m)
    if n > HERE:
        carry_place(m, n, 0.5 * m[SPELL])
    propagate(m, n)
    if n > HERE:
        carry_place(m, n, 0.5 * m[SPELL])
        widen(m, AIR, 1, params.baro_walk * params.baro_walk * m[SPELL])
    walked(params, m, n > BARE)
    m[AGE] += m[SPELL]


@kernel
def halted(m: Floats, i: int) -> bool:
    """Whether a body that was seen to move may stand still: smooth travel and smooth braking look like rest."""
    v = m[MEAN + SPEED + i]
    a = m[PUSHED + i] / m[SPELL] - (GRAVITY if i == 2 else 0.0)
    return v * v <= HALT * (variance(m, SPEED + i) + REST_SPEED * REST_SPEED) and a * a <= HALTING * HALTING


@kernel
def speed_noise(params: ESKF, m: Floats, still: bool, i: int) -> float:
    """Variance of a body's mean velocity over the block."""
    if still and (m[SWIFT + i] == 0.0 or halted(m, i)):
        return REST_SPEED * REST_SPEED
    return (params.speed * params.speed + aiding.density(m, i)) / m[SPELL]


@rare
def runaway(params: ESKF, m: Floats, still: bool) -> bool:
    """Whether velocity is beyond what the filter thinks possible, where nobody sees it."""
    worst = 0.0
    for i in range(3):
        if not aiding.aided(m, i):
            v = m[MEAN + SPEED + i]
            worst = max(worst, v * v / (variance(m, SPEED + i) + speed_noise(params, m, still, i)))
    return worst > GATE


@rare
def see_speed(params: ESKF, m: Floats, still: bool, n: int) -> None:
    """A body stays in the room: its velocity is zero, give or take, where nobody sees it.

    Zero has no direction, so that it must tell nothing of heading: a turn by θ_z takes v along, to v + θ_z × v, which
    the rows of east and north do not see.
    """
    for i in range(3):
        if not aiding.aided(m, i):
            noise = speed_noise(params, m, still, i)
            m[H + SPEED + i] = 1.0
            if i < 2:
                m[H + TURN_Z] = m[MEAN + SPEED + 1] if i == 0 else -m[MEAN + SPEED]
            measure(m, n, 0, -m[MEAN + SPEED + i], noise)


@rare
def see_rest(m: Floats, n: int) -> None:
    """At rest the mean rate is the bias, as far as it does not vary: (1 − S) ω − b = 0."""
    one = 1.0 / m[SPELL]
    rate = scale(vector(m, TURNED), one)
    varied = max(m[WOUND] * one - dot(rate, rate), 0.0)
    noise = (varied + REST_RATE * REST_RATE) * REST_TAU * one
    for i in range(3):
        g = GYR + 3 * i
        m[H + BIAS + i] = 1.0
        m[H + g] = rate.x
        m[H + g + 1] = rate.y
        m[H + g + 2] = rate.z
        explained = m[MEAN + g] * rate.x + m[MEAN + g + 1] * rate.y + m[MEAN + g + 2] * rate.z + m[MEAN + BIAS + i]
        measure(m, n, 0, m[TURNED + i] * one - explained, noise)


class Fit(NamedTuple):
    """Of a field, earth frame: whether norm or dip are not those learned, and whether heading is not; and whether
    something of position and velocity was refused."""

    refused: bool
    turned: bool
    field: Vec3
    astray: bool


@rare
def see_field(params: ESKF, m: Floats, steady: bool, n: int) -> Fit:
    """The three rows of the field, and whether they fit; ``steady``: they have not for a while, in one way."""
    one = 1.0 / m[COUNT]
    field = scale(vector(m, FIELD), one)
    x, y, z = field
    level = m[MEAN + MAG]
    up = m[MEAN + MAG + 1]
    strength2 = level * level + up * up
    strength = sqrt(x * x + y * y)
    off = strength - level
    misfit2 = (off * off + (z - up) * (z - up)) / strength2
    doubt = 1.0 + misfit2 / (params.mag_gate * params.mag_gate)
    refused = doubt > REJECTED
    sure = min(GATE * variance(m, TURN_Z), 0.5)
    turned = y < ASTRAY * strength and (y < 0.0 or x * x > sure * strength * strength)
    if turned:
        doubt = UNHEARD if steady else max(doubt, REJECTED)
    noise = params.mag_noise * params.mag_noise * strength2 * doubt / m[SPELL]
    m[H + TURN + 1] = z
    m[H + TURN_Z] = -y
    aside(m, 0, one)
    measure(m, n, TURN_Z, -x, noise)
    m[H + TURN] = -z
    m[H + TURN_Z] = x
    m[H + MAG] = -1.0
    aside(m, 1, one)
    measure(m, n, TURN_Z, level - y, noise)
    m[H + TURN] = y
    m[H + TURN + 1] = -x
    m[H + MAG + 1] = -1.0
    aside(m, 2, one)
    measure(m, n, TURN_Z, up - z, noise)
    return Fit(refused, turned, field, False)


@kernel
def aside(m: Floats, row: int, one: float) -> None:
    """What offset and delay do to a row of the field."""
    for k in range(3):
        m[H + IRON + k] = -m[SEEN + 3 * row + k] * one
    m[H + DELAY] = -m[LATE + row] * one


@rare
def see_all(params: ESKF, m: Floats, still: bool, believed: bool, steady: bool, n: int) -> Fit:
    """x and P from all that was seen in a block, and the mean with x added."""
    fit = Fit(False, False, ZERO, False)
    if believed:
        see_speed(params, m, still, n)
    if still:
        see_rest(m, n)
    if m[COUNT] > 0.0:
        fit = see_field(params, m, steady, n)
    if n > HERE:
        fit = Fit(fit.refused, fit.turned, fit.field, aiding.see_places(m, n))
    for i in range(n):
        m[MEAN + i] += m[X + i]
    take_along(m, P, n, m[X + SPEED], m[X + SPEED + 1])
    return fit


@rare
def odd_for(m: Floats, odd: Odd, fit: Fit) -> Odd:
    """Whether the field that does not fit is one of the room: a magnet on the sensor turns with it."""
    if not (fit.refused or fit.turned):
        return NOTHING_ODD
    spell = m[SPELL]
    off = sub(fit.field, odd.field)
    if odd.spell == 0.0 or dot(off, off) > STEADY * STEADY * dot(fit.field, fit.field):
        return Odd(fit.field, spell)
    if fit.refused and m[WOUND] < TURNING * TURNING * spell:
        return odd
    weight = spell / (odd.spell + spell)
    return Odd(add(odd.field, scale(off, weight)), odd.spell + spell)


@rare
def take_field(m: Floats, field: Vec3) -> None:
    """This field is the earth's from now on; of its heading see ``found_north``."""
    x, y, z = field
    m[MEAN + MAG] = sqrt(x * x + y * y)
    m[MEAN + MAG + 1] = z
    independent(m, MAG, 2, FIRST_FIELD)


@rare
def begin_block(m: Floats) -> None:
    """Nothing integrated yet, nothing to correct."""
    for i in range(ROTATED, SIZE):
        m[i] = 0.0
    for i in range(N):
        m[X + i] = 0.0


@kernel
def upright(force: Vec3) -> Quat:
    """The shortest turn that brings a force to the vertical."""
    x, y, z = normalize(force)
    if z < NEARLY_DOWN:
        return Quat(0.0, 1.0, 0.0, 0.0)
    return quat.normalize(Quat(1.0 + z, y, -x, 0.0))


@rare
def found_up(params: ESKF, m: Floats) -> Quat:
    """The turn that brings the block's mean force to the vertical, as at the start."""
    swing = upright(vector(m, PUSHED))
    turn = 2.0 * sqrt(swing.x * swing.x + swing.y * swing.y)
    heading = sqrt(variance(m, TURN_Z) + turn * turn)
    start = params.tilt_start * DEGREE
    swung = SWINGING / GRAVITY
    independent(m, TURN, 2, sqrt(start * start + swung * swung * m[WOUND] / m[SPELL]))
    independent(m, TURN_Z, 1, heading)
    if m[AIDED] != 0.0:
        aiding.lost_sight(m, 0.0)
    else:
        still_here(m)
    return swing


@rare
def found_north(m: Floats, swing: Quat) -> Quat:
    """The same turn, and one about the vertical that brings the block's mean field north."""
    field = quat.rotate(swing, scale(vector(m, FIELD), 1.0 / m[COUNT]))
    take_field(m, field)
    independent(m, TURN_Z, 1, FIRST_HEADING)
    return tilt.add_yaw(swing, atan2(field.x, field.y))


@kernel
def step(params: ESKF, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """The attitude at every sample, and what the next correction is made of."""
    attitude, unit, still, out, odd, blocks, fresh, health, m = state
    if fresh:
        begin_block(m)
    x, y, z = gyr
    g = MEAN + GYR
    rate = Vec3(
        x - m[MEAN + BIAS] - (m[g] * x + m[g + 1] * y + m[g + 2] * z),
        y - m[MEAN + BIAS + 1] - (m[g + 3] * x + m[g + 4] * y + m[g + 5] * z),
        z - m[MEAN + BIAS + 2] - (m[g + 6] * x + m[g + 7] * y + m[g + 8] * z),
    )
    attitude = quat.integrate(attitude, rate, dt)
    if dt > GAP_SECONDS:
        across_gap(m, dt)
        dt = BRIEF
    r = quat.matrix(attitude)
    if m[AIDED] != 0.0:
        aiding.carried(m, 0.5 * dt)
    feel(m, r, gyr, acc, dt)
    if m[AIDED] != 0.0:
        aiding.carried(m, 0.5 * dt)
    if tilt.present(mag):
        if unit == 0.0:
            unit = first_field(params, m, attitude, mag)
            independent(m, TURN_Z, 1, UNKNOWN)
        look(m, r, rate, mag, unit)
    return State(attitude, unit, still, out, odd, blocks, False, health, m)


@kernel
def due(params: ESKF, state: State) -> bool:
    """Whether a block has ended."""
    return state.memory[SPELL] >= params.block


@kernel
def known(state: State) -> int:
    """How much of a row is computed: what exists."""
    if state.memory[AIDED] != 0.0:
        return ROW
    return HERE if state.unit > 0.0 else BARE


@rare
def correct(params: ESKF, state: State, dt: float) -> State:
    """Covariance and corrections at the end of a block."""
    attitude, unit, still, out, odd, blocks, _, _, m = state
    n = known(state)
    predict(params, m, n)
    out = out + m[SPELL] if runaway(params, m, still) else 0.0
    up_lost = m[HEARD] > 0.0 and (out > GATE_TIME or variance(m, TURN) + variance(m, TURN + 1) > LOST_TILT)
    if up_lost or (m[COUNT] > 0.0 and variance(m, TURN_Z) > UNKNOWN * UNKNOWN):
        swing = found_up(params, m) if up_lost else IDENTITY
        if m[COUNT] > 0.0 and variance(m, TURN_Z) > UNKNOWN * UNKNOWN:
            swing = found_north(m, swing)
        m[FOUND] = 1.0
        return State(quat.compose(swing, attitude), unit, False, 0.0, NOTHING_ODD, blocks + 1, True, 0, m)
    fit = see_all(params, m, still, out == 0.0, odd.spell > ODD_TIME, n)
    swing = quat.exp(vector(m, X + TURN))
    health = ACC_REJECTED if out > 0.0 else 0
    if fit.refused or fit.turned:
        health |= MAG_REJECTED
    if fit.astray:
        health |= AID_REJECTED
    odd = odd_for(m, odd, fit)
    if odd.spell > params.mag_time:  # the room was changed, not the moment
        take_field(m, odd.field)
        independent(m, TURN_Z, 1, UNKNOWN)
        health |= MAG_LEARNED
        odd = NOTHING_ODD
    return State(quat.compose(swing, attitude), unit, False, out, odd, blocks + 1, True, health, m)


@kernel
def loosen(params: ESKF, state: State, variance: float) -> State:
    """The whole attitude less sure."""
    state.memory[LOST] += variance
    return state


@kernel
def loosen_heading(params: ESKF, state: State, variance: float) -> State:
    """Heading less sure."""
    state.memory[LOST_Z] += variance
    return state


@kernel
def calm(params: ESKF, state: State) -> State:
    """The sensor is at rest."""
    attitude, unit, _, out, odd, blocks, fresh, health, m = state
    return State(attitude, unit, True, out, odd, blocks, fresh, health, m)


@kernel
def deviation(m: Floats, i: int) -> float:
    """σ of an angle."""
    return min(sqrt(max(variance(m, i), 0.0)), UNIFORM)


@kernel
def output(params: ESKF, state: State) -> Output:
    """Attitude, bias, σ and health."""
    m = state.memory
    sigma = Vec3(deviation(m, TURN), deviation(m, TURN + 1), deviation(m, TURN_Z))
    return Output(state.quat, vector(m, MEAN + BIAS), sigma, state.health)


def learned(params: ESKF, state: State) -> Learned:
    """What the filter knows of its sensor by now."""
    m, unit = state.memory, state.unit
    bias = estimate(m, BIAS, 3, params.bias_start * DEGREE, params.bias_walk * DEGREE)
    matrix = estimate(m, GYR, 9, params.scale_start, params.scale_walk)
    force = estimate(m, ACC, 3, params.acc_bias, params.acc_walk)
    if unit == 0.0:
        return Learned(matrix, bias, force)
    offset = estimate(m, IRON, 3, params.mag_offset, params.offset_walk, unit)
    late = estimate(m, DELAY, 1, params.mag_delay * MILLI, 0.0)
    return Learned(matrix, bias, force, offset, late, estimate(m, MAG, 2, FIRST_FIELD, params.field_walk, unit))


def told(state: State, known: Learned) -> State:
    """A state before its first sample that knows what an earlier run has learned, for ``again``."""
    m = list(state.memory)
    tell(m, GYR, known.gyr_matrix)
    tell(m, BIAS, known.gyr_bias)
    tell(m, ACC, known.acc_bias)
    tell(m, IRON, known.mag_offset)
    tell(m, DELAY, known.mag_delay)
    return state._replace(memory=m)


@kernel
def aid(params: ESKF, state: State, row: int, value: float, sigma: float, age: float) -> State:
    """One number of position, velocity or height, see ``aiding``; what has a direction ends a relative heading."""
    m = state.memory
    before = aiding.oriented(m)
    aiding.sight(m, row, value, sigma, age)
    if state.unit == 0.0 and aiding.oriented(m) and not before:
        independent(m, TURN_Z, 1, UNKNOWN)
    return state


@kernel
def place(params: ESKF, state: State) -> aiding.Place:
    """Where the body is and how it moves."""
    return aiding.place(state.memory)


FILTER = Filter(
    name="ESKF",
    params=ESKF,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "heading", "bias", "sigma"}),
    uses=frozenset({"gyr", "acc", "mag"}),
    citation="J. Solà, Quaternion kinematics for the error-state Kalman filter, arXiv:1711.02508, 2017",
    settles=Settling(15.0, 120.0),
    loosen=loosen,
    loosen_heading=loosen_heading,
    calm=calm,
    due=due,
    correct=correct,
    aid=aid,
    place=place,
    judges=frozenset({"bias", "field"}),
    calibration=SelfCalibration(again, told, learned),
)
