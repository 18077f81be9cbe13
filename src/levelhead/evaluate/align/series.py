"""A stream of orientation as a function of time, and two of them at the same instants."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from levelhead.errors import LevelheadError
from levelhead.recording import Array, median, real_array, time_array
from levelhead.rotations import to_scipy

if TYPE_CHECKING:
    from scipy.spatial.transform import Slerp

MIN_SAMPLES = 24  # samples; with fewer nothing is claimed
MAX_GAP = 4.0  # sample intervals; nothing is interpolated across a longer step


@dataclass(frozen=True, eq=False)
class OrientationSeries:
    """Orientation over time, without the samples at which it is missing.

    Interpolated is along great circles of the unit sphere in four dimensions (Shoemake's slerp). These stay great
    circles when the four numbers are permuted, negated or conjugated, so the convention may be settled afterwards.

    Attributes:
        t: (n,) seconds, increasing.
        quat: (n, 4) unit quaternions, in the convention of their source.
    """

    t: Array
    quat: Array
    _slerp: "Slerp" = field(repr=False)

    @staticmethod
    def from_samples(name: str, t: ArrayLike, quat: ArrayLike) -> "OrientationSeries":
        """A course from (n,) seconds and (n, 4) quaternions of any length; NaN and zero rows are missing samples.

        Raises:
            LevelheadError: shapes that do not fit, time that does not increase, too few samples.
        """
        from scipy.spatial.transform import Slerp

        try:
            stamps = time_array(t)
            values = real_array("quat", quat, (len(stamps), 4), "unit quaternions")
        except LevelheadError as error:
            raise LevelheadError(f"{name}: {error}") from None
        norm = np.sqrt(np.sum(values * values, axis=1))
        known = norm > 1e-6  # False for NaN
        if known.sum() < MIN_SAMPLES:
            raise LevelheadError(
                f"{name} has {int(known.sum())} samples with an orientation; expected at least {MIN_SAMPLES} to compare"
            )
        stamps, values = stamps[known], values[known] / norm[known, None]
        return OrientationSeries(stamps, values, Slerp(stamps, to_scipy(values)))

    @property
    def interval(self) -> float:
        """Seconds between samples, the median."""
        return median(np.diff(self.t))

    def at(self, when: Array) -> Array:
        """(m, 4) quaternions at the instants ``when`` (m,); NaN outside of the course and across its gaps."""
        after = np.clip(np.searchsorted(self.t, when), 1, len(self.t) - 1)
        known = (when >= self.t[0]) & (when <= self.t[-1])
        known &= self.t[after] - self.t[after - 1] <= MAX_GAP * self.interval
        found = np.full((len(when), 4), np.nan)
        found[known] = self._slerp(when[known]).as_quat(scalar_first=True)
        return found


class SeriesPair:
    """Two courses at the same instants: those of the slower one; the faster one is interpolated."""

    def __init__(self, estimate: OrientationSeries, reference: OrientationSeries) -> None:
        self.estimate, self.reference = estimate, reference
        self.at_reference = estimate.interval <= reference.interval
        self.when = reference.t if self.at_reference else estimate.t

    def instants(self, shift: float, count: int) -> Array:
        """At most ``count`` instants, spread evenly over those at which both are known for this shift in s."""
        left, right = self.at(shift)
        good = np.flatnonzero(np.isfinite(left[:, 0]) & np.isfinite(right[:, 0]))
        picked = np.unique(np.linspace(0, len(good) - 1, min(count, len(good))).astype(int)) if len(good) else good
        return self.when[good[picked]]

    def at(self, shift: float, when: Array | None = None) -> tuple[Array, Array]:
        """(m, 4) estimate and reference at the slower one's stamps ``when`` (all of them if None); NaN if unknown.

        ``shift`` is the time in s by which the estimate is late: its stamp t belongs to the reference at
        t − shift.
        """
        slow = self.reference if self.at_reference else self.estimate
        rows = slice(None) if when is None else np.searchsorted(slow.t, when)
        if self.at_reference:
            return self.estimate.at(slow.t[rows] + shift), slow.quat[rows]
        return slow.quat[rows], self.reference.at(slow.t[rows] - shift)
