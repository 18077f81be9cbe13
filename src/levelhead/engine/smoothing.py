"""The smoother: every estimate uses the whole recording.

The filter runs forward and keeps of each block of samples what its ``Smoothing`` asks for. Then the blocks are
corrected backwards, each by all that follows it (for the ``ESKF`` by ``filters.eskf.rts``, which has the equations).

The attitude between the ends of two blocks is rotated from the left by exp of a rotation vector that goes linearly from
the correction of the first block to that of the second one before its own measurements. Only two minutes of blocks
are kept: the filter runs forward once to save its state now and then, and again through each stretch before that is
smoothed.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from levelhead import filters
from levelhead.calibration import Calibration
from levelhead.compiler.hooks import declare, fill, rebind
from levelhead.compiler.mark import KernelFunction, compiled_only, kernel
from levelhead.compiler.tree import native, plain
from levelhead.engine.batch import DEFAULT_GUARD, NO_MAG
from levelhead.engine.binding import bind, choose_engine, for_engine, numba_installed
from levelhead.engine.driver import Carry, Settings, advance, result
from levelhead.engine.native import NativeSmoother, has_smoother
from levelhead.engine.prior import apply_prior, correct_recording, read_calibration
from levelhead.errors import LevelheadError
from levelhead.filters.contract import Filter, FilterState, Schedule, Smoothing
from levelhead.filters.parameters import FilterChoice, Params
from levelhead.guard import Guard
from levelhead.kernels import quat
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import GAP_SECONDS
from levelhead.kernels.vec3 import Vec3
from levelhead.recording import Array, Recording
from levelhead.track import Track

KEPT = 500  # blocks in memory, ten MB: more would not stay near the processor
SHORTEST = 1e-9  # s, a block


class Hooks(Protocol):
    """What the smoother calls of a filter: members of its ``contract.Smoothing``."""

    WIDTH: int  # numbers of a block

    @staticmethod
    def block_ended(state: FilterState) -> bool:
        """Whether a block ended with the last sample."""
        ...

    @staticmethod
    def keep(state: FilterState, kept: Array, first: int) -> None:
        """Keeps the block that has just ended, as numbers from ``first`` on."""
        ...

    @staticmethod
    def back(kept: Array, first: int, memory: Array) -> None:
        """One step back, to the block that is kept from ``first`` on."""
        ...

    @staticmethod
    def read(kept: Array, first: int, memory: Array) -> tuple[Vec3, Vec3, Vec3]:
        """Rotation vector, bias and σ of the block that the step back has reached."""
        ...

    @staticmethod
    def rotation(kept: Array, first: int) -> Quat:
        """The rotation by the correction at the end of a block, earth frame."""
        ...

    @staticmethod
    def is_restart(kept: Array, first: int) -> bool:
        """Whether the attitude of a block is independent of that before it."""
        ...


hooks: Hooks = declare(Hooks)


class BlockRows(NamedTuple):
    """The blocks of a stretch, one after the other; the first one is the last of the stretch before."""

    numbers: Array  # WIDTH of each
    end: Array  # last sample of each


class FlatTrack(NamedTuple):
    """What comes out, flat."""

    quat: Array  # 4 a sample
    bias: Array  # 3
    sigma: Array  # 3


class Corrections(NamedTuple):
    """Of the blocks kept, three numbers each, flat."""

    turn: Array  # rotation vectors of the corrections at their ends
    before: Array  # and just before their ends
    bias: Array
    sigma: Array


@compiled_only
def forward(
    settings: Settings, carry: Carry, last: float, start: int, t: Array, gyr: Array, acc: Array, mag: Array,
    attitude: Array, health: Array, kept: BlockRows,
) -> tuple[Carry, int, int]:  # fmt: skip
    """Samples from ``start`` on until there is no room for another block, or no sample.

    Returns the carry, how many blocks were kept, and the sample after the last one. The native engine has this loop in
    ``native.forward.c``.
    """
    field = Vec3(0.0, 0.0, 0.0)
    count = 1
    i = start
    while i < len(t) and count < len(kept.end):
        j = 3 * i
        if len(mag) > 0:
            field = Vec3(mag[j], mag[j + 1], mag[j + 2])
        turned = Vec3(gyr[j], gyr[j + 1], gyr[j + 2])
        carry = advance(settings, carry, turned, Vec3(acc[j], acc[j + 1], acc[j + 2]), field, t[i] - last)
        last = t[i]
        said = result(settings, carry.run)
        k = 4 * i
        attitude[k], attitude[k + 1], attitude[k + 2], attitude[k + 3] = said.quat
        health[i] = said.health
        if hooks.block_ended(carry.run.state):
            hooks.keep(carry.run.state, kept.numbers, hooks.WIDTH * count)
            kept.end[count] = float(i)
            count += 1
        i += 1
    return carry, count, i


@kernel
def backward(kept: Array, count: int, m: Array, turn: Array, bias: Array, sigma: Array) -> None:
    """Rotation vectors of the corrections, bias and σ of all blocks kept, from the last one on, which m holds."""
    for steps in range(count):
        k = count - 1 - steps
        if steps > 0:
            hooks.back(kept, hooks.WIDTH * k, m)
        vector, offset, deviation = hooks.read(kept, hooks.WIDTH * k, m)
        j = 3 * k
        turn[j], turn[j + 1], turn[j + 2] = vector
        bias[j], bias[j + 1], bias[j + 2] = offset
        sigma[j], sigma[j + 1], sigma[j + 2] = deviation


@kernel
def compose_ends(kept: Array, count: int, turn: Array, before: Array) -> None:
    """Rotation vectors of attitudes just before the ends of blocks: by the blocks' own corrections, then ``turn``."""
    for k in range(count):
        j = 3 * k
        asked = quat.exp(Vec3(turn[j], turn[j + 1], turn[j + 2]))
        before[j], before[j + 1], before[j + 2] = quat.log(quat.multiply(asked, hooks.rotation(kept, hooks.WIDTH * k)))


@kernel
def last_gap(t: Array, first: int, last: int) -> int:
    """The last sample of these that comes after a gap; ``first`` if none does."""
    found = first
    for i in range(first + 1, last + 1):
        if t[i] - t[i - 1] > GAP_SECONDS:
            found = i
    return found


@kernel
def turn_by(attitude: Array, i: int, x: float, y: float, z: float) -> None:
    """Turns the attitude of sample i by a rotation vector, earth frame."""
    k = 4 * i
    q = Quat(attitude[k], attitude[k + 1], attitude[k + 2], attitude[k + 3])
    turned = quat.compose(quat.exp(Vec3(x, y, z)), q)
    attitude[k], attitude[k + 1], attitude[k + 2], attitude[k + 3] = turned


@kernel
def spread_block(
    t: Array, kept: Array, k: int, count: int, first: int, last: int,
    turn: Array, before: Array, bias: Array, sigma: Array, attitude: Array, biases: Array, sigmas: Array,
) -> None:  # fmt: skip
    """From the ends of block k − 1 and k to each sample between: linear, but not across a new start.

    ``first`` and ``last`` are these samples. Block ``count`` has no end: it is what follows the last one.
    """
    here = min(k, count - 1)
    one = 3 * (k - 1)
    other = 3 * here
    left = t[max(first - 1, 0)]
    span = max(t[last] - left, SHORTEST)
    anew = hooks.is_restart(kept, hooks.WIDTH * here)
    joined = last_gap(t, max(first - 1, 0), last) if anew else 0
    for i in range(first, last + 1):
        line = min((t[i] - left) / span, 1.0) if k < count else 1.0
        share = line
        if anew:
            share = 1.0 if i >= joined else 0.0
        if k == count or i == last:
            turn_by(attitude, i, turn[other], turn[other + 1], turn[other + 2])
        else:
            kept_share = 1.0 - share
            turn_by(
                attitude,
                i,
                kept_share * turn[one] + share * before[other],
                kept_share * turn[one + 1] + share * before[other + 1],
                kept_share * turn[one + 2] + share * before[other + 2],
            )
        for j in range(3):
            biases[3 * i + j] = bias[one + j] + line * (bias[other + j] - bias[one + j])
            sigmas[3 * i + j] = sigma[one + j] + line * (sigma[other + j] - sigma[one + j])


@compiled_only
def correct_stretch(
    t: Array, kept: BlockRows, count: int, stop: int, memory: Array, corrections: Corrections, track: FlatTrack
) -> None:
    """Backwards through the blocks that were kept, then to every sample between them and up to ``stop``.

    The native engine has this loop in ``native.smoother.c``.
    """
    turn, before, bias, sigma = corrections
    backward(kept.numbers, count, memory, turn, bias, sigma)
    compose_ends(kept.numbers, count, turn, before)
    k = 1
    while k <= count:
        first = int(kept.end[k - 1]) + 1
        last = int(kept.end[k]) if k < count else stop - 1
        spread_block(
            t, kept.numbers, k, count, first, last, turn, before, bias, sigma, track.quat, track.bias, track.sigma
        )
        k += 1


class BoundSmoother(NamedTuple):
    """The smoother of one filter, in plain Python."""

    flt: Filter  # the one of the forward run
    pairs: tuple[tuple[object, object], ...]  # for ``rebind``
    name: str

    def bind(self, function: KernelFunction) -> KernelFunction:
        """A function of this module that calls the filter's."""
        return rebind(function, self.pairs, self.name)


@functools.cache
def bind_smoother(flt: Filter, guarded: bool) -> BoundSmoother:
    """The smoother of a filter that has one."""
    parts = flt.smoothing
    assert parts is not None and flt.schedule is not None
    schedule = Schedule(flt.schedule.due, parts.correct)
    ahead = flt._replace(name=f"{flt.name}_forward", init=parts.init, schedule=schedule, aiding=None)
    name = f"{flt.name}_{'guarded' if guarded else 'unguarded'}"
    members = {key: getattr(parts, key) for key in ("block_ended", "keep", "back", "read", "rotation", "is_restart")}
    pairs = (*bind(ahead, guarded).pairs, (hooks, fill(hooks, name, WIDTH=parts.width, **members)))
    return BoundSmoother(ahead, pairs, name)


def choose_smoother_engine(engine: str, flt: Filter, guarded: bool) -> str:
    """What ``engine`` means for the smoother of a filter: without a native one machine code at any length."""
    has_native = has_smoother(flt, guarded)
    if engine == "auto" and not has_native:
        return "compiled" if numba_installed() else "python"
    return choose_engine(engine, 0, has_native)


class Stretch(NamedTuple):
    """Where the forward run was when a stretch began."""

    start: int
    carry: Carry


class Smoother:
    """Forward and backward over one recording."""

    def __init__(
        self, recording: Recording, params: Params, guard: Guard | None, prior: Calibration | None, engine: str
    ) -> None:
        flt, guarded = filters.of(params), guard is not None
        assert flt.smoothing is not None
        self._prior, recording = prior, correct_recording(recording, prior)
        self._parts: Smoothing = flt.smoothing
        self._bound = bind_smoother(flt, guarded)
        self._settings = Settings(params, guard or DEFAULT_GUARD)
        begin = bind(self._bound.flt, guarded).begin(self._settings)
        self.begin = Stretch(0, apply_prior(self._bound.flt, begin, prior))
        self._engine = choose_smoother_engine(engine, flt, guarded)
        if self._engine == "native":
            self._native = NativeSmoother(flt, self._bound.flt, guarded, self._settings, begin)
        else:
            self._forward = for_engine(self._bound.bind(forward), self._engine)
            self._correct = for_engine(self._bound.bind(correct_stretch), self._engine)
        mag = NO_MAG if recording.mag is None else recording.mag
        self._sensors = [self._numbers(a.reshape(-1)) for a in (recording.t, recording.gyr, recording.acc, mag)]
        n = len(recording)
        self.track = FlatTrack(np.empty(4 * n), np.empty(3 * n), np.empty(3 * n))
        self.health = np.zeros(n, np.uint32)
        self._kept = BlockRows(self._zeros(KEPT * self._parts.width), self._zeros(KEPT))
        self._memory = self._zeros(self._parts.memory)  # of the backward run

    def _numbers(self, values: Array) -> Array:
        """As the engine likes numbers: plain Python reads a list several times as fast."""
        return values.tolist() if self._engine == "python" else values

    def _zeros(self, count: int) -> Array:
        return self._numbers(np.zeros(count))

    def run_forward(self, stretch: Stretch) -> tuple[int, Stretch]:
        """Through one stretch: how many blocks were kept, and where the next one begins."""
        self._parts.keep_start(stretch.carry.run.state, self._kept.numbers)
        self._kept.end[0] = float(stretch.start - 1)
        last = float(self._sensors[0][max(stretch.start - 1, 0)])
        into = (*self._sensors, self.track.quat, self.health)
        if self._engine == "native":
            carry, count, stop = self._native.forward(stretch.carry, last, stretch.start, *into, *self._kept)
        else:
            carry = native(stretch.carry) if self._engine == "compiled" else plain(stretch.carry)
            carry, count, stop = self._forward(self._settings, carry, last, stretch.start, *into, self._kept)
        return count, Stretch(stop, plain(carry))

    def calibration_at_end(self, end: Stretch) -> Calibration | None:
        """What was known of the sensor at the end, which is all there is to know."""
        return read_calibration(self._bound.flt, self._settings, end.carry, self._prior)

    def end(self, stretch: Stretch) -> None:
        """Backwards begins where the recording ends, of which nothing more is to be calibration_at_end."""
        self._parts.begin(stretch.carry.run.state, self._memory)

    def back(self, count: int, stop: int) -> None:
        """Through the stretch that was kept, to the sample before ``stop``."""
        corrections = Corrections(*(self._zeros(3 * count) for _ in range(4)))
        t = self._sensors[0]
        if self._engine == "native":
            self._native.correct(t, *self._kept, count, stop, self._memory, *corrections, *self.track)
        else:
            self._correct(t, self._kept, count, stop, self._memory, corrections, self.track)


def smooth(
    recording: Recording,
    params: FilterChoice | None = None,
    *,
    guard: Guard | None = DEFAULT_GUARD,
    engine: str = "auto",
    prior: Calibration | None = None,
    progress: Callable[[float], None] | None = None,
) -> Track:
    """Orientation of every sample of a recording, with all of the recording known: the best there is offline.

    Args:
        recording: what the sensors said, SI units; pressure and GNSS are not used.
        params: of the self-calibrating filter ``ESKF``; None: those of ``filters.offline``. Blocks are made 0.25 s long
            at least.
        guard: as for ``fuse``.
        engine: as for ``fuse``.
        prior: as for ``fuse``.
        progress: called now and then with the fraction done, 0 to 1.

    Returns:
        A Track with the stamps of the recording; health is that of the forward run. Memory: ten numbers a sample, and
        five hundred blocks.

    Raises:
        LevelheadError: another filter, no such engine, or a prior that is none.
    """
    if not isinstance(recording, Recording):
        raise LevelheadError(
            f"smooth takes a Recording, not {type(recording).__name__}; levelhead.read(path) makes one"
        )
    params = filters.offline() if params is None else filters.resolve(params)
    flt = filters.of(params)
    if flt.smoothing is None:
        who = " or ".join(one.name for one in filters.ALL if one.smoothing)
        raise LevelheadError(f"{flt.name} has no smoother; {who} has one")
    run = Smoother(recording, flt.smoothing.offline(params), guard, prior, engine)
    stretches = [run.begin]
    n, count = len(recording), 0
    while stretches[-1].start < n:
        count, after = run.run_forward(stretches[-1])
        stretches.append(after)
        if progress is not None:
            progress(0.5 * after.start / n)
    run.end(stretches[-1])
    for k in range(len(stretches) - 2, -1, -1):
        stop = stretches[k + 1].start
        if k < len(stretches) - 2:
            count, _ = run.run_forward(stretches[k])
        run.back(count, stop)
        if progress is not None:
            progress(1.0 - 0.5 * stretches[k].start / n)
    calibration = run.calibration_at_end(stretches[-1])
    quats, bias, sigma = (values.reshape(n, -1) for values in run.track)
    return Track(recording.t, quats, bias, sigma, run.health, params, calibration=calibration)
