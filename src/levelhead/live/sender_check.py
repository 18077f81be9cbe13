"""The messages on a topic that a reader uses: those of the node that it heard first, in their order."""

import threading
import time

from levelhead.errors import LevelheadError
from levelhead.live.messages import ORIENTATION, RAW, Health, Message, Orientation, OtherVersion, Raw, unpack

OTHER_VERSION_TIME = 1.0  # s of messages of another version alone, after which the reader gets the error
KINDS = {ORIENTATION: Orientation, RAW: Raw}


class SenderCheck:
    """Lets one node through, and of it no message twice.

    Zenoh lets every session that is connected write on every key. Each message carries the id of its node and a
    number, and Zenoh stamps it with the id of the session. The reader keeps to the node and session that it heard
    first, until the node's liveliness token goes away.

    Args:
        topic: of the messages.

    Attributes:
        rejected: messages that were not let through.
        error: raised to the reader, because only messages of another version come; None while that is not so.
    """

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._kind = KINDS.get(topic, Health)
        self._lock = threading.Lock()
        self._sender: tuple[int, str] | None = None  # node and session
        self._seq = -1
        self._other_since: float | None = None  # monotonic time of the first message of another version
        self.rejected = 0
        self.error: LevelheadError | None = None

    def accept(self, data: bytes, session: str = "") -> Message | None:
        """The message in ``data``, or None where it is damaged, of another sender, or out of order.

        Args:
            data: the messages on the topic.
            session: id of the session that sent it; "": not known.
        """
        try:
            message = unpack(data)
        except OtherVersion as error:
            self._add_other_version(error)
            return None
        except LevelheadError:
            message = None
        with self._lock:
            if message is None or not isinstance(message, self._kind) or not self._is_next(message, session):
                self.rejected += 1
                return None
            return message

    def _is_next(self, message: Message, session: str) -> bool:
        sender = message.node, session
        if self._sender is None:
            self._sender, self._seq = sender, -1
        if sender != self._sender or message.seq < self._seq:
            return False
        if isinstance(message, Orientation) and message.seq == self._seq and message.valid:
            return False  # only the safe state repeats an orientation, as invalid
        self._seq = message.seq
        return True

    def _add_other_version(self, error: LevelheadError) -> None:
        self.rejected += 1
        now = time.monotonic()
        self._other_since = self._other_since or now
        if self._sender is None and now - self._other_since >= OTHER_VERSION_TIME:
            self.error = error

    def lose(self, node: int) -> None:
        """The node is gone: the next one that publishes is followed."""
        with self._lock:
            if self._sender is not None and self._sender[0] == node:
                self._sender = None
