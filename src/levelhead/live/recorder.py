"""The black box of a node: from the start, or switched on and off while it runs."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

from levelhead.live.box import BlackBox
from levelhead.live.events import Journal
from levelhead.open_types import JsonObject


class Recorder:
    """Holds the black box that a node writes now.

    Args:
        box: that of the start, or None. A later one gets a name of its own in the same folder, else in this one.
        journal: takes the events "recording" and "box_failed".
        config: gives the node's configuration.

    Attributes:
        box: None where nothing is recorded.
    """

    def __init__(self, box: BlackBox | None, journal: Journal, config: Callable[[], JsonObject]) -> None:
        self.box, self._journal, self._config = box, journal, config
        self._folder = Path() if box is None else box.path.parent
        self._closing: threading.Thread | None = None

    @property
    def path(self) -> str:
        """Of the file; "": nothing is recorded."""
        return "" if self.box is None else str(self.box.path)

    def begin(self) -> None:
        """Writes the configuration into the box, and from here on samples and events."""
        if self.box is not None:
            self.box.begin(self._config())
            self._journal.begin("recording", self.path, path=self.path)

    def switch(self, on: bool) -> None:
        """Begins a new box, or ends the one that there is; nothing where it is so already.

        Raises:
            LevelheadError: the file cannot be made.
        """
        if on == (self.box is not None):
            return
        if on:
            self.box = BlackBox(_free_path(self._folder))
            self.begin()
            return
        box, self.box = self.box, None
        self._journal.end("recording")
        self._journal.end("box_failed")
        assert box is not None
        self._closing = threading.Thread(target=box.close, name="end of a box")  # a tick cannot wait for the disk
        self._closing.start()

    def check(self) -> None:
        """Reports a box that failed."""
        if self.box is not None and self.box.failure:
            self._journal.begin("box_failed", self.box.failure)

    def close(self) -> None:
        """Ends the box, and waits until all is written."""
        if self.box is not None:
            self.box.close()
        if self._closing is not None:
            self._closing.join()


def _free_path(folder: Path) -> Path:
    """A name from date and time that does not exist yet."""
    stem = time.strftime("levelhead-%Y%m%d-%H%M%S")
    names = (f"{stem}{f'-{number}' if number else ''}.mcap" for number in range(1000))
    return next(folder / name for name in names if not (folder / name).exists())
