"""Stamps for the samples of a FIFO: a line through (number of the sample, time at which it was first seen)."""

from math import exp

MEMORY = 20.0  # s after which an observation counts 1/e
PRIOR = 20.0  # samples: how long it takes the line to leave the nominal rate
PRIOR_WEIGHT = PRIOR**3


class SampleClock:
    """The clock of a chip as the host sees it.

    A chip takes a sample every b seconds of its own clock, which is off by a percent or so; the host sees how many
    there are whenever it reads. The newest one is then between 0 and b old, so a least-squares line through (number of
    the newest sample, time of the reading) lies half a period late; its slope is b. Old readings fade.

    Args:
        rate: nominal samples a second.
        rate_factor: the true rate is within this factor of it.
    """

    def __init__(self, rate: float, rate_factor: float = 2.0) -> None:
        self._rate_factor = rate_factor
        self.period = 1.0 / rate
        self.last = -float("inf")  # stamp of the last sample
        self._begin()

    def _begin(self) -> None:
        self._nominal = self.period  # the slope's prior while there are few readings
        self._weight = self._x = self._y = self._xx = self._xy = 0.0
        self._seen = 0.0  # the sums are about the last observation, so that nothing grows

    def restart(self) -> None:
        """Samples were lost, an unknown number: the line restarts, with the slope that it has."""
        self._begin()

    def stamps(self, count: int, now: float) -> list[float]:
        """The stamps (s) of the ``count`` samples that the reading at host time ``now`` (s) found.

        They increase strictly and are never later than ``now``.
        """
        if count <= 0:
            return []
        self._observe(count, now)
        period, last = self.period, self.last
        newest = now + (self._y - period * self._x) / self._weight - 0.5 * period
        found = []
        for back in range(count - 1, -1, -1):
            stamp, latest = newest - back * period, now - back * 1e-6
            stamp = min(stamp, latest)
            if stamp <= last:
                stamp = last + 1e-6
            found.append(stamp)
            last = stamp
        self.last = last
        return found

    def _observe(self, count: int, now: float) -> None:
        """One more point; the origin of the sums moves to it."""
        if self._weight > 0.0:
            dx, dy = float(count), now - self._seen
            fade = exp(-dy / MEMORY) if dy > 0.0 else 1.0
            w, x, y = self._weight, self._x, self._y
            self._xx = fade * (self._xx - 2.0 * dx * x + dx * dx * w)
            self._xy = fade * (self._xy - dy * x - dx * y + dx * dy * w)
            self._x, self._y, self._weight = fade * (x - dx * w), fade * (y - dy * w), fade * w
        self._weight += 1.0
        self._seen = now
        xx = self._xx - self._x * self._x / self._weight
        xy = self._xy - self._x * self._y / self._weight
        slope = (xy + PRIOR_WEIGHT * self._nominal) / (xx + PRIOR_WEIGHT)
        if self._nominal < self._rate_factor * slope < self._rate_factor**2 * self._nominal:
            self.period = slope
