"""What a sample says about the sensor's health, besides what the filter says."""

from math import sqrt

from levelhead.filters.health import (
    ACC_MISSING,
    ACC_SATURATED,
    ACC_STUCK,
    GYR_MISSING,
    GYR_SATURATED,
    GYR_STUCK,
    MAG_REJECTED,
)
from levelhead.kernels.tilt import GRAVITY
from levelhead.live.events import Journal
from levelhead.sample import Sample

OFF_G = 2.0  # m/s²
SAME_SECONDS, SAME_SAMPLES = 0.5, 20  # of one whole sample again and again
HOLD = 0.5  # s without a cause before a warning ends
WARNINGS = {
    "acceleration": "the specific force is {:.1f} m/s², more than 2 m/s² from g: tilt relies on the gyroscope",
    "gyr_clipped": "the gyroscope is at its full scale: it turned faster than it can say",
    "acc_clipped": "the accelerometer is at its full scale",
    "axis_stuck": "an axis repeats one value",
    "stuck": "the sensor repeats one whole sample: it is frozen",
    "mag_disturbed": "the magnetic field is not the earth's: the magnetometer is not used",
    "missing": "samples come without gyroscope or accelerometer",
}
BITS = (
    (GYR_SATURATED, "gyr_clipped"),
    (ACC_SATURATED, "acc_clipped"),
    (GYR_STUCK | ACC_STUCK, "axis_stuck"),
    (MAG_REJECTED, "mag_disturbed"),
    (GYR_MISSING | ACC_MISSING, "missing"),
)
ALL_BITS = sum(bits for bits, _ in BITS)


class Watch:
    """Looks at every sample and keeps the journal's warnings up to date."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._last: Sample | None = None
        self._same = 0
        self._since = 0.0
        self._until: dict[str, float] = {}  # warning → when it ends unless its cause comes back

    def look(self, sample: Sample, health: int) -> None:
        """One sample, and the filter's health bits for it."""
        x, y, z = sample.acc
        norm = sqrt(x * x + y * y + z * z)
        if norm - GRAVITY > OFF_G or GRAVITY - norm > OFF_G:
            self._warn("acceleration", sample.t, norm)
        if health & ALL_BITS:
            for bits, name in BITS:
                if health & bits:
                    self._warn(name, sample.t)
        last, self._last = self._last, sample
        if last is not None and last.gyr == sample.gyr and last.acc == sample.acc:
            self._same += 1
            if self._same >= SAME_SAMPLES and sample.t - self._since >= SAME_SECONDS:
                self._warn("stuck", sample.t)
        else:
            self._same, self._since = 0, sample.t
        if self._until:
            self._end(sample.t)

    def _warn(self, name: str, t: float, value: float = 0.0) -> None:
        self._until[name] = t + HOLD
        self._journal.begin(name, WARNINGS[name].format(value))

    def _end(self, t: float) -> None:
        for name in [name for name, end in self._until.items() if t > end]:
            del self._until[name]
            self._journal.end(name)
