"""Detectors that need the readings alone: full scale, axes that hang, spikes, and specific force that is not gravity.

Their results are the same for every run over a recording, so lanes compute them once for all. A reading that is missing
is left out: the slow mean replaces it in the sums for rest, and no other detector uses it.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.health import (
    ACC_MISSING,
    ACC_SATURATED,
    ACC_STUCK,
    GYR_MISSING,
    GYR_SATURATED,
    GYR_SPIKE,
    GYR_STUCK,
)
from levelhead.guard.params import Guard
from levelhead.guard.rate_jump import NO_JUMP, Jump, update_jump
from levelhead.guard.rate_noise import NO_NOISE, RateNoise, is_silent, update_noise
from levelhead.guard.rest import NO_SUMS, SlowMeans, Sums, add_sample, update_means
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.vec3 import ZERO, Vec3, add, scale, sub
from levelhead.units import DEGREE, GRAVITY

LEAST_GYR_SCALE = 4.0  # rad/s: no gyroscope has a smaller full scale (250 °/s) than this
LEAST_ACC_SCALE = 19.0  # m/s²: no accelerometer has a smaller full scale (2 g) than this
PLATEAU = 0.997  # of the largest reading so far: readings above this may be clipped
APPROACH = 0.7  # of the largest reading so far: a reading that rises from below this in two samples rises steeply
AT_FULL = 0.99  # of a full scale found: where it ends drifts with temperature
STEEP = 1.0  # 1/s, of the reading itself
PLATEAU_SECONDS = 0.02  # at least, and
FLAT = 0.12  # slope (1/s) times seconds: of a smooth peak, which is flat to PLATEAU, it is 0.012
CREEP = 0.3  # 1/s of the reading itself: where a full scale ends drifts with temperature and with other axes
NOT_STEEP = -1.0
LEAST = 1e-5  # rad/s, m/s²: no sensor has finer steps than this
STEPS = 2.5  # a change of two steps of the sensor's numbers is rounding, of three it is motion
NO_STEP = 1e9  # rad/s, m/s²: no change was seen yet
NO_READING = 2e9  # in its place: no reading was seen yet
GROUP_DELAY = 0.0019  # s, of a gyroscope's low-pass filter: MPU-6050 register map, register 26, DLPF_CFG 1
STUCK_SAMPLES = 20.0
STUCK_SECONDS = 1.0  # of one value while another axis moves


class Extreme(NamedTuple):
    """The largest readings of a sensor so far, upwards and downwards (any axis), and whether they are its full scale.

    Calibration moves the two ends of a range by different amounts.
    """

    up: float
    down: float
    last: float  # largest component of the last reading
    before: float  # and of the one before
    slope: float  # 1/s of the reading itself, by which it was reached
    stay: float  # s near the largest since it was reached abruptly; negative: it was not
    found: int  # 1: up is full scale, 2: down is
    clipped: bool


class Repeat(NamedTuple):
    """The last reading, the axes that have repeated theirs since (bits 1, 2, 4), and for how many seconds."""

    last: Vec3
    axes: int
    time: float
    step: float  # rad/s, m/s²: the smallest change of an axis so far, which is the step of the sensor's numbers


class DetectorState(NamedTuple):
    """The detectors' memory of the readings, and their findings in the last of them."""

    sums: Sums
    means: SlowMeans
    gyr_extreme: Extreme
    acc_extreme: Extreme
    gyr_repeat: Repeat
    acc_repeat: Repeat
    jump: Jump  # of the gyroscope
    noise: RateNoise
    far_from_g: bool  # the norm of the last specific force is
    was_far: bool  # and so it was at the sample before
    health: int


@kernel
def below_full_scale(up: float, down: float, found: int) -> Extreme:
    """The state after a reading far below full scale."""
    return Extreme(up=up, down=down, last=0.0, before=0.0, slope=0.0, stay=NOT_STEEP, found=found, clipped=False)


NO_SAMPLES = DetectorState(
    sums=NO_SUMS,
    means=SlowMeans(ZERO, ZERO, 0.0),
    gyr_extreme=below_full_scale(LEAST_GYR_SCALE, LEAST_GYR_SCALE, 0),
    acc_extreme=below_full_scale(LEAST_ACC_SCALE, LEAST_ACC_SCALE, 0),
    gyr_repeat=Repeat(last=ZERO, axes=0, time=0.0, step=NO_READING),
    acc_repeat=Repeat(last=ZERO, axes=0, time=0.0, step=NO_READING),
    jump=NO_JUMP,
    noise=NO_NOISE,
    far_from_g=False,
    was_far=False,
    health=0,
)


@kernel
def update_extreme(extreme: Extreme, v: Vec3, full: float, dt: float) -> Extreme:
    """Whether a reading is at full scale: ``full`` if known (not 0), else the largest one so far if it is a plateau."""
    x, y, z = v
    far = APPROACH * min(extreme.up, extreme.down)
    if full == 0.0 and max(abs(x), abs(y), abs(z)) < far:  # nearly always
        if extreme.last == 0.0 and not extreme.clipped:
            return extreme
        return below_full_scale(extreme.up, extreme.down, extreme.found)
    if full > 0.0:
        return Extreme(
            up=full, down=full, last=0.0, before=0.0, slope=0.0, stay=NOT_STEEP, found=3, clipped=is_at_range(v, full)
        )
    return update_plateau(extreme, max(x, y, z), -min(x, y, z), dt)


@noinline
def update_plateau(extreme: Extreme, high: float, low: float, dt: float) -> Extreme:
    """Whether the largest component of a reading, ``high`` upwards or ``low`` downwards, is on a plateau.

    A body slows down before it turns round; a clipped reading goes up steeply and then stays.
    """
    up, down, last = extreme.up, extreme.down, extreme.last
    slope, stay, found = extreme.slope, extreme.stay, extreme.found
    upwards = high > low
    largest = high if upwards else low
    top = up if upwards else down
    side = 1 if upwards else 2
    if largest < PLATEAU * top:
        return Extreme(
            up=up,
            down=down,
            last=largest,
            before=last,
            slope=0.0,
            stay=NOT_STEEP,
            found=found,
            clipped=found & side != 0 and largest > AT_FULL * top,
        )
    beyond = PLATEAU * largest > top
    if beyond and found & side != 0:
        found -= side  # its range is larger than that
    steady = stay >= 0.0 and largest - last < CREEP * dt * largest
    if not steady and (beyond or last < PLATEAU * top):
        slope = max(largest - last, last - extreme.before) / (dt * largest)
        stay = 0.0 if slope > STEEP else NOT_STEEP
    elif stay >= 0.0:
        stay += dt
        if has_elapsed(stay, dt, PLATEAU_SECONDS) and slope * stay >= FLAT:
            found |= side
        if found & side == 0:  # a plateau is as high as it began
            high, low = up, down
    return Extreme(
        up=max(up, high),
        down=max(down, low),
        last=largest,
        before=last,
        slope=slope,
        stay=stay,
        found=found,
        clipped=found & side != 0,
    )


@kernel
def is_at_range(v: Vec3, full: float) -> bool:
    """Whether a reading is at a full scale that is known (not 0)."""
    x, y, z = v
    return full > 0.0 and max(abs(x), abs(y), abs(z)) >= PLATEAU * full


@kernel
def smaller_step(step: float, change: float) -> float:
    """The step of a sensor's numbers after an axis changed by ``change``."""
    return change if 0.0 < change < step else step


@kernel
def update_repeat(repeat: Repeat, v: Vec3, dt: float) -> Repeat:
    """Which axes repeat their last value while another one moves.

    Zero does not count (simulations without noise), nor changes of a step or two: numbers of few digits
    repeat at rest.
    """
    (a, b, c), axes, time, step = repeat
    if step > NO_STEP:
        return Repeat(last=v, axes=0, time=0.0, step=NO_STEP)
    x, y, z = v
    p = abs(x - a)
    q = abs(y - b)
    r = abs(z - c)
    smallest = min(p, q, r)
    if smallest > 0.0:
        return Repeat(last=v, axes=0, time=0.0, step=min(step, smallest))
    step = smaller_step(smaller_step(smaller_step(step, p), q), r)
    if max(p, q, r) < max(LEAST, STEPS * step):
        return Repeat(last=repeat.last, axes=axes, time=time, step=step)
    same = 0
    if p == 0.0 and x != 0.0:
        same |= 1
    if q == 0.0 and y != 0.0:
        same |= 2
    if r == 0.0 and z != 0.0:
        same |= 4
    if axes & same == 0:
        return Repeat(last=v, axes=same, time=0.0, step=step)
    return Repeat(last=v, axes=axes & same, time=time + dt, step=step)


@kernel
def is_stuck(repeat: Repeat, dt: float) -> bool:
    """Whether an axis has repeated one value for 1 s and 20 samples while another one changed."""
    return repeat.time > 0.0 and has_elapsed(repeat.time, dt, max(STUCK_SECONDS, STUCK_SAMPLES * dt))


@kernel
def is_far_from_g(guard: Guard, acc: Vec3) -> bool:
    """Whether the norm of a specific force (m/s²) is more than ``acc_gate`` from g."""
    x, y, z = acc
    square = x * x + y * y + z * z
    low = max(GRAVITY - guard.acc_gate, 0.0)
    high = GRAVITY + guard.acc_gate
    return not low * low <= square <= high * high


@kernel
def detect(
    guard: Guard, state: DetectorState, gyr: Vec3, acc: Vec3, missing: int, blind: bool, lost: bool, dt: float
) -> DetectorState:
    """The detectors after one sample (rad/s, m/s², ``dt`` s).

    ``missing``: health bits of the missing readings; ``blind``: the rate has been missing for long; ``lost``: samples
    were lost before this one.
    """
    means, jump, noise, far = state.means, state.jump, state.noise, state.far_from_g
    gyr_extreme, acc_extreme = state.gyr_extreme, state.acc_extreme
    gyr_repeat, acc_repeat = state.gyr_repeat, state.acc_repeat
    health = 0
    no_gyr = missing & GYR_MISSING != 0
    no_acc = missing & ACC_MISSING != 0
    if not no_gyr:
        plausible = lost or is_at_range(gyr, guard.gyr_range * DEGREE)
        jump = update_jump(jump, gyr, jump.force if no_acc else acc, plausible, dt)
        gyr = jump.rate
        if jump.spikes > 0:
            health = GYR_SPIKE
    sums = add_sample(state.sums, means.gyr if no_gyr else gyr, means.acc if no_acc else acc, dt)
    if sums.complete:
        means = update_means(guard, means, sums, blind)
    if not no_gyr:
        gyr_extreme = update_extreme(gyr_extreme, gyr, guard.gyr_range * DEGREE, dt)
        gyr_repeat = update_repeat(gyr_repeat, gyr, dt)
        if gyr_extreme.clipped:
            health |= GYR_SATURATED
        noise = update_noise(noise, gyr, means.pace > 0.0, dt)
        if is_stuck(gyr_repeat, dt) or is_silent(noise):
            health |= GYR_STUCK
    if not no_acc:
        acc_extreme = update_extreme(acc_extreme, acc, guard.acc_range, dt)
        acc_repeat = update_repeat(acc_repeat, acc, dt)
        if acc_extreme.clipped:
            health |= ACC_SATURATED
        elif is_stuck(acc_repeat, dt):
            health |= ACC_STUCK
        far = is_far_from_g(guard, acc)
    return DetectorState(
        sums=sums,
        means=means,
        gyr_extreme=gyr_extreme,
        acc_extreme=acc_extreme,
        gyr_repeat=gyr_repeat,
        acc_repeat=acc_repeat,
        jump=jump,
        noise=noise,
        far_from_g=far,
        was_far=state.far_from_g,
        health=health,
    )


@kernel
def accepted_rate(state: DetectorState, gyr: Vec3) -> Vec3:
    """The rate (rad/s) in place of the last sample, see ``rate_jump``; zero from a gyroscope that hangs."""
    if is_silent(state.noise):
        return ZERO
    return add(state.jump.rate, state.jump.returned)


@kernel
def mean_rate(before: Vec3, now: Vec3, lost: float, dt: float) -> Vec3:
    """The mean rate (rad/s) over the ``dt`` seconds between the stamps of two readings.

    A reading is the rate ``GROUP_DELAY`` before its stamp, with a straight line between two readings. The mean is the
    later reading less a share 1/2 − ``GROUP_DELAY``/dt of the change. Below twice the delay it is the later reading:
    nothing is extrapolated.
    """
    share = max(0.5 - GROUP_DELAY / dt, 0.0)
    return sub(now, scale(sub(now, before), share))
