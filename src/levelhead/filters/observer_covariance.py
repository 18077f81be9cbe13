"""σ for filters with set gains: the covariance of an observer whose gain is given, optimal or not.

A. Gelb (ed.), Applied Optimal Estimation, 1974, section 7.2. The error of an angle and the bias of its gyroscope go as
in ``kernels.two_state``; the filter takes the share K of an innovation of variance r into the angle, and k of it off
the bias, which is Joseph's form with the gain (K, −k). So σ grows where nothing corrects, and shrinks only as fast as
the filter really averages.

The disturbance of an innovation is not white noise: an acceleration lasts for a while, and so does an iron beam. With
variance s and duration τ its white equivalent at one sample is

    r = s (1 + (1 − K) 2 τ/Δt)                                                                                  (1)

whose limits are right: all of s when the filter jumps onto the sample (K = 1), the density 2 τ s when it averages.
"""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import kernel
from levelhead.filters.contract import Gains
from levelhead.kernels.tilt import GAP_SECONDS, UNIFORM, after_gap, bias_after_gap, is_present
from levelhead.kernels.two_state import Covariance, Gain, joseph, predict
from levelhead.kernels.vec3 import Vec3
from levelhead.units import DEGREE, GRAVITY

INTERVAL = 0.05  # s between two updates of σ
TURN_ON = (1.0 * DEGREE) * (1.0 * DEGREE)  # (rad/s)², bias of a gyroscope just turned on
REST_BIAS = (0.05 * DEGREE) * (0.05 * DEGREE)  # (rad/s)², bias after it was read off at rest
WALK = (0.003 * DEGREE) * (0.003 * DEGREE)  # (rad/s)²/s, random walk of the bias
NOISE = (0.02 * DEGREE) * (0.02 * DEGREE)  # rad²/s, white noise of the rate
SCALE = 0.01 * 0.01 * 0.5  # s: the rate is wrong by 1 % of itself, for half a second of a turn
OFFSET = (0.1 / GRAVITY) * (0.1 / GRAVITY)  # rad², offset of an accelerometer as tilt: no time averages it away
SHAKE = 0.01 * 0.01  # rad², noise of an accelerometer at rest, as tilt
JERK_SECONDS = 0.15  # for which an acceleration lasts
HALF_PER_G2 = 0.5 / (GRAVITY * GRAVITY)
SMOOTH = 1.0  # s, time constant of the mean square acceleration
IRON = (5.0 * DEGREE) * (5.0 * DEGREE)  # rad², by which iron nearby turns the field
IRON_SECONDS = 2.0  # s for which a body on the move is near the same iron


class ObserverCovariance(NamedTuple):
    """Covariances of tilt (about each horizontal axis) and of heading; the mean square acceleration, g²."""

    tilt: Covariance
    heading: Covariance
    motion: float


@kernel
def initial_covariance(acc: Vec3, mag: Vec3) -> ObserverCovariance:
    """After the first sample: the variance of one reading; a relative heading is right by definition."""
    tilt = IRON if is_present(acc) else UNIFORM * UNIFORM
    heading = IRON if is_present(mag) else 0.0
    return ObserverCovariance(Covariance(tilt, 0.0, TURN_ON), Covariance(heading, 0.0, TURN_ON), 0.0)


@kernel
def predict_covariance(p: Covariance, rate2: float, unmeasured: float, dt: float) -> Covariance:
    """After ``dt`` s without a correction; ``rate2`` is the squared rate, (rad/s)²; ``unmeasured`` (rad²) is added."""
    if dt > GAP_SECONDS:
        return Covariance(after_gap(p.level, dt), 0.0, bias_after_gap(p.bias, WALK * dt, TURN_ON))
    return predict(p, dt, (NOISE + SCALE * rate2) * dt + unmeasured, WALK * dt)


@kernel
def white_variance(variance: float, twice: float, share: float) -> float:
    """Eq. 1: the white equivalent of a variance; ``twice`` is 2 τ/Δt, ``share`` is K."""
    return variance * (1.0 + (1.0 - share) * twice)


@kernel
def limit_bias(p: Covariance) -> Covariance:
    """At rest the bias is known to 0.05 °/s (1σ), at least."""
    if p.bias > REST_BIAS:
        return Covariance(p.level, 0.0, REST_BIAS)
    return p


@kernel
def update_covariance(
    covariance: ObserverCovariance,
    gains: Gains,
    gyr: Vec3,
    acc: Vec3,
    rest: bool,
    unmeasured: float,
    corrected_by: int,
    dt: float,
) -> ObserverCovariance:
    """After an interval of ``dt`` s, with the filter's gains for an interval of that length.

    ``unmeasured`` (rad²) is added; ``corrected_by`` are the sensors that corrected: 1 accelerometer, 2 magnetometer.
    """
    tilt, heading, motion = covariance
    x, y, z = gyr
    rate2 = x * x + y * y + z * z
    tilt = predict_covariance(tilt, rate2, unmeasured, dt)
    heading = predict_covariance(heading, rate2, unmeasured, dt)
    if rest:
        tilt = limit_bias(tilt)
        heading = limit_bias(heading)
    share_tilt, bias_tilt, share_heading = gains.tilt, gains.tilt_bias, gains.heading
    bias_heading = gains.heading_bias
    often = 2.0 / dt
    if corrected_by & 1 != 0:
        if is_present(acc):
            x, y, z = acc
            off = HALF_PER_G2 * (x * x + y * y + z * z) - 0.5  # |a|/g − 1 to first order
            motion += dt / (SMOOTH + dt) * (off * off - motion)
        r = SHAKE + white_variance(motion, JERK_SECONDS * often, share_tilt)
        tilt = joseph(tilt, Gain(share_tilt, -bias_tilt), r)
    if corrected_by & 2 != 0:
        r = white_variance(IRON, IRON_SECONDS * often, share_heading)
        heading = joseph(heading, Gain(share_heading, -bias_heading), r)
    return ObserverCovariance(tilt, heading, motion)


@kernel
def sigma(covariance: ObserverCovariance) -> Vec3:
    """1σ about east, north and up, rad; at most that of an angle about which nothing is known."""
    tilt = min(sqrt(max(covariance.tilt.level, 0.0) + OFFSET), UNIFORM)
    return Vec3(tilt, tilt, min(sqrt(max(covariance.heading.level, 0.0)), UNIFORM))
