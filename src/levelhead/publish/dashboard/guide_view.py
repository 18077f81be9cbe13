"""The page of a guided calibration: how the sensor should lie, and what to do."""

import math
import threading
from collections.abc import Iterator

import numpy as np

from levelhead.calibrate.next_pose import Instruction
from levelhead.open_types import JsonObject
from levelhead.publish.dashboard.block import pack_block
from levelhead.recording import Array
from levelhead.rotations import from_rotvec

PERIOD = 0.2  # s between two blocks at most
LAST = 0.5  # s until a browser has the last instruction


class GuideView:
    """The body as it should be put down, the instruction beside it, and the results so far.

    Args:
        title: the subject of the page.
    """

    def __init__(self, title: str) -> None:
        self._title = title
        self._changed, self._over = threading.Condition(), threading.Event()
        self._guide: JsonObject = {"words": "…", "fraction": 0.0, "notes": []}
        self.calls = {"about": self._about}

    def _about(self, _: JsonObject) -> bytes:
        return pack_block({"kind": "guide", "title": self._title, "health": []})

    def show(self, now: Instruction) -> None:
        """Shows it to all pages that are open."""
        with self._changed:
            self._guide = guide_of(now) | ({"quat": self._guide.get("quat")} if now.side is None else {})
            self._changed.notify_all()

    def stream(self) -> Iterator[bytes]:
        """The instruction of now, again and again."""
        while not self._over.is_set():
            with self._changed:
                self._changed.wait(PERIOD)
                block = pack_block({"state": {"valid": True, "words": [], "guide": self._guide}, "events": []})
            yield block

    def close(self) -> None:
        """Ends the streams; a browser gets the last instruction first."""
        if self._guide.get("done"):
            self._over.wait(LAST)
        self._over.set()


def guide_of(now: Instruction) -> JsonObject:
    """An instruction for the page."""
    guide: JsonObject = {
        "words": now.words + ("; the verdict is at the terminal" if now.done else ""), "fraction": now.fraction,
        "done": now.done,
        "notes": [
            f"up now: {now.up}", f"sides that were up: {', '.join(now.sides) or 'none'}",
            f"not known yet: {now.unobservable_words() or 'nothing'}",
        ],
    }  # fmt: skip
    return guide if now.side is None else guide | {"quat": side_attitude(now.side).tolist()}


def side_attitude(side: Array) -> Array:
    """(4,) the shortest turn from level that puts a side of the sensor up, sensor to earth."""
    x, y, z = side / np.linalg.norm(side)
    angle, level = math.acos(min(1.0, max(-1.0, z))), math.hypot(x, y)
    axis = np.array([1.0, 0.0, 0.0]) if level < 1e-9 else np.array([y, -x, 0.0]) / level
    found: Array = from_rotvec(angle * axis)
    return found
