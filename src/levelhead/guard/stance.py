"""Whether the foot of a walker stands, sample by sample: the likelihood ratio of ``gaits.stance`` in constant memory.

The window of ``WINDOW`` s is five parts of a fifth of it and the one that grows: sums of the specific force f, of |f|²
and of the rate's |ω|². With u the direction of the mean force,

    a² = mean |f − g u|²,    w² = mean |ω|²                                                                     (1)

A foot that stands has the noises σ_a and σ_w along each axis, one that moves s_a and s_w. It stands where that is
likelier (I. Skog, P. Händel, J.-O. Nilsson, J. Rantakokko, IEEE Trans. Biomed. Eng. 57(11), 2010, with Gaussians on
both sides):

    a²/σ_a² + w²/σ_w² − a²/s_a² − w²/s_w² < 3 ln(s_a² s_w²/(σ_a² σ_w²))                                          (2)

All four follow the walk: running means over ``MEMORY``. Nothing here depends on the sensor's axes.
"""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.vec3 import ZERO, Vec3, add, dot, norm, scale
from levelhead.units import DEGREE, GRAVITY

WINDOW = 0.1  # s
MEMORY = 3.0  # s of stance, or of swing, over which the noises are averaged
LONGEST = 1.5  # s, of a stance between two strides
SHORTEST = 0.06  # s
ARM = 0.1  # m, by which the sensor is above the point about which a standing foot rolls
LASTING = 0.1  # s for which the velocity by that rolling is alike
PART = WINDOW / 5.0  # s


class Sums(NamedTuple):
    """Sums over a part of the window, each reading times its interval."""

    force: Vec3
    force2: float
    rate2: float
    time: float


class StanceNoise(NamedTuple):
    """Variances along each axis."""

    acc: float  # (m/s²)²
    gyr: float  # (rad/s)²


STANDING = StanceNoise(0.15**2, (6.0 * DEGREE) ** 2)  # of a walker's foot at first
MOVING = StanceNoise(9.0**2, (150.0 * DEGREE) ** 2)
LEAST = StanceNoise(0.01**2, (0.1 * DEGREE) ** 2)  # of a stance without noise


class StanceState(NamedTuple):
    """The state of a foot."""

    first: Sums  # the parts of the window
    second: Sums
    third: Sums
    fourth: Sums
    fifth: Sums
    now: Sums
    still: StanceNoise
    moving: StanceNoise
    stood: float  # s for which it stands; less than 0: there was no sample
    swung: float  # s since it stood for ``SHORTEST``
    begins: bool  # it has stood for ``SHORTEST`` with this sample, and not before
    sigma: float  # m/s, 1σ of its zero velocity; 0: it moves


NOTHING = Sums(force=ZERO, force2=0.0, rate2=0.0, time=0.0)


@kernel
def begin_stance() -> StanceState:
    """Before the first sample."""
    return StanceState(
        first=NOTHING, second=NOTHING, third=NOTHING, fourth=NOTHING, fifth=NOTHING, now=NOTHING, still=STANDING,
        moving=MOVING, stood=-1.0, swung=0.0, begins=False, sigma=0.0,
    )  # fmt: skip


@kernel
def add_sums(a: Sums, b: Sums) -> Sums:
    """Both parts together."""
    return Sums(force=add(a.force, b.force), force2=a.force2 + b.force2, rate2=a.rate2 + b.rate2, time=a.time + b.time)


@kernel
def log(x: float) -> float:
    """ln x for 1 ≤ x < 10¹³ within 10⁻⁵ of it, by roots: ln x = 128 arsinh(y), y = (r − 1/r)/2, r the 128th root."""
    r = sqrt(sqrt(sqrt(sqrt(sqrt(sqrt(sqrt(x)))))))
    y = 0.5 * (r - 1.0 / r)
    y2 = y * y
    return 128.0 * y * (1.0 - y2 * (1.0 / 6.0 - y2 * (0.075 - y2 * (15.0 / 336.0))))


@kernel
def follow(before: StanceNoise, now: StanceNoise, share: float) -> StanceNoise:
    """A running mean of noises."""
    return StanceNoise(before.acc + share * (now.acc - before.acc), before.gyr + share * (now.gyr - before.gyr))


@kernel
def at_least(noise: StanceNoise, least: StanceNoise, factor: float) -> StanceNoise:
    """Noises of at least so many times others."""
    return StanceNoise(max(factor * least.acc, noise.acc), max(factor * least.gyr, noise.gyr))


@kernel
def step_stance(stance: StanceState, gyr: Vec3, acc: Vec3, dt: float) -> StanceState:
    """A sample (rad/s, m/s², ``dt`` s); it stands where ``sigma`` is not 0. NaN: the foot moves until it has left."""
    dt = 0.0 if stance.stood < 0.0 else dt  # before the first sample nothing is known
    first, second, third, fourth, fifth, now = (
        stance.first, stance.second, stance.third, stance.fourth, stance.fifth, stance.now,
    )  # fmt: skip
    if has_elapsed(now.time, dt, PART):
        first, second, third, fourth, fifth, now = second, third, fourth, fifth, now, NOTHING
    now = add_sums(now, Sums(force=scale(acc, dt), force2=dt * dot(acc, acc), rate2=dt * dot(gyr, gyr), time=dt))
    window = add_sums(add_sums(add_sums(first, second), add_sums(third, fourth)), add_sums(fifth, now))
    one = 1.0 / max(window.time, 1e-9)
    turn = one * window.rate2
    push = max(one * window.force2 - 2.0 * GRAVITY * one * norm(window.force) + GRAVITY * GRAVITY, 0.0)
    known = window.force2 - window.force2 == 0.0 and window.rate2 - window.rate2 == 0.0
    whole = known and first.time > 0.0
    still, moving = stance.still, stance.moving
    statistic = push * (1.0 / still.acc - 1.0 / moving.acc) + turn * (1.0 / still.gyr - 1.0 / moving.gyr)
    stands = whole and statistic < 3.0 * log(moving.acc / still.acc * (moving.gyr / still.gyr))
    stood = stance.stood + dt if stands else 0.0
    lasts = stands and has_elapsed(stood, dt, SHORTEST)
    begins = lasts and not has_elapsed(stance.stood, dt, SHORTEST)
    if whole:
        share = dt / (MEMORY + dt)
        found = StanceNoise(push / 3.0, turn / 3.0)
        if not stands:
            moving = follow(moving, found, share)
        elif stood < LONGEST:  # who waits is quieter than a stance
            still = follow(still, found, share)
        still = at_least(still, LEAST, 1.0)
        moving = at_least(moving, still, 4.0)
    sigma = ARM * sqrt(still.gyr * max(1.0, LASTING / max(dt, 1e-9))) if stands else 0.0
    return StanceState(
        first=first, second=second, third=third, fourth=fourth, fifth=fifth, now=now, still=still, moving=moving,
        stood=stood, swung=0.0 if lasts else stance.swung + dt, begins=begins, sigma=sigma,
    )  # fmt: skip
