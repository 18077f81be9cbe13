"""A verb over a corpus: plan, hand out, gather, write."""

import os
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from levelhead.axis_map import AxisMap
from levelhead.corpora.cluster import Pool, WorkerDied, open_pool
from levelhead.corpora.job import FUSE, Batch, Job, check_same_sensor, choose_methods
from levelhead.corpora.places import Source, is_gone, list_sources
from levelhead.corpora.plan import Plan, make_plan
from levelhead.corpora.results import Results
from levelhead.corpora.sensors import assign_sensors
from levelhead.corpora.work import failed_row, run_batch
from levelhead.earth_frame import find_frame
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.binding import check_engine
from levelhead.engine.threads import cores
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import FilterChoice
from levelhead.guard import Guard
from levelhead.open_types import JsonObject, ReadOnlyJson, Untyped

FLUSH = 0.5  # s between two parts


@dataclass
class Progress:
    """How far a run is.

    Attributes:
        recordings: how many there are to do.
        done: how many of them are done.
        skipped: how many an earlier run has done.
        failed: how many of the done ones gave no result.
        fraction: share of the bytes that are done.
        seconds: since the first was handed over.
        dashboard: address of Dask's own; "": none.
    """

    recordings: int = 0
    done: int = 0
    skipped: int = 0
    failed: int = 0
    fraction: float = 0.0
    seconds: float = 0.0
    dashboard: str = ""

    @property
    def rate(self) -> float:
        """Recordings a second."""
        return self.done / self.seconds if self.seconds > 0.0 else 0.0


Report = Callable[[Progress], None]


def corpus(
    places: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    do: str = FUSE,
    *methods: FilterChoice,
    out: str | os.PathLike[str] | None = None,
    guard: Guard | None = DEFAULT_GUARD,
    magnetometer: bool = True,
    tracks: bool = False,
    sensor: str = "",
    order: str = "",
    engine: str = "auto",
    axes: str = "",
    frame: str = "ENU",
    workers: int | None = None,
    scheduler: str | None = None,
    memory: str | None = None,
    hints: ReadOnlyJson | None = None,
    storage: ReadOnlyJson | None = None,
    progress: Report | None = None,
) -> Untyped:
    """One verb over all recordings in some places: a row for each recording and method.

    In a script, call it below ``if __name__ == "__main__":``, because the processes of ``workers`` import the script.

    Args:
        places: folders with all that is below them, files, patterns such as ``data/**/*.parquet``, or URLs of these
            (``s3://bucket/prefix``).
        do: "fuse", "smooth", "doctor", "noise" or "bench".
        methods: the filters, as for ``fuse``; for "bench" also names such as "vqf.VQF". None: the default.
        out: folder of the results. A run that was ended goes on where it was; None: nothing is kept.
        guard: in front of levelhead's filters, as for ``fuse``.
        magnetometer: False: magnetometers are left out.
        tracks: write each track to ``out``/tracks, as Parquet. Workers on other machines need the same folder.
        sensor: recordings of the same sensor start with the calibration of the one before: a regular expression whose
            group, in the name of a recording, is the sensor; or ``column:NAME`` of its file.
        order: the key of the order of a sensor's recordings in time, likewise; by default their names.
        engine: as for ``fuse_recordings``.
        axes: how the sensors sit on their bodies, as for ``Track.mounted``, for the tracks that are written.
        frame: earth frame of these tracks, "ENU", "NED" or "NWU".
        workers: processes on this machine; None: one for each core; 0: this process, without Dask.
        scheduler: address of a Dask scheduler, such as tcp://10.0.0.1:8786, to work there instead.
        memory: of each process on this machine, such as "2GiB"; beyond it the process is started anew.
        hints: for the reader, as for ``levelhead.read``.
        storage: options of fsspec's file system, such as ``{"anon": True}``; not kept.
        progress: called after every batch.

    Returns:
        A ``pyarrow.Table``, sorted by recording and method; ``.to_pandas()`` makes a data frame. Column "error" has
        the sentence why a recording gave no result.

    Raises:
        LevelheadError: no recordings, two with one name, a folder with results of something else, a scheduler that
            does not answer, workers with another version, a full disk.

    >>> corpus("recordings", "fuse", "EKF", "ESKF", out="results")  # doctest: +SKIP
    """
    job = Job(
        do, choose_methods(do, methods), guard, dict(hints or {}), magnetometer, tracks, sensor, order, engine=engine,
        axes="" if not axes else str(AxisMap.parse(axes)), frame=find_frame(frame).name,
    )  # fmt: skip
    check_engine(engine)
    if (job.axes or job.frame != "ENU") and not tracks:
        raise LevelheadError("axes and frame are those of written tracks; ask for these too: --tracks, or tracks=True")
    check_same_sensor(job)
    if tracks and out is None:
        raise LevelheadError("tracks need a folder; name one with out=")
    named = [places] if isinstance(places, str | os.PathLike) else list(places)
    sources = list_sources(named, storage)
    with ExitStack() as stack:
        folder = Path(out) if out is not None else Path(stack.enter_context(TemporaryDirectory(prefix="levelhead-")))
        results = Results(folder, job)
        stack.enter_context(results.lock())
        return run_job(job, sources, results, storage or {}, workers, scheduler, memory, progress)


def run_job(
    job: Job,
    sources: Sequence[Source],
    results: Results,
    storage: ReadOnlyJson,
    workers: int | None,
    scheduler: str | None,
    memory: str | None,
    progress: Report | None,
) -> Untyped:
    """The sources that are not done yet, and the table of all of them."""
    ordered, sensors = assign_sensors(job, sources, storage)
    at_work = cores() if workers is None else workers
    plan = make_plan(ordered, results.done(), sensors, at_work)
    state = Progress(plan.todo, skipped=plan.recordings - plan.todo)
    if plan.todo:
        with open_pool(workers, scheduler, memory) as pool:
            state.dashboard = pool.dashboard
            _drive(job, plan, pool, results, storage, state, progress)
    return results.finish([source.name for source in sources], lambda url: is_gone(url, storage))


def _drive(
    job: Job, plan: Plan, pool: Pool, results: Results, storage: ReadOnlyJson, state: Progress, report: Report | None
) -> None:
    """Keeps the pool busy until the plan is done; rows are written as they come, a part every ``FLUSH`` seconds."""
    running: dict[object, Batch] = {}
    began = flushed = time.perf_counter()
    size = 0
    try:
        if report is not None:
            report(state)
        while True:
            while len(running) < pool.room and (batch := plan.take(len(running))) is not None:
                running[pool.submit(run_batch, job, batch, storage, results.tracks)] = batch
            if not running:
                return
            ticket, outcome = pool.wait()
            batch = running.pop(ticket)
            rows = _rows_of(job, plan, batch, outcome)
            if rows is None:
                continue
            results.add(rows)
            plan.finish(batch, rows)
            size += sum(source.size for source in batch.sources)
            now = time.perf_counter()
            state.done += len(batch.sources)
            state.failed += len({row["recording"] for row in rows if row.get("error")})
            state.fraction, state.seconds = size / max(plan.todo_bytes, 1), now - began
            if now - flushed > FLUSH:
                results.flush()
                flushed = now
            if report is not None:
                report(state)
    finally:
        results.flush()


def _rows_of(job: Job, plan: Plan, batch: Batch, outcome: list[JsonObject] | WorkerDied) -> list[JsonObject] | None:
    """The rows of a batch; None: its worker died, and its recordings will be run one by one."""
    if not isinstance(outcome, WorkerDied):
        return outcome
    if plan.isolate(batch):
        return None
    source = batch.sources[0]
    sentence = f"{source.url} ended every worker that took it; it may need more memory than a worker has"
    return [failed_row(job, source, batch.sensor, batch.prior, sentence, transient=True)]
