"""A phone that runs phyphox with remote access: the node asks it for new samples.

The protocol is phyphox's own (https://phyphox.org/wiki/index.php/Remote-interface_communication): /config names the
buffers, /control?cmd=start begins, /get?t=T&x=T|t gives the values after time T of the buffer t.
"""

import json
import threading
import urllib.error
import urllib.parse
import urllib.request

from levelhead.errors import LevelheadError
from levelhead.live.phone.messages import phyphox_buffers
from levelhead.live.phone.source import PHONE_AXES
from levelhead.live.phone.streams import Sensor, SensorReading, SensorStreams
from levelhead.open_types import JsonObject
from levelhead.sample import Sample
from levelhead.sources.sensors.bus import SensorError

PERIOD = 0.05  # s between two questions
TIMEOUT = 2.0  # s for an answer


class PhyphoxSource:
    """Samples of a phone that runs phyphox; see ``Source``. The body's x points up the phone's screen.

    Args:
        place: address and port as phyphox shows them, such as ``192.168.1.7:8080``.

    Raises:
        LevelheadError: no address.
    """

    rate = gyr_range = acc_range = 0.0
    ended = False
    silence_limit = 0.5  # s without a sample before it counts as silent: a radio network pauses

    def __init__(self, place: str) -> None:
        found = urllib.parse.urlsplit(place if "://" in place else f"http://{place}")
        if not found.hostname or found.path not in ("", "/"):
            raise LevelheadError(
                f"'{place}' is not an address; expected as phyphox shows it, such as phyphox:192.168.1.7:8080"
            )
        self._base = f"http://{found.netloc}"
        self.name = f"phyphox at {found.netloc}"
        self._streams = SensorStreams()
        self._buffers: dict[Sensor, tuple[str, str, str, str]] = {}
        self._newest: dict[Sensor, float] = {}
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        self._failure = ""
        self._told = ""

    def start(self) -> None:
        """Asks for the experiment, and begins it.

        Raises:
            SensorError: it does not answer.
            LevelheadError: the experiment lacks a sensor.
        """
        try:
            self._buffers = phyphox_buffers(self._get("/config"))
            self._get("/control?cmd=start")
        except (OSError, ValueError) as error:
            words = f"{self.name} does not answer: {error}; is 'Allow remote access' on, in the same network?"
            raise SensorError("bus_error", words) from None
        self._newest = {}
        self._over.clear()
        self._thread = threading.Thread(target=self._run, name="phyphox", daemon=True)
        self._thread.start()

    def restart(self) -> None:
        """Asks anew."""
        self.close()
        self.start()

    def _run(self) -> None:
        while not self._over.wait(PERIOD):
            try:
                answer = self._get(self._question())
                with self._lock:
                    self._add(answer)
                    self._failure = ""
            except (OSError, ValueError, KeyError, TypeError, LevelheadError) as error:
                with self._lock:
                    self._failure = f"{self.name}: {error}"

    def _question(self) -> str:
        words = []
        for sensor, (time, *axes) in self._buffers.items():
            newest = self._newest.get(sensor)
            since = "full" if newest is None else repr(newest)
            words.append(f"{time}={since}")
            words += [f"{axis}={since}" + ("" if newest is None else f"%7C{time}") for axis in axes]
        return "/get?" + "&".join(words)

    def _add(self, answer: JsonObject) -> None:
        for sensor, names in self._buffers.items():
            columns = [answer["buffer"][name]["buffer"] for name in names]
            for t, *values in zip(*columns, strict=False):  # a column may be a value ahead
                if t is None or None in values or t <= self._newest.get(sensor, -1.0):
                    continue
                self._newest[sensor] = float(t)
                self._streams.add(SensorReading(sensor, float(t), tuple(float(value) for value in values)))

    def _get(self, path: str) -> JsonObject:
        with urllib.request.urlopen(self._base + path, timeout=TIMEOUT) as answer:
            found = json.load(answer)
        if not isinstance(found, dict):
            raise ValueError("the answer is not a JSON object")
        return found

    def poll(self) -> list[Sample]:
        """The samples since the last call."""
        with self._lock:
            return [PHONE_AXES.apply(sample) for sample in self._streams.take()]

    def troubles(self) -> list[tuple[str, str]]:
        """See ``Source``."""
        with self._lock:
            new, self._told = self._failure != self._told, self._failure
            return [("garbage", self._failure)] if new and self._failure else []

    def close(self) -> None:
        """Asks no more; the experiment goes on in the phone."""
        self._over.set()
        if self._thread is not None:
            self._thread.join(timeout=2 * TIMEOUT)
