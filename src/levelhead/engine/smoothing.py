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
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.binding import bind, for_engine, numba_installed
from levelhead.engine.driver import Carry, Settings, advance, result
from levelhead.engine.prior import apply_prior, read_calibration
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
    def restarted(kept: Array, first: int) -> bool:
        """Whether the attitude of a block is independent of that before it."""
        ...


hooks: Hooks = declare(Hooks)


class Kept(NamedTuple):
    """The blocks of a stretch, one after the other; the first one is the last of the stretch before."""

    numbers: Array  # WIDTH of each
    end: Array  # last sample of each


class Smoothed(NamedTuple):
    """What comes out, a row a sample."""

    quat: Array  # 4
    bias: Array  # 3
    sigma: Array  # 3


@compiled_only
def forward(
    settings: Settings, carry: Carry, last: float, start: int, t: Array, gyr: Array, acc: Array, mag: Array,
    attitude: Array, health: Array, kept: Kept,
) -> tuple[Carry, int, int]:  # fmt: skip
    """Samples from ``start`` on until there is no room for another block, or no sample.

    Returns the carry, how many blocks were kept, and the sample after the last one.
    """
    field = Vec3(0.0, 0.0, 0.0)
    count = 1
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
        if hooks.block_ended(carry.run.state):
            hooks.keep(carry.run.state, kept.numbers, hooks.WIDTH * count)
            kept.end[count] = float(i)
            count += 1
        i += 1
    return carry, count, i


@compiled_only
def backward(kept: Kept, count: int, m: Array, turn: Array, bias: Array, sigma: Array) -> None:
    """Rotation vectors of the corrections, bias and σ of all blocks kept, from the last one on, which m holds."""
    for steps in range(count):
        k = count - 1 - steps
        if steps > 0:
            hooks.back(kept.numbers, hooks.WIDTH * k, m)
        (
            (turn[k, 0], turn[k, 1], turn[k, 2]),
            (bias[k, 0], bias[k, 1], bias[k, 2]),
            (sigma[k, 0], sigma[k, 1], sigma[k, 2]),
        ) = hooks.read(kept.numbers, hooks.WIDTH * k, m)


@compiled_only
def compose_ends(kept: Kept, turn: Array, before: Array) -> None:
    """Rotation vectors of attitudes just before the ends of blocks: by the blocks' own corrections, then ``turn``."""
    for k in range(len(turn)):
        asked = quat.exp(Vec3(turn[k, 0], turn[k, 1], turn[k, 2]))
        before[k, 0], before[k, 1], before[k, 2] = quat.log(
            quat.multiply(asked, hooks.rotation(kept.numbers, hooks.WIDTH * k))
        )


@kernel
def last_gap(t: Array, first: int, last: int) -> int:
    """The last sample of these that comes after a gap; ``first`` if none does."""
    found = first
    for i in range(first + 1, last + 1):
        if t[i] - t[i - 1] > GAP_SECONDS:
            found = i
    return found


@compiled_only
def turn_by(attitude: Array, i: int, x: float, y: float, z: float) -> None:
    """Turns the attitude of sample i by a rotation vector, earth frame."""
    q = Quat(attitude[i, 0], attitude[i, 1], attitude[i, 2], attitude[i, 3])
    turned = quat.compose(quat.exp(Vec3(x, y, z)), q)
    attitude[i, 0], attitude[i, 1], attitude[i, 2], attitude[i, 3] = turned


@compiled_only
def spread(
    t: Array, kept: Kept, count: int, stop: int, at_end: Array, before: Array,
    bias: Array, sigma: Array, track: Smoothed,
) -> None:  # fmt: skip
    """From the ends of blocks to every sample up to ``stop``: linear within a block, but not across a new start."""
    for k in range(1, count + 1):
        here = min(k, count - 1)
        first = int(kept.end[k - 1]) + 1
        last = int(kept.end[k]) if k < count else stop - 1
        left = t[max(first - 1, 0)]
        span = max(t[last] - left, SHORTEST)
        anew = hooks.restarted(kept.numbers, hooks.WIDTH * here)
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


class Machine(NamedTuple):
    """Compiled parts of the smoother for one filter."""

    flt: Filter  # the one of the forward run
    forward: KernelFunction
    backward: KernelFunction
    compose_ends: KernelFunction
    spread: KernelFunction


@functools.cache
def machine(flt: Filter, guarded: bool) -> Machine:
    """The smoother of a filter that has one."""
    parts = flt.smoothing
    assert parts is not None and flt.schedule is not None
    schedule = Schedule(flt.schedule.due, parts.correct)
    ahead = flt._replace(name=f"{flt.name}_forward", init=parts.init, schedule=schedule)
    driver = bind(ahead, guarded)
    name = f"{flt.name}_{'guarded' if guarded else 'unguarded'}"
    members = {key: getattr(parts, key) for key in ("block_ended", "keep", "back", "read", "rotation", "restarted")}
    pairs = (*driver.pairs, (hooks, fill(hooks, name, WIDTH=parts.width, **members)))
    engine = "compiled" if numba_installed() else "python"  # slow, with the same bits
    made = (for_engine(rebind(part, pairs, name), engine) for part in (forward, backward, compose_ends, spread))
    return Machine(ahead, *made)


class Stretch(NamedTuple):
    """Where the forward run was when a stretch began."""

    start: int
    carry: Carry


class Smoother:
    """Forward and backward over one recording."""

    def __init__(self, recording: Recording, params: Params, guard: Guard | None, prior: Calibration | None) -> None:
        flt = filters.of(params)
        assert flt.smoothing is not None
        self._parts: Smoothing = flt.smoothing
        self._machine = machine(flt, guard is not None)
        driver = bind(self._machine.flt, guard is not None)
        self._settings = Settings(params, guard or DEFAULT_GUARD)
        mag = np.empty((0, 3)) if recording.mag is None else np.array(recording.mag)
        self._sensors = (np.array(recording.t), np.array(recording.gyr), np.array(recording.acc), mag)
        n = len(recording)
        self.track = Smoothed(np.empty((n, 4)), np.empty((n, 3)), np.empty((n, 3)))
        self.health = np.zeros(n, np.uint32)
        self.begin = Stretch(0, apply_prior(self._machine.flt, driver.begin(self._settings), prior))
        self._kept = Kept(np.zeros(KEPT * self._parts.width), np.zeros(KEPT))
        self._memory = np.zeros(self._parts.memory)  # of the backward run

    def run_forward(self, stretch: Stretch) -> tuple[int, Stretch]:
        """Through one stretch: how many blocks were kept, and where the next one begins."""
        self._parts.keep_start(stretch.carry.run.state, self._kept.numbers)
        self._kept.end[0] = stretch.start - 1
        last = float(self._sensors[0][max(stretch.start - 1, 0)])
        carry, count, stop = self._machine.forward(
            self._settings,
            native(stretch.carry) if numba_installed() else stretch.carry,
            last,
            stretch.start,
            *self._sensors,
            self.track.quat,
            self.health,
            self._kept,
        )
        return count, Stretch(stop, plain(carry))

    def calibration_at_end(self, end: Stretch) -> Calibration | None:
        """What was known of the sensor at the end, which is all there is to know."""
        return read_calibration(self._machine.flt, self._settings, end.carry)

    def end(self, stretch: Stretch) -> None:
        """Backwards begins where the recording ends, of which nothing more is to be calibration_at_end."""
        self._parts.begin(stretch.carry.run.state, self._memory)

    def back(self, count: int, stop: int) -> None:
        """Through the stretch that was kept, to the sample before ``stop``."""
        turn, bias, sigma, before = (np.zeros((count, 3)) for _ in range(4))
        self._machine.backward(self._kept, count, self._memory, turn, bias, sigma)
        self._machine.compose_ends(self._kept, turn, before)
        self._machine.spread(self._sensors[0], self._kept, count, stop, turn, before, bias, sigma, self.track)


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
    flt = filters.of(params)
    if flt.smoothing is None:
        who = " or ".join(one.name for one in filters.ALL if one.smoothing)
        raise LevelheadError(f"{flt.name} has no smoother; {who} has one")
    run = Smoother(recording, flt.smoothing.offline(params), guard, prior)
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
    return Track(recording.t, *run.track, run.health, params, calibration=calibration)
