"""The conditioning of a sample, before any filter sees it: it depends on the readings only.

NaN marks a missing reading; the zero vector marks a sensor that does not exist. A missing rate is replaced by the last
one, for at most ``GAP_SECONDS``; any other missing reading becomes the zero vector, which corrects nothing. The result
is the same for every filter and every parameter set, so lanes compute it once for all of their runs.
"""

from typing import NamedTuple, Protocol

from levelhead.compiler.hooks import declare
from levelhead.compiler.mark import kernel
from levelhead.engine.full_scale import NO_APPROACH, Approach, mean_beyond, unmeasured_angle, update_approach
from levelhead.filters.health import (
    ACC_MISSING,
    ACC_STUCK,
    GAP,
    GYR_MISSING,
    GYR_SATURATED,
    GYR_STUCK,
    MAG_MISSING,
)
from levelhead.filters.observer_covariance import INTERVAL
from levelhead.guard import Guard
from levelhead.guard.detectors import NO_SAMPLES, DetectorState, Extreme
from levelhead.guard.rate_jump import first_rate
from levelhead.guard.rest import NO_SUMS, SlowMeans
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.tilt import GAP_SECONDS, TURN, is_present
from levelhead.kernels.vec3 import ZERO, Vec3, add, dot, scale, sub
from levelhead.units import DEGREE

READING_LIMIT = 1e9  # rad/s, m/s², µT: a longer reading is missing; NaN and infinity fail the comparison too
SQUARE_LIMIT = READING_LIMIT * READING_LIMIT
RATE_UNUSABLE = GYR_MISSING | GYR_SATURATED | GYR_STUCK  # the rate is not the body's
LEAST_ROTATION = 5.5 * DEGREE  # rad, 1σ of an unmeasured rotation from which the filter's covariance is inflated
INTERVALS = 16.0  # over which the usual interval is averaged
CHANGE_VARIANCE = 1.0 / 12.0  # of a number that is uniform between 0 and 1: when in a lost interval the rate changed
RETURN_VARIANCE = 0.06  # of the rate between, as a share of its square


class ConditionedSample(NamedTuple):
    """The last sample without its unusable readings, and the sums over the samples before it."""

    gyr: Vec3  # rad/s, in the mean over dt as far as known; where it is missing the last one that was not
    acc: Vec3  # m/s²; the zero vector where it cannot be used
    mag: Vec3  # µT; the zero vector where it cannot be used
    dt: float  # s
    interval: float  # s, usual one
    health: int  # Health bits of its readings
    had_field: bool  # an earlier sample had a magnetometer reading
    started: bool  # this or an earlier sample had a specific force, which a filter needs to start
    rate_unknown: bool  # the rotation in dt is unknown
    rate_age: float  # s since the last usable rate; of a clipped one since it reached full scale
    unmeasured: float  # rad², variance of the part of this sample's rotation that was not measured
    since_sigma: float  # s since σ was last updated
    corrected_by: int  # sensors with a usable reading since then: 1 accelerometer, 2 magnetometer
    detected: DetectorState
    rate: Approach  # rad/s; where it is missing the last one that was not
    force: Approach  # m/s²


NO_SAMPLE = ConditionedSample(
    gyr=ZERO,
    acc=ZERO,
    mag=ZERO,
    dt=0.0,
    interval=0.0,
    health=0,
    had_field=False,
    started=False,
    rate_unknown=False,
    rate_age=0.0,
    unmeasured=0.0,
    since_sigma=0.0,
    corrected_by=0,
    detected=NO_SAMPLES,
    rate=NO_APPROACH,
    force=NO_APPROACH,
)


@kernel
def missing_bits(gyr: Vec3, acc: Vec3, mag: Vec3) -> int:
    """Health bits of the readings that are missing."""
    rate2 = dot(gyr, gyr)
    force2 = dot(acc, acc)
    field2 = dot(mag, mag)
    if rate2 + force2 + field2 < SQUARE_LIMIT:
        return 0
    health = 0
    if not rate2 < SQUARE_LIMIT:
        health = GYR_MISSING
    if not force2 < SQUARE_LIMIT:
        health |= ACC_MISSING
    if not field2 < SQUARE_LIMIT:
        health |= MAG_MISSING
    return health


class DetectorHooks(Protocol):
    """The functions of the guard's detectors that conditioning calls; see ``driver.Hooks``."""

    @staticmethod
    @kernel
    def detect(
        guard: Guard,
        detected: DetectorState,
        gyr: Vec3,
        acc: Vec3,
        missing: int,
        rate_lost: bool,
        lost: bool,
        dt: float,
    ) -> DetectorState:
        """The detectors' next state, with its health bits."""
        return detected

    @staticmethod
    @kernel
    def accepted_rate(detected: DetectorState, gyr: Vec3) -> Vec3:
        """The rate (rad/s) in place of the sample that was just detected."""
        return gyr

    @staticmethod
    @kernel
    def interval_rate(before: Vec3, now: Vec3, lost: float, dt: float) -> Vec3:
        """The mean rate (rad/s) over the ``dt`` seconds between two stamps; without a guard the later reading, as
        published filters have it, but for the ``lost`` seconds of them in which samples were lost."""
        return sub(now, scale(sub(now, before), 0.5 * (lost / dt))) if lost > 0.0 else now


detectors: DetectorHooks = declare(DetectorHooks)


class UnmeasuredRotation(NamedTuple):
    """How much of a rotation was not measured."""

    rate_age: float  # s since the last usable rate
    variance: float  # rad², of this sample's part


ALL_MEASURED = UnmeasuredRotation(0.0, 0.0)


class Interval(NamedTuple):
    """The time between two samples."""

    usual: float  # s, the mean; one that is longer than twice as long counts as twice as long
    lost: float  # s of it for which samples were lost: all beyond the usual one, where that is at least another


@kernel
def update_interval(usual: float, dt: float) -> Interval:
    """After ``dt`` seconds; ``usual`` is 0 before the first."""
    if not has_elapsed(dt, usual, 2.0 * usual):
        return Interval(usual + (dt - usual) / INTERVALS, 0.0)
    if usual == 0.0:
        return Interval(dt, 0.0)
    return Interval(usual + (min(dt, 2.0 * usual) - usual) / INTERVALS, dt - usual)


@kernel
def lost_variance(last: Vec3, gyr: Vec3, lost: float) -> float:
    """rad², about each axis, of the rotation in ``lost`` seconds without samples, if the mean of the rates before and
    after is held for it.

    A change that comes at once, at a time that is uniform in them, makes that error uniform. The other part was chosen
    so that σ is honest on recordings from which samples were taken, ``benchmarks/accuracy/changed.py``.
    """
    change = sub(gyr, last)
    rate2 = max(dot(gyr, gyr), dot(last, last))
    return lost * lost * (CHANGE_VARIANCE * dot(change, change) + RETURN_VARIANCE * rate2)


@kernel
def unmeasured_rotation(health: int, rate_age: float, dt: float) -> UnmeasuredRotation:
    """The rotation while the rate was unusable; its variance is 0 up to ``LEAST_ROTATION``."""
    if health & RATE_UNUSABLE == 0:
        return ALL_MEASURED
    before = TURN * rate_age
    after = TURN * (rate_age + dt)
    if after <= LEAST_ROTATION:
        return UnmeasuredRotation(rate_age + dt, 0.0)
    return UnmeasuredRotation(rate_age + dt, after * after - (before * before if before > LEAST_ROTATION else 0.0))


@kernel
def first_sample(gyr: Vec3, acc: Vec3, mag: Vec3, health: int) -> ConditionedSample:
    """The first sample; a filter starts with it if it has a specific force."""
    means = SlowMeans(gyr, acc, 0.0)
    detected = DetectorState(
        sums=NO_SUMS,
        means=means,
        gyr_extreme=NO_SAMPLES.gyr_extreme,
        acc_extreme=NO_SAMPLES.acc_extreme,
        gyr_repeat=NO_SAMPLES.gyr_repeat,
        acc_repeat=NO_SAMPLES.acc_repeat,
        jump=first_rate(gyr, acc),
        noise=NO_SAMPLES.noise,
        far_from_g=False,
        was_far=False,
        health=0,
    )
    return ConditionedSample(
        gyr=gyr,
        acc=acc,
        mag=mag,
        dt=0.0,
        interval=0.0,
        health=health,
        had_field=False,
        started=is_present(acc),
        rate_unknown=False,
        rate_age=0.0,
        unmeasured=0.0,
        since_sigma=0.0,
        corrected_by=0,
        detected=detected,
        rate=Approach(gyr, ZERO, 0.0),
        force=Approach(acc, ZERO, 0.0),
    )


@kernel
def sigma_due(sample: ConditionedSample) -> bool:
    """Whether σ is updated after this sample."""
    return has_elapsed(sample.since_sigma, sample.dt, INTERVAL) or sample.unmeasured > 0.0


class MeasuredRate(NamedTuple):
    """The rate of a sample, and how much of its rotation was not measured."""

    gyr: Vec3  # rad/s
    approach: Approach
    rate_age: float  # s since the last usable rate
    unmeasured: float  # rad²


@kernel
def measure_rate(
    sample: ConditionedSample, gyr: Vec3, extreme: Extreme, health: int, lost: float, dt: float
) -> MeasuredRate:
    """The mean rate since the last sample: beyond full scale it is extrapolated, see ``full_scale``."""
    before = sample.rate
    rate_age, unmeasured = unmeasured_rotation(health, sample.rate_age, dt)
    rate = Approach(gyr, before.slope, 0.0)
    if health & GYR_SATURATED or health & RATE_UNUSABLE == 0:
        rate = update_approach(before, gyr, extreme, dt)
    if rate.time > 0.0:
        unmeasured = unmeasured_angle(rate, before.time)
        rate_age = rate.time
        gyr = add(gyr, mean_beyond(rate, dt))
    elif health & (RATE_UNUSABLE | GAP) == 0:
        if lost > 0.0:
            unmeasured = lost_variance(before.last, gyr, lost)
        gyr = detectors.interval_rate(before.last, gyr, lost, dt)
    return MeasuredRate(gyr=gyr, approach=rate, rate_age=rate_age, unmeasured=unmeasured)


@kernel
def sensors_since_sigma(sample: ConditionedSample, acc: Vec3, mag: Vec3) -> int:
    """The sensors that corrected since the last update of σ: 1 for a specific force, 2 for a field."""
    sensors = 0 if sigma_due(sample) else sample.corrected_by
    if is_present(acc):
        sensors |= 1
    if is_present(mag):
        sensors |= 2
    return sensors


@kernel
def condition(guard: Guard, sample: ConditionedSample, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> ConditionedSample:
    """The next sample, conditioned; ``sample`` is the one before."""
    health = missing_bits(gyr, acc, mag)
    if health != 0:
        gyr = sample.rate.last if health & GYR_MISSING else gyr
        acc = ZERO if health & ACC_MISSING else acc
        mag = ZERO if health & MAG_MISSING else mag
    if not sample.started:
        return first_sample(gyr, acc, mag, health)
    rate_lost = health & GYR_MISSING != 0 and has_elapsed(sample.rate_age, dt, GAP_SECONDS)
    usual, lost = update_interval(sample.interval, dt)
    detected = detectors.detect(guard, sample.detected, gyr, acc, health, rate_lost, lost > 0.0, dt)
    if health & GYR_MISSING == 0:
        gyr = detectors.accepted_rate(detected, gyr)
    health |= detected.health
    force = sample.force
    if is_present(acc):
        force = update_approach(force, acc, detected.acc_extreme, dt)
        if health & ACC_STUCK:
            acc = ZERO
        elif force.time > 0.0:
            acc = add(acc, mean_beyond(force, dt))
    if dt > GAP_SECONDS:
        health |= GAP
    measured = measure_rate(sample, gyr, detected.gyr_extreme, health, lost, dt)
    since_sigma = (0.0 if sigma_due(sample) else sample.since_sigma) + dt
    corrected_by = sensors_since_sigma(sample, acc, mag)
    had_field = sample.had_field or is_present(sample.mag)
    rate_unknown = rate_lost or health & GAP != 0
    return ConditionedSample(  # without control flow between so many keywords, which Numba cannot take apart
        gyr=measured.gyr,
        acc=acc,
        mag=mag,
        dt=dt,
        interval=usual,
        health=health,
        had_field=had_field,
        started=True,
        rate_unknown=rate_unknown,
        rate_age=measured.rate_age,
        unmeasured=measured.unmeasured,
        since_sigma=since_sigma,
        corrected_by=corrected_by,
        detected=detected,
        rate=measured.approach,
        force=force,
    )
