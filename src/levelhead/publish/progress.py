"""A progress bar for people: on stderr, only when that is a terminal, and only for what takes a while."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from levelhead.compiler.compile import CompileEvents
from levelhead.open_types import Handle

PATIENCE = 0.5  # s before a bar appears: what is done sooner needs none
COMPILING = "compiling for this machine, once"


@contextmanager
def progress(title: str) -> Iterator[Callable[[float], None]]:
    """Gives a function that takes the fraction done, 0 to 1, and draws a bar on stderr once half a second has passed.

    In a pipe, a log file or a test nothing is written, and rich is not imported. The bar is gone when the work is done.
    While a filter is compiled, which happens once and is kept, it says so.

        with progress("fusing") as report:
            fuse(recording, params, progress=report)
    """
    if not sys.stderr.isatty():
        yield lambda fraction: None
        return
    began = monotonic()
    shown: list[tuple[Handle, Handle]] = []

    def report(fraction: float) -> None:
        if not shown and fraction < 1.0 and monotonic() - began >= PATIENCE:
            shown.append(_start(title))
        for bar, task in shown:
            bar.update(task, description=title, total=1.0, completed=min(max(fraction, 0.0), 1.0))

    def compiling() -> None:
        if not shown:
            shown.append(_start(COMPILING))
        for bar, task in shown:
            bar.update(task, description=COMPILING, total=None)

    CompileEvents.callbacks.append(compiling)
    try:
        yield report
    finally:
        CompileEvents.callbacks.remove(compiling)
        for bar, _ in shown:
            bar.stop()


def _start(title: str) -> tuple[Handle, Handle]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn()
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    bar.start()
    return bar, bar.add_task(title, total=1.0)
