"""The algebra of the covariance of ``ESKF``: prediction, scalar measurements, independent states.

Prediction: P ← F P Fᵀ + Q. Only velocity and attitude are driven by others, so that six rows change (eq. 7).
Measurements are scalar, one after the other (P. S. Maybeck, Stochastic Models, Estimation, and Control, vol. 1, 1979,
section 7.4; eq. 13). With a row h, variance r and innovation y of the state as it was before the block:

    s = h P hᵀ + r,   u = P hᵀ/√s
    x ← x + u (y − h x)/√s,   P ← P − u uᵀ

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
from levelhead.kernels.arrays import Floats, add_scaled, copy
from levelhead.kernels.vec3 import Vec3

PARTIAL = at.FIELD - at.HEADING  # states of which a magnetometer takes a share


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
    for i in range(at.DRIVEN):
        row = i * at.ROW
        copy(m, at.W + row, at.P + at.VELOCITY * at.ROW + row, n)
        for k in range(n):
            if m[at.F + row + k] != 0.0:
                add_scaled(m, at.W + row, m[at.F + row + k], at.P + k * at.ROW, n)


@kernel
def driven_block(m: Floats, n: int) -> None:
    """The block of F P Fᵀ of the driven states, where P holds F P already."""
    for j in range(at.DRIVEN):
        for k in range(n):
            weight = m[at.F + j * at.ROW + k]
            if weight != 0.0:
                for i in range(j + 1):
                    m[at.P + (at.VELOCITY + i) * at.ROW + at.VELOCITY + j] += weight * m[at.W + i * at.ROW + k]
    for i in range(at.DRIVEN):
        for j in range(i):
            upper = at.P + (at.VELOCITY + j) * at.ROW + at.VELOCITY + i
            m[at.P + (at.VELOCITY + i) * at.ROW + at.VELOCITY + j] = m[upper]


@noinline
def propagate(m: Floats, n: int) -> None:
    """P ← F P Fᵀ for the first ``n`` states, with F of eq. 7."""
    driven_rows(m, n)
    for j in range(n):
        for i in range(at.DRIVEN):
            m[at.P + j * at.ROW + at.VELOCITY + i] = m[at.W + i * at.ROW + j]
    for i in range(at.DRIVEN):
        copy(m, at.P + (at.VELOCITY + i) * at.ROW, at.W + i * at.ROW, n)
    driven_block(m, n)


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


class Innovation(NamedTuple):
    """Of a scalar measurement: its innovation less what x has explained already, and h P hᵀ."""

    value: float
    explained: float


@kernel
def innovate(m: Floats, n: int, innovation: float) -> Innovation:
    """Puts P hᵀ into U; h is zero afterwards."""
    for i in range(n):
        m[at.U + i] = 0.0
    for j in range(n):
        if m[at.H + j] != 0.0:
            add_scaled(m, at.U, m[at.H + j], at.P + j * at.ROW, n)
    explained = 0.0
    for j in range(n):
        explained += m[at.H + j] * m[at.U + j]
        innovation -= m[at.H + j] * m[at.X + j]
        m[at.H + j] = 0.0
    return Innovation(innovation, explained)


@noinline
def update_scalar(m: Floats, n: int, innovation: float, noise: float) -> float:
    """One scalar measurement with row h, eq. 13; h is zero afterwards. Returns h P hᵀ.

    ``innovation`` is y and ``noise`` r, in the unit of the measurement.
    """
    y, explained = innovate(m, n, innovation)
    one = 1.0 / sqrt(explained + noise)
    for i in range(n):
        m[at.U + i] = m[at.U + i] * one
    add_scaled(m, at.X, y * one, at.U, n)
    for i in range(n):
        add_scaled(m, at.P + i * at.ROW, -m[at.U + i], at.U, n)
    return explained


@noinline
def update_partial(m: Floats, n: int, share: float, innovation: float, noise: float, bound: float) -> float:
    """``update_scalar`` of a magnetometer, eq. 19, with the share β of the states from HEADING up to FIELD.

    An innovation beyond ``bound`` σ makes r grow, so that it has the influence of one of ``bound`` σ.
    """
    y, explained = innovate(m, n, innovation)
    s = explained + noise
    s += s * max(0.0, abs(y) / sqrt(s) / bound - 1.0)
    one = 1.0 / sqrt(s)
    for i in range(n):
        m[at.U + i] = m[at.U + i] * one
    root = sqrt(share * (2.0 - share))
    for i in range(PARTIAL):
        m[at.SHARE_OF_U + i] = m[at.U + at.HEADING + i] * share
        m[at.ROOT_OF_U + i] = m[at.U + at.HEADING + i] * root
    add_scaled(m, at.X + at.HEADING, y * one, at.SHARE_OF_U, PARTIAL)
    add_scaled(m, at.X + at.FIELD, y * one, at.U + at.FIELD, n - at.FIELD)
    for i in range(at.HEADING):
        row = at.P + i * at.ROW
        add_scaled(m, row + at.HEADING, -m[at.U + i], at.SHARE_OF_U, PARTIAL)
        add_scaled(m, row + at.FIELD, -m[at.U + i], at.U + at.FIELD, n - at.FIELD)
    for i in range(PARTIAL):
        row = at.P + (at.HEADING + i) * at.ROW
        add_scaled(m, row, -m[at.SHARE_OF_U + i], at.U, at.HEADING)
        add_scaled(m, row + at.HEADING, -m[at.ROOT_OF_U + i], at.ROOT_OF_U, PARTIAL)
        add_scaled(m, row + at.FIELD, -m[at.U + at.HEADING + i], at.U + at.FIELD, n - at.FIELD)
    for i in range(at.FIELD, n):
        add_scaled(m, at.P + i * at.ROW, -m[at.U + i], at.U, n)
    return explained
