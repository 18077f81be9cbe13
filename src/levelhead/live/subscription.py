"""A reader's side of a topic: the newest message or a queue, and never an old orientation that looks valid."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from levelhead.errors import LevelheadError
from levelhead.live.messages import ORIENTATION, Orientation, Raw

QUEUE = 1024  # messages that wait for a reader of raw samples and events
MAX_AGE = 0.25  # s after which an orientation is invalid
TIMEOUT = 0.5  # s that ``latest`` waits


class Arrival(NamedTuple):
    """A message that waits: itself, monotonic host time of its arrival in s, and its age then in s."""

    message: Any
    time: float
    age: float


class Subscription:
    """The messages of a topic, for one reader; iterate over it, or ask for the next one or the newest one.

    Orientations: only the newest waits, and one that is older than ``max_age`` when it is read has ``valid=False``. If
    none comes for ``max_age``, or the node is gone, the last one is given once more with ``valid=False``. Other topics,
    and orientations with ``history``, wait in a queue; a reader that does not keep up loses the oldest (``missed``
    counts them). No reader ever holds up the node.

    Args:
        topic: the topic.
        history: messages that may wait; None: the newest orientation, ``QUEUE`` messages of other topics.
        max_age: s; inf: orientations stay as the node published them, as a log needs it.
        age_of: s since the node took the sample of a message, where the clocks must be compared first
            (``set_clock``); orientations wait until then.
        on_close: called with the subscription when it is closed.

    Attributes:
        missed: messages that were dropped from the queue, and raw samples that the network dropped.
        expired: orientations that were too old when they were read.
        age: s, of the message that was read last; NaN: none, or not known.
        clock_offset: s, the node's clock minus this machine's; NaN: not known; 0 in the node's own process.
        clock_uncertainty: s, of the offset.
        closed: no more messages will come.
    """

    def __init__(
        self, topic: str = "", history: int | None = None, max_age: float = MAX_AGE, *,
        age_of: Callable[[Any], float] | None = None,
        on_close: Callable[["Subscription"], None] | None = None,
    ) -> None:  # fmt: skip
        if history is not None and history < 1:
            raise LevelheadError(f"the history is {history} messages; expected 1 or more")
        if not max_age > 0.0:
            raise LevelheadError(f"the largest age is {max_age:g} s; expected more than 0")
        state = topic == ORIENTATION
        self.topic, self._age_of, self._on_close = topic, age_of, on_close
        self._waits_for_clock = state and age_of is not None
        self._newest_only = state and history is None
        self._max_age = max_age if state else math.inf
        self._queue: deque[Arrival] = deque(maxlen=1 if self._newest_only else history or QUEUE)
        self._ready = threading.Condition()
        self.missed = self.expired = 0
        self._dropped = 0  # messages that the queue dropped since the last one was read
        self._sequence: tuple[int, int] | None = None  # node and number of the last raw sample that was read
        self.age = math.nan
        self.clock_offset = self.clock_uncertainty = 0.0 if age_of is None else math.nan
        self.closed = False
        self.keep: Any = None  # an object that must live as long as the subscription
        self._failure: LevelheadError | None = None
        self._last: Orientation | None = None  # the last valid orientation that was read
        self._expires = math.inf  # monotonic time at which it stops being valid
        self._lost: set[int] = set()  # nodes that are gone

    # The bus

    def put(self, message: Any, age: float = 0.0) -> None:
        """The bus hands a message over; ``age``: s since the node took its sample."""
        with self._ready:
            if not self._newest_only and len(self._queue) == self._queue.maxlen:
                self.missed += 1
                self._dropped += 1
            self._queue.append(Arrival(message, time.monotonic(), age))
            self._ready.notify()

    def lose(self, node: int) -> None:
        """The node is gone: its waiting messages, and the last one read, are invalid."""
        with self._ready:
            self._lost.add(node)
            if self._last is not None and self._last.node == node:
                self._expires = min(self._expires, time.monotonic())
            self._ready.notify_all()

    def set_clock(self, offset: float, uncertainty: float) -> None:
        """The clocks were compared: the node's minus this machine's, s."""
        with self._ready:
            self.clock_offset, self.clock_uncertainty = offset, uncertainty
            self._waits_for_clock = False
            self._ready.notify_all()

    def find(self, node: int) -> None:
        """The node is there again."""
        with self._ready:
            self._lost.discard(node)

    def fail(self, error: LevelheadError) -> None:
        """No message can ever be read: the reader gets the error."""
        with self._ready:
            self._failure, self.closed = error, True
            self._ready.notify_all()

    # The reader

    def get(self, timeout: float | None = None) -> Any:
        """The next message; None after ``timeout`` seconds without one, or when the bus is closed.

        Raises:
            LevelheadError: only messages of another version come, or a node that does not answer this reader.
        """
        until = math.inf if timeout is None else time.monotonic() + timeout
        with self._ready:
            while (not self._queue or self._waits_for_clock) and not self.closed:
                now = time.monotonic()
                if now >= self._expires and self._last is not None:
                    return self._expire(self._last, now)
                left = min(until, self._expires) - now
                if left <= 0.0:
                    return None
                self._ready.wait(None if math.isinf(left) else left)
            if not self._queue:
                if self._failure is not None:
                    raise self._failure
                return None
            arrival = self._queue.popleft()
        return self._read(arrival)

    def latest(self, timeout: float | None = TIMEOUT) -> Any:
        """The newest message that was not read yet, as ``get``; those before it are dropped.

        A program that steers takes None for "nothing new", and steers on by the last one until one has ``valid=False``.
        """
        with self._ready:
            while len(self._queue) > 1:
                self._queue.popleft()
        return self.get(timeout)

    def _expire(self, last: Orientation, now: float) -> Orientation:
        """The last orientation once more, invalid."""
        self.age += now - self._expires
        self._last, self._expires = None, math.inf
        return last._replace(valid=False)

    def _read(self, arrival: Arrival) -> Any:
        message = arrival.message
        now = time.monotonic()
        if isinstance(message, Raw):
            self._count_gap(message)
        self.age = arrival.age + now - arrival.time if self._age_of is None else self._age_of(message)
        if not isinstance(message, Orientation) or math.isinf(self._max_age):
            return message
        fresh = self.age <= self._max_age and message.node not in self._lost
        if not (message.valid and fresh):
            self.expired += message.valid
            self._last, self._expires = None, math.inf
            return message._replace(valid=False)
        self._last, self._expires = message, now + self._max_age - self.age
        return message

    def _count_gap(self, message: Raw) -> None:
        """Raw samples are numbered without gaps: those that neither came nor were dropped here were lost."""
        with self._ready:
            dropped, self._dropped = self._dropped, 0
            if self._sequence is not None and self._sequence[0] == message.node:
                self.missed += max(0, message.seq - self._sequence[1] - 1 - dropped)
            self._sequence = message.node, message.seq

    def __iter__(self) -> Iterator[Any]:
        while (message := self.get()) is not None:
            yield message

    def close(self) -> None:
        """No more messages."""
        with self._ready:
            self.closed = True
            self._ready.notify_all()
        if self._on_close is not None:
            self._on_close(self)

    def __enter__(self) -> "Subscription":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
