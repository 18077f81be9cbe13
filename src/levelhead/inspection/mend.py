"""The mend of a recording's readings: a record that a finding carries and ``--fix`` applies."""

from dataclasses import dataclass

import numpy as np

from levelhead.recording import Array, Recording


@dataclass(frozen=True, eq=False)
class Mend:
    """A correction of one sensor: (n, 3) readings become ``readings @ matrix.T − offset``, ``delay`` s earlier.

    Attributes:
        role: "gyr", "acc" or "mag".
        matrix: (3, 3).
        offset: (3,) in the unit of the readings, or (n, 3) with one for each row.
        delay: s by which the readings come late.
        since: s, time from which the offset counts; −∞: from the start.
        lag: s, time constant of a filter of first order through which they went.
        sole: whether nothing else explains the readings as well.
    """

    role: str
    matrix: Array
    offset: Array
    delay: float = 0.0
    lag: float = 0.0
    sole: bool = True
    since: float = -np.inf

    def apply(self, recording: Recording) -> Recording:
        """A recording with this sensor mended."""
        later = (recording.t >= self.since)[:, None]
        values = np.asarray(getattr(recording, self.role)) @ self.matrix.T - np.where(later, self.offset, 0.0)
        if self.lag:
            box = max(1, round(0.25 * self.lag * recording.rate))
            smooth = np.stack([np.convolve(one, np.ones(box) / box, "same") for one in values.T], axis=1)
            values = smooth + self.lag * np.gradient(smooth, recording.t, axis=0)
        if self.delay:
            known = np.isfinite(values).all(axis=1)
            at = recording.t + self.delay
            values = np.stack([np.interp(at, recording.t[known], axis) for axis in values[known].T], axis=1)
            values[~known] = np.nan
        gyr, acc, mag = (
            values if role == self.role else own
            for role, own in (("gyr", recording.gyr), ("acc", recording.acc), ("mag", recording.mag))
        )
        assert gyr is not None and acc is not None
        return Recording(recording.t, gyr, acc, mag, recording.truth, recording.meta)


def turn(role: str, matrix: Array, sole: bool = True) -> Mend:
    """A mend that multiplies only."""
    return Mend(role, matrix, np.zeros(3), sole=sole)
