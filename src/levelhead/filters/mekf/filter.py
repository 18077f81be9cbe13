"""EKF: multiplicative extended Kalman filter for attitude and gyroscope bias, with gravity and field as vectors.

E. J. Lefferts, F. L. Markley and M. D. Shuster keep the attitude in a unit quaternion and its error in a small rotation
vector, here θ in the **earth** frame, and the bias error β in the sensor frame (with ^ on what is estimated):

    R = exp([θ]×) R^,   b = b^ + β                                                                              (1)
    θ' = −R β + noise,   β' = noise                                                                             (2)

so that with P in blocks A = E[θθᵀ], C = E[θβᵀ], B = E[ββᵀ], in one step of Δt

    C ← C − Δt R B                                                                                              (3)
    A ← A − Δt (R Cᵀ + C Rᵀ) + Δt² R B Rᵀ + q_θ Δt I                                                            (4)
    B ← B + q_β Δt I                                                                                            (5)

In the earth frame both measurements are plain. Specific force f = R a of a body that does not accelerate is (0, 0, g),
and the field h = R m has no eastern part. To first order in θ

    f_y/g = θ_x + v_x,   −f_x/g = θ_y + v_y,   h_x/√(h_x² + h_y²) = θ_z + v_z                                   (6)

Each row of H is a unit vector, so the updates are scalar ones, one after the other, with a division each:

    K = P hᵀ/(h P hᵀ + r),   x ← x + K y,   P ← P − K h P                                                       (7)

A body that stays in the room does not accelerate on average: f is low-passed in the earth frame, where gravity stands
still however the sensor turns, before it is a measurement. The variance r of what is left follows | |a| − g |, as q_θ
follows the rate, whose error is a share of itself.

A magnet may turn the heading but never tilt the horizon: the dip of the field does not enter, nor does, in (6), what
tilt errors do to h_x (its part h_z/h_y θ_y is noise), and the row of θ_z has no gain for θ_x and θ_y (the
consider filter of Schmidt):

    P ← P − K h P − (K h P)ᵀ + K (h P hᵀ + r) Kᵀ,   K_x = K_y = 0                                               (8)

What is left is indirect: heading teaches the bias about the vertical, which the next turn shares out.

An innovation beyond ``gate`` σ is not believed, for ``gate_time`` at most. Then the filter lets go of its own belief
instead: A grows by the square of what it refused to see.
"""

from math import pi, sqrt
from typing import Annotated, NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import Filter, Inflation, Output, Schedule, Settling
from levelhead.filters.health import ACC_REJECTED, MAG_REJECTED
from levelhead.filters.parameters import Param, parameters
from levelhead.kernels import quat, tilt, triad
from levelhead.kernels.lowpass import older, share
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GAP_SECONDS, GRAVITY, UNIFORM, after_gap, bias_after_gap
from levelhead.kernels.vec3 import ZERO, Vec3

DEGREE = pi / 180.0
PER_G = 1.0 / GRAVITY
HALF_PER_G2 = 0.5 / (GRAVITY * GRAVITY)
ONE = 0.1  # s: samples further apart than this are worth one measurement each, not more
LINEAR = 0.04  # squared tangent of the angle up to which a sine is its angle
RESTED = (0.05 * DEGREE) * (0.05 * DEGREE)  # (rad/s)², of a bias read off at rest
SMALL_TURN = 1e-4  # rad²
FIRST_HEADING = (60.0 * DEGREE) * (60.0 * DEGREE)  # rad², of one reading of a magnetometer indoors


@parameters()
class EKF(NamedTuple):
    """Multiplicative extended Kalman filter: attitude and gyroscope bias, from gravity and field as vectors."""

    gyr_noise: Annotated[
        float,
        Param("(deg/s)/√Hz", "noise density of the rate", low=0.0, low_open=True, sweep=(0.01, 1.0), log=True),
    ] = 0.1
    gyr_scale: Annotated[
        float, Param("√s", "noise density of the rate, as a share of the rate", low=0.0, sweep=(5e-4, 0.05), log=True)
    ] = 0.006
    bias_walk: Annotated[
        float, Param("(deg/s)/√s", "random walk of the bias", low=0.0, sweep=(1e-4, 0.1), log=True)
    ] = 0.005
    acc_noise: Annotated[
        float,
        Param("(m/s²)/√Hz", "density of acceleration at rest", low=0.0, low_open=True, sweep=(0.02, 2.0), log=True),
    ] = 0.2
    acc_motion: Annotated[
        float, Param("√s", "density of acceleration as a share of | |a| − g |", low=0.0, sweep=(0.01, 3.0), log=True)
    ] = 0.1
    acc_tau: Annotated[
        float, Param("s", "low-pass of specific force in the earth frame", low=0.0, sweep=(0.1, 10.0), log=True)
    ] = 2.0
    mag_noise: Annotated[
        float,
        Param("deg/√Hz", "density of the field's heading", low=0.0, low_open=True, sweep=(1.0, 100.0), log=True),
    ] = 30.0
    tilt_start: Annotated[
        float, Param("deg", "1σ of the first tilt", low=0.0, low_open=True, sweep=(0.5, 30.0), log=True)
    ] = 5.0
    bias_start: Annotated[
        float, Param("deg/s", "1σ of the bias at the start", low=0.0, low_open=True, sweep=(0.01, 10.0), log=True)
    ] = 1.0
    block: Annotated[
        float, Param("s", "time between two corrections; 0: at every sample", low=0.0, sweep=(0.005, 0.2), log=True)
    ] = 0.02
    gate: Annotated[
        float, Param("", "innovations beyond so many σ are not believed", low=0.0, sweep=(2.0, 10.0), log=True)
    ] = 5.0
    gate_time: Annotated[float, Param("s", "but not for longer than this", low=0.0, sweep=(0.1, 10.0), log=True)] = 1.0


class Cov(NamedTuple):
    """P, upper triangle: a attitude (rad²), b bias ((rad/s)²), c attitude by row with bias by column."""

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


class Block(NamedTuple):
    """What has come in since the last correction."""

    spell: float  # s
    turned: float  # ∫ |rate|² dt, rad²/s
    seen: float  # s with an accelerometer
    rough: float  # ∫ (|a|/g − 1)² dt over these, s
    east: float  # sum of the fields seen, earth frame
    north: float


class State(NamedTuple):
    """Attitude, bias (rad/s), covariance, low-passed specific force in the earth frame (g), and what was refused."""

    quat: Quat
    bias: Vec3
    p: Cov
    force: Vec3
    age: float  # s over which that is averaged
    block: Block
    acc_out: float  # s for which the innovation has been beyond the gate
    mag_out: float
    health: int


EMPTY = Block(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Fix(NamedTuple):
    """Correction so far of attitude (rad, earth frame) and bias (rad/s), and the covariance after it."""

    turn: Vec3
    bias: Vec3
    p: Cov


class Seen(NamedTuple):
    """After a measurement: the correction, and for how many seconds it has been refused (0: it was not)."""

    fix: Fix
    out: float


@kernel
def diagonal(attitude: float, heading: float, bias: float) -> Cov:
    """P of independent errors, from variances."""
    return Cov(
        attitude, 0.0, 0.0, attitude, 0.0, heading,
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        bias, 0.0, 0.0, bias, 0.0, bias,
    )  # fmt: skip


@kernel
def init(params: EKF, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """Tilt and heading of the first sample; a relative heading starts at 0 and is right by definition."""
    attitude = params.tilt_start * DEGREE
    bias = params.bias_start * DEGREE
    heading = FIRST_HEADING if tilt.present(mag) else 0.0
    p = diagonal(attitude * attitude, heading, bias * bias)
    return State(triad.start(acc, mag), ZERO, p, Vec3(0.0, 0.0, 1.0), 0.0, EMPTY, 0.0, 0.0, 0)


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


@kernel
def across_gap(params: EKF, p: Cov, dt: float) -> Cov:
    """P after a time in which anything may have happened: the attitude is lost, and tells nothing about the bias."""
    start = params.bias_start * DEGREE
    walk = params.bias_walk * DEGREE
    bias = bias_after_gap(max(p.bxx, p.byy, p.bzz), walk * walk * dt, start * start)
    return diagonal(after_gap(max(p.axx, p.ayy), dt), after_gap(p.azz, dt), bias)


@kernel
def update(fix: Fix, x: float, y: float, z: float, u: float, v: float, w: float, s: float, innovation: float) -> Fix:
    """Eq. 7 with P hᵀ = (x, y, z, u, v, w) and s = h P hᵀ + r."""
    (tx, ty, tz), (bx, by, bz), p = fix
    axx, axy, axz, ayy, ayz, azz, cxx, cxy, cxz, cyx, cyy, cyz, czx, czy, czz, bxx, bxy, bxz, byy, byz, bzz = p
    one = 1.0 / s
    kx = x * one
    ky = y * one
    kz = z * one
    ku = u * one
    kv = v * one
    kw = w * one
    return Fix(
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


@kernel
def looser(p: Cov, tilted: float, headed: float) -> Cov:
    """Attitude less sure by these variances; what it told about the bias is forgotten."""
    return Cov(
        p.axx + tilted, p.axy, p.axz, p.ayy + tilted, p.ayz, p.azz + headed,
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        p.bxx, p.bxy, p.bxz, p.byy, p.byz, p.bzz,
    )  # fmt: skip


@kernel
def tilt_innovation(force: Vec3) -> Vec3:
    """Eq. 6, x and y; where the angle is not its sine any more, the sine's arc (series to the ninth power).

    Beyond 90° it grows on, to 2 upside down, so that this is no resting place.
    """
    x, y, z = force
    square = x * x + y * y
    if z > 0.0:
        if square <= LINEAR * z * z:
            return Vec3(y, -x, 0.0)
        s = square / (square + z * z)
        longer = 1.0 + s * (1.0 / 6.0 + s * (3.0 / 40.0 + s * (15.0 / 336.0 + s * (105.0 / 3456.0))))
        return Vec3(y * longer, -x * longer, 0.0)
    level = sqrt(square)
    if level == 0.0:
        return Vec3(2.0, 0.0, 0.0)
    longer = max(2.0 / level - 0.7, 1.3)
    return Vec3(y * longer, -x * longer, 0.0)


@kernel
def heading_innovation(x: float, y: float) -> float:
    """Eq. 6, z, of the field's eastern and northern part; beyond 90° it stays at its largest."""
    level = sqrt(x * x + y * y)
    if level == 0.0:
        return 0.0
    if y >= 0.0:
        return x / level
    return 1.0 if x >= 0.0 else -1.0


@kernel
def see_gravity(params: EKF, fix: Fix, force: Vec3, block: Block, out: float) -> Seen:
    """The two rows of tilt, unless the innovation is beyond the gate."""
    p = fix.p
    x, y, _ = tilt_innovation(force)
    still = params.acc_noise * PER_G
    seen = min(block.seen, ONE)
    r = (still * still + params.acc_motion * params.acc_motion * block.rough / block.seen) / seen
    square = x * x + y * y
    if square > params.gate * params.gate * (max(p.axx, p.ayy) + r):
        out += block.spell
        if out <= params.gate_time:
            return Seen(fix, out)
        p = looser(p, square, square)  # whoever was so wrong about the vertical knows no heading either
    fix = update(Fix(ZERO, fix.bias, p), p.axx, p.axy, p.axz, p.cxx, p.cxy, p.cxz, p.axx + r, x)
    p = fix.p
    return Seen(update(fix, p.axy, p.ayy, p.ayz, p.cyx, p.cyy, p.cyz, p.ayy + r, y - fix.turn.y), 0.0)


@kernel
def see_field(params: EKF, fix: Fix, block: Block, out: float) -> Seen:
    """The row of heading, unless the innovation is beyond the gate."""
    p = fix.p
    innovation = heading_innovation(block.east, block.north) - fix.turn.z
    r = params.mag_noise * params.mag_noise * (DEGREE * DEGREE) / min(block.spell, ONE)
    square = innovation * innovation
    if square > params.gate * params.gate * (p.azz + r):
        out += block.spell
        if out <= params.gate_time:
            return Seen(fix, out)
        p = looser(p, 0.0, square)
        fix = Fix(fix.turn, fix.bias, p)
    return Seen(upright(fix, update(fix, p.axz, p.ayz, p.azz, p.czx, p.czy, p.czz, p.azz + r, innovation)), 0.0)


@kernel
def upright(before: Fix, after: Fix) -> Fix:
    """An update whose gain for tilt is zero: then K hᵀP + P h Kᵀ − K s Kᵀ, as in (8), is all of (7) but that block."""
    x, y, _ = before.turn
    p = after.p
    old = before.p
    return Fix(
        Vec3(x, y, after.turn.z),
        after.bias,
        Cov(
            old.axx, old.axy, p.axz, old.ayy, p.ayz, p.azz,
            p.cxx, p.cxy, p.cxz, p.cyx, p.cyy, p.cyz, p.czx, p.czy, p.czz,
            p.bxx, p.bxy, p.bxz, p.byy, p.byz, p.bzz,
        ),
    )  # fmt: skip


@kernel
def gathered(block: Block, attitude: Quat, rate: Vec3, acc: Vec3, mag: Vec3, dt: float) -> Block:
    """The block with one more sample."""
    spell, turned, seen, rough, east, north = block
    x, y, z = rate
    turned += (x * x + y * y + z * z) * dt
    if tilt.present(acc):
        x, y, z = acc
        off = HALF_PER_G2 * (x * x + y * y + z * z) - 0.5  # |a|/g − 1 to first order
        seen += dt
        rough += off * off * dt
    if tilt.present(mag):
        x, y, z = quat.rotate(attitude, mag)
        east += x
        north += y
    return Block(spell + dt, turned, seen, rough, east, north)


@kernel
def lowpassed(params: EKF, force: Vec3, attitude: Quat, acc: Vec3, age: float, dt: float) -> Vec3:
    """Specific force in the earth frame, in g."""
    x, y, z = quat.rotate(attitude, acc)
    a, b, c = force
    weight = share(params.acc_tau, age, dt)
    return Vec3(a + weight * (x * PER_G - a), b + weight * (y * PER_G - b), c + weight * (z * PER_G - c))


@kernel
def predicted(params: EKF, p: Cov, attitude: Quat, block: Block, dt: float) -> Cov:
    """P at the end of a block, whose last sample came after ``dt``."""
    if dt > GAP_SECONDS:
        return across_gap(params, p, dt)
    noise = params.gyr_noise * DEGREE
    walk = params.bias_walk * DEGREE
    spell = block.spell
    turn = noise * noise * spell + params.gyr_scale * params.gyr_scale * block.turned
    return predict(p, quat.matrix(attitude), turn, walk * walk * spell, spell)


@kernel
def step(params: EKF, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """The attitude at every sample, and what the next correction is made of."""
    attitude, bias, p, force, age, block, acc_out, mag_out, health = state
    x, y, z = gyr
    a, b, c = bias
    attitude = quat.integrate(attitude, Vec3(x - a, y - b, z - c), dt)
    age = older(age, dt)
    block = gathered(block, attitude, gyr, acc, mag, dt)
    if tilt.present(acc):
        force = lowpassed(params, force, attitude, acc, age, dt)
    return State(attitude, bias, p, force, age, block, acc_out, mag_out, health)


@kernel
def due(params: EKF, state: State) -> bool:
    """Whether a block has ended."""
    return state.block.spell >= params.block


@kernel
def correct(params: EKF, state: State, dt: float) -> State:
    """Eqs. 3 to 7 at the end of every block, whose last sample came after ``dt``."""
    attitude, bias, p, force, age, block, acc_out, mag_out, health = state
    health = 0
    fix = Fix(ZERO, bias, predicted(params, p, attitude, block, dt))
    if block.seen > 0.0:
        fix, acc_out = see_gravity(params, fix, force, block, acc_out)
        if acc_out > 0.0:
            health = ACC_REJECTED
    if block.east != 0.0 or block.north != 0.0:
        fix, mag_out = see_field(params, fix, block, mag_out)
        if mag_out > 0.0:
            health |= MAG_REJECTED
    swing = quat.exp(fix.turn)
    force = followed(force, fix.turn, swing)
    return State(quat.compose(swing, attitude), fix.bias, fix.p, force, age, EMPTY, acc_out, mag_out, health)


@kernel
def followed(force: Vec3, turn: Vec3, swing: Quat) -> Vec3:
    """The low-passed force after the attitude was corrected; it is upright itself, so a small turn needs no more."""
    x, y, _ = turn
    if x * x + y * y < SMALL_TURN:
        a, b, c = force
        return Vec3(a + y * c, b - x * c, c)
    return quat.rotate(swing, force)


@kernel
def inflate(params: EKF, state: State, variance: float) -> State:
    """The whole attitude less sure, and the force in the earth frame seen afresh: it was turned with the error."""
    attitude, bias, p, force, _, block, acc_out, mag_out, health = state
    return State(attitude, bias, looser(p, variance, variance), force, 0.0, block, acc_out, mag_out, health)


@kernel
def inflate_heading(params: EKF, state: State, variance: float) -> State:
    """Heading less sure."""
    attitude, bias, p, force, age, block, acc_out, mag_out, health = state
    return State(attitude, bias, looser(p, 0.0, variance), force, age, block, acc_out, mag_out, health)


@kernel
def at_rest(params: EKF, state: State) -> State:
    """What is left of the bias once it has been read off at rest is small, and was not caused by the attitude."""
    attitude, bias, p, force, age, block, acc_out, mag_out, health = state
    if p.bxx + p.byy + p.bzz <= 6.0 * RESTED:
        return state
    known = Cov(
        p.axx, p.axy, p.axz, p.ayy, p.ayz, p.azz,
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        RESTED, 0.0, 0.0, RESTED, 0.0, RESTED,
    )  # fmt: skip
    return State(attitude, bias, known, force, age, block, acc_out, mag_out, health)


@kernel
def output(params: EKF, state: State) -> Output:
    """Attitude, bias, σ and health."""
    p = state.p
    return Output(
        state.quat,
        state.bias,
        Vec3(
            min(sqrt(max(p.axx, 0.0)), UNIFORM),
            min(sqrt(max(p.ayy, 0.0)), UNIFORM),
            min(sqrt(max(p.azz, 0.0)), UNIFORM),
        ),
        state.health,
    )


FILTER = Filter(
    name="EKF",
    params=EKF,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "heading", "bias", "sigma"}),
    uses=frozenset({"gyr", "acc", "mag"}),
    citation="E. J. Lefferts, F. L. Markley, M. D. Shuster, Kalman Filtering for Spacecraft Attitude Estimation, "
    "Journal of Guidance, Control, and Dynamics 5(5), 1982",
    settles=Settling(15.0, 120.0),
    inflation=Inflation(inflate, inflate_heading),
    at_rest=at_rest,
    schedule=Schedule(due, correct),
)
