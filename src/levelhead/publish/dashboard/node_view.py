"""The page of a running node: orientations with their readings, state, events, parameters, a record."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from datetime import datetime
from itertools import islice
from pathlib import Path

import numpy as np

from levelhead import filters
from levelhead.errors import LevelheadError
from levelhead.live.box import BlackBox
from levelhead.live.events import EXPECTED
from levelhead.live.messages import CONFIG, HEALTH, NOTHING, ORIENTATION, RAW, Health, Orientation, Raw
from levelhead.live.subscription import Subscription
from levelhead.open_types import JsonObject, Untyped
from levelhead.publish.dashboard.block import pack_block
from levelhead.publish.dashboard.description import filter_description, health_names
from levelhead.sample import Sample

PERIOD = 0.04  # s between two looks for messages, and at least between two blocks
HISTORY = 8192  # messages that may wait
KEPT = 60_000  # rows for a page that is opened later: five minutes at 200 Hz
LISTED = 200  # events likewise
WAIT = 0.2  # s that an orientation waits for its raw sample
Row = tuple[float, ...]


class NodeView:
    """Follows a node through its four topics.

    Args:
        subscribe: gives the Subscription of a topic; takes ``history`` and ``max_age`` as ``Subscription`` does.
        set_params: sets parameters of the node, by keyword; raises LevelheadError where it refuses.
        title: the subject of the page.
        folder: where a record is written.
        starts: gives the commands that start a node, for a page without an orientation.

    Attributes:
        calls: about, set, record.
    """

    def __init__(
        self, subscribe: Callable[..., Subscription], set_params: Callable[..., None], title: str = "node",
        folder: Path = Path(), starts: Callable[[], list[str]] = list,
    ) -> None:  # fmt: skip
        self._starts = starts
        self._set_params, self._title, self._folder = set_params, title, folder
        self._rows: deque[Row] = deque(maxlen=KEPT)
        self._events: deque[JsonObject] = deque(maxlen=LISTED)
        self._row_count = self._event_count = 0  # of the whole run
        self._raws: dict[int, Raw] = {}
        self._waiting: deque[tuple[float, Orientation]] = deque()
        self._last: Orientation | None = None
        self._config: JsonObject = {}
        self._failure = ""
        self._box: BlackBox | None = None
        self._recorded = 0
        self._changed, self._over = threading.Condition(), threading.Event()
        self._history = {
            topic: subscribe(topic, history=HISTORY, max_age=math.inf) for topic in (ORIENTATION, RAW, HEALTH, CONFIG)
        }
        self._newest = subscribe(ORIENTATION)  # marks messages that are too old
        self.calls = {"about": self._about, "set": self._set, "record": self._record}
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.wait(PERIOD):
            with self._changed:
                try:
                    self._read()
                except LevelheadError as error:  # this reader gets nothing from the node
                    self._failure = str(error)
                    self._changed.notify_all()
                    return
                self._changed.notify_all()

    def _read(self) -> None:
        """Takes all that came since the last time."""
        topics = self._history
        while (config := topics[CONFIG].get(timeout=0.0)) is not None:
            self._config = config.data
        while (event := topics[HEALTH].get(timeout=0.0)) is not None:
            self._take_event(event)
        while (raw := topics[RAW].get(timeout=0.0)) is not None:
            self._raws[raw.seq] = raw
        while (orientation := topics[ORIENTATION].get(timeout=0.0)) is not None:
            if orientation.valid:
                self._waiting.append((time.monotonic(), orientation))
        while self._waiting and (
            self._waiting[0][1].seq in self._raws or time.monotonic() - self._waiting[0][0] > WAIT
        ):
            self._take(self._waiting.popleft()[1])
        while (newest := self._newest.latest(timeout=0.0)) is not None:
            self._last = newest

    def _take(self, said: Orientation) -> None:
        """One more row."""
        for skipped in [seq for seq in self._raws if seq < said.seq]:
            del self._raws[skipped]
        raw = self._raws.pop(said.seq, None)
        gyr, acc, mag = (NOTHING,) * 3 if raw is None else (raw.gyr, raw.acc, raw.mag or NOTHING)
        self._rows.append((1e-9 * said.stamp, *said.quat, *said.sigma, *said.bias, *gyr, *acc, *mag, said.health))
        self._row_count += 1
        if self._box is not None and raw is not None:
            self._box.sample(raw.seq, raw.stamp, Sample(raw.t, raw.gyr, raw.acc, raw.mag, raw.pressure), said)
            self._recorded += 1

    def _take_event(self, event: Health) -> None:
        self._events.append({
            "t": 1e-9 * event.stamp, "name": event.name, "text": event.text, "on": event.on,
            "fault": event.on and event.name not in EXPECTED,
        })  # fmt: skip
        self._event_count += 1
        if self._box is not None:
            self._box.event(event)

    def _about(self, _: JsonObject) -> bytes:
        known = {"kind": "node", "title": self._title, "clock": True, "health": health_names()}
        return pack_block(known | {"starts": self._starts() if self._last is None else []})

    def _set(self, asked: JsonObject) -> bytes:
        """Asks the node for other parameters."""
        self._set_params(**asked["values"])
        return pack_block({})

    def _record(self, asked: JsonObject) -> bytes:
        """Begins or ends a black box of the messages of this page's server."""
        with self._changed:
            if asked["on"] and self._box is None:
                box = BlackBox(self._folder / f"{datetime.now():levelhead-%Y-%m-%d-%H%M%S}.mcap")
                box.begin(self._config)
                self._box, self._recorded = box, 0
            elif not asked["on"] and self._box is not None:
                box, self._box = self._box, None
                box.close()
        return pack_block({})

    def stream(self) -> Iterator[bytes]:
        """Rows and events since the last block, and the state of now: at least every 0.2 s, so that silence shows."""
        rows = events = 0
        while not self._over.is_set():
            with self._changed:
                self._changed.wait(WAIT)
                new = min(self._row_count - rows, len(self._rows))
                table = np.array(list(islice(self._rows, len(self._rows) - new, None)))
                listed = list(self._events)[max(0, len(self._events) - (self._event_count - events)) :]
                rows, events = self._row_count, self._event_count
                header = {"state": self._state(), "events": listed}
            yield pack_block(header, row_columns(table) if new else None)
            time.sleep(PERIOD)

    def _state(self) -> JsonObject:
        """The state of the moment."""
        last, reader = self._last, self._newest
        state: JsonObject = {"valid": False, "words": [], "failure": self._failure}
        if last is not None:
            state |= {"valid": last.valid and not self._failure, "words": last.words, "seq": last.seq}
            state |= {"stamp": 1e-9 * last.stamp, "age": finite(reader.age)}
        if reader.clock_uncertainty > 0.0:
            state |= {"offset": finite(reader.clock_offset), "uncertainty": finite(reader.clock_uncertainty)}
        if self._config:
            params = filters.find(self._config["filter"]).params(**self._config["params"])
            state |= {"filter": filter_description(params), "source": str(self._config.get("source", ""))}
        if (box := self._box) is not None:
            state["record"] = {"path": str(box.path), "rows": self._recorded, "failure": box.failure}
        return state

    def close(self) -> None:
        """Ends the subscriptions, and a record."""
        self._over.set()
        self._thread.join()
        if self._box is not None:
            self._box.close()
        for subscription in (*self._history.values(), self._newest):
            subscription.close()


def row_columns(table: Untyped) -> dict[str, Untyped]:
    """(n, 21) rows as columns of a block."""
    edges = {
        "t": (0, 1),
        "quat": (1, 5),
        "sigma": (5, 8),
        "bias": (8, 11),
        "gyr": (11, 14),
        "acc": (14, 17),
        "mag": (17, 20),
    }
    columns = {name: table[:, low:high].astype(np.float32) for name, (low, high) in edges.items()}
    return columns | {"t": table[:, 0], "health": table[:, 20].astype(np.uint32)}


def finite(value: float) -> float | None:
    """A number; JSON has no NaN."""
    return value if math.isfinite(value) else None
