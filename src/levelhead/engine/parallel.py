"""Many runs on all cores: many recordings through one filter, or many parameter sets over one recording."""

import functools
from collections.abc import Callable, Iterable, Iterator, Sequence

from levelhead import filters
from levelhead.compiler.tree import has_memory
from levelhead.engine import lanes
from levelhead.engine.batch import DEFAULT_GUARD, fuse
from levelhead.engine.binding import check_engine, choose_engine, numba_installed
from levelhead.engine.native import has_imu
from levelhead.engine.threads import map_in_order
from levelhead.errors import LevelheadError
from levelhead.filters.contract import Filter
from levelhead.filters.parameters import FilterChoice, Params
from levelhead.guard import Guard
from levelhead.kernels.vec3 import ZERO
from levelhead.recording import Recording
from levelhead.track import Track

LEAST_LANES = 8  # parameter sets of one filter from which a block of lanes takes less time than its single runs
SAMPLES_FOR_LANES = 50_000_000  # native single runs of these take seconds, as compiling lanes does, once per machine


def fuse_recordings(
    recordings: Iterable[Recording],
    params: FilterChoice | None = None,
    *,
    guard: Guard | None = DEFAULT_GUARD,
    engine: str = "auto",
    workers: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Iterator[Track]:
    """The track of each recording, in their order, on all cores.

    A generator: recordings are taken as they are needed and a few at a time, so ``recordings`` may itself read files
    one after the other (``map(lh.read, paths)``) and need not fit into memory.

    Args:
        recordings: the sensors' readings, any number of recordings.
        params: the filter, as for ``fuse``.
        guard: in front of it, as for ``fuse``.
        engine: as for ``fuse``; "auto" decides for each recording. Plain Python runs one recording at a time.
        workers: threads; None: one for each core.
        progress: called with the number of recordings done.

    Raises:
        LevelheadError: no such filter or engine; or a recording that cannot be fused, named by its source or number.
    """
    params = filters.default() if params is None else filters.resolve(params)
    check_engine(engine)  # a wrong name is refused before the first recording is read
    return _fuse_recordings(recordings, params, guard, engine, workers, progress)


def _fuse_recordings(
    recordings: Iterable[Recording],
    params: Params,
    guard: Guard | None,
    engine: str,
    workers: int | None,
    progress: Callable[[int], None] | None,
) -> Iterator[Track]:
    def work(numbered: tuple[int, Recording]) -> Track:
        number, recording = numbered
        try:
            return fuse(recording, params, guard=guard, engine=engine)
        except LevelheadError as error:
            raise LevelheadError(f"{_name(number, recording)}: {error}") from error

    for done, track in enumerate(map_in_order(work, enumerate(recordings), workers), 1):
        if progress is not None:
            progress(done)
        yield track


def _name(number: int, recording: Recording) -> str:
    source = recording.meta.get("source") if isinstance(recording, Recording) else None
    return f"recording {number}" + (f" ({source})" if source else "")


def lanes_are_faster(flt: Filter, sets: int) -> bool:
    """Whether so many parameter sets of a filter go side by side.

    A filter with memory of a fixed size has loops of its own that are SIMD already: its sets run one by one.
    """
    return sets >= LEAST_LANES and not has_memory(flt.init(flt.params(), ZERO, ZERO, ZERO))


def engine_for_sets(engine: str, samples: int, flt: Filter, guarded: bool) -> str:
    """The engine for many sets of one filter: "compiled" also where there is a native one, if lanes are worth it."""
    native = has_imu(flt, guarded)
    lanes_worth = native and engine == "auto" and numba_installed() and samples >= SAMPLES_FOR_LANES
    return "compiled" if lanes_worth else choose_engine(engine, samples, native)


def fuse_parameter_sets(
    recording: Recording,
    parameter_sets: Sequence[Params],
    *,
    guard: Guard | None = DEFAULT_GUARD,
    engine: str = "auto",
    workers: int | None = None,
) -> list[Track]:
    """One recording through many parameter sets, each track the same to the bit as that of ``fuse``.

    Compiled, sets of the same filter run side by side (``engine.lanes``), and blocks of them on all cores.

    Args:
        recording: the sensors' readings.
        parameter_sets: parameter sets, each as for ``fuse``; filters may be mixed.
        guard: in front of all of them, as for ``fuse``.
        engine: as for ``fuse``.
        workers: threads; None: one for each core.

    Raises:
        LevelheadError: no such filter or engine.
    """
    resolved = [filters.resolve(params) for params in parameter_sets]
    check_engine(engine)
    samples = len(recording) * len(resolved)
    found: dict[int, Track] = {}
    for flt in {filters.of(params): None for params in resolved}:
        mine = [i for i, params in enumerate(resolved) if filters.of(params) is flt]
        sets = [resolved[i] for i in mine]
        chosen = engine_for_sets(engine, samples, flt, guard is not None)
        made: Iterable[Track]
        if chosen == "compiled" and lanes_are_faster(flt, len(sets)):
            made = lanes.tracks(recording, flt, sets, guard, workers)
        else:
            one = functools.partial(fuse, recording, guard=guard, engine=chosen)
            made = map_in_order(one, sets, workers)
        found.update(zip(mine, made, strict=True))
    return [found[i] for i in range(len(resolved))]
