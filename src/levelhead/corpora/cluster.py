"""Workers: this process, processes on this machine, or those of a Dask cluster."""

import logging
import time
import warnings
from asyncio import CancelledError as AbandonedError
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from typing import Protocol

from levelhead.engine.threads import cores
from levelhead.errors import LevelheadError, require
from levelhead.open_types import JsonObject, Untyped
from levelhead.version import VERSION

Work = Callable[..., list[JsonObject]]
PATIENCE = 10.0  # s that a scheduler has to answer, and workers to be there
SPARING = {  # regular tasks of Dask that cost some percent of a core beside the work
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "2s",
    "distributed.admin.system-monitor.gil.enabled": False,  # a thousand times a second, where gilknocker is installed
    "distributed.worker.memory.monitor-interval": "500ms",
    # Dask has workers give memory back after each array; getting it anew takes as long as the arithmetic on it.
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 1 << 28,
    "distributed.nanny.pre-spawn-environ.MALLOC_MMAP_THRESHOLD_": 1 << 25,
}
FRESH = 1.0  # s for which the number of workers is taken to hold
NOISY = ("distributed", "bokeh", "tornado")
GONE = "the scheduler is gone; the finished rows are kept, and the same command goes on from there"
AHEAD = 2  # tasks for each thread of a worker that are handed over: none waits, and none are lost by the thousand


class WorkerDied(Exception):
    """A task's workers died under it, time and again."""


class Pool(Protocol):
    """Takes tasks and gives their results as they come."""

    dashboard: str  # its address; "": none

    @property
    def room(self) -> int:
        """How many tasks may be handed over at a time."""
        ...

    def submit(self, work: Work, *arguments: object) -> object:
        """Hands a task over and returns its ticket."""
        ...

    def wait(self) -> tuple[object, list[JsonObject] | WorkerDied]:
        """The ticket and the result of a task that is done.

        Raises:
            LevelheadError: the task's own, or the scheduler is gone.
        """
        ...


@contextmanager
def open_pool(workers: int | None, scheduler: str | None, memory: str | None) -> Iterator[Pool]:
    """The pool for a run.

    Args:
        workers: processes on this machine; None: one for each core; 0: this process, without Dask.
        scheduler: address of a Dask scheduler, such as tcp://10.0.0.1:8786, in place of these.
        memory: of a process on this machine, such as 2GiB, beyond which it is started anew; None: an equal share.

    Raises:
        LevelheadError: Dask is not installed, no scheduler answers, no workers, or workers with another version.
    """
    if scheduler is None and workers == 0:
        yield Inline()
        return
    require("distributed", "a corpus on several processes", "corpus")
    with _quiet():
        if scheduler is None:
            with _local(cores() if workers is None else workers, memory) as pool:
                yield pool
        else:
            with _remote(scheduler) as pool:
                yield pool


class Inline:
    """This process, one task at a time."""

    dashboard = ""
    room = 1

    def __init__(self) -> None:
        self._task: tuple[object, Work, tuple[object, ...]] | None = None

    def submit(self, work: Work, *arguments: object) -> object:
        """See ``Pool``."""
        ticket = object()
        self._task = ticket, work, arguments
        return ticket

    def wait(self) -> tuple[object, list[JsonObject] | WorkerDied]:
        """See ``Pool``."""
        assert self._task is not None
        ticket, work, arguments = self._task
        return ticket, work(*arguments)


class DaskPool:
    """A Dask cluster."""

    def __init__(self, client: Untyped) -> None:
        from distributed import as_completed

        self._client = client
        self._running = as_completed(loop=client.loop)
        self._futures: dict[object, Untyped] = {}
        self._room, self._counted = 0, -FRESH
        self.dashboard = str(client.dashboard_link or "")

    @property
    def room(self) -> int:
        """See ``Pool``; workers may come and go."""
        now = time.monotonic()
        if now - self._counted > FRESH:
            with self.connection():
                workers = self._client.scheduler_info(n_workers=-1)["workers"].values()
            self._room = AHEAD * max(1, sum(worker["nthreads"] for worker in workers))
            self._counted = now
        return self._room

    def submit(self, work: Work, *arguments: object) -> object:
        """See ``Pool``."""
        with self.connection():
            future = self._client.submit(work, *arguments, pure=False)
            self._running.add(future)
        self._futures[future.key] = future
        return future.key

    def wait(self) -> tuple[object, list[JsonObject] | WorkerDied]:
        """See ``Pool``."""
        from distributed import KilledWorker

        with self.connection():
            future = next(self._running)
            while future.status in ("lost", "pending"):  # its worker died with the result, which is computed anew
                self._running.add(future)
                future = next(self._running)
        del self._futures[future.key]
        if future.status == "finished":
            with self.connection():
                rows: list[JsonObject] = future.result()
                future.release()
            return future.key, rows
        if future.status != "error":
            raise LevelheadError(GONE)
        error = future.exception()
        if isinstance(error, KilledWorker):
            return future.key, WorkerDied(str(error))
        if isinstance(error, LevelheadError):
            raise error
        raise LevelheadError(f"a worker failed: {type(error).__name__}: {error}")

    @contextmanager
    def connection(self) -> Iterator[None]:
        """Says that the scheduler is gone, whichever of Dask's calls is the first to notice, and by which error.

        A task's own error is none of Dask's: it comes as the state of its future.
        """
        try:
            yield
        except LevelheadError:
            raise
        except (OSError, CancelledError, AbandonedError):  # among the first: a comm that is closed, a time that is over
            raise LevelheadError(GONE) from None
        except Exception:
            if self._client.status == "running":
                raise
            raise LevelheadError(GONE) from None


@contextmanager
def _quiet() -> Iterator[None]:
    """Dask reports lost connections and busy ports on standard error; the run has its own reports."""
    import distributed  # noqa: F401  (which gives loggers of its parts levels of their own)

    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in NOISY]
    loggers = [logging.getLogger(name) for name in {*names, *NOISY}]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            yield
        finally:
            for logger, level in zip(loggers, levels, strict=True):
                logger.setLevel(level)


@contextmanager
def _local(workers: int, memory: str | None) -> Iterator[DaskPool]:
    import dask
    from distributed import Client

    if workers < 0:
        raise LevelheadError(f"{workers} workers can do nothing; expected 1 or more, or 0 for this process")
    with (
        dask.config.set(SPARING),
        _closing(_local_cluster(workers, memory)) as cluster,
        _closing(Client(cluster, set_as_default=False)) as client,
    ):
        yield DaskPool(client)


@contextmanager
def _closing(handle: Untyped) -> Iterator[Untyped]:
    """Closes a client or a cluster; the results do not depend on its arrival."""
    try:
        yield handle
    finally:
        with suppress(Exception):
            handle.close(timeout=PATIENCE)


def _local_cluster(workers: int, memory: str | None) -> Untyped:
    from distributed import LocalCluster

    try:
        return LocalCluster(
            n_workers=workers,
            threads_per_worker=1,  # reading holds Python's lock
            processes=True,
            memory_limit=memory or "auto",
            silence_logs=logging.CRITICAL,
            dashboard_address="localhost:8787",  # another port where that is taken
        )
    except ValueError as error:
        raise LevelheadError(f"no workers with {memory} of memory each: {error}") from None


@contextmanager
def _remote(address: str) -> Iterator[DaskPool]:
    from distributed import Client
    from distributed.comm.addressing import get_address_host_port

    try:
        get_address_host_port(address)
    except ValueError:  # which a client would find out in its thread, and wait half a minute for that to end
        raise LevelheadError(
            f"'{address}' is not an address of a Dask scheduler; expected one such as tcp://10.0.0.1:8786"
        ) from None
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise LevelheadError(
            f"no Dask scheduler answers at {address} within {PATIENCE:g} s ({type(error).__name__}); start one with "
            "`dask scheduler`, and workers with `dask worker`"
        ) from None
    with _closing(client):
        pool = DaskPool(client)
        with pool.connection():
            try:
                client.wait_for_workers(1, timeout=PATIENCE)
            except TimeoutError:
                raise LevelheadError(
                    f"the scheduler at {address} has no worker; start some: dask worker {address}"
                ) from None
            _check_versions(client)
        yield pool


def _check_versions(client: Untyped) -> None:
    """Refuses workers with another levelhead, by their addresses."""
    said = client.run(version_there(), on_error="return")
    wrong = {address: found for address, found in said.items() if found != VERSION}
    if wrong:
        words = ", ".join(
            f"{address} has {f'levelhead {found}' if isinstance(found, str) and found else 'none'}"
            for address, found in sorted(wrong.items())[:5]
        )
        more = f" and {len(wrong) - 5} more" if len(wrong) > 5 else ""
        raise LevelheadError(f"workers need levelhead {VERSION}, but {words}{more}; install the same on all of them")


def version_there() -> Callable[[], str]:
    """A function that gives the version of levelhead where it is called, "" without one.

    It is nested so that it travels as code: a worker without levelhead could not look it up by name.
    """

    def version() -> str:
        import importlib

        try:
            return str(importlib.import_module("levelhead.version").VERSION)
        except ImportError:
            return ""

    return version
