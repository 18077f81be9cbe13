"""The reader's side of the bus between processes and machines: subscriptions, and requests for parameters."""

import json
import math
import os
import threading
import time
import weakref
from pathlib import Path

from levelhead.errors import LevelheadError, nearest
from levelhead.live.clock_offset import ClockOffset
from levelhead.live.messages import ALIVE, CLOCK, ORIENTATION, SET, TOPICS, Message
from levelhead.live.sender_check import SenderCheck
from levelhead.live.subscription import MAX_AGE, Subscription
from levelhead.live.zenoh_bus import CACHE, TIME
from levelhead.live.zenoh_session import ENDPOINT, check_handshake, configuration, is_reached, open_session
from levelhead.open_types import Untyped

INTERVAL, FIRST_INTERVAL = 1.0, 0.05  # s between two questions for the node's clock, and until the first answer
ANSWER_TIME = 2.0  # s within which a node answers
UNANSWERED = 5.0  # s of connection without any answer, or without connection, after which the reason is looked for


class _SessionHolder:
    """Lives as long as a subscription."""


class ParameterClient:
    """Changes the parameters of a node's filter: ``ParameterClient(endpoint).set(beta=0.1)``.

    Args:
        endpoint: where the node listens.
        certificates: as for ``configuration``.

    Raises:
        LevelheadError: as for ``subscribe``.
    """

    def __init__(self, endpoint: str = ENDPOINT, *, certificates: Path | None = None) -> None:
        given = configuration(endpoint, False, certificates)
        check_handshake(endpoint, certificates)
        self._endpoint, self._session = endpoint, open_session(given)
        self.close = weakref.finalize(self, self._session.close)

    def set(self, **changes: float) -> None:
        """Sets parameters and waits until the node has them.

        Raises:
            LevelheadError: the node refuses them, does not run, or does not hear this client.
        """
        until = time.monotonic() + ANSWER_TIME
        while (left := until - time.monotonic()) > 0.0:
            for reply in self._session.get(SET, payload=json.dumps(changes), timeout=left):
                if reply.ok is not None:
                    why = bytes(reply.ok.payload).decode()
                    if why:
                        raise LevelheadError(why)
                    return
            time.sleep(0.02)  # not connected yet
        raise LevelheadError(
            f"no node at {self._endpoint} has taken {json.dumps(changes)} within {ANSWER_TIME:g} s: it does not "
            "run, or it lets in readers only (--readers) and takes no parameters from other processes"
        )


class _NodeWatch:
    """Compares clocks with the node, reports missed messages, and fails a reader that can get nothing."""

    def __init__(self, session: Untyped, endpoint: str, certificates: Path | None) -> None:
        self._session, self._endpoint, self._certificates = session, endpoint, certificates
        self._reader = os.urandom(8).hex()
        self._offsets: dict[int, ClockOffset] = {}
        self._answered = False
        self._connected, self._since = False, time.monotonic()  # with any node, and since when
        self._stopped = threading.Event()

    def start(self, subscription: Subscription) -> None:
        """Begins to ask, for a reader."""
        threading.Thread(target=self._run, args=(weakref.ref(subscription),), name="clock", daemon=True).start()

    def stop(self) -> None:
        """Asks no more."""
        self._stopped.set()

    def age(self, message: Message) -> float:
        """s since the node took the sample; inf where the clocks have not been compared."""
        offset = self._offsets.get(message.node)
        return math.inf if offset is None else offset.age(1e-9 * message.stamp, time.monotonic())

    def _run(self, reader: "weakref.ref[Subscription]") -> None:
        while True:
            subscription = reader()
            if subscription is None or subscription.closed:
                return
            try:
                self._ask(subscription)
            except Exception:
                return
            try:
                self._check_connection()
            except LevelheadError as error:
                subscription.fail(error)
                return
            del subscription
            if self._stopped.wait(INTERVAL if self._answered else FIRST_INTERVAL):
                return

    def _ask(self, subscription: Subscription) -> None:
        counts = {"missed": subscription.missed, "expired": subscription.expired}
        report = json.dumps({"reader": self._reader, "topic": subscription.topic} | counts)
        sent = time.monotonic()
        for reply in self._session.get(CLOCK, payload=report, timeout=ANSWER_TIME):
            received = time.monotonic()
            if reply.ok is None:
                continue
            node, stamp = TIME.unpack(bytes(reply.ok.payload))
            offset = self._offsets.setdefault(node, ClockOffset())
            offset.add(sent, 1e-9 * stamp, received)
            self._answered = True
            wall = time.time() - time.monotonic()
            subscription.set_clock(offset.estimate.offset - wall, offset.estimate.uncertainty)

    def _check_connection(self) -> None:
        """Says why nothing comes, once that has lasted.

        Raises:
            LevelheadError: the endpoint does not let this reader in, or is not a node.
        """
        if self._answered:
            return
        now, connected = time.monotonic(), bool(self._session.info.peers_zid())
        if connected != self._connected:
            self._connected, self._since = connected, now
        if now - self._since < UNANSWERED:
            return
        self._since = now
        if connected:
            raise LevelheadError(
                f"the node at {self._endpoint} does not answer this reader: the common name of its certificate is not "
                "among the node's --readers"
            )
        check_handshake(self._endpoint, self._certificates)
        if is_reached(self._endpoint):
            raise LevelheadError(
                f"{self._endpoint} does not answer as a node that this reader understands: a node that runs with "
                "--certificates is reached by tls/NAME:PORT and with certificates"
            )


def subscribe(
    topic: str = ORIENTATION, endpoint: str = ENDPOINT, *, certificates: Path | None = None,
    history: int | None = None, max_age: float = MAX_AGE,
) -> Subscription:  # fmt: skip
    """The messages of a node, in another process or on another machine.

        for message in subscribe("imu/orientation"):
            if message.valid:
                print(message.euler)

    The reader follows the node that it heard first (``SenderCheck``). The node need not run yet, may be restarted, and
    is not informed; late joiners get the last message at once. A node that is gone makes its last orientation invalid:
    at once where its process ends, and when ``max_age`` is over where its machine is cut off.

    Args:
        topic: "imu/orientation", "imu/raw", "imu/health" or "imu/config".
        endpoint: where the node listens.
        certificates: as for ``configuration``.
        history: as for ``Subscription``.
        max_age: as for ``Subscription``.

    Raises:
        LevelheadError: Zenoh is not installed, no such topic, an endpoint without the certificates that it needs, or
            one side refuses the other's certificate.
    """
    if topic not in TOPICS:  # a wider key would get nothing where access rules hold, and no error
        raise LevelheadError(f"there is no topic '{topic}'; {nearest(topic, TOPICS)}")
    given = configuration(endpoint, False, certificates)
    check_handshake(endpoint, certificates)
    session = open_session(given)
    from zenoh import SampleKind
    from zenoh.ext import HistoryConfig, declare_advanced_subscriber
    from zenoh.handlers import Callback

    end_session = weakref.finalize(session_holder := _SessionHolder(), session.close)  # also when the program just ends
    watch = _NodeWatch(session, endpoint, certificates)

    def close(_: Subscription) -> None:
        watch.stop()
        end_session()

    subscription = Subscription(topic, history, max_age, age_of=watch.age, on_close=close)
    check = SenderCheck(topic)

    def receive(sample: Untyped) -> None:
        stamp = sample.timestamp
        message = check.accept(bytes(sample.payload), "" if stamp is None else str(stamp.get_id()))
        if message is not None:
            subscription.put(message)
        elif check.error is not None:
            subscription.fail(check.error)

    def receive_token(sample: Untyped) -> None:
        node = str(sample.key_expr).rpartition("/")[2]
        if not node.isdecimal():
            return  # no node's token
        if sample.kind == SampleKind.PUT:
            subscription.find(int(node))
        else:
            subscription.lose(int(node))
            check.lose(int(node))

    # Without threads of their own, which would keep the program from ending.
    alive = session.liveliness().declare_subscriber(f"{ALIVE}/*", Callback(receive_token, indirect=False), history=True)
    history_config = HistoryConfig(detect_late_publishers=True, max_samples=CACHE)
    topic_subscriber = declare_advanced_subscriber(
        session, topic, Callback(receive, indirect=False), history=history_config
    )
    subscription.keep = (session_holder, alive, topic_subscriber, watch)
    watch.start(subscription)
    return subscription
