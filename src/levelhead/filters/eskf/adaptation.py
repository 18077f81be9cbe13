"""Adaptation of ``ESKF``: how much a body moves, and how wide its priors are, found from the estimates themselves.

**Density of velocity.** Whatever the gain of a filter, its innovations are white. y, the mean velocity of a block less
the travel that is fixed to the sensor, through a low-pass filter of time constant τ becomes ȳ; white noise of density
D gives E ȳ² = D/(2 τ). With the variance P_vv, which explains part of it,

    D = max(0, 2 τ (ȳ² − P_vv)),   averaged over ``DENSITY_TIME``, within ``speed``² and ``speed_max``²            (1)

one for the two horizontal axes, one for the vertical.

**Travel.** The variance of u in (2) of the package is the running mean of u² + P_uu: one step of expectation
maximisation in each block.

**Width of a prior.** Sensors are a mixture of calibrated and raw ones. Let a state have the prior variance s², the
variance P, and let x be its estimate less the prior's mean, which is 0 but where an earlier run has told it. The
measurements alone then say x/κ ± √(P/κ) with κ = 1 − P/s². Where even the lower end of that is beyond s,

    s'² = (|x|/κ − 5 √(P/κ))²                                                                                   (2)

takes the place of s². The exchange is exact, correlations included: a measurement x = 0 of variance
r = −s² s'²/(s'² − s²) takes the information 1/s² − 1/s'² away. P grows, and x goes to where it would be.
"""

from math import sqrt

from levelhead.compiler.mark import kernel, noinline
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import add_variance, variance
from levelhead.filters.eskf.params import ESKF
from levelhead.kernels.arrays import Floats, add_scaled, copy
from levelhead.units import DEGREE

INNOVATION_TIME = 2.0  # s, τ
DENSITY_TIME = 10.0  # s
TRAVEL_TIME = 8.0  # s over which the variance of travel is averaged
LEAST_TRAVEL = 0.1  # m/s, 1σ
MOST_TRAVEL = 2.0
LEAST_INFORMATION = 0.02  # κ: below, the measurements say nothing of their own
SURE = 5.0  # σ by which they must do so
WIDER = 1.1  # times a variance, at least, for an exchange
UNINFORMED = 0.98  # share of its prior variance above which a state was not measured
MOST_GYR_BIAS = 30.0 * DEGREE  # rad/s
MOST_ACC_BIAS = 0.3  # m/s²
SAME_SENSOR = 0.13  # of the largest width of an axis is that of the others, at least


@kernel
def mean_travel(m: Floats, i: int) -> float:
    """Mean over the block of the velocity that is fixed to the sensor along earth axis i, R̄ u, m/s."""
    r = at.INT_R + 3 * i
    u = at.MEAN + at.TRAVEL
    return (m[r] * m[u] + m[r + 1] * m[u + 1] + m[r + 2] * m[u + 2]) / m[at.BLOCK_TIME]


@noinline
def adapt_motion(params: ESKF, m: Floats) -> None:
    """Eq. 1 and the variance of travel."""
    time = m[at.BLOCK_TIME]
    weight = time / (INNOVATION_TIME + time)
    excess_h = 0.0
    excess_v = 0.0
    for i in range(3):
        y = m[at.MEAN + at.VELOCITY + i] - mean_travel(m, i)
        m[at.MEAN_INNOVATION + i] += weight * (y - m[at.MEAN_INNOVATION + i])
        mean = m[at.MEAN_INNOVATION + i]
        excess = mean * mean - variance(m, at.VELOCITY + i)
        if i < 2:
            excess_h += 0.5 * excess
        else:
            excess_v = excess
    set_density(params, m, 0, excess_h)
    set_density(params, m, 1, excess_v)
    mean2 = 0.0
    for i in range(3):
        u = m[at.MEAN + at.TRAVEL + i]
        mean2 += (u * u + variance(m, at.TRAVEL + i)) / 3.0
    found = m[at.TRAVEL_VARIANCE] + time / (TRAVEL_TIME + time) * (mean2 - m[at.TRAVEL_VARIANCE])
    low = min(LEAST_TRAVEL, params.travel)
    high = MOST_TRAVEL if params.travel > 0.0 else 0.0  # without travel the model is that of a laboratory
    m[at.TRAVEL_VARIANCE] = min(max(found, low * low), high * high)


@kernel
def set_density(params: ESKF, m: Floats, k: int, excess: float) -> None:
    """Eq. 1 for the horizontal (0) or vertical (1) axes: what they say now or in the mean, whichever is more."""
    time = m[at.BLOCK_TIME]
    now = max(0.0, 2.0 * INNOVATION_TIME * excess)
    m[at.MEAN_DENSITY + k] += time / (DENSITY_TIME + time) * (now - m[at.MEAN_DENSITY + k])
    low = params.speed * params.speed
    high = max(params.speed_max * params.speed_max, low)
    m[at.DENSITY + k] = min(max(m[at.MEAN_DENSITY + k], now, low), high)


@kernel
def prior_deviation(m: Floats, i: int) -> float:
    """Estimate of state i less the mean of its prior, x of eq. 2."""
    mean = m[at.PRIOR_MEAN + i] if m[at.PRIOR_SIGMA + i] > 0.0 else 0.0
    return m[at.MEAN + i] + m[at.X + i] - mean


@kernel
def informed_bound(m: Floats, i: int) -> float:
    """The lower end of what measurements alone say of the size of state i, eq. 2; 0 where they say nothing."""
    prior = m[at.PRIOR_VARIANCE + i]
    if not variance(m, i) < (1.0 - LEAST_INFORMATION) * prior:
        return 0.0
    kappa = 1.0 - variance(m, i) / prior
    return max(abs(prior_deviation(m, i)) / kappa - SURE * sqrt(max(variance(m, i), 0.0) / kappa), 0.0)


@noinline
def widen_prior(m: Floats, n: int, first: int, most: float) -> None:
    """Eq. 2 for the three axes of a sensor from state ``first`` on; ``most`` is the largest width."""
    widest = SAME_SENSOR * max(informed_bound(m, first), informed_bound(m, first + 1), informed_bound(m, first + 2))
    if widest > 0.0:
        for i in range(first, first + 3):
            old = m[at.PRIOR_VARIANCE + i]
            width = min(max(informed_bound(m, i), widest), most)
            new = width * width
            if new > WIDER * old:
                m[at.PRIOR_VARIANCE + i] = new
                if variance(m, i) > UNINFORMED * old:
                    add_variance(m, i, 1, new - old)
                else:
                    exchange_prior(m, n, i, old, new)


@kernel
def exchange_prior(m: Floats, n: int, i: int, old: float, new: float) -> None:
    """Takes the prior variance ``old`` of state i out of x and P, and puts ``new`` into its place."""
    copy(m, at.U, at.P + i * at.ROW, n)
    one = 1.0 / sqrt(old * new / (new - old) - m[at.U + i])  # 1/√−S
    gain = prior_deviation(m, i) * one
    for j in range(n):
        m[at.U + j] = m[at.U + j] * one
    add_scaled(m, at.X, gain, at.U, n)
    for j in range(n):
        add_scaled(m, at.P + j * at.ROW, m[at.U + j], at.U, n)


@kernel
def set_prior_widths(m: Floats) -> None:
    """The priors of the start."""
    for i in range(3):
        m[at.PRIOR_VARIANCE + at.ACC_BIAS + i] = variance(m, at.ACC_BIAS + i)
        m[at.PRIOR_VARIANCE + at.GYR_BIAS + i] = variance(m, at.GYR_BIAS + i)
