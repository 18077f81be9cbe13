"""The gyroscope's bias, read off at the start while the sensor is still; refused if it moves."""

from math import hypot, sqrt

from levelhead.kernels.tilt import GRAVITY
from levelhead.sample import Triple

TICKS = 500
PATIENCE = 6  # times as many samples as are needed
BLOCK = 10  # samples that are averaged before they are judged, so that noise is not taken for motion
GYR = 0.02  # rad/s (1.1 °/s), of a block off the mean of those before
ACC = 0.3  # m/s², the same
BIAS = 0.44  # rad/s (25 °/s): no gyroscope is that far off at rest; an MPU-6050 is allowed 20 °/s
OFF_G = 1.0  # m/s²
LEFT = 0.1  # °/s: 1σ of what is left of the bias: noise of the mean, slow turning that was taken for bias, warming
ZERO = (0.0, 0.0, 0.0)


class Mean:
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


def apart(a: Triple, b: Triple) -> float:
    """The length of a − b."""
    return sqrt(sum((x - y) ** 2 for x, y in zip(a, b, strict=True)))


class StillCalibration:
    """Takes samples until it knows the bias, or that the sensor moves.

    Args:
        ticks: still samples that are needed.

    Attributes:
        refusals: how often it began anew.
        taken: samples so far.
    """

    def __init__(self, ticks: int = TICKS) -> None:
        self.ticks, self.refusals, self.taken = ticks, 0, 0
        self._begin()

    def _begin(self) -> None:
        self._gyr, self._acc = Mean(), Mean()
        self._block_gyr, self._block_acc = Mean(), Mean()

    @property
    def done(self) -> bool:
        """Whether there were enough still samples."""
        return self._gyr.count >= self.ticks

    @property
    def hopeless(self) -> bool:
        """Whether it had more than enough samples."""
        return self.taken > PATIENCE * self.ticks and not self.done

    @property
    def bias(self) -> Triple:
        """The mean rate at rest, rad/s."""
        return self._gyr.value

    def take(self, gyr: Triple, acc: Triple) -> str:
        """One sample; the answer is why the sensor is not still, or "" while it may be."""
        self.taken += 1
        if not abs(sum(gyr) + sum(acc)) < 1e9:
            return ""  # a missing reading says nothing
        self._block_gyr.add(gyr)
        self._block_acc.add(acc)
        if self._block_gyr.count < BLOCK:
            return ""
        why = self._judged(self._block_gyr.value, self._block_acc.value)
        if why:
            self.refusals += 1
            self._begin()
            return why
        for _ in range(BLOCK):
            self._gyr.add(self._block_gyr.value)
            self._acc.add(self._block_acc.value)
        self._block_gyr, self._block_acc = Mean(), Mean()
        return ""

    def _judged(self, gyr: Triple, acc: Triple) -> str:
        if self._gyr.count:
            turned, pushed = apart(gyr, self._gyr.value), apart(acc, self._acc.value)
            if turned > GYR or pushed > ACC:
                return (
                    f"the sensor moves: its rate changed by {turned:.3f} rad/s, its specific force by {pushed:.2f} m/s²"
                )
        if apart(gyr, ZERO) > BIAS:
            return f"the sensor turns at {apart(gyr, ZERO):.2f} rad/s, which is no bias"
        length = hypot(*acc)
        if abs(length - GRAVITY) > OFF_G:
            return f"the specific force is {length:.2f} m/s² and not g: the sensor accelerates, or is badly off"
        return ""
