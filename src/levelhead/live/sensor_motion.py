"""Rate and specific force of a live sensor without the errors that are known of it, with 1σ, for ``Orientation``."""

import math

from levelhead.calibration import Calibration
from levelhead.engine.prior import Warmth
from levelhead.engine.stream import Stream
from levelhead.kernels import correction
from levelhead.kernels.correction import SensorErrors
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.vec3 import ZERO, Vec3, sub
from levelhead.motion import SECOND_DIFFERENCE
from levelhead.sample import Triple

ENOUGH = 50  # second differences at rest, from which their RMS is within a tenth of the noise
NOTHING = (math.nan, math.nan, math.nan)


class RestNoise:
    """1σ of the white noise of three axes: the RMS of second differences at rest over √6, as ``motion.white_noise``."""

    def __init__(self) -> None:
        self._sums, self._count = (0.0, 0.0, 0.0), 0
        self._before: list[Triple] = []

    def add(self, values: Triple, rests: bool) -> None:
        """The readings of a sample."""
        if not rests or not math.isfinite(sum(values)):
            self._before.clear()
            return
        if len(self._before) == 2:
            (a, b, c), (x, y, z) = self._before
            u, v, w = values
            s, t, r = self._sums
            self._sums = s + (a - 2.0 * x + u) ** 2, t + (b - 2.0 * y + v) ** 2, r + (c - 2.0 * z + w) ** 2
            self._count += 1
            self._before.pop(0)
        self._before.append(values)

    @property
    def variance(self) -> Triple:
        """σ²; NaN before there was enough rest."""
        if self._count < ENOUGH:
            return NOTHING
        x, y, z = (total / (self._count * SECOND_DIFFERENCE**2) for total in self._sums)
        return x, y, z


class SensorMotion:
    """Rate and specific force of each sample, as ``Track.angular_rate`` and ``Track.specific_force`` have them.

    Args:
        stream: the filter; its calibration is taken at ``refresh``.
        known: errors of the sensor that the stream corrects, or its prior.
    """

    def __init__(self, stream: Stream, known: Calibration | None) -> None:
        self._stream = stream
        self._warmth = None if known is None or not known.temperature else Warmth(known.temperature)
        self._noise = RestNoise(), RestNoise()
        zero = Mat3(*(0.0,) * 9)
        self._errors = SensorErrors(zero, ZERO, zero, ZERO, zero, ZERO, 0.0)
        self._doubt = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)  # variances of the biases of gyroscope and accelerometer
        if known is not None:
            self._use(known)
        self.refresh()

    def _use(self, found: Calibration) -> None:
        self._errors = found.errors
        gyr, acc = ((part.sigma**2).tolist() for part in (found.gyr_bias, found.acc_bias))
        self._doubt = tuple(gyr), tuple(acc)

    def refresh(self) -> None:
        """Takes the filter's present calibration; its bias of the gyroscope comes with each sample."""
        found = self._stream.calibration
        if found is not None:
            self._use(found)
            self._errors = self._errors._replace(gyr_bias=ZERO)

    def set_temperature(self, temperature: float) -> None:
        """The temperature of the samples that follow, °C."""
        if self._warmth is not None:
            self._warmth.set(temperature)

    def measure(self, gyr: Triple, acc: Triple, bias: Triple, rests: bool) -> tuple[Triple, Triple, Triple, Triple]:
        """Rate in rad/s and its 1σ, specific force in m/s² and its 1σ; NaN where they are not known.

        Args:
            gyr: as the filter was given it, rad/s.
            acc: likewise, m/s².
            bias: that the filter estimates, rad/s.
            rests: whether the guard finds the sensor at rest.
        """
        if self._warmth is not None:
            gyr, acc = self._warmth.less("gyr", gyr), self._warmth.less("acc", acc)
        for noise, values in zip(self._noise, (gyr, acc), strict=True):
            noise.add(values, rests)
        rate = sub(correction.true_rate(self._errors, Vec3(*gyr)), Vec3(*bias))
        there = not correction.is_absent(Vec3(*acc))
        force = correction.true_force(self._errors, Vec3(*acc)) if there else NOTHING
        sigma_rate, sigma_force = (
            (math.sqrt(x + a), math.sqrt(y + b), math.sqrt(z + c))
            for (x, y, z), (a, b, c) in zip((one.variance for one in self._noise), self._doubt, strict=True)
        )
        (p, q, r), (u, v, w) = rate, force
        return (p, q, r), sigma_rate, (u, v, w), sigma_force
