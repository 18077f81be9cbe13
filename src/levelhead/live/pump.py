"""A thread that hands a node's messages to a function."""

import math
import threading
from collections.abc import Callable, Sequence

from levelhead.live.messages import Message
from levelhead.live.subscription import Subscription

PERIOD = 0.002  # s between two looks for new messages
HISTORY = 4096  # messages that may wait


class Pump:
    """Calls ``send`` with each message of some topics until it is closed."""

    def __init__(
        self, subscribe: Callable[..., Subscription], topics: Sequence[str], send: Callable[[Message], None]
    ) -> None:
        self._send = send
        self._subscriptions = [subscribe(topic, history=HISTORY, max_age=math.inf) for topic in topics]
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="pump", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.wait(PERIOD):
            for subscription in self._subscriptions:
                while (message := subscription.get(timeout=0.0)) is not None:
                    self._send(message)

    def close(self) -> None:
        """No more messages."""
        self._over.set()
        self._thread.join(timeout=2.0)
        for subscription in self._subscriptions:
            subscription.close()
