"""Samples as they come, as a recording that grows."""

import math
from collections.abc import Sequence

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array, Recording
from levelhead.sample import Sample

FIRST = 4096  # rows for which there is room at first
NOTHING = (math.nan, math.nan, math.nan)


class GrowingRecording:
    """Rows of t, gyr, acc and mag in arrays that double when they are full."""

    def __init__(self) -> None:
        self._t: Array = np.empty(FIRST)
        self._three: Array = np.empty((3, FIRST, 3))
        self._count = 0
        self._field = False

    @property
    def duration(self) -> float:
        """Seconds from the first sample to the last."""
        return float(self._t[self._count - 1] - self._t[0]) if self._count else 0.0

    def add(self, samples: Sequence[Sample]) -> None:
        """More rows; one whose stamp is not after the last one's is left out."""
        for sample in samples:
            if self._count and not sample.t > self._t[self._count - 1]:
                continue
            if self._count == len(self._t):
                self._t = np.concatenate([self._t, np.empty_like(self._t)])
                self._three = np.concatenate([self._three, np.empty_like(self._three)], axis=1)
            self._t[self._count] = sample.t
            self._three[:, self._count] = sample.gyr, sample.acc, sample.mag or NOTHING
            self._field |= sample.mag is not None
            self._count += 1

    def recording(self) -> Recording:
        """All rows so far; later ones do not change it.

        Raises:
            LevelheadError: there are none.
        """
        if not self._count:
            raise LevelheadError("no sample came; expected a sensor that measures")
        gyr, acc, mag = (values[: self._count] for values in self._three)
        return Recording(self._t[: self._count], gyr, acc, mag if self._field else None)
