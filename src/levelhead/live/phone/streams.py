"""Samples from sensors that are read each at times of its own."""

import math
from collections import deque
from typing import Literal, NamedTuple

from levelhead.sample import Sample, Triple

Sensor = Literal["gyr", "acc", "mag", "pressure"]
WAITING = 2000  # readings of a sensor that may wait for the other one


class SensorReading(NamedTuple):
    """One reading of one sensor.

    Attributes:
        sensor: which one.
        t: s on the phone's clock.
        values: rad/s, m/s² or µT along the phone's axes; Pa for pressure.
    """

    sensor: Sensor
    t: float
    values: tuple[float, ...]


class SensorStreams:
    """Joins readings into samples at the gyroscope's times; the specific force is interpolated between its neighbours.

    Attributes:
        unusable: readings so far that were not finite or came out of order.
    """

    def __init__(self) -> None:
        self._gyr: deque[SensorReading] = deque(maxlen=WAITING)
        self._acc: deque[SensorReading] = deque(maxlen=WAITING)
        self._slow: dict[str, deque[SensorReading]] = {"mag": deque(maxlen=WAITING), "pressure": deque(maxlen=WAITING)}
        self._newest: dict[str, float] = {}
        self.unusable = 0

    def add(self, reading: SensorReading) -> None:
        """Takes a reading."""
        finite = math.isfinite(reading.t) and all(math.isfinite(value) for value in reading.values)
        if not finite or reading.t <= self._newest.get(reading.sensor, -math.inf):
            self.unusable += 1
            return
        self._newest[reading.sensor] = reading.t
        queue = {"gyr": self._gyr, "acc": self._acc}.get(reading.sensor)
        (self._slow[reading.sensor] if queue is None else queue).append(reading)

    def take(self) -> list[Sample]:
        """The samples whose time the accelerometer has reached, the oldest first."""
        samples: list[Sample] = []
        while self._gyr and self._acc and self._acc[-1].t >= self._gyr[0].t:
            t, gyr = self._gyr[0].t, self._gyr.popleft().values
            while len(self._acc) > 1 and self._acc[1].t <= t:
                self._acc.popleft()
            if self._acc[0].t > t:  # before the first force
                continue
            mag, pressure = self._newest_until("mag", t), self._newest_until("pressure", t)
            samples.append(
                Sample(
                    t, (gyr[0], gyr[1], gyr[2]), self._force(t), None if mag is None else (mag[0], mag[1], mag[2]),
                    None if pressure is None else pressure[0],
                )
            )  # fmt: skip
        return samples

    def _force(self, t: float) -> Triple:
        before = self._acc[0]
        after = self._acc[1] if len(self._acc) > 1 else before
        share = 0.0 if after.t == before.t else (t - before.t) / (after.t - before.t)
        x, y, z = (a + share * (b - a) for a, b in zip(before.values, after.values, strict=True))
        return x, y, z

    def _newest_until(self, sensor: str, t: float) -> tuple[float, ...] | None:
        found = None
        queue = self._slow[sensor]
        while queue and queue[0].t <= t:
            found = queue.popleft().values
        return found
