"""Warnings that follow from each sample and from the filter's health bits."""

from math import sqrt

from levelhead.filters.health import (
    ACC_MISSING,
    ACC_SATURATED,
    ACC_STUCK,
    GYR_MISSING,
    GYR_SATURATED,
    GYR_SPIKE,
    GYR_STUCK,
    MAG_REJECTED,
    TURN_MISSED,
)
from levelhead.live.events import Journal
from levelhead.sample import Sample
from levelhead.units import GRAVITY

MAX_G_ERROR = 2.0  # m/s²
FROZEN_TIME, FROZEN_SAMPLES = 0.5, 20  # s, and samples, without any change
WARNING_TIME = 0.5  # s without a cause before a warning ends
WARNINGS = {
    "acceleration": "the specific force is {:.1f} m/s², more than 2 m/s² from g: tilt relies on the gyroscope",
    "gyr_clipped": "the gyroscope is at its full scale: it turned faster than it can measure",
    "acc_clipped": "the accelerometer is at its full scale",
    "axis_stuck": "an axis repeats one value",
    "stuck": "the sensor repeats one whole sample: it is frozen",
    "mag_disturbed": "the magnetic field is not the earth's: the magnetometer is not used",
    "turn_missed": "a turn was not measured: the tilt is wrong by about its σ, and is being corrected",
    "gyr_spike": "single rates are far from those around them, and are not used: check the wiring of the bus",
    "missing": "samples come without gyroscope or accelerometer",
}
BITS = (
    (GYR_SATURATED, "gyr_clipped"),
    (ACC_SATURATED, "acc_clipped"),
    (GYR_STUCK | ACC_STUCK, "axis_stuck"),
    (MAG_REJECTED, "mag_disturbed"),
    (TURN_MISSED, "turn_missed"),
    (GYR_SPIKE, "gyr_spike"),
    (GYR_MISSING | ACC_MISSING, "missing"),
)
ALL_BITS = sum(bits for bits, _ in BITS)


class HealthMonitor:
    """Keeps the journal's warnings up to date, sample by sample."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._last: Sample | None = None
        self._repeats = 0
        self._repeated_since = 0.0
        self._ends: dict[str, float] = {}  # warning → when it ends unless its cause comes back

    def add(self, sample: Sample, health: int) -> None:
        """Takes one sample and the filter's health bits for it."""
        x, y, z = sample.acc
        norm = sqrt(x * x + y * y + z * z)
        if norm - GRAVITY > MAX_G_ERROR or GRAVITY - norm > MAX_G_ERROR:
            self._warn("acceleration", sample.t, norm)
        if health & ALL_BITS:
            for bits, name in BITS:
                if health & bits:
                    self._warn(name, sample.t)
        last, self._last = self._last, sample
        if last is not None and last.gyr == sample.gyr and last.acc == sample.acc:
            self._repeats += 1
            if self._repeats >= FROZEN_SAMPLES and sample.t - self._repeated_since >= FROZEN_TIME:
                self._warn("stuck", sample.t)
        else:
            self._repeats, self._repeated_since = 0, sample.t
        if self._ends:
            self._end(sample.t)

    def _warn(self, name: str, t: float, value: float = 0.0) -> None:
        self._ends[name] = t + WARNING_TIME
        self._journal.begin(name, WARNINGS[name].format(value))

    def _end(self, t: float) -> None:
        for name in [name for name, end in self._ends.items() if t > end]:
            del self._ends[name]
            self._journal.end(name)
