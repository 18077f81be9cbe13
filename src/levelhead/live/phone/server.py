"""HTTP and HTTPS on one port: gives the page, takes messages of the page and of Sensor Logger."""

import hmac
import json
import socket
import ssl
import threading
from collections import deque
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject, Untyped

MAX_MESSAGE = 2**20  # bytes of a message
TLS_HANDSHAKE = b"\x16"  # first byte of a TLS connection (RFC 8446, section 5.1)
TIMEOUT = 10.0  # s that a connection may be silent


class PhoneServer:
    """Serves until it is closed; messages come to ``take`` as dictionaries, on threads of the server.

    Args:
        address: where to listen.
        port: which port; 0: one that is free.
        token: first part of each path; a request without it gets nothing.
        take: gets each message; raises LevelheadError, whose sentence the sender gets.
        tls: for connections that begin as TLS; None: HTTP alone.

    Raises:
        LevelheadError: the port is taken, or no such address.
    """

    def __init__(
        self, address: str, port: int, token: str, take: Callable[[JsonObject], int], tls: ssl.SSLContext | None
    ) -> None:
        self.token, self.take, self.tls = token, take, tls
        self.failures: deque[str] = deque(maxlen=100)
        try:
            self._http = _Server((address, port), _Handler)
        except OSError as error:
            raise LevelheadError(f"cannot listen on {address}:{port}: {error.strerror}") from None
        self._http.owner = self
        self.port = int(self._http.server_address[1])
        self._thread = threading.Thread(target=self._http.serve_forever, args=(0.1,), name="phone", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Listens no more."""
        self._http.shutdown()
        self._http.server_close()
        self._thread.join(timeout=2.0)


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    allow_reuse_address = True
    owner: PhoneServer

    def finish_request(self, request: Untyped, client_address: Untyped) -> None:
        """On the connection's own thread, so that a slow handshake delays no other."""
        request.settimeout(TIMEOUT)
        try:
            first = request.recv(1, socket.MSG_PEEK)
            if first == TLS_HANDSHAKE:
                if self.owner.tls is None:
                    return
                request = self.owner.tls.wrap_socket(request, server_side=True)
            super().finish_request(request, client_address)
            if isinstance(request, ssl.SSLSocket):
                request.close()
        except OSError:  # cut off, no handshake, or too slow
            return

    def handle_error(self, request: Untyped, client_address: Untyped) -> None:
        """A client that goes away is not a fault of the node."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    wbufsize = 2**16  # headers and body in one packet
    server: _Server

    def do_GET(self) -> None:
        """The page."""
        if self._allowed():
            page = files("levelhead.live.phone").joinpath("page.html").read_bytes()
            self._answer(200, page, "text/html; charset=utf-8")

    def do_POST(self) -> None:
        """A message."""
        if not self._allowed():
            return
        size = self.headers.get("Content-Length", "")
        if not size.isdecimal() or int(size) > MAX_MESSAGE:
            self.close_connection = True
            self._refuse(413, f"a message has a length of at most {MAX_MESSAGE} bytes")
            return
        try:
            message = json.loads(self.rfile.read(int(size)))
            if not isinstance(message, dict):
                raise LevelheadError("a message is a JSON object")
            count = self.server.owner.take(message)
        except LevelheadError as error:
            self._refuse(400, str(error))
        except (ValueError, RecursionError):
            self._refuse(400, "the message is not JSON")
        else:
            self._answer(200, json.dumps({"readings": count}).encode(), "application/json")

    def _allowed(self) -> bool:
        token = self.path.partition("?")[0].strip("/").partition("/")[0]
        if hmac.compare_digest(token.encode(), self.server.owner.token.encode()):
            return True
        self.close_connection = True
        self._answer(404, b"not found", "text/plain")
        return False

    def _refuse(self, status: int, words: str) -> None:
        self.server.owner.failures.append(words)
        self._answer(status, json.dumps({"error": words}).encode(), "application/json")

    def _answer(self, status: int, body: bytes, kind: str) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", "default-src 'self' 'unsafe-inline'; img-src data:")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """The node's terminal is for the node."""
