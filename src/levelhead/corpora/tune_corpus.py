"""A filter's parameters for many recordings: the search of ``tune`` here, the runs of the filter with the workers.

A recording's reference (its truth, or the smoother's track) is made by a worker and kept there, as far as ``KEPT``
samples go; a worker that has it not, or no longer, makes it again. So this process holds one recording, and every
worker some; the result depends on neither.
"""

import os
import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from levelhead.corpora.cluster import Pool, WorkerDied, open_pool
from levelhead.corpora.job import Job
from levelhead.corpora.places import Source, list_sources, local_copy
from levelhead.corpora.plan import pack
from levelhead.corpora.work import read_recording
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.binding import check_engine
from levelhead.engine.threads import cores
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import FilterChoice, Params
from levelhead.guard import Guard
from levelhead.open_types import JsonObject, ReadOnlyJson
from levelhead.recording import Array
from levelhead.tune import Tuning
from levelhead.tune.left_out import stretch_scores
from levelhead.tune.reference_orientation import Kind, Reference, references
from levelhead.tune.score_references import score_references
from levelhead.tune.sweep import Metric
from levelhead.tune.tune_filter import check_wishes, counts_heading, search_references

KEPT = 4_000_000  # samples with their references, 0.5 GB, that a worker keeps
MIN_RECORDINGS = 2  # recordings, of which one can be left out
_kept: dict[object, Reference] = {}
_lock = threading.Lock()


class ReferenceWish(NamedTuple):
    """The data from which a worker makes a reference."""

    job: Job
    storage: ReadOnlyJson
    kind: Kind | None
    heading: bool
    engine: str


@dataclass(frozen=True)
class CorpusTuning:
    """The tuning, and the recordings that could not serve with the reason, by name."""

    tuning: Tuning
    left_out: dict[str, str]


def tune_corpus(
    places: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    params: FilterChoice,
    names: Sequence[str] = (),
    *,
    metric: Metric | None = None,
    goal: Kind | None = None,
    guard: Guard | None = DEFAULT_GUARD,
    magnetometer: bool = True,
    engine: str = "auto",
    runs: int | None = None,
    seed: int = 0,
    workers: int | None = None,
    scheduler: str | None = None,
    memory: str | None = None,
    hints: ReadOnlyJson | None = None,
    storage: ReadOnlyJson | None = None,
    progress: Callable[[float], None] | None = None,
) -> CorpusTuning:
    """``tune_filter`` over all recordings in some places, cross-validated over recordings.

    Args:
        places: as for ``corpus``.
        params: the filter and the rest, as for ``tune_filter``.
        names: parameters to search.
        metric: the error to minimise.
        goal: the reference of the filter.
        guard: in front of it.
        magnetometer: False: magnetometers are left out.
        engine: of the many runs of the search, as for ``tune_filter``.
        runs: of the filter for one search.
        seed: of the search.
        workers: processes on this machine.
        scheduler: address of a Dask scheduler.
        memory: of each process.
        hints: for the reader.
        storage: options of fsspec.
        progress: called with the fraction done, 0 to 1.

    Raises:
        LevelheadError: as ``corpus`` and ``tune_filter``; fewer than two recordings that can serve.
    """
    check_engine(engine)
    space = check_wishes(params, names, metric, goal, runs)
    job = Job("tune", guard=guard, hints=dict(hints or {}), magnetometer=magnetometer)
    sources = list_sources([places] if isinstance(places, str | os.PathLike) else list(places), storage)
    with open_pool(workers, scheduler, memory) as pool:
        wish = ReferenceWish(job, storage or {}, goal, metric != "tilt", engine)
        batches = pack(sources, 4 * (workers or cores()))
        rows = _facts(pool, wish, batches)
        chosen: Metric = metric or ("total" if all(_shows_heading(space.params, row) for row in rows) else "tilt")
        if wish.heading and chosen == "tilt":
            wish = wish._replace(heading=False)
            rows = _facts(pool, wish, batches)
        held_sources, held = _serving(wish, sources, rows)
        found = search_references(
            space, chosen, held, [one.recording for one in held], guard=guard, runs=runs, seed=seed,
            progress=progress, score=_Score(pool, wish, held_sources, workers or cores()),
        )  # fmt: skip
    return CorpusTuning(found, {row["name"]: row["error"] for row in rows if "error" in row})


def _shows_heading(params: Params, row: ReadOnlyJson) -> bool:
    """Whether heading counts on a recording; one that cannot serve changes nothing."""
    return "error" in row or counts_heading(params, row["kind"], row["magnetometer"])


def _serving(
    wish: ReferenceWish, sources: Sequence[Source], rows: Sequence[ReadOnlyJson]
) -> tuple[list[Source], list[Reference]]:
    """Recordings that can serve, and a reference of each; the first has its whole recording, the others its start.

    Raises:
        LevelheadError: there are fewer than two.
    """
    good = {row["name"]: row for row in rows if "error" not in row}
    serving = [source for source in sources if source.name in good]
    if len(serving) < MIN_RECORDINGS:
        errors = (row["error"] for row in rows if "error" in row)
        reason = next(errors, "there is only one, for which there is levelhead tune")
        raise LevelheadError(f"{len(serving)} of {len(sources)} recordings can be tuned on; {reason}")
    first = _reference(wish, serving[0])
    held = [replace(first, remarks=good[first.name]["remarks"])]
    for source in serving[1:]:
        row = good[source.name]
        held.append(Reference(first.recording[:2], row["kind"], source.name, row["seconds"], row["remarks"]))
    return serving, held


class _Score:
    """Errors of parameter sets over some of the recordings, by all workers; searches ask it in turn."""

    def __init__(self, pool: Pool, wish: ReferenceWish, sources: Sequence[Source], workers: int) -> None:
        self._pool, self._wish, self._workers = pool, wish, workers
        self._sources = {source.name: source for source in sources}
        self._one_at_a_time = threading.Lock()

    def __call__(self, held: Sequence[Reference], sets: Sequence[Params], count: int) -> Array:
        batches = pack([self._sources[one.name] for one in held], 2 * self._workers)
        with self._one_at_a_time:
            rows = _gather(self._pool, [(score_batch, self._wish, batch, list(sets), count) for batch in batches])
        found = {row["name"]: row["scores"] for row in rows}
        return np.array([found[one.name] for one in held])


def _facts(pool: Pool, wish: ReferenceWish, batches: Sequence[tuple[Source, ...]]) -> list[JsonObject]:
    return _gather(pool, [(reference_facts, wish, batch) for batch in batches])


def _gather(
    pool: Pool, tasks: Sequence[tuple[Callable[..., list[JsonObject]], *tuple[object, ...]]]
) -> list[JsonObject]:
    """The rows of all tasks, in whatever order they end."""

    waiting, running, rows = list(reversed(tasks)), 0, list[JsonObject]()
    while waiting or running:
        while waiting and running < pool.room:
            work, *arguments = waiting.pop()
            pool.submit(work, *arguments)
            running += 1
        _, outcome = pool.wait()
        running -= 1
        if isinstance(outcome, WorkerDied):
            raise LevelheadError(
                "workers ended one after the other under the same recordings; give them more memory (--memory)"
            )
        rows += outcome
    return rows


def _reference(wish: ReferenceWish, source: Source) -> Reference:
    """The reference of a recording: kept, or made and kept while others that were used before it make room."""
    key = (wish.job.digest, wish.kind, wish.heading, source.url, source.stamp)
    with _lock:
        if key in _kept:
            return _kept[key]
    with local_copy(source, wish.storage) as path:
        recording = read_recording(path, wish.job)
    (made,) = references([recording], wish.kind, wish.heading, wish.job.guard)
    made = replace(made, name=source.name, smoothed=None)
    with _lock:
        _kept[key] = made
        while len(_kept) > 1 and sum(len(one.recording) for one in _kept.values()) > KEPT:
            del _kept[next(iter(_kept))]
    return made


def reference_facts(wish: ReferenceWish, sources: Sequence[Source]) -> list[JsonObject]:
    """A row for each recording: its reference, or the reason for its absence; a worker's task."""
    rows: list[JsonObject] = []
    for source in sources:
        try:
            one = _reference(wish, source)
        except (LevelheadError, OSError, MemoryError) as error:
            rows.append({"name": source.name, "error": " ".join(str(error).split()) or type(error).__name__})
            continue
        facts = {"kind": one.kind, "seconds": one.seconds, "magnetometer": one.recording.mag is not None}
        remarks = tuple(f"{source.name}: {remark.partition(': ')[2]}" for remark in one.remarks)
        rows.append({"name": source.name, "remarks": remarks} | facts)
    return rows


def score_batch(wish: ReferenceWish, sources: Sequence[Source], sets: Sequence[Params], count: int) -> list[JsonObject]:
    """The errors of parameter sets over ``count`` stretches of some recordings; a worker's task."""
    found = []
    for source in sources:
        one = _reference(wish, source)
        if count == 1:
            scores = score_references([one], sets, wish.job.guard, wish.engine)
        else:
            scores = stretch_scores(one, sets, count, wish.job.guard, wish.engine)
        found.append({"name": source.name, "scores": scores.tolist()})
    return found
