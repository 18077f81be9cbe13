"""The page of a guided calibration: how the sensor should lie, and what to do."""

import math
import time

import numpy as np

from levelhead.calibrate.next_pose import Instruction
from levelhead.publish.dashboard.page import PORT, Page, plain_text
from levelhead.recording import Array
from levelhead.rotations import from_rotvec

LAST = 0.5  # s until what the page showed last has reached the browser


class GuideView:
    """The body as it should be put down, the instruction beside it, and what is told.

    Args:
        title: what the page is about.
        port: of the page.
    """

    def __init__(self, title: str, port: int = PORT) -> None:
        self.page = Page(title, port)
        self._bar = self.page.server.gui.add_progress_bar(0.0)
        self._told = self.page.server.gui.add_markdown("")
        self._last: Instruction | None = None

    def show(self, now: Instruction) -> None:
        """Draws it, if it is another one than before."""
        if now is self._last:
            return
        self._last = now
        more = "; the verdict is at the terminal" if now.done else ""
        self.page.status.content = f"**{plain_text(now.words + more)}**"
        self._bar.value = 100.0 * now.fraction
        sides = ", ".join(now.sides) or "none"
        unknown = now.unobservable_words() or "nothing"
        self._told.content = plain_text(f"up now: {now.up}; sides that were up: {sides}; not known yet: {unknown}")
        if now.side is not None:
            self.page.turn(side_attitude(now.side).tolist())

    def stop(self) -> None:
        """Closes the page; a browser gets the last instruction first."""
        if self._last is not None and self._last.done:
            time.sleep(LAST)
        self.page.stop()


def side_attitude(side: Array) -> Array:
    """(4,) the shortest turn from level that puts a side of the sensor up, sensor to earth."""
    x, y, z = side / np.linalg.norm(side)
    angle, level = math.acos(min(1.0, max(-1.0, z))), math.hypot(x, y)
    axis = np.array([1.0, 0.0, 0.0]) if level < 1e-9 else np.array([y, -x, 0.0]) / level
    found: Array = from_rotvec(angle * axis)
    return found
