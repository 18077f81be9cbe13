"""A microcontroller on a serial line that prints its samples as text."""

import time
from collections.abc import Callable

from levelhead.errors import LevelheadError
from levelhead.open_types import Handle
from levelhead.sample import Sample
from levelhead.sources.devices.line_parser import LONGEST, Lines
from levelhead.sources.hints import Hints
from levelhead.sources.sensors.bus import SensorError
from levelhead.sources.sensors.sample_clock import SampleClock
from levelhead.sources.sentences import sentence

BAUD = 115_200
CHUNK = 65_536
RATE_FACTOR = 50.0  # the rate is the node's, and the device may have another one
BACKWARDS = 10  # samples in a row whose stamps are before the last good one: the device began anew
WRAPS = (2**32 * 1e-6, 2**32 * 1e-3)  # s after which micros() and millis() of 32 bits begin anew
NEAR_WRAP = 1.0  # s


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
        self._lines = Lines(self.name, Hints(self._hints.map, self._hints.scale))
        self._clock_fit = SampleClock(self.rate, RATE_FACTOR) if self.rate else None
        self._line: Handle = None
        self._rest = b""
        self._last: float | None = None  # stamp of the last sample, s
        self._shift = 0.0  # s added to the device's stamps, because it began anew
        self._behind = 0
        self._reported = 0  # lines of garbage that were reported
        self._troubles: list[tuple[str, str]] = []

    @property
    def garbage(self) -> int:
        """Lines so far that were no line of numbers."""
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
            words = getattr(error, "strerror", None) or str(error)
            raise SensorError(
                "unplugged", f"cannot open {self.port}: {words}; is it plugged in, and are you in its group (dialout)?"
            ) from None
        self._rest = b""

    def restart(self) -> None:
        """Opens the port again."""
        self.close()
        self.start()

    def poll(self) -> list[Sample]:
        """What came since the last time.

        Raises:
            SensorError: the device is gone.
            LevelheadError: what it says has no gyroscope, no accelerometer, or units that cannot be told.
        """
        data = self._read()
        if not data:
            return []
        at = self._clock()
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > LONGEST:
            self._rest = b""
            self._lines.garbage += 1
        samples: list[Sample] = []
        for line in lines:
            samples += self._lines.take(line, at)
        self._report_garbage()
        if words := self._lines.lacking(at):
            self._troubles.append(("unnamed", words))
        return self._in_order(samples)

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
            stamps = self._clock_fit.stamps(len(samples), samples[-1].t)
            return [sample._replace(t=t) for sample, t in zip(samples, stamps, strict=True)]
        kept = []
        for sample in samples:
            t = sample.t + self._shift
            if self._last is not None and t <= self._last:
                t = self._backwards(sample.t, self._last)
                if t <= self._last:
                    continue
            self._behind = 0
            self._last = t
            kept.append(sample._replace(t=t))
        return kept

    def _backwards(self, stamp: float, last: float) -> float:
        """A stamp that is not after the last one, put right if its reason is known; else the stamp that it has."""
        if not self._lines.stamped:  # several lines in one read came at the same host time
            return last + 1e-6
        for wrap in WRAPS:
            if abs(last - self._shift - wrap) < NEAR_WRAP and 0.0 <= stamp < NEAR_WRAP:
                self._shift += wrap
                return stamp + self._shift
        self._behind += 1
        if self._behind == 1:
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
        LevelheadError: no port, or a speed that is no number.
    """
    port, _, baud = text.partition("@")
    if not port or (baud and not baud.isdecimal()):
        raise LevelheadError(
            f"'{text}' is no serial line; expected such as serial:/dev/ttyUSB0 or serial:/dev/ttyUSB0@115200"
        )
    return port, int(baud) if baud else BAUD
