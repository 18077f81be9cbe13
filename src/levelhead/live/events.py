"""The names of everything that can happen to a node, and a journal that reports each state once."""

from collections.abc import Callable
from typing import Any, NamedTuple

from levelhead.open_types import JsonObject

EVENTS = {
    "started": "the node runs; data: source, rate, filter, parameters, guard, version, rights that the system denies",
    "calibrating": "the node waits for a sensor at rest, and publishes no orientation yet",
    "calibrated": "the gyroscope's bias was measured at the start and is subtracted; data: bias in rad/s",
    "calibration_refused": "the sensor moved during the calibration, which begins again",
    "parameters": "parameters were changed; data: all of them, and the first sample that they hold for",
    "heading": "the yaw was set; data: heading in degrees, and the first sample that it holds for",
    "not_set": "a request for parameters that do not exist or are out of range; nothing was changed",
    "stance": "the foot stands; data: t in s, position and its sigma in m along east, north and up",
    "unbounded": "the foot has not stood for seconds: position drifts",
    "acceleration": "the length of the specific force is more than 2 m/s² from g",
    "mag_disturbed": "the magnetic field is not the earth's: the magnetometer is not used",
    "turn_missed": "the velocity from a wrong tilt shows a turn that was not measured",
    "gyr_clipped": "the gyroscope is at its full scale",
    "acc_clipped": "the accelerometer is at its full scale",
    "gyr_spike": "a single rate was far from those around it, and was not used",
    "axis_stuck": "an axis of gyroscope or accelerometer repeats one value",
    "stuck": "the sensor repeats one whole sample",
    "missing": "a sample came without gyroscope or accelerometer",
    "samples_lost": "samples were lost before the node could read them",
    "silent": "the source gives no samples",
    "bus_error": "the chip does not answer on the bus",
    "bus_stuck": "a line of the bus is held down",
    "wrong_chip": "another chip answers at the address",
    "implausible": "the chip gives nothing but zeros or ones",
    "phone": "a phone began to send; data of others is refused",
    "unplugged": "the serial port is gone",
    "assumed": "units that the source does not state were concluded from its numbers",
    "unnamed": "lines come, but their columns and units are not known yet",
    "garbage": "lines of the serial port were not numbers",
    "time_backwards": "the source's time went back; the samples were dropped",
    "refused": "the filter refused a sample",
    "invalid": "safe state: the last orientation was marked invalid, and none follows until samples do",
    "late": "ticks were missed, because the machine was busy; they were skipped",
    "over_budget": "a tick took longer than its budget",
    "subscriber_slow": "a subscriber does not keep up and misses messages",
    "recording": "a black box is written; data: path",
    "box_failed": "the black box cannot be written any more; the node goes on without it",
    "second_node": "another node publishes on the same topic",
    "foreign_message": "messages on the node's topics that no node sent",
    "ended": "the recording that was replayed is over",
    "stopped": "the node ends; data: the figures of the run",
}
EXPECTED = frozenset(  # no warnings
    {
        "started",
        "config",
        "calibrating",
        "calibrated",
        "parameters",
        "heading",
        "phone",
        "recording",
        "stance",
        "ended",
        "stopped",
    }
)
REPEAT = 1.0  # s between two notes of the same name


class Event(NamedTuple):
    """An event before it is a message."""

    name: str
    on: bool
    text: str
    data: JsonObject


class Journal:
    """Reports when states begin and end, and single events at most once per second and name.

    Args:
        report: takes an Event.
        clock: host time in s.

    Attributes:
        active: the states that hold now, name → sentence.
        counts: how often each event happened, reported or not.
    """

    def __init__(self, report: Callable[[Event], None], clock: Callable[[], float]) -> None:
        self._report, self._clock = report, clock
        self.active: dict[str, str] = {}
        self.counts: dict[str, int] = {}
        self._last_report: dict[str, float] = {}
        self._unreported: dict[str, int] = {}

    def begin(self, name: str, text: str, **data: Any) -> None:
        """A state begins; reported unless it holds already."""
        if name not in self.active:
            self.active[name] = text
            self.counts[name] = self.counts.get(name, 0) + 1
            self._report(Event(name, True, text, data))

    def end(self, name: str) -> None:
        """A state ends; reported if it held."""
        if self.active.pop(name, None) is not None:
            self._report(Event(name, False, f"{EVENTS[name]}: over", {}))

    def note(self, name: str, text: str, **data: Any) -> None:
        """A single event."""
        self.counts[name] = self.counts.get(name, 0) + 1
        now = self._clock()
        if now - self._last_report.get(name, -REPEAT) < REPEAT:
            self._unreported[name] = self._unreported.get(name, 0) + 1
            return
        self._last_report[name] = now
        more = self._unreported.pop(name, 0)
        self._report(Event(name, True, f"{text} (and {more} more before)" if more else text, data))

    def tell(self, name: str, text: str, **data: Any) -> None:
        """A single event, reported each time."""
        self.counts[name] = self.counts.get(name, 0) + 1
        self._report(Event(name, True, text, data))
