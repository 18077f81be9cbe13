"""The smoother: every estimate uses the whole recording.

The filter runs forward and keeps the quantities that its ``Smoothing`` needs of each block of samples. Then the blocks
are corrected backwards, each by all that follows it (for the ``ESKF`` by ``filters.eskf.rts``, which has the
equations).

The attitude between the ends of two blocks is rotated from the left by exp of a rotation vector that goes linearly from
the correction of the first block to that of the second one before its own measurements. Only half a minute of blocks
is kept: the filter runs forward once to save its state now and then, and again through each stretch before that is
smoothed.
"""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from levelhead import filters
from levelhead.calibration import Calibration
from levelhead.compiler.hooks import fill, rebind
from levelhead.compiler.mark import KernelFunction
from levelhead.compiler.tree import Tree, native
from levelhead.engine.aiding_inputs import aiding_inputs
from levelhead.engine.batch import DEFAULT_GUARD, NO_MAG, navigation_fields
from levelhead.engine.binding import bind, choose_engine, for_engine, numba_installed
from levelhead.engine.driver import Settings
from levelhead.engine.native import NativeSmoother, has_smoother, smoother_name
from levelhead.engine.prior import apply_prior, correct_recording, read_calibration
from levelhead.engine.serialization import leaf_bytes, value_of
from levelhead.engine.smoother_kernels import (
    BlockRows,
    Corrections,
    FlatTrack,
    NavCorrections,
    Readings,
    correct_stretch,
    correct_stretch_with_nav,
    forward_stretch,
    forward_stretch_with_aiding,
    hooks,
    nav_hooks,
)
from levelhead.errors import LevelheadError
from levelhead.filters.contract import Aiding, Filter, FilterState, Schedule, Smoothing
from levelhead.filters.parameters import FilterChoice, Params
from levelhead.guard import Guard
from levelhead.open_types import JsonObject
from levelhead.recording import Array, Recording
from levelhead.rotations import turn_heading
from levelhead.track import Track

MOST_BLOCKS = 125  # blocks in memory, two MB: more would not stay near the processor


class BoundSmoother(NamedTuple):
    """The smoother of one filter, with aiding or without, in plain Python."""

    flt: Filter  # the one of the forward run
    parts: Smoothing
    forward: KernelFunction  # of ``smoother_kernels``, not bound yet
    correct: KernelFunction
    pairs: tuple[tuple[object, object], ...]  # for ``rebind``
    name: str
    turn_start: Callable[[FilterState, FilterState], FilterState | None] | None = None  # with aiding

    def bind(self, function: KernelFunction) -> KernelFunction:
        """A function of ``smoother_kernels`` that calls the filter's."""
        return rebind(function, self.pairs, self.name)


@functools.cache
def bind_smoother(flt: Filter, guarded: bool) -> BoundSmoother:
    """The smoother of a filter that has one, without aiding."""
    parts = flt.smoothing
    assert parts is not None and flt.schedule is not None
    schedule = Schedule(flt.schedule.due, parts.correct)
    title = smoother_name(flt, False)
    ahead = flt._replace(name=f"{title}_forward", init=parts.init, schedule=schedule, aiding=None)
    name = f"{title}_{'guarded' if guarded else 'unguarded'}"
    pairs = (*bind(ahead, guarded).pairs, (hooks, _fill_hooks(parts, name)))
    return BoundSmoother(
        flt=ahead, parts=parts, forward=forward_stretch, correct=correct_stretch, pairs=pairs, name=name
    )


MEMBERS = ("is_block_end", "keep_start", "keep", "back", "read", "rotation", "is_restart")  # of ``Hooks``


def _fill_hooks(parts: Smoothing, name: str) -> object:
    return fill(hooks, name, WIDTH=parts.width, **{key: getattr(parts, key) for key in MEMBERS})


@functools.cache
def bind_aided_smoother(flt: Filter, guarded: bool) -> BoundSmoother:
    """The smoother of a filter that takes position, velocity and height, with these."""
    aided = flt.aided_smoothing
    assert aided is not None and flt.schedule is not None and flt.aiding is not None and flt.calibration is not None
    title = smoother_name(flt, True)
    ahead = flt._replace(
        name=f"{title}_forward",
        init=aided.parts.init,
        schedule=Schedule(flt.schedule.due, aided.parts.correct),
        aiding=Aiding(aided.update, flt.aiding.nav_state),
        calibration=flt.calibration._replace(restart=aided.restart),
    )
    name = f"{title}_{'guarded' if guarded else 'unguarded'}"
    nav = fill(nav_hooks, name, read_nav=aided.read_nav, nav_change=aided.nav_change, is_set=aided.is_set)
    pairs = (*bind(ahead, guarded).pairs, (hooks, _fill_hooks(aided.parts, name)), (nav_hooks, nav))
    return BoundSmoother(
        flt=ahead,
        parts=aided.parts,
        forward=forward_stretch_with_aiding,
        correct=correct_stretch_with_nav,
        pairs=pairs,
        name=name,
        turn_start=aided.turn_start,
    )


def choose_smoother_engine(engine: str, flt: Filter, guarded: bool, aided: bool) -> str:
    """The engine of a filter's smoother: without a native one machine code at any length.

    Raises:
        LevelheadError: no such engine.
    """
    has_native = has_smoother(flt, guarded, aided)
    if engine == "auto" and not has_native:
        return "compiled" if numba_installed() else "python"
    return choose_engine(engine, 0, has_native)


class Stretch(NamedTuple):
    """Where the forward run was when a stretch began."""

    start: int
    carry: bytes  # the driver's Carry


class Stretches(Protocol):
    """A list of them, in memory or in a file."""

    def append(self, stretch: Stretch, /) -> None:
        """One more."""
        ...

    def __len__(self) -> int: ...

    def __getitem__(self, index: int, /) -> Stretch: ...


class Smoother:
    """Forward and backward over one recording."""

    def __init__(
        self, recording: Recording, params: Params, guard: Guard | None, prior: Calibration | None, engine: str
    ) -> None:
        flt, guarded = filters.of(params), guard is not None
        self._prior, recording = prior, correct_recording(recording, prior)
        inputs = None if flt.aided_smoothing is None else aiding_inputs(recording)
        self._bound = bind_smoother(flt, guarded) if inputs is None else bind_aided_smoother(flt, guarded)
        self._parts = self._bound.parts
        self._settings = Settings(self._parts.offline(params), guard or DEFAULT_GUARD)
        self._params = params
        self.turn = 0.0  # rad about the vertical, that brings all attitudes to north at the end of the run
        begin = bind(self._bound.flt, guarded).begin(self._settings)
        self._engine = choose_smoother_engine(engine, flt, guarded, inputs is not None)
        lists = self._engine == "python"
        self._readings = inputs and Readings._make(a.tolist() if lists else a for a in inputs)
        self._pack: Callable[[Tree], bytes]
        self._unpack: Callable[[bytes], Tree]
        if self._engine == "native":
            name = smoother_name(flt, inputs is not None)
            self._native = NativeSmoother(name, self._bound.flt, guarded, self._settings, begin)
            self._pack, self._unpack = self._native.pack, self._native.unpack
        else:
            self._pack, self._unpack = leaf_bytes, functools.partial(value_of, begin)
            self._forward = for_engine(self._bound.bind(self._bound.forward), self._engine)
            self._correct = for_engine(self._bound.bind(self._bound.correct), self._engine)
        self._nav = np.empty(0 if inputs is None else 12 * len(recording))  # position, velocity, 1σ of both
        self.begin = Stretch(0, self._pack(apply_prior(self._bound.flt, begin, prior)))
        n, mag = len(recording), [] if recording.mag is None else [recording.mag]
        sensors = [a.reshape(-1) for a in (recording.t, recording.gyr, recording.acc, *mag)]
        self.take(sensors, FlatTrack(np.empty(4 * n), np.empty(3 * n), np.empty(3 * n)), np.zeros(n, np.uint32))
        self._kept = BlockRows(self._zeros(MOST_BLOCKS * self._parts.width), self._zeros(MOST_BLOCKS))
        self._memory = self._zeros(self._parts.memory)  # of the backward run

    def _numbers(self, values: Array) -> Array:
        """As the engine likes numbers: plain Python reads a list several times as fast."""
        return values.tolist() if self._engine == "python" else values

    def _zeros(self, count: int) -> Array:
        """Zeros from where a cache line begins, so that no vector lies across two."""
        room = np.zeros(count + 7)
        skipped = -(room.ctypes.data // 8) % 8
        return self._numbers(room[skipped : skipped + count])

    def take(self, sensors: Sequence[Array], track: FlatTrack, health: NDArray[np.uint32]) -> None:
        """Arrays to work on: t, gyr, acc and perhaps mag, flat; and where the results go."""
        self._sensors = [self._numbers(a) for a in (*sensors, *([] if len(sensors) == 4 else [NO_MAG]))]
        self.track, self.health = track, health

    def run(
        self,
        stretches: Stretches,
        progress: Callable[[float], None] | None,
        passed: Callable[[int | None], None] = lambda following: None,
        resumed: int | None = None,
    ) -> Calibration | None:
        """There and back.

        Args:
            stretches: where their beginnings are kept: empty as yet, or those of an earlier run.
            progress: called with the fraction done.
            passed: called after each stretch with None on the way there, and on the way back with the number of the
                stretch that follows, -1 after all.
            resumed: such a number of an earlier run, whose ``memory`` was set; None: the way back begins.
        """
        report = progress or (lambda fraction: None)
        if len(stretches) == 0:
            stretches.append(self.begin)
        n, count, last = len(self.health), None, stretches[len(stretches) - 1]
        while last.start < n:
            count, last = self.run_forward(last)
            stretches.append(last)
            report(0.5 * last.start / n)
            passed(None)
            if last.start == n and (turned := self._turn_start(last)) is not None:
                stretches, last = [turned], turned
        first = len(stretches) - 2 if resumed is None else resumed
        if resumed is None:
            self.end(last)
        for k in range(first, -1, -1):
            if count is None or k < first:
                count, _ = self.run_forward(stretches[k])
            self.back(count, stretches[k + 1].start)
            report(1.0 - 0.5 * stretches[k].start / n)
            passed(k - 1)
        return self.calibration_at_end(last)

    def _turn_start(self, end: Stretch) -> Stretch | None:
        """Where the forward run begins again, once it has found heading by a receiver."""
        turn_start = self._bound.turn_start
        if turn_start is None:
            return None
        begin = self._unpack(self.begin.carry)
        state = turn_start(begin.run.state, self._unpack(end.carry).run.state)
        if state is None:
            return None
        self.begin = Stretch(0, self._pack(begin._replace(run=begin.run._replace(state=state))))
        return self.begin

    @property
    def navigation(self) -> JsonObject:
        """A track's position and velocity, if there was any aiding."""
        if self._readings is None:
            return {}
        return navigation_fields(self._nav.reshape(-1, 4, 3))

    @property
    def memory(self) -> list[float]:
        """The backward pass's knowledge of all that follows."""
        return list(map(float, self._memory))

    @memory.setter
    def memory(self, values: Sequence[float]) -> None:
        self._memory[:] = values

    def run_forward(self, stretch: Stretch) -> tuple[int, Stretch]:
        """Through one stretch: how many blocks were kept, and where the next one begins."""
        self._kept.end[0] = float(stretch.start - 1)
        last = float(self._sensors[0][max(stretch.start - 1, 0)])
        into = (*self._sensors, self.track.quat, self.health)
        if self._engine == "native":
            more = () if self._readings is None else (*self._readings, self._nav)
            carry, count, stop = self._native.forward(stretch.carry, last, stretch.start, *into, *self._kept, *more)
            return count, Stretch(stop, carry)
        begin = self._unpack(stretch.carry)
        begin = native(begin) if self._engine == "compiled" else begin
        aiding = () if self._readings is None else (self._readings, self._nav)
        end, count, stop = self._forward(self._settings, begin, last, stretch.start, *into, self._kept, *aiding)
        return count, Stretch(stop, self._pack(end))

    def calibration_at_end(self, end: Stretch) -> Calibration | None:
        """The calibration at the end, which uses the whole recording."""
        carry = self._unpack(end.carry)
        self.turn = self._parts.turn_north(self._params, carry.run.state)
        return read_calibration(self._bound.flt, self._settings, carry, self._prior)

    def end(self, stretch: Stretch) -> None:
        """Backwards begins where the recording ends, of which nothing more is to be calibration_at_end."""
        self._parts.begin(self._unpack(stretch.carry).run.state, self._memory)

    def back(self, count: int, stop: int) -> None:
        """Through the stretch that was kept, to the sample before ``stop``."""
        corrections = Corrections(*(self._zeros(3 * count) for _ in range(4)))
        t, found = self._sensors[0], NavCorrections(self._zeros(12 * count), self._zeros(6 * count))
        if self._engine == "native":
            more = () if self._readings is None else (*found, self._nav)
            self._native.correct(t, *self._kept, count, stop, self._memory, *corrections, *self.track, *more)
        else:
            aiding = () if self._readings is None else (found, self._nav)
            self._correct(t, self._kept, count, stop, self._memory, corrections, self.track, *aiding)


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
        recording: the sensors' readings in SI units; pressure and GNSS give the track position and velocity.
        params: of the self-calibrating filter ``ESKF``; None: those of ``filters.offline``. Blocks are made 0.25 s long
            at least, without pressure and GNSS.
        guard: as for ``fuse``.
        engine: as for ``fuse``.
        prior: as for ``fuse``.
        progress: called now and then with the fraction done, 0 to 1.

    Returns:
        A Track with the stamps of the recording; health is that of the forward run. Memory: ten numbers a sample, and
        a hundred and twenty-five blocks.

    Raises:
        LevelheadError: another filter, no such engine, or a prior that is none.
    """
    if not isinstance(recording, Recording):
        raise LevelheadError(
            f"smooth takes a Recording, not {type(recording).__name__}; levelhead.read(path) makes one"
        )
    params = offline_params(params)
    run = Smoother(recording, params, guard, prior, engine)
    calibration = run.run([], progress)
    quats, bias, sigma = (values.reshape(len(recording), -1) for values in run.track)
    track = Track(
        recording.t, quats, bias, sigma, run.health, params, calibration=calibration, readings=recording,
        **run.navigation,
    )  # fmt: skip
    return turn_north(track, run.turn)


def turn_north(track: Track, turn: float) -> Track:
    """A smoothed track turned about the vertical by an angle (rad), with the σ of the north that it then points to."""
    if turn == 0.0 or track.north is None or track.sigma is None:
        return track
    east, north, heading = track.sigma.T
    c, s = math.cos(turn), math.sin(turn)
    sigma = np.stack(
        [np.hypot(c * east, s * north), np.hypot(s * east, c * north), np.hypot(heading, track.north.sigma)], axis=1
    )
    return replace(track, quat=turn_heading(track.quat, turn), sigma=sigma)


def offline_params(params: FilterChoice | None) -> Params:
    """The parameters of a filter that has a smoother.

    Raises:
        LevelheadError: it has none.
    """
    params = filters.offline() if params is None else filters.resolve(params)
    flt = filters.of(params)
    if flt.smoothing is None:
        who = " or ".join(one.name for one in filters.ALL if one.smoothing)
        raise LevelheadError(f"{flt.name} has no smoother; {who} has one")
    return params
