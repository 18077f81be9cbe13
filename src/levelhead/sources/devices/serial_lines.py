"""A microcontroller on a serial line that prints its samples as text."""

import math
import os
import time
from collections.abc import Callable

from levelhead.errors import LevelheadError
from levelhead.open_types import Untyped
from levelhead.sample import Sample
from levelhead.sources.conclusions.sentences import sentence
from levelhead.sources.devices.fine_stamps import FineStamps
from levelhead.sources.devices.line_parser import MAX_BYTES, LineParser
from levelhead.sources.hints import Hints
from levelhead.sources.sensors.bus import SensorError
from levelhead.sources.sensors.sample_clock import SampleClock

BAUD = 115_200
CHUNK = 65_536
RATE_FACTOR = 50.0  # the rate is the node's, and the device may have another one
BACKWARDS = 10  # samples in a row whose stamps are before the last good one: the device began anew
WRAPS = (2**32 * 1e-6, 2**32 * 1e-3)  # s after which micros() and millis() of 32 bits begin anew
NEAR_WRAP = 1.0  # s
PAUSE, PAUSE_INTERVALS = 0.25, 5.0  # s, and usual intervals of the samples that came, without a line: the device paused
WEIGHT = 0.05  # of an interval in the running mean
UNREADABLE_TIME, UNREADABLE_BYTES = (
    1.0,
    64,
)  # s and bytes without a sample, after which the speed of the line is doubted
UNREADABLE_SHARE = 0.1  # of bytes that are not text; at the wrong speed it is about one half
TEXT = frozenset(b"\t\r\n") | frozenset(range(32, 127))


class SerialLines:
    """Samples from a serial port.

    Args:
        port: such as /dev/ttyUSB0.
        baud: bits a second.
        hints: as for files, checked.
        clock: host time in s.

    Attributes:
        garbage: lines so far that were no line of numbers.
    """

    gyr_range = acc_range = 0.0
    ended = False

    def __init__(
        self, port: str, baud: int = BAUD, hints: Hints | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.name, self.port, self.baud = f"serial line {port}", port, baud
        self._clock, self._hints = clock, hints or Hints()
        self.rate = self._hints.rate or 0.0
        self._lines = LineParser(self.name, Hints(self._hints.map, self._hints.scale))
        self._clock_fit = SampleClock(self.rate, RATE_FACTOR) if self.rate else None
        self._fine = FineStamps()
        self._arrived, self._interval = 0.0, 0.0  # host time of the last samples, and s per sample, without stamps
        self._line: Untyped = None
        self._rest = b""
        self._unread: tuple[float, int, int] | None = None  # since the last sample: host time, bytes, those no text
        self._last: float | None = None  # stamp of the last sample, s
        self._raw = -math.inf  # its stamp by the device's own clock, s
        self._shift = 0.0  # s added to the device's stamps, because it began anew
        self._behind = 0
        self._reported = 0  # lines of garbage that were reported
        self._troubles: list[tuple[str, str]] = []

    @property
    def garbage(self) -> int:
        """LineParser so far that were no line of numbers."""
        return self._lines.garbage

    def start(self) -> None:
        """Opens the port.

        Raises:
            LevelheadError: pyserial is not installed.
            SensorError: there is no such port, or it may not be opened.
        """
        try:
            import serial
        except ImportError:
            raise LevelheadError("serial lines need pyserial: pip install 'levelhead[live]'") from None
        try:
            self._line = serial.Serial(self.port, self.baud, timeout=0)
        except (OSError, ValueError) as error:
            number = getattr(error, "errno", None)  # pyserial's own words repeat the port
            words = str(error) if number is None else os.strerror(number)
            raise SensorError(
                "unplugged", f"cannot open {self.port}: {words}; is it plugged in, and are you in its group (dialout)?"
            ) from None
        self._rest = b""

    def restart(self) -> None:
        """Opens the port again."""
        self.close()
        self.start()

    def poll(self) -> list[Sample]:
        """The samples since the last call.

        Raises:
            SensorError: the device is gone.
            LevelheadError: its lines have no gyroscope, no accelerometer, or unclear units.
        """
        data = self._read()
        if not data:
            return []
        at = self._clock()
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > MAX_BYTES:
            self._rest = b""
            self._lines.garbage += 1
        samples: list[Sample] = []
        for line in lines:
            samples += self._lines.take(line, at)
        self._report_garbage()
        self._check_speed(data, at, bool(samples))
        if words := self._lines.lacking(at):
            self._troubles.append(("unnamed", words))
        return self._in_order(samples)

    def _check_speed(self, data: bytes, at: float, understood: bool) -> None:
        """Doubts the speed of the line, once, where bytes come that are not text and make no sample."""
        if understood:
            self._unread = None
            return
        since, count, bad = self._unread or (at, 0, 0)
        if count < 0:
            return
        count, bad = count + len(data), bad + sum(byte not in TEXT for byte in data)
        self._unread = since, count, bad
        if at - since >= UNREADABLE_TIME and count >= UNREADABLE_BYTES and bad > UNREADABLE_SHARE * count:
            self._unread = since, -1, 0
            words = (
                f"{self.port} sends bytes that are not text ({bad} of {count}): {self.baud} bits a second are not the "
                f"device's speed; name the one of its Serial.begin(), such as serial:{self.port}@9600"
            )
            self._troubles.append(("garbage", words))

    def _read(self) -> bytes:
        """All that is there; a terminal gives 4 KiB at a time."""
        data = b""
        try:
            while len(data) < CHUNK and (more := self._line.read(CHUNK)):
                data += more
        except (OSError, TypeError, AttributeError):  # SerialException is an OSError, but pyserial has other ways too
            raise SensorError("unplugged", f"{self.port} is gone; was it unplugged?") from None
        return data

    def _in_order(self, samples: list[Sample]) -> list[Sample]:
        """Stamps that increase: by the device's clock, or by the host's where it has none."""
        if self._clock_fit is not None and samples and not self._lines.stamped:
            if self._paused(samples):
                self._clock_fit.restart()
            stamps = self._clock_fit.stamps(len(samples), samples[-1].t)
            return [sample._replace(t=t) for sample, t in zip(samples, stamps, strict=True)]
        kept = []
        for sample in samples:
            t = sample.t + self._shift
            if self._lines.stamped and (self._last is None or t >= self._raw):
                self._raw, t = t, self._fine.place(t, -math.inf if self._last is None else self._last)
            if self._last is not None and t <= self._last:
                t = self._backwards(sample.t, self._last)
                if t <= self._last:
                    continue
            self._behind = 0
            self._last = t
            kept.append(sample._replace(t=t))
        return kept

    def _paused(self, samples: list[Sample]) -> bool:
        """Whether the device sent nothing for longer than these samples, without stamps, stand for."""
        last, newest = self._arrived, samples[-1].t
        self._arrived = newest
        count = len(samples)
        if last == 0.0:
            self._interval = (newest - samples[0].t) / max(1, count - 1)
            return False
        since = newest - last
        if self._interval > 0.0 and since > max(PAUSE, PAUSE_INTERVALS * count * self._interval):
            return True
        self._interval += WEIGHT * (since / count - self._interval) if self._interval > 0.0 else since / count
        return False

    def _backwards(self, stamp: float, last: float) -> float:
        """A stamp that is not after the last one, put right if its reason is known; else the stamp that it has."""
        if not self._lines.stamped:  # several lines in one read came at the same host time
            return last + 1e-6
        for wrap in WRAPS:
            if abs(last - self._shift - wrap) < NEAR_WRAP and 0.0 <= stamp < NEAR_WRAP:
                self._shift += wrap
                return stamp + self._shift
        self._behind += 1
        if self._behind == 1 and stamp + self._shift < self._raw:
            self._troubles.append(
                ("time_backwards", f"{self.port} sent a stamp that goes back, from {last:.6g} to {stamp:.6g} s")
            )
        if self._behind < BACKWARDS:
            return stamp + self._shift
        self._shift = last + 1e-3 - stamp
        return stamp + self._shift

    def _report_garbage(self) -> None:
        new = self.garbage - self._reported
        if new > 0:
            self._reported = self.garbage
            self._troubles.append(("garbage", f"{new} lines from {self.port} were no numbers ({self.garbage} so far)"))

    def troubles(self) -> list[tuple[str, str]]:
        """See ``Source``."""
        found, self._troubles = self._troubles, []
        while self._lines.conclusions:
            found.append(("assumed", sentence(self._lines.conclusions.pop(0))))
        return found

    def close(self) -> None:
        """Lets go of the port."""
        if self._line is not None:
            line, self._line = self._line, None
            line.close()


def parse_serial(text: str) -> tuple[str, int]:
    """Port and speed from words such as ``/dev/ttyUSB0`` or ``/dev/ttyUSB0@921600``.

    Raises:
        LevelheadError: no port, or a speed that is not a number.
    """
    port, _, baud = text.partition("@")
    if not port or (baud and not baud.isdecimal()):
        raise LevelheadError(
            f"'{text}' is not a serial line; expected such as serial:/dev/ttyUSB0 or serial:/dev/ttyUSB0@115200"
        )
    return port, int(baud) if baud else BAUD
