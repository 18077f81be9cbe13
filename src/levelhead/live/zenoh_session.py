"""Sessions of Eclipse Zenoh: peer to peer, with no broker and no search of the network.

A node listens, on the loopback by default; subscribers connect in any order. Traffic that leaves the machine is
encrypted and both sides show certificates, or it is refused.
"""

import json
import re
import socket
import ssl
from pathlib import Path

from levelhead.errors import LevelheadError
from levelhead.live.messages import CLOCK
from levelhead.open_types import JsonObject, Untyped

ENDPOINT = "tcp/127.0.0.1:7447"
LOOPBACK = re.compile(r"^(tcp|tls)/(127\.\d+\.\d+\.\d+|\[::1\]|localhost):\d+$")
OPEN = re.compile(r"^tls/[^/]+:\d+$")
CERTIFICATES = ("ca.pem", "own.pem", "own.key")
MAX_WAIT_US = 50_000  # µs that the thread that sends waits for a slow link before it drops a message
LEASE = 2000  # ms without a sign of life after which either side counts as gone; 400 is too short on a busy machine
RETRY = {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2}
HANDSHAKE_TIME = 1.0  # s for the check of certificates


def check_endpoint(endpoint: str, certificates: Path | None) -> str:
    """An endpoint that may be used.

    Raises:
        LevelheadError: no endpoint, or one that would send to the network without TLS and certificates.
    """
    if LOOPBACK.match(endpoint) and (certificates is not None or endpoint.startswith("tcp/")):
        return endpoint
    if endpoint.startswith("tcp/"):
        raise LevelheadError(
            f"{endpoint} is not this machine alone, and tcp is open to all who reach it; expected tls/ADDRESS:PORT "
            "with certificates, or tcp/127.0.0.1:PORT"
        )
    if not OPEN.match(endpoint):
        raise LevelheadError(f"'{endpoint}' is not an endpoint; expected such as {ENDPOINT} or tls/192.168.1.5:7447")
    if certificates is None:
        raise LevelheadError(f"{endpoint} needs certificates: a folder with {', '.join(CERTIFICATES)}")
    return endpoint


def configuration(
    endpoint: str, listen: bool, certificates: Path | None = None, readers: tuple[str, ...] = ()
) -> JsonObject:
    """Zenoh's configuration for a node that listens, or a subscriber that connects.

    Args:
        endpoint: where.
        listen: a node.
        certificates: folder with ca.pem, own.pem and own.key, for both sides of TLS.
        readers: names in the certificates that may subscribe; all else is denied. Empty: every holder of a certificate
            of the same authority.

    Raises:
        LevelheadError: see ``check_endpoint``; or a certificate is missing.
    """
    checked = check_endpoint(endpoint, certificates)
    given: JsonObject = {
        "mode": "peer",
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "timestamping/enabled": True,
        "transport/link/tx/lease": LEASE,
        "transport/link/tx/queue/congestion_control/drop/wait_before_drop": MAX_WAIT_US,
        "listen/endpoints": [checked] if listen else [],
        "connect/endpoints": [] if listen else [checked],
    }
    if not listen:
        given["connect/timeout_ms"] = -1
        given["connect/exit_on_failure"] = False
        given["connect/retry"] = RETRY
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


def _rules(readers: tuple[str, ...]) -> JsonObject:
    """All is denied, except that these may read the topics, and ask for the clock and for earlier messages."""
    reading = ["declare_subscriber", "declare_queryable", "liveliness_query", "declare_liveliness_subscriber"]
    late = ["@adv/**", "imu/**/@adv/**"]
    topics = {"permission": "allow", "key_exprs": ["imu/**", *late]}
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [
            {"id": "in", "messages": reading, "flows": ["ingress", "egress"]} | topics,
            {"id": "ask", "messages": ["query"], "flows": ["ingress", "egress"], "permission": "allow",
             "key_exprs": [CLOCK, *late]},
            {"id": "out", "messages": ["put", "reply", "liveliness_token"], "flows": ["egress"]} | topics,
        ],
        "subjects": [{"id": "readers", "cert_common_names": list(readers)}],
        "policies": [{"rules": ["in", "ask", "out"], "subjects": ["readers"]}],
    }  # fmt: skip


def open_session(given: JsonObject) -> Untyped:
    """A Zenoh session.

    Raises:
        LevelheadError: Zenoh is not installed, or the endpoint cannot be used.
    """
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


def check_handshake(endpoint: str, certificates: Path | None) -> None:
    """Tries TLS with the node, because Zenoh retries for ever without giving a reason.

    A node that is not reached may come later: no error.

    Raises:
        LevelheadError: one side refuses the other's certificate.
    """
    if not endpoint.startswith("tls/") or certificates is None:
        return
    host, _, port = endpoint.removeprefix("tls/").rpartition(":")
    authority, own, key = (str(Path(certificates) / name) for name in CERTIFICATES)
    try:
        context = ssl.create_default_context(cafile=authority)
        context.load_cert_chain(own, key)
        with (
            socket.create_connection((host.strip("[]"), int(port)), HANDSHAKE_TIME) as plain,
            context.wrap_socket(plain, server_hostname=host.strip("[]")) as wrapped,
        ):
            wrapped.settimeout(0.2)
            wrapped.recv(1)  # with TLS 1.3 a refusal of this side's certificate comes after the handshake
    except ssl.SSLCertVerificationError as error:
        raise LevelheadError(
            f"{endpoint}: the node's certificate is refused ({error.verify_message}); connect by a name that it holds, "
            "such as tls/localhost:PORT, and with a ca.pem of the same authority"
        ) from None
    except TimeoutError:
        return
    except ssl.SSLError as error:
        why = (error.reason or str(error)).replace("_", " ").lower()
        raise LevelheadError(
            f"{endpoint}: TLS fails ({why}); own.pem must be signed by the authority of the node, and belong to own.key"
        ) from None
    except OSError:
        return


def is_reached(endpoint: str) -> bool:
    """Whether anything listens there."""
    host, _, port = endpoint.partition("/")[2].rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), HANDSHAKE_TIME).close()
    except OSError:
        return False
    return True
