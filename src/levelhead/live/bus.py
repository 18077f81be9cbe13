"""The bus inside a process: topics, subscriptions, and the last message for late joiners."""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol
from weakref import WeakKeyDictionary

from levelhead.errors import LevelheadError, nearest
from levelhead.live.messages import TOPICS, Message
from levelhead.live.subscription import MAX_AGE, Subscription
from levelhead.open_types import JsonObject

COMMANDS = 64  # that may wait for the node


def slow_text(topic: str, missed: int, expired: int, where: str = "") -> str:
    """A sentence on a subscriber that does not keep up."""
    what = [f"missed {missed} messages"] * (missed > 0) + [f"read {expired} that were too old"] * (expired > 0)
    return f"a subscriber of {topic}{where} {' and '.join(what)}"


class Command(NamedTuple):
    """A request for other parameters.

    Attributes:
        changes: parameter → value.
        answer: takes "" when they are set, or the reason why they are not, a sentence.
    """

    changes: JsonObject
    answer: Callable[[str], None] = lambda _: None


class MessageBus(Protocol):
    """The side of a bus that a node uses."""

    commands: deque[Command]  # that wait for the node

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
        """Faults since the last call: (event, sentence)."""
        ...

    def close(self) -> None:
        """Lets go of it."""
        ...


class LocalBus:
    """Topics inside this process."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._subscribers: dict[str, tuple[Subscription, ...]] = {}
        self._last: dict[str, tuple[Message, float]] = {}  # and the monotonic time at which it came
        self._owners: dict[str, int] = {}
        self._reported: WeakKeyDictionary[Subscription, tuple[int, int]] = WeakKeyDictionary()
        self.commands: deque[Command] = deque(maxlen=COMMANDS)

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
        self._last[topic] = message, time.monotonic()
        for subscription in self._subscribers.get(topic, ()):
            subscription.put(message)

    def subscribe(self, topic: str, *, history: int | None = None, max_age: float = MAX_AGE) -> Subscription:
        """A reader of its own, which begins with the last message there was; see ``Subscription`` for the arguments.

        Raises:
            LevelheadError: no such topic, history or age.
        """
        if topic not in TOPICS:
            raise LevelheadError(f"there is no topic '{topic}'; {nearest(topic, TOPICS)}")
        subscription = Subscription(topic, history, max_age, on_close=lambda one: self._remove(topic, one))
        with self._lock:
            if topic in self._last:
                message, since = self._last[topic]
                subscription.put(message, time.monotonic() - since)
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
                counts, before = (one.missed, one.expired), self._reported.get(one, (0, 0))
                if counts != before:
                    self._reported[one] = counts
                    found.append(("subscriber_slow", slow_text(topic, counts[0] - before[0], counts[1] - before[1])))
        return found

    def close(self) -> None:
        """Ends all subscriptions."""
        for subscriptions in list(self._subscribers.values()):
            for one in subscriptions:
                one.close()
