"""A progress bar for people: on stderr, only when that is a terminal, and only for long work."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rich.progress import Progress

PATIENCE = 0.5  # s before a bar appears: shorter work needs none


class ProgressReport(Protocol):
    """Takes the fraction done, 0 to 1, and words to stand after the title."""

    def __call__(self, fraction: float, words: str = "") -> None:
        """So much is done."""


@contextmanager
def progress(title: str) -> Iterator[ProgressReport]:
    """Gives a function that takes the fraction done, 0 to 1; after half a second there is a bar on stderr.

    Until a fraction is known the bar moves to and fro. In a pipe, a log file or a test nothing is written, and rich is
    not imported. The bar is gone when the work is done.

        with progress("fusing") as report:
            fuse(recording, params, progress=report)
    """
    if not sys.stderr.isatty():
        yield lambda fraction, words="": None
        return
    bar = _LateBar(title)
    timer = threading.Timer(PATIENCE, bar.start)
    timer.daemon = True
    timer.start()
    try:
        yield bar.report
    finally:
        timer.cancel()
        bar.stop()


class _LateBar:
    """A bar that another thread begins to draw, unless the work is done by then."""

    def __init__(self, title: str) -> None:
        self._title, self._lock = title, threading.Lock()
        self._bar: Progress | None = None
        self._fraction: float | None = None
        self._words = ""
        self._done = False

    def start(self) -> None:
        """Draws it from now on."""
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

        with self._lock:
            if self._done:
                return
            columns = TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn()
            self._bar = Progress(*columns, console=Console(stderr=True), transient=True)
            self._bar.add_task(self._title, total=None)
            self._bar.start()
            self._show()

    def report(self, fraction: float, words: str = "") -> None:
        """So much is done."""
        with self._lock:
            self._fraction, self._words = min(max(fraction, 0.0), 1.0), words
            self._show()

    def stop(self) -> None:
        """The work is done."""
        with self._lock:
            self._done = True
            if self._bar is not None:
                self._bar.stop()

    def _show(self) -> None:
        if self._bar is not None and self._fraction is not None:
            title = f"{self._title}: {self._words}" if self._words else self._title
            self._bar.update(self._bar.task_ids[0], total=1.0, completed=self._fraction, description=title)
