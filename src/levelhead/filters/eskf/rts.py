"""The smoother's part of ``ESKF``: the numbers that the forward run keeps of each block, and one step backwards.

Of block k these are kept: its covariance P_k, the covariance P⁻_k+1 predicted from it, the rows of F P_k that differ
from P_k, and the correction x_k+1. With A = P⁻_k+1, B = F P_k and x^s the correction of a block's mean by all that
follows (H. E. Rauch, F. Tung, C. T. Striebel, Maximum likelihood estimates of linear dynamic systems, AIAA Journal
3(8), 1965):

    G = Bᵀ A⁻¹,   d = x_k+1 + x^s_k+1                                                                          (30)
    x^s_k = G d,   P^s_k = P_k + G (P^s_k+1 − A) Gᵀ                                                            (31)

and with the Cholesky factor A = Rᵀ R

    Rᵀ Y = B,   R Gᵀ = Y

All operations are on rows, which vector instructions take; of a symmetric matrix the upper triangle is kept, factorized
and combined. Without a magnetometer fewer states exist, and rows are shorter. A state without variance, or one of which
the past contains no information, has a column of zeros in G, and is left out. After a reinitialisation of the attitude,
velocity and attitude are left out of (30); the calibration still goes backwards through it. ``rts_aided`` is the same
with position.
"""

from math import sqrt
from typing import NamedTuple

from levelhead.compiler.mark import KernelFunction, instance, kernel, noinline
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.adaptation import found_prior
from levelhead.filters.eskf.aiding import has_direction
from levelhead.filters.eskf.covariance import rotate_velocity_error, vector
from levelhead.filters.eskf.filter import State, start, state_count, update
from levelhead.filters.eskf.params import ESKF
from levelhead.filters.eskf.predict import predict
from levelhead.filters.eskf.sigma import attitude_sigma
from levelhead.kernels import quat
from levelhead.kernels.arrays import Floats, copy, subtract_rows, zeros
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import Vec3

LONGEST_BLOCK = 0.25  # s: blocks need not be shorter than this offline
WHOLE = at.ROW * at.ROW  # numbers of a matrix; those of aiding stay unused
TRIANGLE = at.ROW * (at.ROW + 4) // 2  # of its upper triangle, whose rows begin at a multiple of four
N = at.N_MAGNETIC
LAST = 16  # columns of a triangle, and the rows that are computed in these alone
LEAST = 1e-13  # share of a variance that must be left of it, or it contains no information of its own

# The memory of the forward run: the prediction of a block, behind the filter's
PREDICTED = at.SIZE  # P⁻
BEFORE = PREDICTED + WHOLE  # the attitude before the correction, 4
FORWARD_SIZE = BEFORE + 4

# The record of each block; of P and P⁻ their triangles
BLOCK_P = 0
BLOCK_PREDICTED = BLOCK_P + TRIANGLE
BLOCK_W = BLOCK_PREDICTED + TRIANGLE  # rows of F P of the driven states
BLOCK_X = BLOCK_W + at.DRIVEN * at.ROW
BLOCK_BIAS = BLOCK_X + at.N  # rad/s, 3
BLOCK_ROTATION = BLOCK_BIAS + 3  # by the correction at its end, earth frame, 4
BLOCK_RESTART = BLOCK_ROTATION + 4  # 1: its attitude is independent of that before it
BLOCK_DECAY = BLOCK_RESTART + 1  # shares by which the field's eastern part and body velocity decayed, 2
BLOCK_TURN = BLOCK_DECAY + 2  # rad, half the turn of its last sample, earth frame, 3
BLOCK_SIZE = BLOCK_TURN + 3

# The memory of the step back
AHEAD = 0  # upper triangle of A, then of P^s_k+1 − A
FACTOR = AHEAD + WHOLE  # R
GAIN = FACTOR + WHOLE  # B, then Y, then Gᵀ
LATER = GAIN + WHOLE  # P^s_k+1
NOW = LATER + WHOLE  # P_k, then P^s_k
PRODUCT = NOW + WHOLE
OFF = PRODUCT + WHOLE  # d
SMOOTHED = OFF + at.ROW  # x^s
PRIOR = SMOOTHED + at.ROW  # (rad/s)², prior variances of the gyroscope's bias at the end, 3
SIZE = PRIOR + 3


class BlockEstimate(NamedTuple):
    """Of a block: the rotation vector of its attitude's correction (rad, earth frame), its bias (rad/s), σ of both."""

    turn: Vec3
    bias: Vec3
    sigma: Vec3  # rad, of the attitude


@noinline
def init(params: ESKF, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """``filter.init`` with room behind the memory for the numbers that ``correct`` keeps."""
    m = zeros(FORWARD_SIZE)
    return start(params, m, acc, mag)


@noinline
def correct(params: ESKF, state: State, dt: float) -> State:
    """``filter.correct`` that keeps the predicted covariance and the attitude before the correction."""
    m = state.memory
    predict(params, m, state.resting, state_count(state))
    copy(m, PREDICTED, at.P, WHOLE)
    q = state.quat
    m[BEFORE], m[BEFORE + 1], m[BEFORE + 2], m[BEFORE + 3] = q.w, q.x, q.y, q.z
    return update(params, state)


@kernel
def keep_upper(m: Floats, p: int, n: int, kept: Floats, first: int) -> None:
    """Keeps the upper triangle of the symmetric matrix at ``p``, n states wide, from ``first`` on."""
    to = first
    for i in range(0, n, 4):
        for row in range(p + i * at.ROW, p + (i + 4) * at.ROW, at.ROW):
            for j in range(i, n):
                kept[to + j - i] = m[row + j]
            to += n - i


@kernel
def load_upper(kept: Floats, first: int, n: int, m: Floats, p: int) -> None:
    """Puts an upper triangle back that was kept from ``first`` on."""
    begin = first
    for i in range(0, n, 4):
        for row in range(p + i * at.ROW, p + (i + 4) * at.ROW, at.ROW):
            for j in range(i, n):
                m[row + j] = kept[begin + j - i]
            begin += n - i


@kernel
def mirror(m: Floats, p: int, n: int) -> None:
    """Makes the matrix at ``p`` symmetric, from its upper triangle."""
    for i in range(n):
        for j in range(i):
            m[p + i * at.ROW + j] = m[p + j * at.ROW + i]


@kernel
def is_block_end(state: State) -> bool:
    """Whether a block ended with the last sample."""
    return state.block_end


@kernel
def keep_widening(state: State, blocks: Floats, first: int) -> None:
    """The parts of σ besides P at the end of a block."""
    m = state.memory
    t = first + BLOCK_TURN
    blocks[t], blocks[t + 1], blocks[t + 2] = quat.rotate(state.quat, vector(m, at.HALF_TURN))


@kernel
def keep_start(state: State, blocks: Floats) -> None:
    """The block before a stretch of samples; no more of it is needed."""
    m = state.memory
    keep_widening(state, blocks, 0)
    keep_upper(m, at.P, N, blocks, BLOCK_P)
    for j in range(3):
        blocks[BLOCK_BIAS + j] = m[at.MEAN + at.GYR_BIAS + j]


@kernel
def keep(state: State, blocks: Floats, first: int) -> None:
    """The block that has just ended, as numbers of ``kept`` from ``first`` on."""
    m = state.memory
    keep_upper(m, at.P, N, blocks, first + BLOCK_P)
    keep_upper(m, PREDICTED, N, blocks, first + BLOCK_PREDICTED)
    for j in range(at.DRIVEN * at.ROW):
        blocks[first + BLOCK_W + j] = m[at.W + j]
    for j in range(at.N):
        blocks[first + BLOCK_X + j] = m[at.X + j]
    for j in range(3):
        blocks[first + BLOCK_BIAS + j] = m[at.MEAN + at.GYR_BIAS + j]
    before = Quat(m[BEFORE], m[BEFORE + 1], m[BEFORE + 2], m[BEFORE + 3])
    w, x, y, z = quat.multiply(state.quat, quat.conjugate(before))
    blocks[first + BLOCK_ROTATION] = w
    blocks[first + BLOCK_ROTATION + 1] = x
    blocks[first + BLOCK_ROTATION + 2] = y
    blocks[first + BLOCK_ROTATION + 3] = z
    blocks[first + BLOCK_RESTART] = 1.0 if m[at.REINITIALISED] > 0.0 or m[at.GAP_TIME] > 0.0 else 0.0
    blocks[first + BLOCK_DECAY] = m[at.PLACE_DECAY]
    blocks[first + BLOCK_DECAY + 1] = m[at.BODY_VELOCITY_DECAY]
    keep_widening(state, blocks, first)


@kernel
def rotation(blocks: Floats, first: int) -> Quat:
    """The rotation by the correction at the end of a block, earth frame."""
    q = first + BLOCK_ROTATION
    return Quat(blocks[q], blocks[q + 1], blocks[q + 2], blocks[q + 3])


@kernel
def is_restart(blocks: Floats, first: int) -> bool:
    """Whether the attitude of a block is independent of that before it."""
    return blocks[first + BLOCK_RESTART] > 0.0


@kernel
def begin(state: State, m: Floats) -> None:
    """At the end of the recording, of which nothing follows."""
    for j in range(WHOLE):
        m[NOW + j] = state.memory[at.P + j]
    m[PRIOR], m[PRIOR + 1], m[PRIOR + 2] = found_prior(state.memory)


@kernel
def load_covariances(blocks: Floats, first: int, after: int, m: Floats) -> None:
    """LATER, AHEAD and NOW, from block k, kept from ``first`` on, and the one behind it, from ``after`` on."""
    copy(m, LATER, NOW, WHOLE)
    load_upper(blocks, after + BLOCK_PREDICTED, N, m, AHEAD)
    load_upper(blocks, first + BLOCK_P, N, m, NOW)
    mirror(m, NOW, N)


@kernel
def decay_rows(blocks: Floats, after: int, m: Floats) -> None:
    """The rows of GAIN = B of states that decayed by the block behind."""
    for j in range(at.ROW):
        for i in range(3):
            m[GAIN + (at.PLACE + i) * at.ROW + j] *= 1.0 - blocks[after + BLOCK_DECAY]
            m[GAIN + (at.BODY_VELOCITY + i) * at.ROW + j] *= 1.0 - blocks[after + BLOCK_DECAY + 1]


@kernel
def undo_velocity_turn(blocks: Floats, after: int, m: Floats) -> None:
    """Undoes the change of velocity's error by the correction of the block behind."""
    x, y = blocks[after + BLOCK_X + at.VELOCITY], blocks[after + BLOCK_X + at.VELOCITY + 1]
    rotate_velocity_error(m, LATER, at.ROW, -x, -y)
    m[SMOOTHED + at.VELOCITY] += y * m[SMOOTHED + at.HEADING]
    m[SMOOTHED + at.VELOCITY + 1] -= x * m[SMOOTHED + at.HEADING]


@kernel
def load_offset(blocks: Floats, after: int, m: Floats) -> None:
    """OFF = d of eq. 30."""
    for j in range(at.N):
        m[OFF + j] = blocks[after + BLOCK_X + j] + m[SMOOTHED + j]


@kernel
def load(blocks: Floats, first: int, m: Floats) -> None:
    """Puts block k, kept from ``first`` on, and the one behind it to where the step back needs them."""
    after = first + BLOCK_SIZE
    load_covariances(blocks, first, after, m)
    copy(m, GAIN, NOW, WHOLE)
    for j in range(at.DRIVEN * at.ROW):
        m[GAIN + at.VELOCITY * at.ROW + j] = blocks[after + BLOCK_W + j]
    decay_rows(blocks, after, m)
    undo_velocity_turn(blocks, after, m)
    load_offset(blocks, after, m)


@kernel
def scale_row(m: Floats, row: int, factor: float) -> None:
    """Multiplies a row by a number."""
    for i in range(N):
        m[row + i] = m[row + i] * factor


@kernel
def subtract_upper(m: Floats, i: int, to: int, weight: int, row: int, count: int) -> None:
    """``subtract_rows`` from row i of an upper triangle, at ``to``, with weights that stand in a column."""
    if i < N - LAST:
        subtract_rows(m, to, weight, at.ROW, row, at.ROW, count, N)
    else:
        subtract_rows(m, to + N - LAST, weight, at.ROW, row + N - LAST, at.ROW, count, LAST)


@kernel
def factorize(m: Floats, restart: bool) -> None:
    """R of A = Rᵀ R by rows; the diagonal holds 1/R_jj, and 0 for a state that is left out."""
    copy(m, FACTOR, AHEAD, WHOLE)
    for j in range(N):
        row = FACTOR + j * at.ROW
        if m[AHEAD + j * at.ROW + j] > 0.0:
            subtract_upper(m, j, row, FACTOR + j, FACTOR, j)
        pivot = m[row + j]
        driven = at.VELOCITY <= j < at.VELOCITY + at.DRIVEN
        left_out = pivot <= LEAST * m[AHEAD + j * at.ROW + j] or (restart and driven)
        one = 0.0 if left_out else 1.0 / sqrt(pivot)
        scale_row(m, row, one)
        m[row + j] = one


@kernel
def solve(m: Floats) -> None:
    """Gᵀ of eq. 30, from Rᵀ Y = B and R Gᵀ = Y."""
    for j in range(N):
        if m[FACTOR + j * at.ROW + j] != 0.0:
            subtract_rows(m, GAIN + j * at.ROW, FACTOR + j, at.ROW, GAIN, at.ROW, j, N)
        scale_row(m, GAIN + j * at.ROW, m[FACTOR + j * at.ROW + j])
    for k in range(N):
        i = N - 1 - k
        after = i + 1
        if m[FACTOR + i * at.ROW + i] != 0.0:
            subtract_rows(m, GAIN + i * at.ROW, FACTOR + i * at.ROW + after, 1, GAIN + after * at.ROW, at.ROW, k, N)
        scale_row(m, GAIN + i * at.ROW, m[FACTOR + i * at.ROW + i])


@kernel
def smooth_covariance(m: Floats) -> None:
    """The second half of eq. 31: of symmetric matrices the upper triangle is computed."""
    for i in range(N):
        row, product = AHEAD + i * at.ROW, PRODUCT + i * at.ROW
        for j in range(i, N):
            m[row + j] = m[LATER + i * at.ROW + j] - m[row + j]
        for j in range(N):
            m[product + j] = 0.0
        if m[FACTOR + i * at.ROW + i] != 0.0:
            subtract_rows(m, product, AHEAD + i, at.ROW, GAIN, at.ROW, i, N)
            subtract_rows(m, product, row + i, 1, GAIN + i * at.ROW, at.ROW, N - i, N)
    for i in range(N):
        if m[NOW + i * at.ROW + i] != 0.0:
            subtract_upper(m, i, NOW + i * at.ROW, GAIN + i, PRODUCT, N)
    mirror(m, NOW, N)


@kernel
def combine(m: Floats) -> None:
    """Eq. 31."""
    for i in range(at.ROW):
        m[SMOOTHED + i] = 0.0
        m[OFF + i] = -m[OFF + i]
    subtract_rows(m, SMOOTHED, OFF, 1, GAIN, at.ROW, N, N)
    smooth_covariance(m)


@noinline
def step_back(m: Floats, restart: bool) -> None:
    """Eqs. 30 and 31: from AHEAD, GAIN = B, LATER, NOW = P_k and OFF to SMOOTHED and NOW."""
    factorize(m, restart)
    solve(m)
    combine(m)


def step_back_of(states: int, name: str) -> KernelFunction:
    """``step_back`` of the first so many states; plain Python."""

    def of(function: KernelFunction, **kernels: KernelFunction) -> KernelFunction:
        return instance(function, f"{function.__name__}_{name}", N=states, **kernels)

    scale, upper = of(scale_row), of(subtract_upper)
    return of(
        step_back,
        factorize=of(factorize, scale_row=scale, subtract_upper=upper),
        solve=of(solve, scale_row=scale),
        combine=of(combine, smooth_covariance=of(smooth_covariance, subtract_upper=upper)),
    )


step_back_inertial = step_back_of(at.N_INERTIAL, "inertial")


@kernel
def back(blocks: Floats, first: int, m: Floats) -> None:
    """One step back, to the block that is kept from ``first`` on."""
    load(blocks, first, m)
    restart = is_restart(blocks, first + BLOCK_SIZE)
    if m[AHEAD + at.FIELD * (at.ROW + 1)] > 0.0:  # there was a magnetometer
        step_back(m, restart)
    else:
        step_back_inertial(m, restart)


@kernel
def read(blocks: Floats, first: int, m: Floats) -> BlockEstimate:
    """The block that the step back has reached."""
    b = first + BLOCK_BIAS
    d = SMOOTHED + at.GYR_BIAS
    turn = vector(blocks, first + BLOCK_TURN)
    return BlockEstimate(
        vector(m, SMOOTHED + at.ATTITUDE),
        Vec3(blocks[b] + m[d], blocks[b + 1] + m[d + 1], blocks[b + 2] + m[d + 2]),
        attitude_sigma(m, NOW, 0.0, vector(m, PRIOR), turn),
    )


def offline(params: ESKF) -> ESKF:
    """The parameters with blocks of at least ``LONGEST_BLOCK``, in the frame of the gyroscope; plain Python."""
    return params._replace(block=max(params.block, LONGEST_BLOCK), north_rate=0.0)


def turn_north(params: ESKF, state: State) -> float:
    """The angle (rad) about the vertical that turns a whole recording to the north of its end, and is noted in
    ``state``, whose memory is a list; 0: it is to stay in the frame of the gyroscope. Plain Python."""
    m = state.memory
    if params.north_rate == 0.0 or m[at.NORTH_VARIANCE] == 0.0 or has_direction(m):
        return 0.0
    turn = float(m[at.NORTH] - m[at.NORTH_TURN])  # the attitudes have the turn of the first second already
    m[at.NORTH_TURN] = m[at.NORTH]
    return turn
