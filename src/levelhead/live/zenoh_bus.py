"""The node's side of the bus between processes and machines."""

import json
import struct
import threading
import time
from collections import Counter, deque
from pathlib import Path

from levelhead.errors import LevelheadError
from levelhead.live.bus import Command, LocalBus, slow_text
from levelhead.live.messages import ALIVE, CLOCK, ORIENTATION, SET, TOPICS, Message, pack_message, unpack
from levelhead.live.subscription import MAX_AGE, Subscription
from levelhead.live.zenoh_session import ENDPOINT, check_endpoint, configuration, open_session
from levelhead.open_types import JsonObject, Untyped

WAITING = 4096  # messages that may wait for the network
CACHE = 1  # messages per topic that a late joiner gets
IDENTITY = slice(4, 8)  # of the node, in the bytes of a message
TIME = struct.Struct("<Iq")  # answer on imu/clock: node, ns since 1970
READERS = 256  # whose counts are kept


class ZenohBus:
    """Each published message goes to this process and to all that connect.

    Args:
        endpoint: where to listen.
        certificates: as for ``configuration``.
        readers: as for ``configuration``.
        connect: endpoints of other nodes whose messages should be seen, to notice a second one on the same topic.

    Raises:
        LevelheadError: Zenoh is not installed, the endpoint is taken, or open to the network without certificates.
    """

    def __init__(
        self, endpoint: str = ENDPOINT, *, certificates: Path | None = None, readers: tuple[str, ...] = (),
        connect: tuple[str, ...] = (),
    ) -> None:  # fmt: skip
        given = configuration(endpoint, True, certificates, readers)
        if connect:
            given |= {"connect/endpoints": [check_endpoint(one, certificates) for one in connect]}
            given |= {"connect/timeout_ms": -1, "connect/exit_on_failure": False}
        self._session = open_session(given)
        from zenoh import Locality
        from zenoh.handlers import Callback

        self.local = LocalBus()
        self.commands = self.local.commands
        self._publishers: JsonObject = {}
        self._others: set[int] = set()
        self._reported: set[int] = set()
        self._foreign: Counter[str] = Counter()  # topic: messages that no node sent, since they were reported
        self._counts: dict[str, tuple[int, int]] = {}  # of readers in other processes: missed, expired
        self._slow: deque[str] = deque(maxlen=READERS)
        self._node = 0
        self._token: Untyped = None
        self._declared = [
            self._session.declare_subscriber(
                "imu/*", Callback(self._add_foreign, indirect=False), allowed_origin=Locality.REMOTE
            ),
            self._session.declare_queryable(SET, Callback(self._add_command, indirect=False)),
            self._session.declare_queryable(CLOCK, Callback(self._answer_clock, indirect=False)),
        ]
        self._waiting: deque[tuple[str, Message | None]] = deque(maxlen=WAITING)
        self._newest: Message | None = None  # the orientation that waits
        self._ready = threading.Condition()
        self._closed = False
        self._sender = threading.Thread(target=self._send, name="bus", daemon=True)
        self._sender.start()

    # Other processes

    def _add_foreign(self, sample: Untyped) -> None:
        """A message on the node's topics that it did not send."""
        topic, data = str(sample.key_expr), bytes(sample.payload)
        node = int.from_bytes(data[IDENTITY], "little")
        try:
            unpack(data)
        except LevelheadError:
            node = self._node
        if node != self._node:
            self._others.add(node)
        elif topic in TOPICS:
            self._foreign[topic] += 1

    def _add_command(self, query: Untyped) -> None:
        """A request for parameters; the node answers when it has tried them."""
        try:
            changes = json.loads(bytes(query.payload))
        except (TypeError, ValueError, RecursionError):
            changes = None
        if not isinstance(changes, dict):
            query.reply(SET, 'expected parameters such as {"beta": 0.1}')
            return
        self.commands.append(Command(changes, lambda text: query.reply(SET, text)))

    def _answer_clock(self, query: Untyped) -> None:
        """The node's clock; the question brings the number of messages that a reader missed."""
        query.reply(CLOCK, TIME.pack(self._node, time.time_ns()))
        try:
            report = json.loads(bytes(query.payload))
            reader, topic, counts = str(report["reader"]), str(report["topic"]), (report["missed"], report["expired"])
            before = self._counts.get(reader, (0, 0))
            missed, expired = counts[0] - before[0], counts[1] - before[1]
        except (TypeError, ValueError, KeyError, RecursionError):
            return
        if missed > 0 or expired > 0:
            self._slow.append(slow_text(topic, missed, expired, " in another process"))
        self._counts[reader] = counts
        while len(self._counts) > READERS:
            self._counts.pop(next(iter(self._counts)))

    # The node

    def advertise(self, topic: str, node: int) -> None:
        """See ``MessageBus``."""
        from zenoh import CongestionControl
        from zenoh.ext import CacheConfig, declare_advanced_publisher

        self.local.advertise(topic, node)
        if self._token is None:
            self._node = node
            self._token = self._session.liveliness().declare_token(f"{ALIVE}/{node}")
        self._publishers[topic] = declare_advanced_publisher(
            self._session, topic, express=True, congestion_control=CongestionControl.DROP,
            cache=CacheConfig(CACHE), publisher_detection=True,
        )  # fmt: skip

    def withdraw(self, topic: str, node: int) -> None:
        """See ``MessageBus``."""
        self.local.withdraw(topic, node)

    def publish(self, topic: str, message: Message) -> None:
        """See ``MessageBus``."""
        self.local.publish(topic, message)
        with self._ready:
            if topic == ORIENTATION:
                waits, self._newest = self._newest is not None, message
                if waits:
                    return  # it takes the place of the older one
                self._waiting.append((topic, None))
            else:
                self._waiting.append((topic, message))
            self._ready.notify()

    def _send(self) -> None:
        """Sends from a thread of its own: a tick cannot wait for the network."""
        while True:
            with self._ready:
                while not self._waiting and not self._closed:
                    self._ready.wait()
                if not self._waiting:
                    return
                topic, message = self._waiting.popleft()
                if message is None:
                    message, self._newest = self._newest, None
            if message is not None:
                self._publishers[topic].put(pack_message(message))

    def subscribe(self, topic: str, *, history: int | None = None, max_age: float = MAX_AGE) -> Subscription:
        """A reader in this process."""
        return self.local.subscribe(topic, history=history, max_age=max_age)

    def troubles(self) -> list[tuple[str, str]]:
        """See ``MessageBus``."""
        new = self._others - self._reported
        self._reported |= new
        text = f"another node publishes on {ORIENTATION}: a subscriber follows the one that it heard first; stop one"
        found = self.local.troubles() + [("second_node", text)] * len(new)
        for topic, count in list(self._foreign.items()):
            self._foreign[topic] -= count
            if count:
                text = f"{count} messages on {topic} do not come from this node; readers ignore them"
                found.append(("foreign_message", text))
        while self._slow:
            found.append(("subscriber_slow", self._slow.popleft()))
        return found

    def close(self) -> None:
        """See ``MessageBus``."""
        self.local.close()
        with self._ready:
            self._closed = True
            self._ready.notify()
        self._sender.join()
        self._session.close()
