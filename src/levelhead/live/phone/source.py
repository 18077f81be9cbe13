"""The source of a node: a phone that sends by the page, by Sensor Logger or by datagrams."""

import ipaddress
import math
import secrets
import socket
import threading

from levelhead.axis_map import AxisMap
from levelhead.errors import LevelheadError
from levelhead.live.phone.certificate import make_tls_context
from levelhead.live.phone.messages import SensorLogger, read_datagram, read_page
from levelhead.live.phone.server import PhoneServer
from levelhead.live.phone.streams import SensorReading, SensorStreams
from levelhead.open_types import JsonObject
from levelhead.sample import Sample

PORT, LAST_PORT = 8443, 65_535
LOOPBACK = "127.0.0.1"
PHONE_AXES = AxisMap.parse("y,-x,z")  # x of a phone is right, y up its screen; the body's x is forward, its y left
DATAGRAM, MAX_DATAGRAMS = 65_535, 1000  # bytes of a datagram, and datagrams of a poll
ELSEWHERE = ("192.0.2.1", 9)  # an address for documentation (RFC 5737): a UDP socket that connects sends nothing


def parse_phone(text: str) -> tuple[str, int]:
    """Address and port from nothing, ``192.168.1.5`` or ``192.168.1.5:8443``.

    Raises:
        LevelheadError: another form.
    """
    address, colon, port = text.partition(":")
    address = LOOPBACK if address in ("", "localhost") else address
    try:
        ipaddress.IPv4Address(address)
    except ValueError:
        raise LevelheadError(f"'{address}' is not an IPv4 address; expected such as phone:192.168.1.5") from None
    if colon and not (port.isdecimal() and int(port) <= LAST_PORT):
        raise LevelheadError(f"there is no port '{port}'; expected 1 to {LAST_PORT}, such as phone:{address}:{PORT}")
    return address, int(port) if colon else PORT


class PhoneSource:
    """Samples that a phone sends; see ``Source``. The body's x points up the phone's screen, z out of it.

    Args:
        place: see ``parse_phone``; without an address only this machine is reached.

    Attributes:
        url: of the page, after ``start``.
    """

    rate = gyr_range = acc_range = 0.0
    ended = False
    start_limit = math.inf  # s before the first sample: somebody must take the phone first
    silence_limit = 0.5  # s without a sample before it counts as silent: a radio network pauses

    def __init__(self, place: str = "") -> None:
        self.address, self._port = parse_phone(place)
        self.name = f"a phone at {self.address}"
        self.token = secrets.token_hex(4)
        self.url = ""
        self._lock = threading.Lock()
        self._streams, self._logger = SensorStreams(), SensorLogger()
        self._sender = ""  # the page or app that is kept to
        self._server: PhoneServer | None = None
        self._datagrams: socket.socket | None = None
        self._troubles: list[tuple[str, str]] = []
        self._unusable = 0

    def start(self) -> None:
        """Listens.

        Raises:
            LevelheadError: the port is taken, no such address, or the library for HTTPS is missing.
        """
        local = self.address == LOOPBACK
        tls = None if local else make_tls_context(self.address)
        self._server = PhoneServer(self.address, self._port, self.token, self._take, tls)
        self.url = f"{'http' if local else 'https'}://{self.address}:{self._server.port}/{self.token}"
        self._datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._datagrams.setblocking(False)
        try:
            self._datagrams.bind((self.address, self._server.port))
        except OSError as error:
            self.close()
            raise LevelheadError(f"cannot listen on UDP port {self._port}: {error.strerror}") from None

    def restart(self) -> None:
        """The phone comes back by itself."""

    def _take(self, message: JsonObject) -> int:
        """One message, on a thread of the server.

        Raises:
            LevelheadError: another form, or another phone sends already.
        """
        pushed = "payload" in message
        sender = str(message.get("sessionId" if pushed else "session", ""))[:100]
        with self._lock:
            readings = self._logger.read(message) if pushed else read_page(message)
            self._add(sender, readings)
        return len(readings)

    def _add(self, sender: str, readings: list[SensorReading]) -> None:
        if readings and not self._sender:
            self._sender = sender
            self._troubles.append(("phone", "a phone sends"))
        if readings and sender != self._sender:
            raise LevelheadError("another phone sends already, or the page was loaded anew; end the node first")
        for reading in readings:
            self._streams.add(reading)

    def poll(self) -> list[Sample]:
        """The samples since the last call."""
        with self._lock:
            self._read_datagrams()
            return [PHONE_AXES.apply(sample) for sample in self._streams.take()]

    def _read_datagrams(self) -> None:
        assert self._datagrams is not None
        for _ in range(MAX_DATAGRAMS):
            try:
                data, (host, _port) = self._datagrams.recvfrom(DATAGRAM)
            except OSError:
                return
            try:
                for line in data.decode("ascii", "replace").splitlines():
                    self._add(f"udp {host}", read_datagram(line))
            except LevelheadError as error:
                self._troubles.append(("garbage", f"a datagram from {host}: {error}"))

    def troubles(self) -> list[tuple[str, str]]:
        """See ``Source``."""
        with self._lock:
            found, self._troubles = self._troubles, []
            unusable = self._streams.unusable
        if unusable > self._unusable:
            self._unusable = unusable
            found.append(("garbage", f"{unusable} readings so far were not finite or out of order"))
        while self._server is not None and self._server.failures:
            found.append(("garbage", f"a message of a phone: {self._server.failures.popleft()}"))
        return found

    def close(self) -> None:
        """Listens no more."""
        if self._server is not None:
            self._server.close()
        if self._datagrams is not None:
            self._datagrams.close()

    def instructions(self) -> str:
        """The address for the phone, with a QR code where segno is installed."""
        if self.address == LOOPBACK:
            own = network_address()
            hint = f"; for a phone in this network: --source phone:{own}" if own else ""
            return f"phone: only this machine reaches {self.url}{hint}"
        words = [
            f"phone: open {self.url} and accept its certificate",
            f"  Sensor Logger, HTTP push: {self.url.replace('https', 'http')}",
            f"  Sensorstream, UDP: {self.address}, port {self.url.rpartition(':')[2].partition('/')[0]}",
        ]
        return "\n".join([*words, qr_code(self.url)]).rstrip()


def network_address() -> str:
    """This machine's address in its network, or "" without one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(ELSEWHERE)
            return str(probe.getsockname()[0])
        except OSError:
            return ""


def qr_code(text: str) -> str:
    """A QR code of half blocks for a terminal; "" if segno is not installed."""
    try:
        import segno
    except ImportError:
        return ""
    import io

    out = io.StringIO()
    segno.make(text, error="l").terminal(out, compact=True)
    return out.getvalue()
