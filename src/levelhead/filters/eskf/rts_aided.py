"""The smoother's part of ``ESKF`` where position, velocity or height is measured too: ``rts`` with all states.

A block's transition is S F S with S of half a step of position, p ← p + v T/2, so that rows of position differ as well:

    B_v = F P_k,   B_p = P_p + T/2 (P_v + B_v)                                                                  (34)

F itself is kept, not F P: a state that a first reading sets between two blocks has no past, and a row of zeros in B. A
heading that waits for a receiver's velocity is found by regression (32), and too far off for a correction of first
order. So the forward run is done again from a start that is turned by the found heading, with ``KNOWN_HEADING`` as its
1σ.
"""

from math import pi, remainder, sqrt

from levelhead.compiler.mark import instance, kernel, noinline
from levelhead.filters.contract import AidedSmoothing, NavState, Smoothing
from levelhead.filters.eskf import aiding, rts
from levelhead.filters.eskf import filter as online
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import set_independent, state_variance, vector
from levelhead.filters.eskf.filter import State
from levelhead.filters.eskf.params import ESKF
from levelhead.kernels import quat, tilt
from levelhead.kernels.arrays import Floats, add_scaled, copy, zeros
from levelhead.kernels.quat import Quat
from levelhead.kernels.trig import atan2
from levelhead.kernels.vec3 import ZERO, Vec3

KNOWN_HEADING = 0.5  # rad, 1σ of a start that was turned: wide, for the same velocities correct it again
LEAST_COURSE = 1e-6  # rad: a new tilt turns heading by less, by rounding alone

# The memory of the forward run, behind that of ``rts``
LINKS = rts.FORWARD_SIZE  # Σ |covariance with others| of each state at the end of the last block,
VARIANCES = LINKS + at.ROW  # and its variance
LASTING = VARIANCES + at.ROW  # 1: a state continues; 0: a reading or a gap has set it
NAV_BEFORE = LASTING + at.ROW  # mean position and velocity before the correction, 6
COURSE = NAV_BEFORE + 6  # rad by which heading was turned since the start, all in all,
COURSE_KNOWN = COURSE + 1  # 1: the run starts with it
FORWARD_SIZE = COURSE_KNOWN + 1

# The record of each block, behind that of ``rts``, with 1 − F instead of F P
BLOCK_F = rts.BLOCK_W
BLOCK_LASTING = rts.BLOCK_SIZE
BLOCK_TIME = BLOCK_LASTING + at.ROW  # s
BLOCK_UNDIRECTED = BLOCK_TIME + 1  # 1: its correction of velocity turned the error of velocity along
BLOCK_NAV = BLOCK_UNDIRECTED + 1  # by which its end changed position and velocity, 6
BLOCK_SIZE = BLOCK_NAV + 6


@noinline
def init(params: ESKF, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """``filter.init`` with room behind the memory."""
    m = zeros(FORWARD_SIZE)
    return online.start(params, m, acc, mag)


@noinline
def restart(params: ESKF, before: State, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """``filter.restart``; where an earlier run found heading, it starts with that."""
    begun = online.restart(params, before, gyr, acc, mag)
    attitude, m = begun.quat, begun.memory
    if m[COURSE_KNOWN] != 0.0:
        attitude = tilt.add_yaw(attitude, m[COURSE])
        set_independent(m, at.HEADING, 1, KNOWN_HEADING)
    note_links(m)
    return State(
        attitude, begun.field_norm, resting=begun.resting, block_end=begun.block_end, health=begun.health, memory=m
    )


@kernel
def update_aiding(params: ESKF, state: State, row: int, value: float, sigma: float, age: float) -> State:
    """``filter.update_aiding``; a heading that an earlier run found stays known."""
    if state.memory[COURSE_KNOWN] != 0.0:
        aiding.add_reading(params, state.memory, row, value, sigma, age)
        return state
    return online.update_aiding(params, state, row, value, sigma, age)


@kernel
def link(m: Floats, i: int) -> float:
    """Σ |covariance| of a state with all others; 0: it is independent."""
    total = 0.0
    for j in range(at.ROW):
        if j != i:
            total += abs(m[at.P + i * at.ROW + j])
    return total


@noinline
def note_links(m: Floats) -> None:
    """At the start, and at the end of a block."""
    for i in range(at.ROW):
        m[LINKS + i] = link(m, i)
        m[VARIANCES + i] = state_variance(m, i)


@noinline
def note_lasting(m: Floats) -> None:
    """Before the prediction: a state that lost its covariances, or never had any and has another σ, was set."""
    for i in range(at.ROW):
        was_set = link(m, i) == 0.0 and (m[LINKS + i] != 0.0 or state_variance(m, i) != m[VARIANCES + i])
        m[LASTING + i] = 0.0 if was_set else 1.0


@kernel
def nav_place(i: int) -> int:
    """Where number i of position and velocity is among the states."""
    return at.POSITION + i if i < 3 else at.VELOCITY + i - 3


@noinline
def correct(params: ESKF, state: State, dt: float) -> State:
    """``rts.correct`` that also keeps the other numbers of the way back."""
    m = state.memory
    note_lasting(m)
    for i in range(6):
        m[NAV_BEFORE + i] = m[at.MEAN + nav_place(i)]
    after = rts.correct(params, state, dt)
    note_links(m)
    if m[at.REINITIALISED] > 0.0:
        b = rts.BEFORE
        before = Quat(m[b], m[b + 1], m[b + 2], m[b + 3])
        turn = quat.multiply(after.quat, quat.conjugate(before))
        m[COURSE] += 2.0 * atan2(turn.z, turn.w)
    return after


keep_start = instance(rts.keep_start, "keep_start_aided", N=at.ROW)
keep_covariances = instance(rts.keep, "keep_covariances_aided", N=at.ROW)
load_covariances = instance(rts.load_covariances, "load_covariances_aided", N=at.ROW)


@kernel
def keep(state: State, blocks: Floats, first: int) -> None:
    """The block that has just ended, as numbers of ``kept`` from ``first`` on."""
    keep_covariances(state, blocks, first)
    m = state.memory
    for j in range(at.DRIVEN * at.ROW):
        blocks[first + BLOCK_F + j] = m[at.F + j]
    for j in range(at.ROW):
        blocks[first + BLOCK_LASTING + j] = m[LASTING + j]
    blocks[first + BLOCK_TIME] = m[at.BLOCK_TIME]
    directed = aiding.is_aided(m, 0) or aiding.is_aided(m, 1)
    blocks[first + BLOCK_UNDIRECTED] = 0.0 if directed else 1.0
    for i in range(6):
        blocks[first + BLOCK_NAV + i] = m[at.MEAN + nav_place(i)] - m[NAV_BEFORE + i]


@noinline
def predict_cross(blocks: Floats, after: int, m: Floats) -> None:
    """GAIN = B of eq. 34, from NOW = P_k and the block behind it, which is kept from ``after`` on."""
    copy(m, rts.GAIN, rts.NOW, rts.WHOLE)
    for i in range(at.ROW):
        if blocks[after + BLOCK_LASTING + i] == 0.0:
            for j in range(at.ROW):
                m[rts.GAIN + i * at.ROW + j] = 0.0
    half = 0.5 * blocks[after + BLOCK_TIME]
    speed, place = rts.GAIN + at.VELOCITY * at.ROW, rts.GAIN + at.POSITION * at.ROW
    add_scaled(m, place, half, speed, 3 * at.ROW)
    for i in range(at.DRIVEN):  # velocity before the attitude that drives it
        for k in range(at.ROW):
            weight = blocks[after + BLOCK_F + i * at.ROW + k]
            if weight != 0.0:
                add_scaled(m, speed + i * at.ROW, -weight, rts.GAIN + k * at.ROW, at.ROW)
    add_scaled(m, place, half, speed, 3 * at.ROW)
    rts.decay_rows(blocks, after, m)


@kernel
def load(blocks: Floats, first: int, m: Floats) -> None:
    """``rts.load`` with all states."""
    after = first + BLOCK_SIZE
    load_covariances(blocks, first, after, m)
    predict_cross(blocks, after, m)
    if blocks[after + BLOCK_UNDIRECTED] != 0.0:
        rts.undo_velocity_turn(blocks, after, m)
    rts.load_offset(blocks, after, m)


# a new start leaves position, in mean and variance, as it was
step_back = rts.step_back_of(at.ROW, "aided")


@kernel
def back(blocks: Floats, first: int, m: Floats) -> None:
    """``rts.back`` with all states."""
    load(blocks, first, m)
    step_back(m, rts.is_restart(blocks, first + BLOCK_SIZE))


@kernel
def sigma_now(m: Floats, i: int) -> float:
    """1σ of a state of the block that the step back has reached."""
    return sqrt(max(m[rts.NOW + i * (at.ROW + 1)], 0.0))


@kernel
def read_nav(blocks: Floats, first: int, m: Floats) -> NavState:
    """Corrections of position and velocity of the block that the step back has reached, and 1σ of both."""
    return NavState(
        position=vector(m, rts.SMOOTHED + at.POSITION),
        velocity=vector(m, rts.SMOOTHED + at.VELOCITY),
        sigma_position=Vec3(sigma_now(m, at.POSITION), sigma_now(m, at.POSITION + 1), sigma_now(m, at.POSITION + 2)),
        sigma_velocity=Vec3(sigma_now(m, at.VELOCITY), sigma_now(m, at.VELOCITY + 1), sigma_now(m, at.VELOCITY + 2)),
        aided=True,
    )


@kernel
def nav_change(blocks: Floats, first: int) -> NavState:
    """By which the end of a block changed position and velocity."""
    b = first + BLOCK_NAV
    return NavState(
        position=vector(blocks, b),
        velocity=vector(blocks, b + 3),
        sigma_position=ZERO,
        sigma_velocity=ZERO,
        aided=True,
    )


@kernel
def is_set(blocks: Floats, first: int, i: int) -> bool:
    """Whether a reading or a gap in a block has set number i of position and velocity."""
    return blocks[first + BLOCK_LASTING + nav_place(i)] == 0.0


def offline(params: ESKF) -> ESKF:
    """The parameters as they are: regression (32) takes a fix for one of the block's end, and longer blocks than online
    turned the heading of somebody walking by 180°. Plain Python.
    """
    return params._replace(north_rate=0.0)


def turn_start(begin: State, end: State) -> State | None:
    """The start of another run where the one that ended so has found heading; None: it had no need. Plain Python."""
    angle = remainder(end.memory[COURSE], 2.0 * pi)
    if abs(angle) < LEAST_COURSE or end.field_norm > 0.0 or begin.memory[COURSE_KNOWN] != 0.0:
        return None
    m = list(begin.memory)
    m[COURSE], m[COURSE_KNOWN] = angle, 1.0
    m[at.P + at.HEADING * (at.ROW + 1)] = KNOWN_HEADING * KNOWN_HEADING
    return begin._replace(memory=m)


AIDED = AidedSmoothing(
    parts=Smoothing(
        offline=offline,
        init=init,
        correct=correct,
        width=BLOCK_SIZE,
        is_block_end=rts.is_block_end,
        keep_start=keep_start,
        keep=keep,
        memory=rts.SIZE,
        begin=rts.begin,
        back=back,
        read=rts.read,
        rotation=rts.rotation,
        is_restart=rts.is_restart,
        turn_north=rts.turn_north,
    ),
    restart=restart,
    update=update_aiding,
    read_nav=read_nav,
    nav_change=nav_change,
    is_set=is_set,
    turn_start=turn_start,
)
