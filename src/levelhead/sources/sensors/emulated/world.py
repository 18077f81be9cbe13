"""What emulated chips feel: a recording, played over and over by a clock."""

import time
from collections.abc import Callable
from typing import NamedTuple

from levelhead.recording import Recording
from levelhead.sources.sample import Triple

STANDARD_PRESSURE = 101325.0  # Pa


class Moment(NamedTuple):
    """Rate (rad/s), specific force (m/s²) and field (µT) at one instant, in the sensor's frame."""

    gyr: Triple
    acc: Triple
    mag: Triple


class World:
    """A recording as something that goes on for ever.

    Args:
        recording: without missing rows; played from the start again when it ends.
        clock: host time in s.
        pressure: Pa, the same for ever.
        temperature: °C, the same for ever.
    """

    def __init__(
        self, recording: Recording, clock: Callable[[], float] = time.monotonic,
        pressure: float = STANDARD_PRESSURE, temperature: float = 25.0,
    ) -> None:  # fmt: skip
        self.clock, self.pressure, self.temperature = clock, pressure, temperature
        self._rate, self._n = recording.rate, len(recording)
        none = [(0.0, 0.0, 0.0)] * self._n
        self._gyr = [tuple(row) for row in recording.gyr.tolist()]
        self._acc = [tuple(row) for row in recording.acc.tolist()]
        self._mag = none if recording.mag is None else [tuple(row) for row in recording.mag.tolist()]
        self.began = clock()

    def at(self, seconds: float) -> Moment:
        """What is felt ``seconds`` after the beginning."""
        row = int(seconds * self._rate + 1e-6) % self._n
        return Moment(self._gyr[row], self._acc[row], self._mag[row])
