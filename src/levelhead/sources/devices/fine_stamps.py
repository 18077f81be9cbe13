"""Stamps of a device whose clock steps more slowly than it samples, such as ``millis()`` at 900 Hz."""

import math

from levelhead.sources.sensors.sample_clock import SampleClock

REPEATS = 3  # samples with the stamp of the one before, after which the clock counts as coarse
PAUSE = 20.0  # periods, and steps of the clock, without a sample: the device paused


class FineStamps:
    """Places samples of a coarse clock evenly between its steps, once stamps repeat.

    The samples of a device are even, its stamps are rounded down: a line through (number of the sample, stamp) is the
    finer clock (``SampleClock``).
    """

    def __init__(self) -> None:
        self._count = self._repeats = 0
        self._first = self._last = math.nan  # s, stamps of the device
        self._step = math.inf  # s, the smallest step of its clock so far
        self._clock: SampleClock | None = None

    def place(self, stamp: float, after: float) -> float:
        """The time (s) of a sample with this stamp, which is later than ``after`` where the clock is coarse."""
        self._count += 1
        step = stamp - self._last
        if step > 0.0:
            self._step = min(self._step, step)
        elif step == 0.0:
            self._repeats += 1
        else:
            self._first = stamp
            self._count = 1
        self._last = stamp
        if self._clock is None:
            if self._repeats < REPEATS or not stamp > self._first:
                return stamp
            self._clock = SampleClock((self._count - 1) / (stamp - self._first))
            self._clock.last = after
        elif step > PAUSE * max(self._clock.period, self._step):
            self._clock.restart()
        return self._clock.stamps(1, stamp + self._step)[0]
