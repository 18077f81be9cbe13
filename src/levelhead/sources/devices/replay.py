"""A recording as a live source: at real speed, at a multiple of it, or as fast as it goes."""

import math
import time
from collections.abc import Callable

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Recording
from levelhead.sample import Sample

AT_ONCE = 64  # samples that a poll gives when there is no clock to wait for


class Replay:
    """Samples of a recording, as they would have come.

    Args:
        recording: the recording; NaN stays NaN, a magnetometer row with NaN in it is nothing new.
        speed: 1: as it was; 2: twice as fast; inf: as fast as it is asked for.
        clock: host time in s.

    Raises:
        LevelheadError: the speed is not greater than 0.
    """

    gyr_range = acc_range = 0.0

    def __init__(self, recording: Recording, speed: float = 1.0, clock: Callable[[], float] = time.monotonic) -> None:
        if not speed > 0.0:
            raise LevelheadError(f"the speed is {speed:g}; expected 1 for real time, a multiple of it, or inf")
        self.name, self.rate, self.speed = (
            f"replay of {recording.meta.get('source', 'a recording')}",
            recording.rate,
            speed,
        )
        self._clock, self._recording = clock, recording
        self._t = recording.t.tolist()
        self._gyr, self._acc = ([tuple(row) for row in values.tolist()] for values in (recording.gyr, recording.acc))
        self._mag: list[tuple[float, float, float] | None] = [None] * len(recording)
        if recording.mag is not None:
            new = np.asarray(np.isfinite(recording.mag).all(axis=1))
            self._mag = [tuple(row) if good else None for row, good in zip(recording.mag.tolist(), new, strict=True)]
        self._warmth: list[float | None] = [None] * len(recording)
        if recording.temperature is not None:
            self._warmth = [None if math.isnan(one) else one for one in recording.temperature.tolist()]
        self._next, self._began = 0, clock()

    @property
    def ended(self) -> bool:
        """Whether the last sample was given."""
        return self._next == len(self._t)

    def start(self) -> None:
        """From here the clock runs."""
        self._began = self._clock()

    def restart(self) -> None:
        """There is nothing that could have failed."""

    def poll(self) -> list[Sample]:
        """The samples that are due."""
        last = min(self._next + AT_ONCE, len(self._t))
        if math.isfinite(self.speed):
            due = self._t[0] + (self._clock() - self._began) * self.speed
            last = self._next
            while last < len(self._t) and self._t[last] <= due:
                last += 1
        rows = range(self._next, last)
        self._next = last
        return [Sample(self._t[i], self._gyr[i], self._acc[i], self._mag[i], temperature=self._warmth[i]) for i in rows]

    def troubles(self) -> list[tuple[str, str]]:
        """None."""
        return []

    def close(self) -> None:
        """Nothing is held."""
