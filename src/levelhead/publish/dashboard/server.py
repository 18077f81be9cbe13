"""The page's server: on 127.0.0.1 alone, static files, calls by name, and one stream for live data."""

import json
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Protocol

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject
from levelhead.publish.dashboard.block import pack_block

PORT, LAST_PORT = 8080, 65_535
TRIED = 50  # ports after the first, if that is taken
LARGEST = 2**20  # bytes of a call
KINDS = {
    "html": "text/html; charset=utf-8", "js": "text/javascript", "css": "text/css", "svg": "image/svg+xml",
    "txt": "text/plain; charset=utf-8",
}  # fmt: skip
# Nothing from elsewhere, and nothing that another page could ask for.
POLICY = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; frame-ancestors 'none'"


class View(Protocol):
    """Content of a page."""

    @property
    def calls(self) -> Mapping[str, Callable[[JsonObject], bytes]]:
        """Name → function of the call's arguments, which answers with a block."""
        ...

    def stream(self) -> Iterator[bytes]:
        """Blocks as they come, until the view is closed."""
        ...

    def close(self) -> None:
        """Ends the stream."""
        ...


class PageServer:
    """Serves a view until it is closed.

    Args:
        view: the source of the page; None: the source that ``show`` gives later, for which calls wait.
        port: on 127.0.0.1; if it is taken, the next one that is free.

    Attributes:
        url: where it is.

    Raises:
        LevelheadError: no such port, none is free, or the page was not built.
    """

    def __init__(self, view: View | None, port: int = PORT) -> None:
        self._view, self._shown, self._over = view, threading.Event(), threading.Event()
        try:
            self._http = _bind(port)
        except LevelheadError:
            if view is not None:
                view.close()
            raise
        if view is not None:
            self.show(view)
        self._http.owner = self
        self.port = int(self._http.server_address[1])
        self.url = f"http://127.0.0.1:{self.port}"
        self._thread = threading.Thread(target=self._http.serve_forever, args=(0.1,), name="page", daemon=True)
        self._thread.start()

    def show(self, view: View) -> None:
        """Answers with this view from now on."""
        self._view = view
        self._shown.set()

    @property
    def view(self) -> View:
        """The data of the page; waits until there is one.

        Raises:
            LevelheadError: the server was closed first.
        """
        self._shown.wait()
        if self._view is None:
            raise LevelheadError("there is nothing to show: the terminal has the reason")
        return self._view

    def wait(self) -> None:
        """Until Ctrl-C."""
        while not self._over.wait(1.0):
            pass

    def close(self) -> None:
        """Closes the view, and serves no more."""
        if self._view is not None:
            self._view.close()
        self._shown.set()
        self._over.set()
        self._http.shutdown()
        self._http.server_close()
        self._thread.join(timeout=2.0)


def page_file(name: str) -> bytes | None:
    """A file of the page; None: there is none."""
    try:
        return files("levelhead.publish").joinpath("page", name).read_bytes()
    except OSError:
        return None


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    allow_reuse_address = sys.platform != "win32"  # there it would share the port
    owner: PageServer

    def handle_error(self, request: object, client_address: object) -> None:
        """A browser that goes away is not a fault."""


def _bind(port: int) -> _Server:
    if not 1 <= port <= LAST_PORT:
        raise LevelheadError(f"there is no port {port}; expected 1 to {LAST_PORT}, such as {PORT}")
    if page_file("index.html") is None:
        raise LevelheadError("this levelhead was installed without its page; build it (it needs Node.js): make page")
    last = min(port + TRIED, LAST_PORT)
    for tried in range(port, last + 1):
        try:
            return _Server(("127.0.0.1", tried), _Handler)
        except OSError as error:
            failure = error
    raise LevelheadError(f"cannot open a page on 127.0.0.1:{port} to {last}: {failure.strerror or failure}") from None


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    wbufsize = 2**16  # headers and body in one packet
    server: _Server

    def do_GET(self) -> None:
        """A file of the page, or the stream."""
        if not self._is_own_page():
            return
        name = self.path.partition("?")[0].lstrip("/") or "index.html"
        if name == "stream":
            self._stream()
            return
        kind = KINDS.get(name.rpartition(".")[2])
        content = page_file(name) if kind is not None and "/" not in name else None
        if content is None or kind is None:
            self._answer(404, b"there is no such file", "text/plain")
        else:
            self._answer(200, content, kind)

    def do_POST(self) -> None:
        """A call: /call/NAME with its arguments as JSON."""
        size = self.headers.get("Content-Length", "")
        if not size.isdecimal() or int(size) > LARGEST:
            self.close_connection = True
            self._refuse(413, f"a call has a length of at most {LARGEST} bytes")
            return
        body = self.rfile.read(int(size))
        if not self._is_own_page():
            return
        try:
            call = self.server.owner.view.calls.get(self.path.removeprefix("/call/"))
            if call is None or self.headers.get("Content-Type") != "application/json":
                self._refuse(404, f"there is no call {self.path}")
                return
            self._answer(200, call(json.loads(body)), "application/octet-stream")
        except LevelheadError as error:
            self._refuse(200, str(error))  # a sentence for people, not a fault of the page
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            self._refuse(400, f"the call {self.path} does not fit: {error}")

    def _is_own_page(self) -> bool:
        """Whether the browser asks by this machine's own name: by another one, another site's page would ask."""
        own = {f"{name}:{self.server.owner.port}" for name in ("127.0.0.1", "localhost")}
        origin = self.headers.get("Origin")
        if self.headers.get("Host") in own and (origin is None or origin.removeprefix("http://") in own):
            return True
        self.close_connection = True
        self._answer(403, b"this page is for this machine alone", "text/plain")
        return False

    def _stream(self) -> None:
        """Blocks, each after its length (uint32), as one answer without an end."""
        self.close_connection = True
        self.send_response(200)
        self.send_header("Content-Type", "application/octet-stream")
        self.send_header("Cache-Control", "no-store")
        self.send_header("Connection", "close")
        self.end_headers()
        for block in self.server.owner.view.stream():
            self.wfile.write(len(block).to_bytes(4, "little") + block)
            self.wfile.flush()

    def _refuse(self, status: int, words: str) -> None:
        self._answer(status, pack_block({"error": words}), "application/octet-stream")

    def _answer(self, status: int, body: bytes, kind: str) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Content-Security-Policy", POLICY)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """The terminal is for the address."""
