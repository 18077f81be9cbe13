"""The base of a node's outputs: a thread that sends its messages on."""

import math
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Self

from levelhead.errors import LevelheadError
from levelhead.live.messages import Message
from levelhead.live.subscription import Subscription

PERIOD = 0.002  # s between two looks for new messages
HISTORY = 4096  # messages that may wait


class NodeOutput(ABC):
    """Sends each message of some topics on until it is closed.

    Attributes:
        failure: the reason why the node gives this reader nothing; "": it does.
    """

    failure = ""

    def _begin(self, subscribe: Callable[..., Subscription], topics: Sequence[str]) -> None:
        """Starts to send; ``subscribe`` gives the Subscription of a topic."""
        self._subscriptions = [subscribe(topic, history=HISTORY, max_age=math.inf) for topic in topics]
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name=type(self).__name__, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.wait(PERIOD):
            try:
                for subscription in self._subscriptions:
                    while (message := subscription.get(timeout=0.0)) is not None:
                        self._send(message)
            except LevelheadError as error:
                self._fail(str(error))
                return

    @abstractmethod
    def _send(self, message: Message) -> None:
        """Sends one message."""

    def _fail(self, text: str) -> None:
        """The node gives this reader nothing; ``text`` is the reason."""
        self.failure = text

    def close(self) -> None:
        """No more messages."""
        self._over.set()
        self._thread.join(timeout=2.0)
        for subscription in self._subscriptions:
            subscription.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
