"""The bus inside a process: topics, subscribers with queues of their own, and the last message for who comes late."""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any, Protocol

from levelhead.errors import LevelheadError, nearest
from levelhead.live.messages import TOPICS, Message

COMMANDS = 64  # that may wait for the node
QUEUE = 1024  # messages that wait for a subscriber


class MessageBus(Protocol):
    """What a node asks of a bus."""

    commands: deque[dict[str, Any]]  # parameters that somebody wants changed

    def advertise(self, topic: str, node: int) -> None:
        """Claims a topic.

        Raises:
            LevelheadError: another node publishes there.
        """
        ...

    def publish(self, topic: str, message: Message) -> None:
        """Sends, without ever waiting for a subscriber."""
        ...

    def withdraw(self, topic: str, node: int) -> None:
        """Gives a topic back."""
        ...

    def troubles(self) -> list[tuple[str, str]]:
        """What went wrong since the last question: (event, sentence)."""
        ...

    def close(self) -> None:
        """Lets go of it."""
        ...


class Subscription:
    """The messages of a topic, for one reader; iterate over it, or ask for the next one or the last one.

    A reader that does not keep up loses the oldest messages (``missed`` counts them), and never holds up the node.
    """

    def __init__(self, size: int = QUEUE, on_close: Callable[["Subscription"], None] | None = None) -> None:
        self._queue: deque[Any] = deque(maxlen=size)
        self._ready = threading.Condition()
        self._on_close = on_close
        self.missed = 0
        self.closed = False
        self.keep: Any = None  # what must live as long as the subscription
        self._failure: LevelheadError | None = None

    def put(self, message: Any) -> None:
        """The bus hands a message over."""
        with self._ready:
            self.missed += len(self._queue) == self._queue.maxlen
            self._queue.append(message)
            self._ready.notify()

    def get(self, timeout: float | None = None) -> Any:
        """The next message; None after ``timeout`` seconds without one, or when the bus is closed."""
        until = None if timeout is None else time.monotonic() + timeout
        with self._ready:
            while not self._queue and not self.closed:
                left = None if until is None else until - time.monotonic()
                if left is not None and left <= 0.0:
                    return None
                self._ready.wait(left)
            if self._failure is not None and not self._queue:
                raise self._failure
            return self._queue.popleft() if self._queue else None

    def fail(self, error: LevelheadError) -> None:
        """What came can never be read: the reader gets the error."""
        with self._ready:
            self._failure, self.closed = error, True
            self._ready.notify_all()

    def latest(self, timeout: float | None = None) -> Any:
        """The newest message; those before it are dropped, for who wants to know only where things stand."""
        with self._ready:
            while len(self._queue) > 1:
                self._queue.popleft()
        return self.get(timeout)

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


class LocalBus:
    """Topics inside this process."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._subscribers: dict[str, tuple[Subscription, ...]] = {}
        self._last: dict[str, Message] = {}
        self._owners: dict[str, int] = {}
        self._reported: dict[int, int] = {}
        self.commands: deque[dict[str, Any]] = deque(maxlen=COMMANDS)

    def advertise(self, topic: str, node: int) -> None:
        """See ``MessageBus``."""
        with self._lock:
            owner = self._owners.setdefault(topic, node)
        if owner != node:
            raise LevelheadError(f"another node publishes on {topic} of this bus already; stop it, or take another bus")

    def withdraw(self, topic: str, node: int) -> None:
        """See ``MessageBus``."""
        with self._lock:
            if self._owners.get(topic) == node:
                del self._owners[topic]

    def publish(self, topic: str, message: Message) -> None:
        """See ``MessageBus``."""
        self._last[topic] = message
        for subscription in self._subscribers.get(topic, ()):
            subscription.put(message)

    def subscribe(self, topic: str, size: int = QUEUE) -> Subscription:
        """A reader's own queue of ``size`` messages, which begins with the last message there was.

        Raises:
            LevelheadError: there is no such topic.
        """
        if topic not in TOPICS:
            raise LevelheadError(f"there is no topic '{topic}'; {nearest(topic, TOPICS)}")
        subscription = Subscription(size, lambda one: self._remove(topic, one))
        with self._lock:
            if topic in self._last:
                subscription.put(self._last[topic])
            self._subscribers[topic] = (*self._subscribers.get(topic, ()), subscription)
        return subscription

    def _remove(self, topic: str, subscription: Subscription) -> None:
        with self._lock:
            self._subscribers[topic] = tuple(one for one in self._subscribers.get(topic, ()) if one is not subscription)

    def troubles(self) -> list[tuple[str, str]]:
        """See ``MessageBus``."""
        found = []
        for topic, subscriptions in self._subscribers.items():
            for one in subscriptions:
                new = one.missed - self._reported.get(id(one), 0)
                if new > 0:
                    self._reported[id(one)] = one.missed
                    found.append(("subscriber_slow", f"a subscriber of {topic} missed {new} messages"))
        return found

    def close(self) -> None:
        """Ends all subscriptions."""
        for subscriptions in list(self._subscribers.values()):
            for one in subscriptions:
                one.close()
