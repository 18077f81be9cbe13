"""The names of everything that can happen to a node, and a journal that says each thing once, not two hundred times."""

from collections.abc import Callable
from typing import Any, NamedTuple

EVENTS = {
    "started": "the node runs; data: source, rate, filter, parameters, guard, version, what could not be had",
    "calibrating": "the node waits for a still sensor, and publishes no orientation yet",
    "calibrated": "the gyroscope's bias was read off at the start and is taken off; data: bias in rad/s",
    "calibration_refused": "the sensor moved while the bias was to be read off; it is tried again",
    "parameters": "parameters were changed; data: all of them, and the first sample that they hold for",
    "not_set": "parameters that somebody asked for do not exist, or not with that value; nothing was changed",
    "acceleration": "the length of the specific force is more than 2 m/s² from g",
    "mag_disturbed": "the magnetometer sees another field than the earth's and is not used",
    "gyr_clipped": "the gyroscope is at its full scale",
    "acc_clipped": "the accelerometer is at its full scale",
    "axis_stuck": "an axis of gyroscope or accelerometer repeats one value",
    "stuck": "the sensor repeats one whole sample",
    "missing": "a sample came without gyroscope or accelerometer",
    "samples_lost": "samples were lost before the node could read them",
    "silent": "the source gives nothing",
    "bus_error": "the chip does not answer on the bus",
    "bus_stuck": "a line of the bus is held down",
    "wrong_chip": "another chip answers at the address",
    "implausible": "the chip gives nothing but zeros or ones",
    "unplugged": "the serial port is gone",
    "garbage": "what came on the serial line were no numbers",
    "time_backwards": "the source's time went back; the samples were dropped",
    "refused": "the filter could not take a sample",
    "invalid": "safe state: the last orientation was marked invalid, and none follows until samples do",
    "late": "ticks were missed, because the machine was busy; they were skipped",
    "over_budget": "a tick took longer than its budget",
    "subscriber_slow": "a subscriber does not keep up and misses messages",
    "box_failed": "the black box cannot be written any more; the node goes on without it",
    "second_node": "another node publishes on the same topic",
    "ended": "the recording that was replayed is over",
    "stopped": "the node ends; data: the figures of the run",
}
REPEAT = 1.0  # s between two notes of the same name


class Happening(NamedTuple):
    """An event before it is a message."""

    name: str
    on: bool
    text: str
    data: dict[str, Any]


class Journal:
    """Tells beginnings and ends of states, and notes of single happenings at most once a second each.

    Args:
        tell: takes a Happening.
        clock: host time in s.

    Attributes:
        active: the states that hold now, name → sentence.
        counts: how often each name happened, told or not.
    """

    def __init__(self, tell: Callable[[Happening], None], clock: Callable[[], float]) -> None:
        self._tell, self._clock = tell, clock
        self.active: dict[str, str] = {}
        self.counts: dict[str, int] = {}
        self._noted: dict[str, float] = {}
        self._unsaid: dict[str, int] = {}

    def begin(self, name: str, text: str, **data: Any) -> None:
        """A state holds from now on; told when it begins."""
        if name not in self.active:
            self.active[name] = text
            self.counts[name] = self.counts.get(name, 0) + 1
            self._tell(Happening(name, True, text, data))

    def end(self, name: str) -> None:
        """A state holds no more; told if it did."""
        if self.active.pop(name, None) is not None:
            self._tell(Happening(name, False, f"{EVENTS[name]}: over", {}))

    def note(self, name: str, text: str, **data: Any) -> None:
        """Something happened once."""
        self.counts[name] = self.counts.get(name, 0) + 1
        now = self._clock()
        if now - self._noted.get(name, -REPEAT) < REPEAT:
            self._unsaid[name] = self._unsaid.get(name, 0) + 1
            return
        self._noted[name] = now
        more = self._unsaid.pop(name, 0)
        self._tell(Happening(name, True, f"{text} (and {more} more before)" if more else text, data))
