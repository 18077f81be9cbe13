"""Adaptation of ``ESKF``: how much a body moves, and how wide its priors are, found from the estimates themselves.

**Density of velocity.** The innovations of a filter are white at any gain. y is the mean velocity of a block less the
body velocity; a low-pass filter of time constant τ makes ȳ of it. White noise of density D gives E ȳ² = D/(2 τ). With
the variance P_vv, which explains part of it,

    D = max(0, 2 τ (ȳ² − P_vv)),   averaged over ``DENSITY_TIME``,                                                (23)
    within ``velocity_density``² and ``max_velocity_density``²

one for the two horizontal axes, one for the vertical.

**A missed rotation.** No body moves so that ȳ² is far beyond P_vv + ``max_velocity_density``²/(2 τ). The excess over
``MISSED_GATE`` times that,

    E = max(0, ȳ² − ``MISSED_GATE`` (P_vv + ``max_velocity_density``²/(2 τ))),                                    (28)

is in the horizontal axes the work of a turn θ that was missed: gravity has driven v since. If that was at any time in
the last τ, as likely as at any other, then E v² = (g θ τ)²/3 and E v θ = g θ² τ/2. But the body may turn on, and a turn
back has left its velocity. So while E lasts, 3 E/(g τ)² is added to the variance of tilt, E/(g τ) to its covariance
with v, two thirds of that covariance, and 2 E to the variance of v, all in τ (``predict``). v goes back as tilt is
corrected, or tilt would have to swing to the other side to stop it. Upwards a tilt is of second order; there E is a
specific force that was measured wrong, and the variance of v grows by E in τ.

**A bias that walks faster.** The corrections of a bias in different blocks are independent of each other, and each has
the variance by which it makes P smaller. Let C be their sum with the weight e^(−t/``BIAS_TIME``) after t seconds, and
V that of these variances with its square. Then E C² = V, unless the bias changes by more than its random walk, as that
of a sensor does that warms up. The part beyond ``BIAS_GATE`` times V,

    E = max(0, C² − ``BIAS_GATE`` V),   of the axis where it is largest, at most ``MOST_WALK``² · 1 s,           (29)

is added to the variances of all three axes in each second: they share a chip, and the one about the vertical is often
one that nothing measures.

**Two time scales of a field.** y = H + s − e, the innovation of a block's mean field, through a low-pass filter of time
constant τ becomes ȳ. Innovations of blocks of T seconds are white, and each has the variance P_e + D_f/T, with P_e the
mean variance of a component that the states explain. So the density of changes within seconds is

    now = max(0, 2 τ |ȳ|²/3 − P_e T),   D_f = max(now, its mean over ``FIELD_DENSITY_TIME``, ``mag_noise``² |H|²)   (35)

A disturbance that lasts as long as a body stays in a place has the variance σ_s² |H|². One step of expectation
maximisation in each block, as for body velocity,

    σ_s² = mean over ``PLACE_MEMORY`` of (s_r² + P_rr + s_z² + P_zz)/(2 |H|²), at least (``mag_place``/2)²         (36)

takes the radial and the vertical component of s alone: the azimuth contains the drift of heading, and a wrong bias
would be taken for a bad room.

**Body velocity.** The variance of u in (12) is the running mean of u² + P_uu: one step of expectation
maximisation in each block.

**Width of a prior.** Sensors are a mixture of calibrated and raw ones. Let s² be the
variance that a state would have without any measurement (its prior's, and the additions of (29) since), P the one that
it has, and x its estimate less the prior's mean, which is 0 but with the prior of an earlier run. The measurements
alone then give x/κ ± √(P/κ) with κ = 1 − P/s². Where even the lower end of that is beyond s,

    s'² = (|x|/κ − k √(P/κ))²,   k = ``SURE``; ``SURE_OPEN`` as long as (24) may still find a width,           (25)

takes the place of s². The exchange is exact, correlations included: a measurement x = 0 of variance
r = −s² s'²/(s'² − s²) takes the information 1/s² − 1/s'² away. P grows, and x goes to where it would be.

The bias of a raw gyroscope turns attitude far off within seconds, where nothing is of first order and (25) comes too
late. So the prior of the gyroscope's bias begins with s = ``bias_uncalibrated``. The measurements shrink the volume of
its σ ellipsoid. From det P < ``INFORMED``² s⁶ on, a narrower prior takes its place in every block up to
``NARROW_TIME``,

    s' = max(``bias_start``, |x|/κ − √(P/κ), 0.13 times the largest of the axes),                              (24)

by a measurement x = 0 of the variance r = s² s'²/(s² − s'²), which is as exact.
"""

from math import sqrt

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import aiding
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import (
    add_variance,
    field_scale,
    set_independent,
    state_variance,
    update_scalar,
    vector,
)
from levelhead.filters.eskf.params import ESKF
from levelhead.kernels.arrays import Floats, add_scaled, copy
from levelhead.kernels.elapsed import has_elapsed
from levelhead.kernels.mat3 import Mat3, det
from levelhead.kernels.tilt import NO_LENGTH
from levelhead.kernels.vec3 import ZERO, Vec3, dot, sub
from levelhead.units import DEGREE, GRAVITY

INNOVATION_TIME = 2.0  # s, τ
DENSITY_TIME = 10.0  # s
FIELD_DENSITY_TIME = 30.0  # s
LEAST_PLACE = 0.5  # of the 1σ at the start
PLACE_MEMORY = 60.0  # s over which the variance of the field of a place is averaged
AT_REST = 50.0  # times as long a body that rests stays in the field of its place
BODY_VELOCITY_TIME = 8.0  # s over which the variance of body velocity is averaged
MISSED_GATE = 9.0  # σ², beyond which velocity is not the body's
BIAS_TIME = 15.0  # s over which corrections of the gyroscope's bias are added up
BIAS_GATE = 25.0  # σ², beyond which they are more than its random walk
MOST_WALK = 0.03 * DEGREE  # (rad/s)/√s, of a sensor that warms up
MIN_BODY_VELOCITY = 0.1  # m/s, 1σ
MAX_BODY_VELOCITY = 2.0
LEAST_INFORMATION = 0.02  # κ: below, the measurements have no information of their own
SURE = 5.0  # σ by which they must do so
SURE_OPEN = 3.5  # the same of a gyroscope that may still turn out to be a raw one
WIDER = 1.1  # times a variance, at least, for an exchange
INFORMED = 0.17  # share of its first volume to which a σ ellipsoid shrinks before a width is found from it
SURE_FIRST = 1.0  # σ by which measurements must exceed it then
NARROW_TIME = 20.0  # s after the start in which the prior may still become narrower
UNINFORMED = 0.98  # share of its prior variance above which a state was not measured
MOST_GYR_BIAS = 30.0 * DEGREE  # rad/s
MOST_ACC_BIAS = 0.3  # m/s²
SAME_SENSOR = 0.13  # of the largest width of an axis is that of the others, at least


@kernel
def mean_travel(m: Floats, i: int) -> float:
    """Mean over the block of the velocity that is fixed to the sensor along earth axis i, R̄ u, m/s."""
    r = at.INT_R + 3 * i
    u = at.MEAN + at.BODY_VELOCITY
    return (m[r] * m[u] + m[r + 1] * m[u + 1] + m[r + 2] * m[u + 2]) / m[at.BLOCK_TIME]


@kernel
def velocity_excess(params: ESKF, m: Floats, i: int) -> float:
    """E of eq. 28, (m/s)²; 0 along an axis with aiding, which measures velocity itself."""
    if aiding.is_aided(m, i):
        return 0.0
    mean = m[at.MEAN_INNOVATION + i]
    density = params.max_velocity_density * params.max_velocity_density + aiding.aided_density(m, i)
    explained = state_variance(m, at.VELOCITY + i) + density / (2.0 * INNOVATION_TIME)
    return max(0.0, mean * mean - MISSED_GATE * explained)


@kernel
def is_upside_down(m: Floats) -> bool:
    """Whether the mean specific force points downwards in the earth frame, by more than g/2.

    A body that falls for long has none, and one that is pushed downwards for long does not exist. There a tilt error of
    first order is corrected away from zero, and the wrong attitude is as stable as the right one.
    """
    force = m[at.INT_FORCE + 2] / m[at.ACC_TIME] if m[at.ACC_TIME] > 0.0 else GRAVITY
    m[at.MEAN_UP] += m[at.BLOCK_TIME] / (INNOVATION_TIME + m[at.BLOCK_TIME]) * (force - m[at.MEAN_UP])
    return m[at.MEAN_UP] < -0.5 * GRAVITY


@noinline
def adapt_motion(params: ESKF, m: Floats) -> None:
    """Eqs. 23 and 28, and the variance of body velocity."""
    time = m[at.BLOCK_TIME]
    weight = time / (INNOVATION_TIME + time)
    excess_h = 0.0
    excess_v = 0.0
    for i in range(3):
        y = m[at.MEAN + at.VELOCITY + i] - mean_travel(m, i)
        m[at.MEAN_INNOVATION + i] += weight * (y - m[at.MEAN_INNOVATION + i])
        mean = m[at.MEAN_INNOVATION + i]
        excess = mean * mean - state_variance(m, at.VELOCITY + i)
        if i < 2:
            excess_h += 0.5 * excess
        else:
            excess_v = excess
    m[at.EXCESS] = velocity_excess(params, m, 0) + velocity_excess(params, m, 1)
    m[at.EXCESS + 1] = velocity_excess(params, m, 2)
    set_density(params, m, 0, excess_h)
    set_density(params, m, 1, excess_v)
    mean2 = 0.0
    for i in range(3):
        u = m[at.MEAN + at.BODY_VELOCITY + i]
        mean2 += (u * u + state_variance(m, at.BODY_VELOCITY + i)) / 3.0
    found = m[at.BODY_VELOCITY_VARIANCE] + time / (BODY_VELOCITY_TIME + time) * (mean2 - m[at.BODY_VELOCITY_VARIANCE])
    low = min(MIN_BODY_VELOCITY, params.body_velocity)
    high = (
        MAX_BODY_VELOCITY if params.body_velocity > 0.0 else 0.0
    )  # without body velocity the model is that of a laboratory
    m[at.BODY_VELOCITY_VARIANCE] = min(max(found, low * low), high * high)


@kernel
def set_density(params: ESKF, m: Floats, k: int, excess: float) -> None:
    """Eq. 23 for the horizontal (0) or vertical (1) axes: their value now or in the mean, whichever is more."""
    time = m[at.BLOCK_TIME]
    now = max(0.0, 2.0 * INNOVATION_TIME * excess)
    m[at.MEAN_DENSITY + k] += time / (DENSITY_TIME + time) * (now - m[at.MEAN_DENSITY + k])
    low = params.velocity_density * params.velocity_density
    high = max(params.max_velocity_density * params.max_velocity_density, low)
    m[at.DENSITY + k] = min(max(m[at.MEAN_DENSITY + k], now, low), high)


@noinline
def adapt_field(params: ESKF, m: Floats, e: Vec3, explained: float, resting: bool) -> None:
    """Eqs. 35 and 36, from a block's mean field e and P_e, the mean variance that the states explain."""
    time = m[at.BLOCK_TIME] / (AT_REST if resting else 1.0)
    h, s = vector(m, at.MEAN + at.FIELD), vector(m, at.MEAN + at.PLACE)
    off = sub(sub(e, h), s)
    weight = time / (INNOVATION_TIME + time)
    m[at.FIELD_INNOVATION] += weight * (off.x - m[at.FIELD_INNOVATION])
    m[at.FIELD_INNOVATION + 1] += weight * (off.y - m[at.FIELD_INNOVATION + 1])
    m[at.FIELD_INNOVATION + 2] += weight * (off.z - m[at.FIELD_INNOVATION + 2])
    mean = vector(m, at.FIELD_INNOVATION)
    now = max(0.0, 2.0 * INNOVATION_TIME * dot(mean, mean) / 3.0 - explained * m[at.BLOCK_TIME])
    m[at.MEAN_FIELD_DENSITY] += time / (FIELD_DENSITY_TIME + time) * (now - m[at.MEAN_FIELD_DENSITY])
    m[at.FIELD_DENSITY] = max(m[at.MEAN_FIELD_DENSITY], now)
    level2 = max(h.x * h.x + h.y * h.y, NO_LENGTH)
    radial = s.x * h.x + s.y * h.y
    row = at.P + at.PLACE * at.ROW + at.PLACE
    own = h.x * h.x * m[row] + 2.0 * h.x * h.y * m[row + 1] + h.y * h.y * m[row + at.ROW + 1]
    upward = s.z * s.z + state_variance(m, at.PLACE + 2)
    now = 0.5 * ((radial * radial + own) / level2 + upward) / field_scale(m)
    least = LEAST_PLACE * params.mag_place
    found = m[at.PLACE_VARIANCE] + time / (PLACE_MEMORY + time) * (now - m[at.PLACE_VARIANCE])
    m[at.PLACE_VARIANCE] = max(found, least * least)


@kernel
def note_bias(m: Floats) -> None:
    """Keeps the variances of the gyroscope's bias before the measurements of a block, for ``adapt_bias_walk``."""
    for i in range(3):
        m[at.BIAS_BEFORE + i] = state_variance(m, at.GYR_BIAS + i)


@noinline
def adapt_bias_walk(m: Floats) -> None:
    """Eq. 29, after the measurements of a block and before a prior changes."""
    left = BIAS_TIME / (BIAS_TIME + m[at.BLOCK_TIME])
    excess = 0.0
    for i in range(3):
        m[at.BIAS_CHANGE + i] = left * m[at.BIAS_CHANGE + i] + m[at.X + at.GYR_BIAS + i]
        explained = m[at.BIAS_BEFORE + i] - state_variance(m, at.GYR_BIAS + i)
        m[at.BIAS_CHANGE_VARIANCE + i] = left * left * m[at.BIAS_CHANGE_VARIANCE + i] + explained
        change = m[at.BIAS_CHANGE + i]
        excess = max(excess, change * change - BIAS_GATE * m[at.BIAS_CHANGE_VARIANCE + i])
    m[at.BIAS_WALK] = min(excess, MOST_WALK * MOST_WALK)


@kernel
def found_prior(m: Floats) -> Vec3:
    """Prior variances of the gyroscope's bias, (rad/s)²; zero with the prior of an earlier run."""
    return vector(m, at.PRIOR_VARIANCE + at.GYR_BIAS) if m[at.PRIOR_SIGMA + at.GYR_BIAS] == 0.0 else ZERO


@kernel
def prior_deviation(m: Floats, i: int) -> float:
    """Estimate of state i less the mean of its prior, x of eq. 25."""
    mean = m[at.PRIOR_MEAN + i] if m[at.PRIOR_SIGMA + i] > 0.0 else 0.0
    return m[at.MEAN + i] + m[at.X + i] - mean


@kernel
def informed_bound(m: Floats, i: int, sure: float) -> float:
    """The size of state i by measurements alone, less ``sure`` σ, eqs. 24 and 25; 0 without information."""
    prior = m[at.PRIOR_VARIANCE + i]
    if not state_variance(m, i) < (1.0 - LEAST_INFORMATION) * prior:
        return 0.0
    kappa = 1.0 - state_variance(m, i) / prior
    return max(abs(prior_deviation(m, i)) / kappa - sure * sqrt(max(state_variance(m, i), 0.0) / kappa), 0.0)


@kernel
def widest_axis(m: Floats, first: int, sure: float) -> float:
    """The least width of the priors of a sensor's three axes, which are alike to some degree."""
    x = informed_bound(m, first, sure)
    y = informed_bound(m, first + 1, sure)
    return SAME_SENSOR * max(x, y, informed_bound(m, first + 2, sure))


@noinline
def narrow_prior(params: ESKF, m: Floats, n: int) -> None:
    """Eq. 24, from when enough is known of the gyroscope's bias to ``NARROW_TIME``."""
    x = at.P + at.GYR_BIAS * at.ROW + at.GYR_BIAS
    y = x + at.ROW
    z = y + at.ROW
    volume2 = det(Mat3(m[x], m[x + 1], m[x + 2], m[y], m[y + 1], m[y + 2], m[z], m[z + 1], m[z + 2]))
    raw = params.bias_uncalibrated * DEGREE
    raw2 = raw * raw
    if m[at.GYR_PRIOR_OPEN] > 1.0 or volume2 < INFORMED * INFORMED * raw2 * raw2 * raw2:
        m[at.GYR_PRIOR_OPEN] = 0.0 if has_elapsed(m[at.RUN_TIME], m[at.BLOCK_TIME], NARROW_TIME) else 2.0
        least = max(params.bias_start * DEGREE, widest_axis(m, at.GYR_BIAS, SURE_FIRST))
        for i in range(at.GYR_BIAS, at.GYR_BIAS + 3):
            width = max(informed_bound(m, i, SURE_FIRST), least)
            new = width * width
            old = m[at.PRIOR_VARIANCE + i]
            if WIDER * new < old:
                m[at.PRIOR_VARIANCE + i] = new
                m[at.H + i] = 1.0
                update_scalar(m, n, -m[at.MEAN + i], old * new / (old - new))


@noinline
def widen_prior(m: Floats, n: int, first: int, most: float, sure: float) -> None:
    """Eq. 25 for the three axes of a sensor from state ``first`` on; k is ``sure``, the largest width ``most``."""
    widest = widest_axis(m, first, sure)
    if widest > 0.0:
        for i in range(first, first + 3):
            old = m[at.PRIOR_VARIANCE + i]
            width = min(max(informed_bound(m, i, sure), widest), most)
            new = width * width
            if new > WIDER * old:
                m[at.PRIOR_VARIANCE + i] = new
                if state_variance(m, i) > UNINFORMED * old:
                    add_variance(m, i, 1, new - old)
                else:
                    exchange_prior(m, n, i, old, new)


@kernel
def exchange_prior(m: Floats, n: int, i: int, old: float, new: float) -> None:
    """Takes the prior variance ``old`` of state i out of x and P, and puts ``new`` into its place, eq. 26."""
    copy(m, at.U, at.P + i * at.ROW, n)
    one = 1.0 / sqrt(old * new / (new - old) - m[at.U + i])  # 1/√−S
    gain = prior_deviation(m, i) * one
    for j in range(n):
        m[at.U + j] = m[at.U + j] * one
    add_scaled(m, at.X, gain, at.U, n)
    for j in range(n):
        add_scaled(m, at.P + j * at.ROW, m[at.U + j], at.U, n)


@kernel
def set_prior_widths(params: ESKF, m: Floats) -> None:
    """The priors of the start; that of the gyroscope's bias is wide without an earlier run's prior."""
    m[at.GYR_PRIOR_OPEN] = 0.0
    if params.bias_uncalibrated > params.bias_start and m[at.PRIOR_SIGMA + at.GYR_BIAS] == 0.0:
        m[at.GYR_PRIOR_OPEN] = 1.0
        set_independent(m, at.GYR_BIAS, 3, params.bias_uncalibrated * DEGREE)
    for i in range(3):
        m[at.PRIOR_VARIANCE + at.ACC_BIAS + i] = state_variance(m, at.ACC_BIAS + i)
        m[at.PRIOR_VARIANCE + at.GYR_BIAS + i] = state_variance(m, at.GYR_BIAS + i)
