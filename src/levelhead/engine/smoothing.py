"""The smoother: every instant of a recording knows what was learned by its end.

The filter runs forward and keeps of each block k its covariance P_k, the covariance P⁻_k+1 predicted from it, the rows
of F P_k that differ from P_k, and its correction x_k+1. Then backwards (H. E. Rauch, F. Tung, C. T. Striebel, Maximum
likelihood estimates of linear dynamic systems, AIAA Journal 3(8), 1965), over the error state, with x^s the correction
of block k's mean that the future asks for:

    G = (F P_k)ᵀ (P⁻_k+1)⁻¹                                                                                     (1)
    x^s_k = G (x_k+1 + x^s_k+1),   P^s_k = P_k + G (P^s_k+1 − P⁻_k+1) Gᵀ                                        (2)

Where the attitude was taken from the sensors anew (after a gap, at the start) the past says nothing about it: velocity
and attitude are left out of (1), the calibration still goes backwards through it.

Attitude between the ends of two blocks is turned from the left by exp of a rotation vector that goes linearly from
x^s_k to x_k+1 + x^s_k+1. Only two minutes of blocks are kept: the filter runs forward once to save its state now and
then, and again through each stretch before that is smoothed.
"""

import functools
from collections.abc import Callable
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from levelhead import filters
from levelhead.calibration import Calibration
from levelhead.compiler.compile import compiled
from levelhead.compiler.hooks import rebind
from levelhead.compiler.mark import compiled_only, noinline
from levelhead.compiler.tree import native, plain
from levelhead.engine import backward as rts
from levelhead.engine.backward import WHOLE
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.binding import bind
from levelhead.engine.driver import Settings, advance, result
from levelhead.engine.prior import apply_prior, read_calibration
from levelhead.errors import LevelheadError
from levelhead.filters.contract import Schedule
from levelhead.filters.eskf import FILTER as ESKF_FILTER
from levelhead.filters.eskf import filter as eskf
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import rotate_velocity_error
from levelhead.filters.eskf.predict import predict
from levelhead.filters.parameters import FilterChoice
from levelhead.guard import Guard
from levelhead.kernels import quat
from levelhead.kernels.arrays import Floats, copy, zeros
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GAP_SECONDS, UNIFORM
from levelhead.kernels.vec3 import Vec3
from levelhead.recording import Recording
from levelhead.track import Track

LONGEST = 0.25  # s: blocks need not be shorter than this offline
KEPT = 500  # blocks in memory, ten MB: more would not stay near the processor
SHORTEST = 1e-9  # s, a block
AHEAD = at.SIZE  # P⁻
FROM = AHEAD + WHOLE  # attitude before the correction, 4
WIDE = FROM + 4


@noinline
def remembered(params: Any, state: Any, dt: float) -> Any:
    """``eskf.correct`` that keeps what it predicts."""
    m = state.memory
    predict(params, m, eskf.existing(state))
    copy(m, AHEAD, at.P, WHOLE)
    q = state.quat
    m[FROM], m[FROM + 1], m[FROM + 2], m[FROM + 3] = q.w, q.x, q.y, q.z
    return eskf.update(params, state)


@noinline
def wide_init(params: Any, gyr: Vec3, acc: Vec3, mag: Vec3) -> Any:
    """``eskf.init`` with room behind its memory for what ``remembered`` keeps."""
    m = zeros(WIDE)
    return eskf.start(params, m, acc, mag)


FORWARD = ESKF_FILTER._replace(name="ESKF_forward", init=wide_init, schedule=Schedule(eskf.due, remembered))


class Blocks(NamedTuple):
    """What is kept of each block, row after row; the first one is the last of the stretch before."""

    p: Any  # ROW²
    ahead: Any  # ROW², predicted
    w: Any  # DRIVEN·ROW
    x: Any  # N, correction at its end
    bias: Any  # 3
    swing: Any  # 4, the turn at its end, earth frame
    cut: Any  # 1: attitude starts anew
    gone: Any  # 1, share of the place's field that was forgotten
    end: Any  # its last sample


class Smoothed(NamedTuple):
    """What comes out, a row a sample."""

    quat: Any  # 4
    bias: Any  # 3
    sigma: Any  # 3


def room(count: int) -> Blocks:
    """For that many blocks."""
    return Blocks(*(np.zeros((count, width)) for width in (WHOLE, WHOLE, at.DRIVEN * at.ROW, at.N, 3, 4, 1, 1, 1)))


@compiled_only
def keep(kept: Blocks, k: int, i: int, state: Any) -> None:
    """The block that has just ended, at sample i."""
    m = state.memory
    for j in range(WHOLE):
        kept.p[k, j] = m[at.P + j]
        kept.ahead[k, j] = m[AHEAD + j]
    for j in range(at.DRIVEN * at.ROW):
        kept.w[k, j] = m[at.W + j]
    for j in range(at.N):
        kept.x[k, j] = m[at.X + j]
    for j in range(3):
        kept.bias[k, j] = m[at.MEAN + at.GYR_BIAS + j]
    before = Quat(m[FROM], m[FROM + 1], m[FROM + 2], m[FROM + 3])
    swing = quat.multiply(state.quat, quat.conjugate(before))
    kept.swing[k, 0], kept.swing[k, 1], kept.swing[k, 2], kept.swing[k, 3] = swing
    kept.cut[k, 0] = 1.0 if m[at.REINITIALISED] > 0.0 or m[at.GAP_TIME] > 0.0 else 0.0
    kept.end[k, 0] = float(i)
    kept.gone[k, 0] = m[at.EAST_DECAY]


@compiled_only
def forward(
    settings: Settings, carry: Any, last: float, start: int, t: Any, gyr: Any, acc: Any, mag: Any,
    attitude: Any, health: Any, kept: Blocks,
) -> Any:  # fmt: skip
    """Samples from ``start`` on until there is no room for another block, or no sample.

    Returns the carry, how many blocks were kept, and the sample after the last one.
    """
    field = Vec3(0.0, 0.0, 0.0)
    count = 1
    blocks = carry.run.state.blocks
    i = start
    while i < len(t) and count < len(kept.end):
        if len(mag) > 0:
            field = Vec3(mag[i, 0], mag[i, 1], mag[i, 2])
        turned = Vec3(gyr[i, 0], gyr[i, 1], gyr[i, 2])
        carry = advance(settings, carry, turned, Vec3(acc[i, 0], acc[i, 1], acc[i, 2]), field, t[i] - last)
        last = t[i]
        said = result(settings, carry.run)
        attitude[i, 0], attitude[i, 1], attitude[i, 2], attitude[i, 3] = said.quat
        health[i] = said.health
        if carry.run.state.blocks != blocks:
            blocks = carry.run.state.blocks
            keep(kept, count, i, carry.run.state)
            count += 1
        i += 1
    return carry, count, i


@compiled_only
def load(kept: Blocks, k: int, m: Floats) -> None:
    """What the step back to block k works with; what was smoothed last belongs to block k + 1."""
    copy(m, rts.LATER, rts.NOW, WHOLE)
    for j in range(WHOLE):
        m[rts.AHEAD + j] = kept.ahead[k + 1, j]
        m[rts.NOW + j] = kept.p[k, j]
    copy(m, rts.GAIN, rts.NOW, WHOLE)
    for j in range(at.DRIVEN * at.ROW):
        m[rts.GAIN + at.VELOCITY * at.ROW + j] = kept.w[k + 1, j]
    for j in range(at.ROW):
        m[rts.GAIN + at.FIELD_EAST * at.ROW + j] *= 1.0 - kept.gone[k + 1, 0]
    x, y = kept.x[k + 1, at.VELOCITY], kept.x[k + 1, at.VELOCITY + 1]
    rotate_velocity_error(m, rts.LATER, at.ROW, -x, -y)  # what the correction did to errors of velocity, undone
    m[rts.SMOOTHED + at.VELOCITY] += y * m[rts.SMOOTHED + at.HEADING]
    m[rts.SMOOTHED + at.VELOCITY + 1] -= x * m[rts.SMOOTHED + at.HEADING]
    for j in range(at.N):
        m[rts.OFF + j] = kept.x[k + 1, j] + m[rts.SMOOTHED + j]


@compiled_only
def backward(kept: Blocks, count: int, m: Floats, turn: Any, bias: Any, sigma: Any) -> None:
    """x^s of attitude and bias, and σ^s of attitude, of all blocks kept, from the last one, which m holds, on."""
    for back in range(count):
        k = count - 1 - back
        if back > 0:
            load(kept, k, m)
            rts.step_back(m, kept.cut[k + 1, 0] > 0.0)
        for j in range(3):
            turn[k, j] = m[rts.SMOOTHED + at.ATTITUDE + j]
            bias[k, j] = kept.bias[k, j] + m[rts.SMOOTHED + at.GYR_BIAS + j]
            variance = m[rts.NOW + (at.ATTITUDE + j) * (at.ROW + 1)]
            sigma[k, j] = min(sqrt(max(variance, 0.0)), UNIFORM)


@compiled_only
def ends(swing: Any, turn: Any, before: Any) -> None:
    """The rotation vectors of attitudes just before the ends of blocks: what the blocks corrected, then ``turn``."""
    for k in range(len(swing)):
        asked = quat.exp(Vec3(turn[k, 0], turn[k, 1], turn[k, 2]))
        whole = quat.multiply(asked, Quat(swing[k, 0], swing[k, 1], swing[k, 2], swing[k, 3]))
        before[k, 0], before[k, 1], before[k, 2] = quat.log(whole)


@compiled_only
def last_gap(t: Any, first: int, last: int) -> int:
    """The last sample of these that comes after a gap; ``first`` if none does."""
    found = first
    for i in range(first + 1, last + 1):
        if t[i] - t[i - 1] > GAP_SECONDS:
            found = i
    return found


@compiled_only
def turn_by(attitude: Any, i: int, x: float, y: float, z: float) -> None:
    """Turns the attitude of sample i by a rotation vector, earth frame."""
    q = Quat(attitude[i, 0], attitude[i, 1], attitude[i, 2], attitude[i, 3])
    turned = quat.compose(quat.exp(Vec3(x, y, z)), q)
    attitude[i, 0], attitude[i, 1], attitude[i, 2], attitude[i, 3] = turned


@compiled_only
def spread(
    t: Any, kept: Blocks, count: int, stop: int, at_end: Any, before: Any, bias: Any, sigma: Any, track: Smoothed,
) -> None:  # fmt: skip
    """From the ends of blocks to every sample up to ``stop``: linear within a block, but not across a new start."""
    for k in range(1, count + 1):
        here = min(k, count - 1)
        first = int(kept.end[k - 1, 0]) + 1
        last = int(kept.end[k, 0]) if k < count else stop - 1
        left = t[max(first - 1, 0)]
        span = max(t[last] - left, SHORTEST)
        anew = kept.cut[here, 0] > 0.0
        joined = last_gap(t, max(first - 1, 0), last) if anew else 0
        for i in range(first, last + 1):
            line = min((t[i] - left) / span, 1.0) if k < count else 1.0
            share = line
            if anew:
                share = 1.0 if i >= joined else 0.0
            if k == count or i == last:
                turn_by(track.quat, i, at_end[here, 0], at_end[here, 1], at_end[here, 2])
            else:
                kept_share = 1.0 - share
                turn_by(
                    track.quat,
                    i,
                    kept_share * at_end[k - 1, 0] + share * before[k, 0],
                    kept_share * at_end[k - 1, 1] + share * before[k, 1],
                    kept_share * at_end[k - 1, 2] + share * before[k, 2],
                )
            for j in range(3):
                track.bias[i, j] = bias[k - 1, j] + line * (bias[here, j] - bias[k - 1, j])
                track.sigma[i, j] = sigma[k - 1, j] + line * (sigma[here, j] - sigma[k - 1, j])


@functools.cache
def forward_machine(guarded: bool) -> Any:
    """``forward`` compiled."""
    driver = bind(FORWARD, guarded)
    name = "guarded" if guarded else "unguarded"
    return compiled(rebind(forward, driver.pairs, name))


class Stretch(NamedTuple):
    """Where the forward run was when a stretch began."""

    start: int
    carry: Any


class Smoother:
    """Forward and backward over one recording."""

    def __init__(self, recording: Recording, params: Any, guard: Guard | None, prior: Calibration | None) -> None:
        driver = bind(FORWARD, guard is not None)
        self._forward = forward_machine(guard is not None)
        self._settings = Settings(params, guard or DEFAULT_GUARD)
        mag = np.empty((0, 3)) if recording.mag is None else np.array(recording.mag)
        self._sensors = (np.array(recording.t), np.array(recording.gyr), np.array(recording.acc), mag)
        n = len(recording)
        self.track = Smoothed(np.empty((n, 4)), np.empty((n, 3)), np.empty((n, 3)))
        self.health = np.zeros(n, np.uint32)
        self.begin = Stretch(0, apply_prior(FORWARD, driver.begin(self._settings), prior))
        self._kept = room(KEPT)
        self._smoothed = np.zeros(rts.SIZE)  # the step back at work

    def ahead(self, stretch: Stretch) -> tuple[int, Stretch]:
        """Through one stretch: how many blocks were kept, and where the next one begins."""
        memory = stretch.carry.run.state.memory
        self._kept.p[0], self._kept.bias[0] = (
            memory[at.P : at.P + WHOLE],
            memory[at.MEAN + at.GYR_BIAS : at.MEAN + at.GYR_BIAS + 3],
        )
        self._kept.end[0] = stretch.start - 1
        last = float(self._sensors[0][max(stretch.start - 1, 0)])
        carry, count, stop = self._forward(
            self._settings,
            native(stretch.carry),
            last,
            stretch.start,
            *self._sensors,
            self.track.quat,
            self.health,
            self._kept,
        )
        return count, Stretch(stop, plain(carry))

    def learned(self, end: Stretch) -> Calibration | None:
        """What was known of the sensor at the end, which is all there is to know."""
        return read_calibration(FORWARD, self._settings, end.carry)

    def end(self, stretch: Stretch) -> None:
        """Backwards begins where the recording ends, of which nothing more is to be learned."""
        self._smoothed[rts.NOW : rts.NOW + WHOLE] = stretch.carry.run.state.memory[at.P : at.P + WHOLE]

    def back(self, count: int, stop: int) -> None:
        """Through the stretch that was kept, to the sample before ``stop``."""
        turn, bias, sigma, before = (np.zeros((count, 3)) for _ in range(4))
        compiled(backward)(self._kept, count, self._smoothed, turn, bias, sigma)
        compiled(ends)(self._kept.swing[:count], turn, before)
        compiled(spread)(self._sensors[0], self._kept, count, stop, turn, before, bias, sigma, self.track)


def smooth(
    recording: Recording,
    params: FilterChoice | None = None,
    *,
    guard: Guard | None = DEFAULT_GUARD,
    prior: Calibration | None = None,
    progress: Callable[[float], None] | None = None,
) -> Track:
    """Orientation of every sample of a recording, with all of the recording known: the best there is offline.

    Args:
        recording: what the sensors said, SI units; pressure and GNSS are not used.
        params: of the self-calibrating filter ``ESKF``; None: those of ``filters.offline``. Blocks are made 0.25 s long
            at least.
        guard: as for ``fuse``.
        prior: as for ``fuse``.
        progress: called now and then with the fraction done, 0 to 1.

    Returns:
        A Track with the stamps of the recording; health is that of the forward run. Memory: ten numbers a sample, and
        five hundred blocks.

    Raises:
        LevelheadError: another filter, or a prior that is none.
    """
    if not isinstance(recording, Recording):
        raise LevelheadError(
            f"smooth takes a Recording, not {type(recording).__name__}; levelhead.read(path) makes one"
        )
    params = filters.offline() if params is None else filters.resolve(params)
    if filters.of(params) is not ESKF_FILTER:
        raise LevelheadError(
            f"smooth goes back through what ESKF has learned; {filters.of(params).name} has no smoother"
        )
    run = Smoother(recording, params._replace(block=max(params._asdict()["block"], LONGEST)), guard, prior)
    stretches = [run.begin]
    n, count = len(recording), 0
    while stretches[-1].start < n:
        count, after = run.ahead(stretches[-1])
        stretches.append(after)
        if progress is not None:
            progress(0.5 * after.start / n)
    run.end(stretches[-1])
    for k in range(len(stretches) - 2, -1, -1):
        stop = stretches[k + 1].start
        if k < len(stretches) - 2:
            count, _ = run.ahead(stretches[k])
        run.back(count, stop)
        if progress is not None:
            progress(1.0 - 0.5 * stretches[k].start / n)
    calibration = run.learned(stretches[-1])
    return Track(recording.t, *run.track, run.health, params, calibration=calibration)
