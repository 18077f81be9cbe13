"""Many recordings or parameter sets on a GPU, one thread each.

The kernels are those of the batch driver. Every number of what the runs carry is a row of a table, every run a column;
readings and results likewise, chunk of samples after chunk, so that memory on the GPU does not grow with the length.
"""

import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.compiler.gpu import GpuProgram, from_gpu, on_gpu, to_gpu
from levelhead.compiler.hooks import Bindings, fill, rebind
from levelhead.compiler.mark import KernelFunction
from levelhead.compiler.thread_rows import ThreadRows, thread_rows
from levelhead.compiler.tree import Tree, leaves, rebuild
from levelhead.engine import thread_kernels
from levelhead.engine.aiding_inputs import aiding_inputs
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.binding import CUDA_SINGLE, bind, estimates_bias
from levelhead.engine.driver import Carry, Settings
from levelhead.engine.lanes import Observer
from levelhead.engine.prior import read_calibration
from levelhead.errors import LevelheadError
from levelhead.filters.contract import Filter
from levelhead.filters.parameters import Params
from levelhead.guard import Guard
from levelhead.kernels.single import round_constant
from levelhead.recording import Array, Recording
from levelhead.track import Track

CHUNK_BYTES = 1 << 28  # of readings and results on the GPU at once
BATCH_SAMPLES = 1 << 24  # of the recordings that go together: 1.3 GB of tracks
SAMPLE_NUMBERS = 21  # ten of the readings, eleven of the results


class Variant(NamedTuple):
    """What a program is compiled for."""

    flt: Filter
    guarded: bool
    has_mag: bool
    observer: Observer | None  # None: tracks are kept
    single: bool  # precision


class ThreadProgram(NamedTuple):
    """A compiled program, and where its values lie."""

    program: GpuProgram
    settings: ThreadRows
    carry: ThreadRows
    sums: ThreadRows | None


@functools.cache
def compile_threads(variant: Variant) -> ThreadProgram:
    """The program of a variant; NVVM compiles it at its first use."""
    flt, guarded, has_mag, observer, single = variant
    bound, example = bind(flt, guarded), Settings(flt.params(), DEFAULT_GUARD)
    settings = thread_rows(example)
    carry = thread_rows(bound.begin(example), settings)
    filled = fill(
        thread_kernels.hooks,
        bound.name,
        HAS_MAG=has_mag,
        load_settings=settings.load,
        load_carry=carry.load,
        store_carry=carry.store,
    )
    pairs: Bindings = (*bound.pairs, (thread_kernels.hooks, filled))
    main: KernelFunction = thread_kernels.run_tracks
    sums = None
    if observer is not None:
        sums = thread_rows(observer.start, carry)
        members = {"observe": observer.observe, "load": sums.load, "store": sums.store}
        main = thread_kernels.run_scores
        pairs = (*pairs, (thread_kernels.score, fill(thread_kernels.score, observer.name, **members)))
    program = GpuProgram(rebind(main, pairs, bound.name), round_constant if single else None)
    return ThreadProgram(program, settings, carry, sums)


class Threads:
    """Runs side by side: one recording through many parameter sets, or as many recordings as sets."""

    def __init__(self, variant: Variant, guard: Guard, recordings: Sequence[Recording], sets: Sequence[Params]) -> None:
        self._program, self._variant, self._recordings = compile_threads(variant), variant, recordings
        self._settings = [Settings(params, guard) for params in sets]
        self._type: type[np.floating] = np.float32 if variant.single else np.float64
        program, sums = self._program, self._program.sums
        last = sums or program.carry
        self._floats: Array = np.zeros((last.floats, len(sets)), self._type)
        self._wholes: NDArray[np.int64] = np.zeros((last.wholes, len(sets)), np.int64)
        begin = bind(variant.flt, variant.guarded).begin
        program.settings.put(self._floats, self._wholes, self._settings)
        program.carry.put(self._floats, self._wholes, [begin(settings) for settings in self._settings])
        self._lengths = np.array([len(one) for one in recordings], np.int64)
        if len(recordings) < len(sets):
            self._lengths = np.repeat(self._lengths, len(sets))

    def _inputs(self, start: int, stop: int) -> Array:
        """(10, samples, recordings) readings of a chunk; beyond the end of a recording zeros."""
        table = np.zeros((10, stop - start, len(self._recordings)), self._type)
        for column, one in enumerate(self._recordings):
            end = min(stop, len(one))
            rows = slice(0, max(end - start, 0))
            table[0, rows, column] = np.diff(one.t[max(start - 1, 0) : end], prepend=one.t[:1] if start == 0 else [])
            table[1:4, rows, column], table[4:7, rows, column] = one.gyr[start:end].T, one.acc[start:end].T
            if one.mag is not None:
                table[7:10, rows, column] = one.mag[start:end].T
        return table

    def _chunks(self) -> Iterator[tuple[int, int, NDArray[np.int64]]]:
        """First sample, the one after the last, and how many of these each run has."""
        numbers = 10 * len(self._recordings) + (SAMPLE_NUMBERS - 10) * len(self._settings)
        size, n = max(CHUNK_BYTES // (8 * numbers), 1), int(self._lengths.max())
        for start in range(0, n, size):
            stop = min(start + size, n)
            yield start, stop, np.clip(self._lengths - start, 0, stop - start)

    def tracks(self) -> list[Track]:
        """The track of each run."""
        flt, guarded = self._variant.flt, self._variant.guarded
        kept = [(np.empty((n, 10)), np.empty(n, np.uint32)) for n in self._lengths]
        floats, wholes = to_gpu(self._floats), to_gpu(self._wholes)
        count = len(self._settings)
        for start, stop, lengths in self._chunks():
            outputs, health = on_gpu((10, stop - start, count), self._type), on_gpu((stop - start, count), np.uint32)
            arguments = (floats, wholes, to_gpu(lengths), to_gpu(self._inputs(start, stop)), outputs, health)
            self._program.program.run(count, *arguments)
            numbers, bits = from_gpu(outputs), from_gpu(health)
            for column, (into, flags) in enumerate(kept):
                n = int(lengths[column])
                into[start : start + n] = numbers[:, :n, column].T
                flags[start : start + n] = bits[:n, column]
        self._floats, self._wholes = from_gpu(floats), from_gpu(wholes)
        made = []
        for column, (settings, (numbers, flags)) in enumerate(zip(self._settings, kept, strict=True)):
            carry: Carry = self._program.carry.get(self._floats, self._wholes, column)
            recording = self._recordings[column if len(self._recordings) > 1 else 0]
            made.append(
                Track(
                    recording.t,
                    np.ascontiguousarray(numbers[:, :4]),
                    np.ascontiguousarray(numbers[:, 4:7]) if estimates_bias(flt, guarded) else None,
                    np.ascontiguousarray(numbers[:, 7:]),
                    flags,
                    settings.filter,
                    calibration=read_calibration(flt, settings, carry),
                )
            )
        return made

    def observe(self, truth: Array, sums: Sequence[Tree]) -> list[Tree]:
        """What the observer has seen of each run at the end, beginning with ``sums``; truth: (n, 4)."""
        place = self._program.sums
        assert place is not None
        place.put(self._floats, self._wholes, list(sums))
        floats, wholes = to_gpu(self._floats), to_gpu(self._wholes)
        for start, stop, lengths in self._chunks():
            real = np.ascontiguousarray(truth[start:stop].T, self._type)
            inputs = to_gpu(self._inputs(start, stop))
            self._program.program.run(len(lengths), floats, wholes, to_gpu(lengths), inputs, to_gpu(real))
        after, whole = from_gpu(floats), from_gpu(wholes)
        return [place.get(after, whole, column) for column in range(len(self._settings))]


def check_aiding(flt: Filter, recording: Recording) -> None:
    """Refuses what no thread takes.

    Raises:
        LevelheadError: the recording has pressure or GNSS, which the filter would use.
    """
    if flt.aiding is not None and aiding_inputs(recording) is not None:
        raise LevelheadError(
            "the engine 'cuda' takes no pressure and no GNSS; leave them out of the recording, or use the engine 'auto'"
        )


def tracks_of_sets(
    recording: Recording, flt: Filter, parameter_sets: Sequence[Params], guard: Guard | None, engine: str
) -> list[Track]:
    """The track of each parameter set of one filter over one recording.

    Memory: 84 bytes for each sample of each track.
    """
    check_aiding(flt, recording)
    variant = Variant(flt, guard is not None, recording.mag is not None, None, engine == CUDA_SINGLE)
    return Threads(variant, guard or DEFAULT_GUARD, [recording], parameter_sets).tracks()


def tracks_of_recordings(
    recordings: Iterable[Recording], params: Params, flt: Filter, guard: Guard | None, engine: str
) -> Iterator[Track]:
    """The track of each recording, in their order; recordings are taken a batch of ``BATCH_SAMPLES`` at a time."""
    batch: list[Recording] = []
    for recording in recordings:
        check_aiding(flt, recording)
        if batch and sum(map(len, batch)) + len(recording) > BATCH_SAMPLES:
            yield from _tracks_of_batch(batch, params, flt, guard, engine)
            batch = []
        batch.append(recording)
    yield from _tracks_of_batch(batch, params, flt, guard, engine)


def _tracks_of_batch(
    batch: Sequence[Recording], params: Params, flt: Filter, guard: Guard | None, engine: str
) -> list[Track]:
    found: dict[int, Track] = {}
    for has_mag in (False, True):
        mine = [i for i, one in enumerate(batch) if (one.mag is not None) == has_mag]
        if mine:
            variant = Variant(flt, guard is not None, has_mag, None, engine == CUDA_SINGLE)
            runs = Threads(variant, guard or DEFAULT_GUARD, [batch[i] for i in mine], [params] * len(mine))
            found.update(zip(mine, runs.tracks(), strict=True))
    return [found[i] for i in range(len(batch))]


def observe_on_gpu(
    recording: Recording,
    flt: Filter,
    parameter_sets: Sequence[Params],
    observer: Observer,
    truth: Array,
    sums: Array,
    *,
    guard: Guard | None = DEFAULT_GUARD,
    progress: Callable[[float], None] | None = None,
    engine: str = "cuda",
) -> Array:
    """``lanes.observe`` on the GPU."""
    check_aiding(flt, recording)
    variant = Variant(flt, guard is not None, recording.mag is not None, observer, engine == CUDA_SINGLE)
    runs = Threads(variant, guard or DEFAULT_GUARD, [recording], parameter_sets)
    starts = [rebuild(observer.start, iter(row)) for row in sums.tolist()]
    ends = runs.observe(truth, starts)
    if progress is not None:
        progress(1.0)
    return np.array([list(leaves(end)) for end in ends])
