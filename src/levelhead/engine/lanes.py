"""Many parameter sets over one recording, in lanes: the compiled driver with its inner loop over the sets.

One run waits for its own last sample all the time: every operation needs the one before. Runs with other parameters do
not depend on it, so ``LANES`` of them go side by side, sample by sample, and the compiler makes SIMD of the loop over
the lanes. The kernels are those of the batch driver, in the same order, so every lane has the bits of its single run.

That needs kernels without calls of a C library (``kernels.trig`` has none) and without conversions between whole
numbers and floats: with them the loop stays one lane after the other, slower but with the same bits.

SIMD does both sides of a branch in all lanes and picks. What is rare would then cost as much as what is usual, so the
series for small angles (``quat.cos_half``, ``quat.sinc_half``) say NaN where they would have to ask for a sine. NaN
spreads through a state and stays; a stretch in which it turns up is run again with the whole kernels.
"""

import functools
from collections.abc import Callable, Sequence
from itertools import chain
from math import nan
from typing import Any, NamedTuple

import numpy as np

from levelhead.compiler import lane_slots
from levelhead.compiler.compile import compiled, substitute
from levelhead.compiler.lane_slots import LANES, Rows
from levelhead.compiler.mark import bound, kernel
from levelhead.engine.batch import DEFAULT_GUARD, NO_MAG
from levelhead.engine.binding import bind, estimates_bias, is_guarded
from levelhead.engine.conditioning import NO_SAMPLE, ConditionedSample, sigma_due
from levelhead.engine.driver import Settings, unbound
from levelhead.engine.threads import in_order
from levelhead.filters.contract import Filter
from levelhead.guard import Guard, detectors
from levelhead.kernels import quat, vector_error
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import ZERO, Vec3
from levelhead.recording import Array, Recording
from levelhead.track import Track

STRETCH = 1024  # samples between two looks at what has come out of the lanes
HAS_MAG = True  # bound to what the recording has: without a magnetometer its part of the filter is not compiled
OWN_SIGMA = CORRECTS = False  # bound to whether the filter carries its σ, and whether it has a ``correct``
SAID = 0  # bound to the bytes of one sample in a tile
NOTHING = np.empty(0)
condition = start = phase = update_rest = inflate = step_accelerated = step_plain = correction_due = (
    apply_correction
) = update_sigma = unbound
each = result = after = see = unbound
load = load_params = store = store_said = load_seen = store_seen = unbound


@kernel
def lost(angle: float) -> float:
    """In place of a sine or cosine that is hardly ever needed: says so."""
    return nan


@kernel
def lost_pull(expected: Vec3, x: float, y: float, z: float) -> Vec3:
    """In place of the pull of a direction that is far off."""
    return Vec3(nan, nan, nan)


RARE = (
    (quat.cos_half, bound(quat.cos_half, "short", cos=lost)),
    (quat.sinc_half, bound(quat.sinc_half, "short", sin=lost)),
    (vector_error.unit_scale, lost),
    (vector_error.obtuse_error, lost_pull),
)


@kernel
def phase_of_lane(at: int, lane: int, guard: Guard, sample: ConditionedSample) -> None:
    """A phase of the driver, for one lane."""
    store(at, lane, phase(Settings(load_params(at, lane), guard), sample, load(at, lane)))


@kernel
def run_lanes(
    at: int, guard: Guard, sample: ConditionedSample, last: float, t: Any, gyr: Any, acc: Any, mag: Any, more: Any
) -> ConditionedSample:
    """A stretch of samples, as ``driver.run``, through all lanes of the block at an address.

    The phases are those of ``driver.advance``, each over all lanes. What the recording says by itself (``sample``) is
    asked once for all, and so is whether there is anything to do in a phase. ``after`` does something with each
    sample's result. The scene returned continues where this stretch ends.
    """
    field = ZERO
    for i in range(len(t)):
        j = 3 * i
        if HAS_MAG:
            field = Vec3(mag[j], mag[j + 1], mag[j + 2])
        going = sample.started
        sample = condition(
            guard,
            sample,
            Vec3(gyr[j], gyr[j + 1], gyr[j + 2]),
            Vec3(acc[j], acc[j + 1], acc[j + 2]),
            field,
            t[i] - last,
        )
        last = t[i]
        if not going:
            each(start, at, guard, sample)
        else:
            if sample.sensors.sum.spell >= detectors.SPELL:
                each(update_rest, at, guard, sample)
            if sample.unmeasured > 0.0:
                each(inflate, at, guard, sample)
            if sample.sensors.odd or sample.sensors.was_odd:
                each(step_accelerated, at, guard, sample)
            else:
                each(step_plain, at, guard, sample)
            if CORRECTS:
                some = 0
                for lane in range(LANES):
                    some += 1 if correction_due(Settings(load_params(at, lane), guard), load(at, lane)) else 0
                if some > 0:
                    each(apply_correction, at, guard, sample)
            if not OWN_SIGMA and sigma_due(sample):
                each(update_sigma, at, guard, sample)
        after(at, guard, i, more)
    return sample


@kernel
def tell_lane(at: int, lane: int, guard: Guard, tile: int) -> None:
    """Keep the output of one lane."""
    store_said(tile, lane, result(Settings(load_params(at, lane), guard), load(at, lane)))


@kernel
def tell(at: int, guard: Guard, i: int, tile: int) -> None:
    """Keep the output of each lane: the sample's rows of a tile of ``STRETCH`` samples at the address ``tile``."""
    each(tell_lane, at, guard, tile + i * SAID)


@kernel
def judge_lane(at: int, lane: int, guard: Guard, real: Quat) -> None:
    """Let one lane see its orientation beside the truth."""
    said = result(Settings(load_params(at, lane), guard), load(at, lane))
    store_seen(at, lane, see(load_seen(at, lane), said.quat, real))


@kernel
def judge(at: int, guard: Guard, i: int, truth: Any) -> None:
    """Let each lane see its orientation beside the truth (4n, flat) where there is one."""
    j = 4 * i
    if truth[j] == truth[j]:
        each(judge_lane, at, guard, Quat(truth[j], truth[j + 1], truth[j + 2], truth[j + 3]))


class Observer(NamedTuple):
    """What is gathered from each run beside the truth, sample by sample."""

    name: str
    see: Callable[..., Any]  # kernel (seen, quat, truth) -> seen
    start: Any  # an example of ``seen``: a NamedTuple of floats


class Machine(NamedTuple):
    """The compiled lanes of one filter, and where in a block of memory its values lie."""

    run: Any
    params: Rows
    found: Rows  # what the observer has seen, in the block; without one the output, in a tile
    rows: int


def switches(params: Any) -> tuple[tuple[str, bool], ...]:
    """The parameters that are on or off, as (name, value): they choose another algorithm, which is compiled alone."""
    return tuple((name, value) for name, value in params._asdict().items() if isinstance(value, bool))


class Kind(NamedTuple):
    """What lanes are compiled for."""

    flt: Filter
    guarded: bool
    has_mag: bool
    observer: Observer | None  # None: they tell their output
    switches: tuple[tuple[str, bool], ...]  # the same in all lanes: they would otherwise have to do both and pick one


@functools.cache
def machine(kind: Kind, short: bool) -> Machine:
    """Compiled lanes; ``short``: without what is rare."""
    flt, guarded, has_mag, observer, chosen = kind
    driver, settings = bind(flt, guarded), Settings(flt.params(), DEFAULT_GUARD)
    run = driver.begin(settings).run
    whole = lane_slots.rows(run, 0)
    sets = lane_slots.rows(settings.filter, whole.end, dict(chosen))
    memory = {"load": whole.load, "store": whole.store, "load_params": sets.load, "result": driver.result}
    name = "_".join(
        [
            flt.name,
            "guarded" if guarded else "unguarded",
            "mag" if has_mag else "imu",
            "short" if short else "whole",
            whole.layout,
            sets.layout,
        ]
    )
    phases = {key: substitute(phase, RARE) if short else phase for key, phase in driver.phases.items()}
    own = memory | {
        "each": lane_slots.over_lanes(),
        "condition": phases["condition"],
        "correction_due": phases["correction_due"],
        "HAS_MAG": has_mag, "OWN_SIGMA": flt.gains is None, "CORRECTS": flt.schedule is not None,
    }  # fmt: skip
    for key in (
        "start",
        "update_rest",
        "inflate",
        "step_accelerated",
        "step_plain",
        "apply_correction",
        "update_sigma",
    ):
        own[key] = bound(phase_of_lane, f"{name}_{key}", phase=phases[key], **memory)
    if observer is None:
        said = lane_slots.rows(driver.result(settings, run), 0)
        name = "_".join([name, "tell", said.layout])
        lane = bound(tell_lane, name, store_said=said.store, **memory)
        after = bound(tell, name, tell_lane=lane, SAID=said.end * LANES * 8, **own)
        return Machine(compiled(bound(run_lanes, name, after=after, **own)), sets, said, sets.end)
    seen = lane_slots.rows(observer.start, sets.end)
    name = "_".join([name, observer.name, seen.layout])
    lane = bound(judge_lane, name, see=observer.see, load_seen=seen.load, store_seen=seen.store, **memory)
    after = bound(judge, name, judge_lane=lane, **own)
    return Machine(compiled(bound(run_lanes, name, after=after, **own)), sets, seen, seen.end)


class Block:
    """Up to ``LANES`` parameter sets of one filter on their way through a recording."""

    def __init__(self, kind: Kind, guard: Guard, recording: Recording, tries: Sequence[Any]) -> None:
        self._kind, self._made, self._count = kind, machine(kind, True), len(tries)
        self._table, self._at = lane_slots.allocate(self._made.rows)
        mag = NO_MAG if recording.mag is None else recording.mag.reshape(-1)
        self._rows = (recording.t, recording.gyr.reshape(-1), recording.acc.reshape(-1), mag)
        self._guard, self._scene = guard, NO_SAMPLE
        self._tried = self._lost = 0
        lane_slots.put(self._table, self._made.params, np.array([lane_slots.flat(params) for params in tries], float))

    def _run(self, short: bool, start: int, stop: int, more: Any) -> ConditionedSample:
        t, *others = self._rows
        part = [values[3 * start : 3 * stop] for values in others]
        run = machine(self._kind, short).run
        last = float(t[max(start - 1, 0)])
        sample: ConditionedSample = run(self._at, self._guard, self._scene, last, t[start:stop], *part, more)
        return sample

    def advance(self, start: int, stop: int, more: Any, outputs: Array) -> None:
        """Samples ``start`` to ``stop`` in all lanes. ``outputs`` is where ``tell`` writes to.

        Where the short way gets lost more often than not, it is no longer tried.
        """
        if 2 * self._lost <= self._tried + 1:
            before = self._table.copy()
            sample = self._run(True, start, stop, more)
            self._tried += 1
            if not (np.isnan(self._table).any() or np.isnan(outputs).any()):
                self._scene = sample
                return
            self._lost += 1
            self._table[:] = before
        self._scene = self._run(False, start, stop, more)

    def see(self, truth: Array, seen: Array) -> Array:
        """All samples; what the observer has seen (count, numbers) in the end, from ``seen`` on."""
        lane_slots.put(self._table, self._made.found, seen)
        for start in range(0, len(truth), STRETCH):
            stop = min(start + STRETCH, len(truth))
            self.advance(start, stop, truth[start:stop].reshape(-1), NOTHING)
        return lane_slots.get(self._table, self._made.found, self._count)

    def outputs(self) -> list[list[Any]]:
        """All samples; of each lane quat (n, 4), bias (n, 3), sigma (n, 3) and health (n,)."""
        n, floats = len(self._rows[0]), self._made.found.floats
        tile, at = lane_slots.allocate(min(n, STRETCH) * len(floats))
        said = tile.reshape(-1, len(floats), LANES)
        lanes: list[list[Any]] = [
            [*(np.empty((n, width)) for width in (4, 3, 3)), np.empty(n, np.uint32)] for _ in range(self._count)
        ]
        for start in range(0, n, STRETCH):
            stop = min(start + STRETCH, n)
            self.advance(start, stop, at, said[: stop - start, :10])
            for lane, (q, b, s, h) in enumerate(lanes):
                rows = said[: stop - start, :, lane]
                q[start:stop], b[start:stop], s[start:stop] = rows[:, :4], rows[:, 4:7], rows[:, 7:10]
                h[start:stop] = rows[:, 10].copy().view(np.int64)
        return lanes


def blocks(tries: Sequence[Any]) -> list[list[int]]:
    """The indices of parameter sets that go through a block together: at most ``LANES``, of equal switches."""
    groups: dict[Any, list[int]] = {}
    for i, params in enumerate(tries):
        groups.setdefault(switches(params), []).append(i)
    return [group[k : k + LANES] for group in groups.values() for k in range(0, len(group), LANES)]


def tracks(
    recording: Recording, flt: Filter, tries: Sequence[Any], guard: Guard | None, workers: int | None = None
) -> list[Track]:
    """The whole track of each parameter set, in their order."""
    bias = estimates_bias(flt, guard is not None)

    def work(block: list[int]) -> list[Track]:
        sets = [tries[i] for i in block]
        kind = Kind(flt, is_guarded(flt) and guard is not None, recording.mag is not None, None, switches(sets[0]))
        return [
            Track(recording.t, q, b if bias else None, s, h, params)
            for params, (q, b, s, h) in zip(
                sets, Block(kind, guard or DEFAULT_GUARD, recording, sets).outputs(), strict=True
            )
        ]

    cut = blocks(tries)
    found = dict(zip(chain.from_iterable(cut), chain.from_iterable(in_order(work, cut, workers)), strict=True))
    return [found[i] for i in range(len(tries))]


def observe(
    recording: Recording,
    flt: Filter,
    tries: Sequence[Any],
    observer: Observer,
    truth: Array,
    seen: Array,
    *,
    guard: Guard | None = DEFAULT_GUARD,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Array:
    """What an observer has seen of the run of each parameter set, without keeping tracks.

    Args:
        recording: what the sensors said.
        flt: the filter.
        tries: k parameter sets of it.
        observer: what to gather; compiled together with the filter, once.
        truth: (n, 4) orientation to hold beside; samples that are NaN are not looked at.
        seen: (k, numbers of ``observer.start``) where each run begins.
        guard: as for ``fuse``.
        workers: threads; None: one for each core.
        progress: called with the fraction done, 0 to 1.

    Returns:
        (k, numbers of ``observer.start``) where each run ends.
    """

    def work(block: list[int]) -> Array:
        sets = [tries[i] for i in block]
        guarded = is_guarded(flt) and guard is not None
        kind = Kind(flt, guarded, recording.mag is not None, observer, switches(sets[0]))
        return Block(kind, guard or DEFAULT_GUARD, recording, sets).see(truth, seen[block])

    cut, after, done = blocks(tries), np.empty_like(seen), 0
    for block, part in zip(cut, in_order(work, cut, workers), strict=True):
        after[block] = part
        done += len(block)
        if progress is not None:
            progress(done / len(tries))
    return after
