"""The bus between processes and machines: Eclipse Zenoh, peer to peer, with no broker and no search of the network.

A node listens, on the loopback unless told otherwise; subscribers connect, whoever is first. What leaves the machine is
encrypted and both sides show certificates, or it is refused.
"""

import json
import re
import threading
import weakref
from contextlib import suppress
from pathlib import Path
from typing import Any

from levelhead.errors import LevelheadError, nearest
from levelhead.live.bus import QUEUE, LocalBus, Subscription
from levelhead.live.messages import ORIENTATION, SET, TOPICS, Message, pack, unpack

ENDPOINT = "tcp/127.0.0.1:7447"
LOOPBACK = re.compile(r"^(tcp|tls)/(127\.\d+\.\d+\.\d+|\[::1\]|localhost):\d+$")
OPEN = re.compile(r"^tls/[^/]+:\d+$")
CERTIFICATES = ("ca.pem", "own.pem", "own.key")
WAITING = 4096  # messages that may wait for the network
MAX_WAIT_US = 50_000  # µs that the thread that sends waits for a slow link before it drops a message
CACHE = 1  # messages per topic that a late joiner gets
IDENTITY = slice(4, 8)  # of the node, in the bytes of a message


def check_endpoint(endpoint: str, certificates: Path | None) -> str:
    """An endpoint that may be used.

    Raises:
        LevelheadError: no endpoint, or one that would send to the network without TLS and certificates.
    """
    if LOOPBACK.match(endpoint):
        return endpoint
    if endpoint.startswith("tcp/"):
        raise LevelheadError(
            f"{endpoint} is not this machine alone, and tcp is open to all who reach it; expected tls/ADDRESS:PORT "
            "with certificates, or tcp/127.0.0.1:PORT"
        )
    if not OPEN.match(endpoint):
        raise LevelheadError(f"'{endpoint}' is no endpoint; expected such as {ENDPOINT} or tls/192.168.1.5:7447")
    if certificates is None:
        raise LevelheadError(f"{endpoint} needs certificates: a folder with {', '.join(CERTIFICATES)}")
    return endpoint


def configuration(
    endpoint: str, listen: bool, certificates: Path | None = None, readers: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Zenoh's configuration for a node that listens, or a subscriber that connects.

    Args:
        endpoint: where.
        listen: a node.
        certificates: folder with ca.pem, own.pem and own.key, for both sides of TLS.
        readers: names in the certificates that may subscribe; nobody else may do anything. Empty: whoever has a
            certificate of the same authority.

    Raises:
        LevelheadError: see ``check_endpoint``; or a certificate is missing.
    """
    checked = check_endpoint(endpoint, certificates)
    given: dict[str, Any] = {
        "mode": "peer",
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "timestamping/enabled": True,
        "transport/link/tx/queue/congestion_control/drop/wait_before_drop": MAX_WAIT_US,
        "listen/endpoints": [checked] if listen else [],
        "connect/endpoints": [] if listen else [checked],
    }
    if not listen:
        given["connect/timeout_ms"] = -1
        given["connect/exit_on_failure"] = False
    if certificates is not None:
        authority, own, key = (Path(certificates) / name for name in CERTIFICATES)
        for path in (authority, own, key):
            if not path.is_file():
                raise LevelheadError(f"there is no {path}; the folder of certificates holds {', '.join(CERTIFICATES)}")
        side = "listen" if listen else "connect"
        given["transport/link/tls"] = {
            "root_ca_certificate": str(authority),
            f"{side}_certificate": str(own),
            f"{side}_private_key": str(key),
            "enable_mtls": True,
        }
    if readers:
        if certificates is None:
            raise LevelheadError("readers are known by their certificates; give the folder of certificates as well")
        given["access_control"] = _rules(readers)
    return given


def _rules(readers: tuple[str, ...]) -> dict[str, Any]:
    """Nobody may do anything, but these may read the topics and ask for what late joiners missed."""
    reading = ["declare_subscriber", "query", "declare_queryable", "liveliness_query", "declare_liveliness_subscriber"]
    allowed = {"permission": "allow", "key_exprs": ["imu/**", "@adv/**", "imu/**/@adv/**"]}
    out = ["put", "reply", "liveliness_token"]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [
            {"id": "in", "messages": reading, "flows": ["ingress", "egress"]} | allowed,
            {"id": "out", "messages": out, "flows": ["egress"]} | allowed,
        ],
        "subjects": [{"id": "readers", "cert_common_names": list(readers)}],
        "policies": [{"rules": ["in", "out"], "subjects": ["readers"]}],
    }  # fmt: skip


def _session(given: dict[str, Any]) -> Any:
    try:
        import zenoh
    except ImportError:
        raise LevelheadError("the bus between processes needs Zenoh: pip install 'levelhead[bus]'") from None
    config = zenoh.Config()
    for key, value in given.items():
        config.insert_json5(key, json.dumps(value))
    try:
        return zenoh.open(config)
    except Exception as error:  # zenoh.ZError, and whatever its Rust side raises
        where = given["listen/endpoints"] or given["connect/endpoints"]
        why = str(error).partition(" at ")[0].strip()
        raise LevelheadError(f"cannot use {where[0]}: {why}; is another node there?") from None


class ZenohBus:
    """A node's side: what is published goes to this process and to all that connect.

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
        self._session = _session(given)
        from zenoh.handlers import Callback

        self.local = LocalBus()
        self.commands = self.local.commands
        self._publishers: dict[str, Any] = {}
        self._others: set[int] = set()
        self._reported: set[int] = set()
        self._own = 0
        self._subscribers = [
            self._session.declare_subscriber(ORIENTATION, Callback(self._add_orientation, indirect=False)),
            self._session.declare_subscriber(SET, Callback(self._add_command, indirect=False)),
        ]
        self._waiting = Subscription(WAITING)
        self._sender = threading.Thread(target=self._send, name="bus", daemon=True)
        self._sender.start()

    def _add_orientation(self, sample: Any) -> None:
        data = bytes(sample.payload)
        node = int.from_bytes(data[IDENTITY], "little")
        if node != self._own and data[:2] == b"LH":
            self._others.add(node)

    def _add_command(self, sample: Any) -> None:
        with suppress(ValueError):
            wanted = json.loads(bytes(sample.payload))
            if isinstance(wanted, dict):
                self.commands.append(wanted)

    def advertise(self, topic: str, node: int) -> None:
        """See ``MessageBus``."""
        from zenoh import CongestionControl
        from zenoh.ext import CacheConfig, declare_advanced_publisher

        self.local.advertise(topic, node)
        self._own = node
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
        self._waiting.put((topic, message))

    def _send(self) -> None:
        """Sends from a thread of its own: a tick cannot wait for the network."""
        for topic, message in self._waiting:
            self._publishers[topic].put(pack(message))

    def subscribe(self, topic: str, size: int = QUEUE) -> Subscription:
        """A reader in this process."""
        return self.local.subscribe(topic, size)

    def troubles(self) -> list[tuple[str, str]]:
        """See ``MessageBus``."""
        new = self._others - self._reported
        self._reported |= new
        words = f"another node publishes on {ORIENTATION}: a subscriber cannot tell whom to believe; stop one of them"
        return self.local.troubles() + [("second_node", words)] * len(new)

    def close(self) -> None:
        """See ``MessageBus``."""
        self.local.close()
        self._waiting.close()
        self._sender.join()
        self._session.close()


class ParameterClient:
    """Changes the parameters of a node's filter: ``ParameterClient(endpoint).set(beta=0.1)``.

    Where the node lets in readers only (``readers``), it does not hear this.

    Args:
        endpoint: where the node listens.
        certificates: as for ``configuration``.

    Raises:
        LevelheadError: as for ``subscribe``.
    """

    def __init__(self, endpoint: str = ENDPOINT, *, certificates: Path | None = None) -> None:
        self._session = _session(configuration(endpoint, False, certificates))
        self.close = weakref.finalize(self, self._session.close)

    def set(self, **changes: float) -> None:
        """Sends it; whether the node took it stands on imu/config, and why not on imu/health."""
        self._session.put(SET, json.dumps(changes))


class _SessionHolder:
    """Lives as long as a subscription."""


def subscribe(
    topic: str = ORIENTATION, endpoint: str = ENDPOINT, *, certificates: Path | None = None, size: int = QUEUE
) -> Subscription:
    """The messages of a node, in another process or on another machine.

        for message in subscribe("imu/orientation"):
            if message.valid:
                print(message.euler)

    The node need not run yet, may be restarted, and need not know; whoever comes late gets the last message at once.

    Args:
        topic: "imu/orientation", "imu/raw" or "imu/health".
        endpoint: where the node listens.
        certificates: as for ``configuration``.
        size: messages that may wait; then the oldest are dropped and counted in ``missed``.

    Raises:
        LevelheadError: Zenoh is not installed, no such topic, or an endpoint without the certificates that it needs.
    """
    if topic not in TOPICS:  # a wider key would be given nothing where access rules hold, and silently so
        raise LevelheadError(f"there is no topic '{topic}'; {nearest(topic, TOPICS)}")
    given = configuration(endpoint, False, certificates)
    session = _session(given)
    from zenoh.ext import HistoryConfig, declare_advanced_subscriber
    from zenoh.handlers import Callback

    ending = weakref.finalize(session_holder := _SessionHolder(), session.close)  # also when the program just ends
    subscription = Subscription(size, lambda _: ending())

    def receive(sample: Any) -> None:
        try:
            subscription.put(unpack(bytes(sample.payload)))
        except LevelheadError as error:
            subscription.fail(error)

    handler = Callback(receive, indirect=False)  # a thread of its own would keep the program from ending
    history = HistoryConfig(detect_late_publishers=True, max_samples=CACHE)
    subscription.keep = (session_holder, declare_advanced_subscriber(session, topic, handler, history=history))
    return subscription
