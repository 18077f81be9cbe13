"""The algebra of the covariance of ``ESKF``: prediction, scalar measurements, independent states.

Prediction: P ← F P Fᵀ + Q. Only velocity and attitude are driven by others, so that six rows change (eq. 7).
Measurements are scalar, one after the other (P. S. Maybeck, Stochastic Models, Estimation, and Control, vol. 1, 1979,
section 7.4; eq. 13). With a row h, variance r and innovation y of the state as it was before the block:

    s = h P hᵀ + r,   u = P hᵀ/√s
    x ← x + u (y − h x)/√s,   P ← P − u uᵀ

P takes up to three measurements in one pass. Until then u of a later one is that of P less the products before it,

    u_k = (P hᵀ − Σ_{l<k} u_l (u_l hᵀ))/√s

u_i u_j is u_j u_i to the last bit, so that P stays symmetric by itself. A magnetometer only considers the states before
HEADING (S. F. Schmidt, Application of State-Space Methods to Navigation Problems, 1966): their gain is zero. Those from
there up to FIELD take the share β of theirs (K. M. Brink, Partial-Update Schmidt–Kalman Filter, Journal of Guidance,
Control, and Dynamics 40(9), 2017). With β_i = 0, β and 1 for the three

    x_i ← x_i + β_i u_i (y − h x)/√s,   P_ij ← P_ij − (1 − (1 − β_i)(1 − β_j)) u_i u_j                           (19)
"""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import instance, kernel, noinline
from levelhead.filters.eskf import state as at
from levelhead.kernels.arrays import Floats, add_scaled, copy, subtract_rows
from levelhead.kernels.vec3 import Vec3


@kernel
def add_covariance(m: Floats, i: int, j: int, covariance: float) -> None:
    """Adds to the covariance of two different states."""
    m[at.P + i * at.ROW + j] += covariance
    m[at.P + j * at.ROW + i] += covariance


@kernel
def set_independent(m: Floats, first: int, count: int, sigma: float) -> None:
    """Makes states independent of all others and of each other, with this σ."""
    for i in range(first, first + count):
        for j in range(at.N):
            m[at.P + i * at.ROW + j] = 0.0
            m[at.P + j * at.ROW + i] = 0.0
        m[at.P + i * at.ROW + i] = sigma * sigma


@kernel
def start_from_prior(m: Floats, first: int, count: int, unit: float) -> None:
    """Starts states with the estimates of an earlier run, where there are some; σ becomes no larger by that.

    The estimates are divided by ``unit``.
    """
    for i in range(first, first + count):
        sigma = m[at.PRIOR_SIGMA + i] / unit
        if sigma > 0.0:
            m[at.MEAN + i] = m[at.PRIOR_MEAN + i] / unit
            m[at.P + i * at.ROW + i] = min(m[at.P + i * at.ROW + i], sigma * sigma)


@kernel
def add_variance(m: Floats, first: int, count: int, variance: float) -> None:
    """Adds this variance to each of some states."""
    for i in range(first, first + count):
        m[at.P + i * at.ROW + i] += variance


@kernel
def start_block(m: Floats, first: int, size: int, start: float, walk: float, unit: float) -> None:
    """``state.declare_states`` of the start: independent, and with the prior of an earlier run."""
    set_independent(m, first, size, start)
    start_from_prior(m, first, size, unit)


@kernel
def add_walk(m: Floats, first: int, size: int, start: float, walk: float, unit: float) -> None:
    """``state.declare_states`` of the process noise: the random walk over the block of samples."""
    add_variance(m, first, size, walk * walk * unit * unit * m[at.BLOCK_TIME])


start_inertial = noinline(instance(at.inertial_states, "start_inertial", declare_states=start_block))
start_magnetic = noinline(instance(at.magnetic_states, "start_magnetic", declare_states=start_block))
start_aided = noinline(instance(at.aided_states, "start_aided", declare_states=start_block))
walk_inertial = instance(at.inertial_states, "walk_inertial", declare_states=add_walk)
walk_magnetic = instance(at.magnetic_states, "walk_magnetic", declare_states=add_walk)
walk_aided = instance(at.aided_states, "walk_aided", declare_states=add_walk)


@kernel
def vector(m: Floats, first: int) -> Vec3:
    """Three numbers of the memory, from ``first`` on."""
    return Vec3(m[first], m[first + 1], m[first + 2])


@kernel
def field_scale(m: Floats) -> float:
    """|H|² with its uncertainty, in units of the first field's norm, squared."""
    x, y, z = vector(m, at.MEAN + at.FIELD)
    variance = state_variance(m, at.FIELD) + state_variance(m, at.FIELD + 1) + state_variance(m, at.FIELD + 2)
    return x * x + y * y + z * z + variance / 3.0


@kernel
def state_variance(m: Floats, i: int) -> float:
    """The variance of one state, in its unit squared."""
    return m[at.P + i * at.ROW + i]


@kernel
def driven_rows(m: Floats, n: int) -> None:
    """W: the rows of F P that belong to driven states."""
    copy(m, at.W, at.P + at.VELOCITY * at.ROW, at.DRIVEN * at.ROW)
    for i in range(3):
        v = i * at.ROW
        t = v + 3 * at.ROW
        subtract_rows(m, at.W + v, at.F + v, 1, at.P, at.ROW, at.VELOCITY, n)
        attitude = at.P + at.ATTITUDE * at.ROW
        subtract_rows(m, at.W + v, at.F + v + at.ATTITUDE, 1, attitude, at.ROW, 3, n)
        bias = at.P + at.GYR_BIAS * at.ROW
        subtract_rows(m, at.W + t, at.F + t + at.GYR_BIAS, 1, bias, at.ROW, at.BODY_VELOCITY - at.GYR_BIAS, n)


@kernel
def driven_covariance(m: Floats, w: int, f: int) -> float:
    """Σ_k W_k (1 − F)_k of a row at ``w`` and one at ``f`` of a driven state."""
    total = 0.0
    for k in range(at.VELOCITY):
        total += m[w + k] * m[f + k]
    for k in range(at.ATTITUDE, at.BODY_VELOCITY):
        total += m[w + k] * m[f + k]
    return total


@kernel
def driven_block(m: Floats) -> None:
    """The block of F P Fᵀ of the driven states, where P holds F P already."""
    for i in range(at.DRIVEN):
        for j in range(i, at.DRIVEN):
            upper = at.P + (at.VELOCITY + i) * at.ROW + at.VELOCITY + j
            m[upper] -= driven_covariance(m, at.W + i * at.ROW, at.F + j * at.ROW)
            m[at.P + (at.VELOCITY + j) * at.ROW + at.VELOCITY + i] = m[upper]


@noinline
def propagate(m: Floats, n: int) -> None:
    """P ← F P Fᵀ for the first ``n`` states, with F of eq. 7."""
    driven_rows(m, n)
    for j in range(n):
        for i in range(at.DRIVEN):
            m[at.P + j * at.ROW + at.VELOCITY + i] = m[at.W + i * at.ROW + j]
    for i in range(at.DRIVEN):
        copy(m, at.P + (at.VELOCITY + i) * at.ROW, at.W + i * at.ROW, n)
    driven_block(m)


@kernel
def decay(m: Floats, i: int, left: float) -> None:
    """Multiplies a state by ``left``, in mean and covariance: a first-order Gauss-Markov process."""
    m[at.MEAN + i] = m[at.MEAN + i] * left
    for j in range(at.N):
        m[at.P + i * at.ROW + j] = m[at.P + i * at.ROW + j] * left
    for j in range(at.N):
        m[at.P + j * at.ROW + i] = m[at.P + j * at.ROW + i] * left


@noinline
def propagate_position(m: Floats, n: int, dt: float) -> None:
    """The same for the position alone, p ← p + v dt."""
    for i in range(3):
        for j in range(n):
            m[at.P + (at.POSITION + i) * at.ROW + j] += dt * m[at.P + (at.VELOCITY + i) * at.ROW + j]
    for i in range(3):
        row = at.P + (at.POSITION + i) * at.ROW
        for j in range(i, 3):
            m[row + at.POSITION + j] += dt * m[row + at.VELOCITY + j]
        for j in range(n):
            if j < at.POSITION or j > at.POSITION + i:
                m[at.P + j * at.ROW + at.POSITION + i] = m[row + j]


@noinline
def rotate_velocity_error(m: Floats, p: int, n: int, x: float, y: float) -> None:
    """The covariance at ``p`` after velocity was corrected by (x, y) m/s: its error changes by θ_z × (x, y).

    Without this the variance of heading would shrink with every correction of velocity, though no measurement has a
    direction (A. Barrau, S. Bonnabel, The invariant extended Kalman filter as a stable observer, IEEE
    Transactions on Automatic Control 62(4), 2017).
    """
    east = p + at.VELOCITY * at.ROW
    north = east + at.ROW
    turn = p + at.HEADING * at.ROW
    add_scaled(m, east, -y, turn, n)
    add_scaled(m, north, x, turn, n)
    for j in range(n):
        row = p + j * at.ROW
        m[row + at.VELOCITY] -= y * m[row + at.HEADING]
        m[row + at.VELOCITY + 1] += x * m[row + at.HEADING]
    m[north + at.VELOCITY] = m[east + at.VELOCITY + 1]


@kernel
def multiply_row(m: Floats, u: int, first: int, end: int, n: int) -> None:
    """Adds the part of P hᵀ of the states from ``first`` to before ``end`` to the numbers at ``u``."""
    for j in range(first, end):
        if m[at.H + j] != 0.0:
            add_scaled(m, u, m[at.H + j], at.P + j * at.ROW, n)


@kernel
def clear(m: Floats, first: int, count: int) -> None:
    """Sets ``count`` numbers to zero."""
    for i in range(first, first + count):
        m[i] = 0.0


@kernel
def dot(m: Floats, a: int, b: int, count: int) -> float:
    """Σ of products of ``count`` numbers at ``a`` and ``b``: four sums, so that none waits for the one before it."""
    first, second, third, fourth = 0.0, 0.0, 0.0, 0.0
    whole = count & -4
    for k in range(0, whole, 4):
        first += m[a + k] * m[b + k]
        second += m[a + k + 1] * m[b + k + 1]
        third += m[a + k + 2] * m[b + k + 2]
        fourth += m[a + k + 3] * m[b + k + 3]
    for k in range(whole, count):
        first += m[a + k] * m[b + k]
    return first + second + (third + fourth)


class Innovation(NamedTuple):
    """Of a scalar measurement: its innovation less the part that x has explained already, and h P hᵀ."""

    value: float
    explained: float


@kernel
def innovate(m: Floats, n: int, u: int, innovation: float) -> Innovation:
    """The innovation of a measurement whose P hᵀ is at ``u``; h is zero afterwards."""
    explained = dot(m, at.H, u, n)
    rest = innovation - dot(m, at.H, at.X, n)
    clear(m, at.H, n)
    return Innovation(rest, explained)


@kernel
def variance_after(m: Floats, i: int, k: int) -> float:
    """The variance of one state after the first ``k`` measurements that P does not contain yet."""
    variance = state_variance(m, i)
    for row in range(k):
        variance -= m[at.U + row * at.ROW + i] * m[at.U + row * at.ROW + i]
    return variance


@noinline
def add_scalar(m: Floats, n: int, k: int, innovation: float, noise: float) -> None:
    """One scalar measurement with row h, eq. 13, which x takes and P with ``subtract_products``; h is zero afterwards.

    It is number ``k`` of them. ``innovation`` is y and ``noise`` r, in the unit of the measurement.
    """
    u = at.U + k * at.ROW
    clear(m, u, n)
    multiply_row(m, u, 0, n, n)
    for row in range(k):
        before = at.U + row * at.ROW
        add_scaled(m, u, -dot(m, at.H, before, n), before, n)
    y, explained = innovate(m, n, u, innovation)
    one = 1.0 / sqrt(explained + noise)
    for i in range(n):
        m[u + i] = m[u + i] * one
    add_scaled(m, at.X, y * one, u, n)


@noinline
def subtract_products(m: Floats, n: int, count: int) -> None:
    """P ← P − Σ u uᵀ of the first ``count`` measurements."""
    for i in range(n):
        subtract_rows(m, at.P + i * at.ROW, at.U + i, at.ROW, at.U, at.ROW, count, n)


@kernel
def update_scalar(m: Floats, n: int, innovation: float, noise: float) -> None:
    """``add_scalar`` of a measurement that stands alone."""
    add_scalar(m, n, 0, innovation, noise)
    subtract_products(m, n, 1)


@kernel
def subtract_partial_before(m: Floats, n: int, k: int) -> None:
    """Makes P hᵀ of measurement ``k`` that of P after the measurements before it, eq. 19."""
    u, heading = at.U + k * at.ROW, m[at.H + at.HEADING]
    for row in range(k):
        before = at.U + row * at.ROW
        share, root = at.SHARE_OF_U + row * at.PARTIAL, at.ROOT_OF_U + row * at.PARTIAL
        level = dot(m, at.H, before, at.HEADING)
        beyond = dot(m, at.H + at.FIELD, before + at.FIELD, n - at.FIELD)
        add_scaled(m, u, -(heading * m[share] + beyond), before, at.HEADING)
        add_scaled(m, u + at.HEADING, -level, share, at.PARTIAL)
        add_scaled(m, u + at.HEADING, -heading * m[root], root, at.PARTIAL)
        add_scaled(m, u + at.HEADING, -beyond, before + at.HEADING, at.PARTIAL)
        whole = level + heading * m[before + at.HEADING] + beyond
        add_scaled(m, u + at.FIELD, -whole, before + at.FIELD, n - at.FIELD)


@noinline
def add_partial(m: Floats, n: int, k: int, share: float, innovation: float, noise: float, bound: float) -> float:
    """``add_scalar`` of a magnetometer, eq. 19, with the share β of the states from HEADING up to FIELD.

    Its row has elements of attitude, heading and the states from FIELD on alone. P takes it with
    ``subtract_partial_products``. An innovation beyond ``bound`` σ makes r grow, so that it has the influence of one of
    ``bound`` σ. Returns h P hᵀ.
    """
    u, part = at.U + k * at.ROW, k * at.PARTIAL
    clear(m, u, n)
    multiply_row(m, u, at.ATTITUDE, at.HEADING + 1, n)
    multiply_row(m, u, at.FIELD, n, n)
    subtract_partial_before(m, n, k)
    y, explained = innovate(m, n, u, innovation)
    s = explained + noise
    s += s * max(0.0, abs(y) / sqrt(s) / bound - 1.0)
    one = 1.0 / sqrt(s)
    for i in range(n):
        m[u + i] = m[u + i] * one
    root = sqrt(share * (2.0 - share))
    for i in range(at.PARTIAL):
        m[at.SHARE_OF_U + part + i] = m[u + at.HEADING + i] * share
        m[at.ROOT_OF_U + part + i] = m[u + at.HEADING + i] * root
    add_scaled(m, at.X + at.HEADING, y * one, at.SHARE_OF_U + part, at.PARTIAL)
    add_scaled(m, at.X + at.FIELD, y * one, u + at.FIELD, n - at.FIELD)
    return explained


@noinline
def subtract_partial_products(m: Floats, n: int, count: int) -> None:
    """``subtract_products`` of a magnetometer, eq. 19."""
    step, part = at.ROW, at.PARTIAL
    for i in range(at.HEADING):
        row, weight = at.P + i * at.ROW, at.U + i
        subtract_rows(m, row + at.HEADING, weight, step, at.SHARE_OF_U, part, count, at.PARTIAL)
        subtract_rows(m, row + at.FIELD, weight, step, at.U + at.FIELD, step, count, n - at.FIELD)
    for i in range(at.PARTIAL):
        row, weight = at.P + (at.HEADING + i) * at.ROW, at.U + at.HEADING + i
        subtract_rows(m, row, at.SHARE_OF_U + i, part, at.U, step, count, at.HEADING)
        subtract_rows(m, row + at.HEADING, at.ROOT_OF_U + i, part, at.ROOT_OF_U, part, count, at.PARTIAL)
        subtract_rows(m, row + at.FIELD, weight, step, at.U + at.FIELD, step, count, n - at.FIELD)
    for i in range(at.FIELD, n):
        subtract_rows(m, at.P + i * at.ROW, at.U + i, step, at.U, step, count, n)


@kernel
def update_partial(m: Floats, n: int, share: float, innovation: float, noise: float, bound: float) -> None:
    """``add_partial`` of a measurement that stands alone."""
    add_partial(m, n, 0, share, innovation, noise, bound)
    subtract_partial_products(m, n, 1)
