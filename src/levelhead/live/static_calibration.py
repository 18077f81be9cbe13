"""The gyroscope's bias, measured at the start while the sensor is at rest; refused if it moves."""

import math
from math import hypot, sqrt

from levelhead.sample import Triple
from levelhead.units import GRAVITY

SAMPLES = 500
ATTEMPTS = 6  # times as many samples as are needed, at most
BLOCK = 10  # samples that are averaged before they are compared, so that noise is not taken for motion
MAX_RATE_CHANGE = 0.02  # rad/s (1.1 °/s), of a block off the mean of those before
MAX_FORCE_CHANGE = 0.3  # m/s², the same
MAX_BIAS = 0.44  # rad/s (25 °/s): no gyroscope is that far off at rest; an MPU-6050 is allowed 20 °/s
MAX_G_ERROR = 1.0  # m/s²
SIGMA = math.radians(0.1)  # rad/s, 1σ of the remaining bias: noise of the mean, slow rotation, warming
ZERO = (0.0, 0.0, 0.0)


class VectorMean:
    """A running mean of vectors."""

    def __init__(self) -> None:
        self.count, self._sum = 0, [0.0, 0.0, 0.0]

    def add(self, v: Triple) -> None:
        """One more."""
        self.count += 1
        for axis in range(3):
            self._sum[axis] += v[axis]

    @property
    def value(self) -> Triple:
        """The mean so far."""
        x, y, z = (part / self.count for part in self._sum)
        return x, y, z


def distance(a: Triple, b: Triple) -> float:
    """The length of a − b."""
    return sqrt(sum((x - y) ** 2 for x, y in zip(a, b, strict=True)))


class StaticCalibration:
    """Averages samples at rest until the bias is known.

    Args:
        samples: samples at rest that are needed.

    Attributes:
        taken: samples so far.
    """

    def __init__(self, samples: int = SAMPLES) -> None:
        self.samples, self.taken = samples, 0
        self._begin()

    def _begin(self) -> None:
        self._gyr, self._acc = VectorMean(), VectorMean()
        self._block_gyr, self._block_acc = VectorMean(), VectorMean()

    @property
    def done(self) -> bool:
        """Whether there were enough samples at rest."""
        return self._gyr.count >= self.samples

    @property
    def failed(self) -> bool:
        """Whether there were too many samples without enough of them at rest."""
        return self.taken > ATTEMPTS * self.samples and not self.done

    @property
    def bias(self) -> Triple:
        """The mean rate at rest, rad/s."""
        return self._gyr.value

    def add(self, gyr: Triple, acc: Triple) -> str:
        """Takes one sample.

        Returns:
            Why the sensor is not at rest; "" while it may be.
        """
        self.taken += 1
        if not abs(sum(gyr) + sum(acc)) < 1e9:
            return ""  # a missing reading
        self._block_gyr.add(gyr)
        self._block_acc.add(acc)
        if self._block_gyr.count < BLOCK:
            return ""
        why = self._motion(self._block_gyr.value, self._block_acc.value)
        if why:
            self._begin()
            return why
        for _ in range(BLOCK):
            self._gyr.add(self._block_gyr.value)
            self._acc.add(self._block_acc.value)
        self._block_gyr, self._block_acc = VectorMean(), VectorMean()
        return ""

    def _motion(self, gyr: Triple, acc: Triple) -> str:
        if self._gyr.count:
            rate_change, force_change = distance(gyr, self._gyr.value), distance(acc, self._acc.value)
            if rate_change > MAX_RATE_CHANGE or force_change > MAX_FORCE_CHANGE:
                return (
                    f"the sensor moves: its rate changed by {rate_change:.3f} rad/s, its specific force by "
                    f"{force_change:.2f} m/s²"
                )
        if distance(gyr, ZERO) > MAX_BIAS:
            return f"the sensor turns at {distance(gyr, ZERO):.2f} rad/s, which is more than a bias can be"
        length = hypot(*acc)
        if abs(length - GRAVITY) > MAX_G_ERROR:
            return f"the specific force is {length:.2f} m/s² and not g: the sensor accelerates, or its scale is wrong"
        return ""
