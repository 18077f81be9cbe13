"""The offset of a raw magnetometer (hard iron), found recursively from the turns that the gyroscope measures.

Between two readings m₀ and m₁ the sensor turns by R, and the field h = m − o stays where it is:

    m₁ − o = Rᵀ (m₀ − o)   ⇔   y = A o,   y = m₁ − Rᵀ m₀,   A = 1 − Rᵀ                                           (1)

which is the integral of ṁ + ω × (m − o) = 0. With R = (w, v) as a unit quaternion

    AᵀA = 4 (v·v 1 − v vᵀ),   Aᵀ e = e − R e                                                                    (2)

A pair of readings ends when the sensor has turned by ``TURN``: AᵀA is then of order one, and a gyroscope's bias has had
a second or two. Recursive least squares with a memory of ``MEMORY`` pairs and a prior that stays give o. It is used
only when it explains later pairs much better than no offset does.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.guard.params import Guard
from levelhead.kernels import mat3, quat
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GAP_SECONDS, is_present
from levelhead.kernels.vec3 import ZERO, Vec3, add, dot, scale, sub

TURN = 0.866  # |w| of the turn that ends a pair: 60°
LEAST_TURN = 0.966  # |w| of the least turn of a pair that counts: 30°
LONGEST = 2.0  # s of a pair: no wrong bias of the gyroscope makes 30° of it, by which a field at rest seems an offset
MEMORY = 100.0  # pairs
KEEP = 1.0 - 1.0 / MEMORY
PRIOR = 0.03  # of AᵀA: the offset is 0 along an axis about which nothing turns
LEAK = PRIOR / MEMORY  # the share of it that the memory loses
PAIRS = 12.0  # at least, of an offset that is taken off
GAIN = 6.0  # Σ |y|² over Σ |y − A o|², at least
LEAST_SIGMAS = 4.0  # of its level part
MOST_SIGMA = 0.15  # of the field: 1σ of its level part
USUAL = 4.0  # times the mean square, beyond which a pair counts by its size and no more by its square (Huber)


class Pair(NamedTuple):
    """Two readings of the field."""

    first: Vec3  # µT; the zero vector: there is none
    turn: Quat  # of the sensor since then, of any length
    time: float  # s since then


class Information(NamedTuple):
    """Σ AᵀA, a symmetric matrix."""

    xx: float
    xy: float
    xz: float
    yy: float
    yz: float
    zz: float


class MagOffset(NamedTuple):
    """The offset and its evidence."""

    pair: Pair
    offset: Vec3  # µT
    information: Information
    before: float  # µT², Σ |y|²
    left: float  # µT², Σ |y − A o|² with the offset from earlier pairs
    pairs: float  # in memory
    known: bool  # it is taken off


NO_TURN = Quat(1.0, 0.0, 0.0, 0.0)
NO_IRON = MagOffset(
    pair=Pair(ZERO, NO_TURN, 0.0),
    offset=ZERO,
    information=Information(xx=PRIOR, xy=0.0, xz=0.0, yy=PRIOR, yz=0.0, zz=PRIOR),
    before=0.0,
    left=0.0,
    pairs=0.0,
    known=False,
)


@kernel
def turn_pair(pair: Pair, gyr: Vec3, dt: float) -> Pair:
    """The pair after ``dt`` seconds more at a rate (rad/s); to first order, its length grows with the second."""
    w, x, y, z = pair.turn
    half = 0.5 * dt
    a = gyr.x * half
    b = gyr.y * half
    c = gyr.z * half
    return Pair(
        first=pair.first if dt <= GAP_SECONDS else ZERO,
        turn=Quat(
            w - (x * a + y * b + z * c),
            x + (w * a + (y * c - z * b)),
            y + (w * b + (z * a - x * c)),
            z + (w * c + (x * b - y * a)),
        ),
        time=pair.time + dt,
    )


@kernel
def start_pair(iron: MagOffset, pair: Pair) -> MagOffset:
    """The same offset and evidence with another pair."""
    return MagOffset(
        pair=pair, offset=iron.offset, information=iron.information, before=iron.before, left=iron.left,
        pairs=iron.pairs, known=iron.known,
    )  # fmt: skip


@kernel
def accept(iron: MagOffset) -> MagOffset:
    """The offset is taken off from here on."""
    return MagOffset(
        pair=iron.pair, offset=iron.offset, information=iron.information, before=iron.before, left=iron.left,
        pairs=iron.pairs, known=True,
    )  # fmt: skip


@kernel
def is_complete(pair: Pair, dt: float) -> bool:
    """Whether a pair ends with this reading, ``dt`` seconds after the sample before."""
    return abs(pair.turn.w) < TURN or has_elapsed(pair.time, dt, LONGEST)


@kernel
def add_turn(information: Information, weight: float, v: Vec3) -> Information:
    """The information with (2) of one more turn; the prior is not forgotten."""
    x, y, z = v
    four = 4.0 * weight
    square = x * x + y * y + z * z
    return Information(
        xx=KEEP * information.xx + LEAK + four * (square - x * x),
        xy=KEEP * information.xy - four * x * y,
        xz=KEEP * information.xz - four * x * z,
        yy=KEEP * information.yy + LEAK + four * (square - y * y),
        yz=KEEP * information.yz - four * y * z,
        zz=KEEP * information.zz + LEAK + four * (square - z * z),
    )


@kernel
def invert(information: Information) -> Mat3:
    """(Σ AᵀA)⁻¹"""
    xx, xy, xz, yy, yz, zz = information
    return mat3.inverse(Mat3(xx, xy, xz, xy, yy, yz, xz, yz, zz)).matrix


@kernel
def mean_variance(covariance: Mat3, turn: Quat) -> float:
    """tr(A P Aᵀ)/3, with (2)."""
    _, x, y, z = turn
    trace = covariance.xx + covariance.yy + covariance.zz
    along = dot(Vec3(x, y, z), mat3.apply(covariance, Vec3(x, y, z)))
    return (4.0 / 3.0) * ((x * x + y * y + z * z) * trace - along)


@kernel
def is_certain(guard: Guard, iron: MagOffset, variance: float, mag: Vec3) -> bool:
    """Whether an offset whose level part has this variance (µT²) is beyond doubt, and worth a turn of heading."""
    field = sub(mag, iron.offset)
    strength = dot(field, field)
    size = dot(iron.offset, iron.offset)
    return (
        iron.pairs > PAIRS
        and iron.before > GAIN * iron.left
        and size > guard.iron * guard.iron * strength
        and size > LEAST_SIGMAS * LEAST_SIGMAS * variance
        and variance < MOST_SIGMA * MOST_SIGMA * strength
    )


@noinline
def end_pair(guard: Guard, iron: MagOffset, up: Vec3, mag: Vec3) -> MagOffset:
    """The offset after the pair that ends with this reading (µT); ``up`` is the vertical in the sensor frame.

    The residual of a pair counts by its variance under the present offset, as the first pairs are far off.
    """
    first, turn = iron.pair.first, quat.normalize(iron.pair.turn)
    offset, information = iron.offset, iron.information
    before, left, pairs = iron.before, iron.left, iron.pairs
    pair = Pair(mag, NO_TURN, 0.0)
    if not is_present(first) or abs(turn.w) > LEAST_TURN:
        return start_pair(iron, pair)
    back = quat.conjugate(turn)
    change = sub(mag, quat.rotate(back, first))
    error = sub(sub(mag, offset), quat.rotate(back, sub(first, offset)))
    covariance = invert(information)
    share = 1.0 / (1.0 + mean_variance(covariance, turn))
    square = share * dot(error, error)
    weight = 1.0 if pairs * square <= USUAL * left or pairs < PAIRS else USUAL * left / (pairs * square)
    information = add_turn(information, weight, Vec3(turn.x, turn.y, turn.z))
    covariance = invert(information)
    pull = scale(sub(error, quat.rotate(turn, error)), weight)
    step = mat3.apply(covariance, sub(pull, scale(offset, LEAK)))
    found = MagOffset(
        pair=pair,
        offset=add(offset, step),
        information=information,
        before=KEEP * before + weight * share * dot(change, change),
        left=KEEP * left + weight * square,
        pairs=KEEP * pairs + share,
        known=iron.known,
    )
    level = covariance.xx + covariance.yy + covariance.zz - dot(up, mat3.apply(covariance, up))
    variance = found.left / (3.0 * found.pairs) * level  # the vertical part does not turn heading
    return found if iron.known or not is_certain(guard, found, variance, mag) else accept(found)


@kernel
def update_iron(guard: Guard, iron: MagOffset, up: Vec3, gyr: Vec3, mag: Vec3, dt: float) -> MagOffset:
    """After a sample of ``dt`` seconds: the vertical in the sensor frame, mean rate (rad/s), and a reading (µT) or the
    zero vector."""
    pair = turn_pair(iron.pair, gyr, dt)
    iron = start_pair(iron, pair)
    if is_present(mag) and is_complete(pair, dt):
        return end_pair(guard, iron, up, mag)
    return iron
