"""Many parameter sets over one recording, in lanes: the compiled driver with its inner loop over the sets.

A run needs the result of its own last sample at every operation, so a processor waits most of the time. Runs with other
parameters are independent: ``LANES`` of them go side by side, sample by sample, and the compiler makes SIMD of the loop
over the lanes. The kernels are those of the batch driver, in the same order, so every lane has the bits of its single
run.

The loop becomes SIMD only without calls of a C library (``kernels.trig`` has none) and without conversions between
whole numbers and floats. With them it stays scalar: slower, with the same bits.

SIMD computes both sides of a branch in all lanes and selects. A rare side would then cost as much as the usual one, so
the copy of the kernels that runs first has NaN in its place (``lane_kernels.RARE``). NaN spreads through a state and
stays; a chunk of samples after which a number is NaN is run again with the complete kernels.
"""

import functools
from collections.abc import Callable, Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np

from levelhead.compiler import lane_slots
from levelhead.compiler.borders import CompiledFunction
from levelhead.compiler.compile import compile_kernel
from levelhead.compiler.hooks import Bindings, fill, rebind
from levelhead.compiler.lane_slots import LANES, Rows
from levelhead.compiler.mark import KernelFunction
from levelhead.compiler.tree import Tree
from levelhead.engine import lane_kernels
from levelhead.engine.batch import DEFAULT_GUARD, NO_MAG, Columns
from levelhead.engine.binding import bind, estimates_bias, is_guarded
from levelhead.engine.conditioning import NO_SAMPLE, ConditionedSample
from levelhead.engine.driver import Settings
from levelhead.engine.threads import map_in_order
from levelhead.filters.contract import Filter
from levelhead.filters.parameters import Params
from levelhead.guard import Guard
from levelhead.recording import Array, Recording
from levelhead.track import Track

CHUNK = 1024  # samples between two checks for NaN
NOTHING = np.empty(0)


class Observer(NamedTuple):
    """The sums of each run's errors against the truth, sample by sample."""

    name: str
    observe: KernelFunction  # kernel (sums, quat, truth) -> sums
    start: Tree  # an example of ``sums``: a NamedTuple of floats


class CompiledLanes(NamedTuple):
    """The compiled lanes of one filter, and where in a block of memory its values lie."""

    run: CompiledFunction
    params: Rows
    results: Rows  # the observed values, in the block; without an observer the output, in a tile
    rows: int


def switches(params: Params) -> tuple[tuple[str, bool], ...]:
    """The bool parameters as (name, value): each value is compiled for itself."""
    return tuple((name, value) for name, value in params._asdict().items() if isinstance(value, bool))


class Variant(NamedTuple):
    """The key of a compilation of lanes."""

    flt: Filter
    guarded: bool
    has_mag: bool
    observer: Observer | None  # None: their output is kept
    switches: tuple[tuple[str, bool], ...]  # the same in all lanes, which would otherwise compute both and select


@functools.cache
def compile_lanes(variant: Variant, short: bool) -> CompiledLanes:
    """Compiled lanes; ``short``: with NaN in rare cases."""
    flt, observer = variant.flt, variant.observer
    bound, settings = bind(flt, variant.guarded), Settings(flt.params(), DEFAULT_GUARD)
    run = bound.begin(settings).run
    runs = lane_slots.lane_rows(run, 0)
    params = lane_slots.lane_rows(settings.filter, runs.end, dict(variant.switches))
    parts = [bound.name, "mag" if variant.has_mag else "imu", "short" if short else "whole", runs.layout, params.layout]
    filled = fill(
        lane_kernels.hooks,
        bound.name,
        HAS_MAG=variant.has_mag,
        OWN_SIGMA=flt.gains is None,
        CORRECTS=flt.schedule is not None,
        each=lane_slots.over_lanes(),
        load=runs.load,
        store=runs.store,
        load_params=params.load,
    )
    take: KernelFunction
    more: tuple[object, object]
    if observer is None:
        results, name = lane_slots.lane_rows(bound.result(settings, run), 0), "outputs"
        kept = fill(lane_kernels.outputs, bound.name, BYTES=results.end * LANES * 8, store=results.store)
        take, more, rows = lane_kernels.take_outputs, (lane_kernels.outputs, kept), params.end
    else:
        results, name = lane_slots.lane_rows(observer.start, params.end), observer.name
        members = {"observe": observer.observe, "load": results.load, "store": results.store}
        more = (lane_kernels.observer, fill(lane_kernels.observer, name, **members))
        take, rows = lane_kernels.take_errors, results.end
    owner = "_".join([*parts, name, results.layout])
    pairs: Bindings = (*bound.pairs, (lane_kernels.hooks, filled), more)
    sink = fill(lane_kernels.sink, owner, take=rebind(take, pairs, owner, inline=True))
    machine = rebind(lane_kernels.run_lanes, (*pairs, (lane_kernels.sink, sink)), owner, inline=True)
    if short:
        machine = rebind(machine, lane_kernels.RARE, inline=True)
    return CompiledLanes(run=compile_kernel(machine, lanes=True), params=params, results=results, rows=rows)


class LaneBlock:
    """Up to ``LANES`` parameter sets of one filter on their way through a recording."""

    def __init__(self, variant: Variant, guard: Guard, recording: Recording, parameter_sets: Sequence[Params]) -> None:
        self._variant, self._compiled, self._count = variant, compile_lanes(variant, True), len(parameter_sets)
        self._table, self._at = lane_slots.allocate(self._compiled.rows)
        mag = NO_MAG if recording.mag is None else recording.mag.reshape(-1)
        self._rows = (recording.t, recording.gyr.reshape(-1), recording.acc.reshape(-1), mag)
        self._guard, self._sample = guard, NO_SAMPLE
        self._short_runs = self._nan_runs = 0
        lane_slots.put(
            self._table, self._compiled.params, np.array([lane_slots.flat(params) for params in parameter_sets], float)
        )

    def _run(self, short: bool, start: int, stop: int, more: Tree) -> ConditionedSample:
        t, *others = self._rows
        part = [values[3 * start : 3 * stop] for values in others]
        run = compile_lanes(self._variant, short).run
        last = float(t[max(start - 1, 0)])
        sample: ConditionedSample = run(self._at, self._guard, self._sample, last, t[start:stop], *part, more)
        return sample

    def advance(self, start: int, stop: int, more: Tree, tile: Array) -> None:
        """Samples ``start`` to ``stop`` in all lanes. ``tile`` is where ``lane_kernels.take_outputs`` writes to.

        Where the short kernels give NaN more often than not, they are no longer tried.
        """
        if 2 * self._nan_runs <= self._short_runs + 1:
            before = self._table.copy()
            sample = self._run(True, start, stop, more)
            self._short_runs += 1
            if not (np.isnan(self._table).any() or np.isnan(tile).any()):
                self._sample = sample
                return
            self._nan_runs += 1
            self._table[:] = before
        self._sample = self._run(False, start, stop, more)

    def observe(self, truth: Array, sums: Array) -> Array:
        """All samples; the observed values (count, numbers) at the end, which begin with ``sums``."""
        lane_slots.put(self._table, self._compiled.results, sums)
        for start in range(0, len(truth), CHUNK):
            stop = min(start + CHUNK, len(truth))
            self.advance(start, stop, truth[start:stop].reshape(-1), NOTHING)
        return lane_slots.get(self._table, self._compiled.results, self._count)

    def outputs(self) -> list[Columns]:
        """All samples; of each lane quat (n, 4), bias (n, 3), sigma (n, 3) and health (n,)."""
        n, floats = len(self._rows[0]), self._compiled.results.floats
        tile, at = lane_slots.allocate(min(n, CHUNK) * len(floats))
        results = tile.reshape(-1, len(floats), LANES)
        lanes: list[Columns] = [
            [*(np.empty((n, width)) for width in (4, 3, 3)), np.empty(n, np.uint32)] for _ in range(self._count)
        ]
        for start in range(0, n, CHUNK):
            stop = min(start + CHUNK, n)
            self.advance(start, stop, at, results[: stop - start, :10])
            for lane, (q, b, s, h) in enumerate(lanes):
                rows = results[: stop - start, :, lane]
                q[start:stop], b[start:stop], s[start:stop] = rows[:, :4], rows[:, 4:7], rows[:, 7:10]
                h[start:stop] = rows[:, 10].copy().view(np.int64)
        return lanes


def lane_blocks(parameter_sets: Sequence[Params]) -> list[list[int]]:
    """The indices of parameter sets that share a block: at most ``LANES``, with equal switches."""
    groups: dict[object, list[int]] = {}
    for i, params in enumerate(parameter_sets):
        groups.setdefault(switches(params), []).append(i)
    return [group[k : k + LANES] for group in groups.values() for k in range(0, len(group), LANES)]


def _variants(recording: Recording, flt: Filter, guard: Guard | None) -> Callable[[Params, Observer | None], Variant]:
    """The variant of parameters and an observer, for a recording."""
    guarded, has_mag = is_guarded(flt) and guard is not None, recording.mag is not None

    def variant_of(params: Params, observer: Observer | None) -> Variant:
        return Variant(flt=flt, guarded=guarded, has_mag=has_mag, observer=observer, switches=switches(params))

    return variant_of


def tracks(
    recording: Recording, flt: Filter, parameter_sets: Sequence[Params], guard: Guard | None, workers: int | None = None
) -> list[Track]:
    """The whole track of each parameter set, in their order."""
    bias = estimates_bias(flt, guard is not None)
    variant_of = _variants(recording, flt, guard)

    def work(block: list[int]) -> list[Track]:
        sets = [parameter_sets[i] for i in block]
        variant = variant_of(sets[0], None)
        return [
            Track(recording.t, q, b if bias else None, s, h, params, readings=recording)
            for params, (q, b, s, h) in zip(
                sets, LaneBlock(variant, guard or DEFAULT_GUARD, recording, sets).outputs(), strict=True
            )
        ]

    cut = lane_blocks(parameter_sets)
    found = dict(zip(chain.from_iterable(cut), chain.from_iterable(map_in_order(work, cut, workers)), strict=True))
    return [found[i] for i in range(len(parameter_sets))]


def observe_lanes(
    recording: Recording,
    flt: Filter,
    parameter_sets: Sequence[Params],
    observer: Observer,
    truth: Array,
    sums: Array,
    *,
    guard: Guard | None = DEFAULT_GUARD,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Array:
    """The sums of an observer over the run of each parameter set; no track is kept.

    Args:
        recording: the conditioned samples.
        flt: the filter.
        parameter_sets: k of them, of this filter.
        observer: the quantity to accumulate; compiled together with the filter, once.
        truth: (n, 4) orientation to hold beside; samples that are NaN do not count.
        sums: (k, numbers of ``observer.start``) where each run begins.
        guard: as for ``fuse``.
        workers: threads; None: one for each core.
        progress: called with the fraction done, 0 to 1.

    Returns:
        (k, numbers of ``observer.start``) where each run ends.
    """
    variant_of = _variants(recording, flt, guard)

    def work(block: list[int]) -> Array:
        sets = [parameter_sets[i] for i in block]
        lanes = LaneBlock(variant_of(sets[0], observer), guard or DEFAULT_GUARD, recording, sets)
        return lanes.observe(truth, sums[block])

    cut, after, done = lane_blocks(parameter_sets), np.empty_like(sums), 0
    for block, part in zip(cut, map_in_order(work, cut, workers), strict=True):
        after[block] = part
        done += len(block)
        if progress is not None:
            progress(done / len(parameter_sets))
    return after
