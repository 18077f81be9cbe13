"""Work on all cores: one process each, because most contenders hold Python's lock."""

import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import TypeVar

from levelhead.errors import LevelheadError

T = TypeVar("T")
R = TypeVar("R")


def run_parallel(work: Callable[[T], R], tasks: Sequence[T], jobs: int) -> Iterator[tuple[T, R]]:
    """Tasks and results as they come; with one job in this process, which needs nothing to be picklable.

    Raises:
        LevelheadError: a process died, as a crash in a contender's machine code makes it.
    """
    if jobs == 1:
        for task in tasks:
            yield task, work(task)
        return
    # Fresh interpreters: a fork would take the compiler's threads along in an unknown state.
    pool = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_leave_ctrl_c_to_the_parent)
    try:
        waiting = {pool.submit(work, task): task for task in tasks}
        for done in as_completed(waiting):
            yield waiting[done], done.result()
    except BrokenProcessPool:
        raise LevelheadError(
            "a process that ran a method died; --jobs 1 shows which, and --filter leaves it out"
        ) from None
    finally:
        pool.shutdown(cancel_futures=True)


def _leave_ctrl_c_to_the_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
