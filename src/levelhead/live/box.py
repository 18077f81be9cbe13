"""The black box: everything that was read and decided, in an MCAP file that survives a kill.

Replay needs the rows of topic imu/samples; beside them stand the same readings as ROS 2 messages (``ros_messages``),
which Foxglove, PlotJuggler and rerun decode. The node hands rows over and never waits; a thread writes them every
quarter of a second, without chunks, so that the written part can be read whatever happens next, and asks the disk once
a second to keep it.
"""

import json
import math
import os
import threading
import time
from collections import deque
from pathlib import Path
from typing import IO, cast

from levelhead.errors import LevelheadError
from levelhead.live.events import EXPECTED
from levelhead.live.messages import NOTHING, Health, Orientation
from levelhead.open_types import ReadOnlyJson, Untyped
from levelhead.sample import Sample
from levelhead.sources.formats import ros_messages as ros
from levelhead.sources.formats.blackbox import (
    ATTITUDES,
    CONFIG,
    ENCODING,
    EVENTS,
    FUSED,
    MAG_NEW,
    PACKED,
    ROW,
    SAMPLES,
    SCHEMA,
)  # fmt: skip

EVERY = 0.25  # s between two writes: the most that a kill may lose; each one leaves the node's next tick a cold cache
SYNC = 1.0  # s between two requests to the disk, for when the power goes
WAITING = 500_000  # rows that may wait for the disk
LINEAR, EARTH = "/imu/linear_acceleration", "/imu/earth_acceleration"
VIEWED = {
    "/imu/data": ros.IMU, "/imu/mag": ros.FIELD, ATTITUDES: ros.ATTITUDE, "/tf": ros.TRANSFORMS,
    "/diagnostics": ros.DIAGNOSTICS, LINEAR: ros.ACCELERATION, EARTH: ros.ACCELERATION,
}  # fmt: skip
EVENT_SCHEMA = {"type": "object", "properties": {"name": {"type": "string"}, "text": {"type": "string"}}}
LEVEL_UNKNOWN = (math.nan,) * 10


class BlackBox:
    """A file that takes all samples and events of a node.

    Args:
        path: must not exist yet: a black box is never overwritten.

    Attributes:
        failure: why nothing is written any more; "" while all is well.
        written: rows that are in the file.

    Raises:
        LevelheadError: mcap is not installed, the file exists, or it cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        try:
            from mcap.writer import CompressionType, Writer
        except ImportError:
            raise LevelheadError("a black box needs mcap: pip install 'levelhead[box]'") from None
        self.path = Path(path)
        if self.path.suffix != ".mcap":
            raise LevelheadError(f"the black box {path} must end in .mcap, so that it can be read again")
        try:
            self._file = open(self.path, "xb", buffering=0)  # noqa: SIM115 - closed in close()
        except FileExistsError:
            raise LevelheadError(f"the black box {path} exists already, and none is ever overwritten") from None
        except OSError as error:
            raise LevelheadError(f"cannot write the black box {path}: {error.strerror}") from None
        self.failure, self.written = "", 0
        self._rows: deque[tuple[int, int, Sample, Orientation | None]] = deque(maxlen=WAITING)
        self._events: deque[Health] = deque(maxlen=WAITING)
        self._raw = _Raw(self._file)
        self._writer = Writer(cast(IO[bytes], self._raw), compression=CompressionType.NONE, use_chunking=False)
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        self._channels: dict[str, int] = {}

    def begin(self, config: ReadOnlyJson) -> None:
        """Writes the configuration, and all messages from here on."""
        self._run_safely(lambda: self._head(config))
        self._thread = threading.Thread(target=self._work, name="black box", daemon=True)
        self._thread.start()

    def _head(self, config: ReadOnlyJson) -> None:
        writer = self._writer
        writer.start(profile="levelhead", library=f"levelhead {config.get('version')}")
        writer.add_metadata(CONFIG, {"config": json.dumps(config)})
        rows = writer.register_schema(SCHEMA, ENCODING, json.dumps(ROW.descr).encode())
        events = writer.register_schema("levelhead/event1", "jsonschema", json.dumps(EVENT_SCHEMA).encode())
        self._channels = {
            SAMPLES: writer.register_channel(SAMPLES, ENCODING, rows),
            EVENTS: writer.register_channel(EVENTS, "json", events),
        }
        for topic, kind in VIEWED.items():
            schema = writer.register_schema(kind, "ros2msg", ros.DEFINITIONS[kind].encode())
            self._channels[topic] = writer.register_channel(topic, "cdr", schema)
        self._raw.flush()

    def sample(self, seq: int, stamp: int, sample: Sample, said: Orientation | None) -> None:
        """A sample, and its orientation; None: it was not fused."""
        if len(self._rows) == WAITING:
            self.failure = f"the black box {self.path} ends here: the disk has not taken {WAITING} samples"
        self._rows.append((seq, stamp, sample, said))

    def event(self, event: Health) -> None:
        """Something happened."""
        self._events.append(event)

    def _work(self) -> None:
        synced = time.monotonic()
        while not self._over.wait(EVERY):
            self._run_safely(self._flush)
            if time.monotonic() - synced > SYNC and not self.failure:
                synced = time.monotonic()
                self._run_safely(lambda: os.fdatasync(self._file.fileno()))

    def _run_safely(self, work: Untyped) -> None:
        """Nothing that happens to the disk may reach the node."""
        if self.failure:
            self._rows.clear()
            self._events.clear()
            return
        try:
            work()
        except (OSError, ValueError) as error:
            self.failure = f"the black box {self.path} ends here: {getattr(error, 'strerror', None) or error}"

    def _flush(self) -> None:
        """One block of rows and the events, as single writes."""
        count = len(self._rows)
        now = time.time_ns()
        if count:
            rows = [self._rows.popleft() for _ in range(count)]
            self._writer.add_message(self._channels[SAMPLES], now, b"".join(_pack_row(*row) for row in rows), now)
            for row in rows:
                self._add_viewed(*row)
        while self._events:
            event = self._events.popleft()
            data = json.dumps(event._asdict()).encode()
            self._writer.add_message(self._channels[EVENTS], event.stamp, data, event.stamp)
            level = ros.WARN if event.on and event.name not in EXPECTED else ros.OK
            words = ros.pack_diagnostics(event.stamp, level, f"levelhead: {event.name}", event.text, "", {})
            self._writer.add_message(self._channels["/diagnostics"], event.stamp, words, event.stamp)
        self._raw.flush()
        self.written += count

    def _add_viewed(self, seq: int, stamp: int, sample: Sample, said: Orientation | None) -> None:
        """A row as messages that other viewers decode; readings that are missing are in none."""
        if math.isfinite(sum(sample.gyr) + sum(sample.acc)):
            quat, sigma = (None, None) if said is None else (said.quat, said.sigma)
            self._add(stamp, "/imu/data", ros.pack_imu(stamp, sample.gyr, sample.acc, quat, sigma))
        if sample.mag is not None:
            self._add(stamp, "/imu/mag", ros.pack_field(stamp, sample.mag))
        if sample.attitude is not None:
            self._add(stamp, ATTITUDES, ros.pack_attitude(stamp, sample.attitude))
        if said is not None:
            self._add(stamp, "/tf", ros.pack_transform(stamp, said.quat))
            found = said.accelerations
            if math.isfinite(sum(found.body)):
                self._add(stamp, LINEAR, ros.pack_acceleration(stamp, found.body, found.sigma_body))
                self._add(stamp, EARTH, ros.pack_acceleration(stamp, found.earth, found.sigma_earth, ros.WORLD))

    def _add(self, stamp: int, topic: str, data: bytes) -> None:
        self._writer.add_message(self._channels[topic], stamp, data, stamp)

    def close(self) -> None:
        """Writes the waiting messages, and the end of the file; one that was never begun goes away."""
        if self._file.closed:
            return
        self._over.set()
        if self._thread is not None:
            self._thread.join()
            self._run_safely(self._flush)
            self._run_safely(self._writer.finish)
            self._run_safely(self._raw.flush)
        self._file.close()
        if self._thread is None:
            self.path.unlink(missing_ok=True)

    def __enter__(self) -> "BlackBox":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _pack_row(seq: int, stamp: int, sample: Sample, said: Orientation | None) -> bytes:
    """A row of the file; the thread that writes makes it, and not the node."""
    mag, pressure, temperature = sample.mag, sample.pressure, sample.temperature
    flags = (0 if said is None else FUSED) | (0 if mag is None else MAG_NEW)
    decided = LEVEL_UNKNOWN if said is None else (*said.quat, *said.sigma, *said.bias)
    return PACKED.pack(
        seq, sample.t, stamp, *sample.gyr, *sample.acc, *(mag or NOTHING),
        math.nan if pressure is None else pressure, math.nan if temperature is None else temperature,
        *decided, 0 if said is None else said.health, flags,
    )  # fmt: skip


class _Raw:
    """A file that keeps its bytes until ``flush``, and then writes all of them, or fails: mcap takes a short write
    for a whole one, and a system call for each part of a record would take most of the time."""

    def __init__(self, file: Untyped) -> None:
        self._file = file
        self._waiting = bytearray()

    def write(self, data: bytes) -> int:
        """Keeps it."""
        self._waiting += data
        return len(data)

    def flush(self) -> None:
        """Writes all that waits."""
        left = memoryview(bytes(self._waiting))
        self._waiting.clear()
        while left:
            left = left[self._file.write(left) :]

    def tell(self) -> int:
        """Where the next byte goes."""
        where: int = self._file.tell()
        return where + len(self._waiting)
