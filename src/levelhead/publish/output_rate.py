"""A track at a lower rate than its recording: rows are left out, those that stay are as they were."""

from dataclasses import fields, replace
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject
from levelhead.recording import Array
from levelhead.track import Track

EARLY = 1e-6  # of a period: a sample that rounding puts before its period belongs to it


class OutputRate:
    """Chooses the first sample of each period of 1/rate s; periods begin with the first sample of the track.

    A chosen row is not a mean: it has the bits that it has in the whole track. A rate above the track's chooses all.

    Args:
        rate: rows a second.
        state: that of an earlier process, to go on from there.

    Raises:
        LevelheadError: no such rate.
    """

    def __init__(self, rate: float, state: dict[str, float] | None = None) -> None:
        if not (isfinite(rate) and rate > 0.0):
            raise LevelheadError(f"the output rate is {rate:g}; it must be a number of rows a second above 0")
        self.rate = rate
        self.state = dict(state or {})  # "start" in s, "period": the number of the last sample's

    def rows(self, t: Array) -> NDArray[np.intp]:
        """Positions of the chosen ones among the next samples, from their times."""
        start = self.state.setdefault("start", float(t[0]))
        periods = np.floor((t - start) * self.rate + EARLY)
        before = np.concatenate([[self.state.get("period", -1.0)], periods[:-1]])
        self.state["period"] = float(periods[-1])
        return np.flatnonzero(periods != before)

    def reduce(self, track: Track) -> Track | None:
        """The chosen rows of the next track; None: there are none."""
        rows = self.rows(track.t)
        if len(rows) == 0:
            return None
        columns: JsonObject = {one.name: getattr(track, one.name) for one in fields(track)}
        parts: JsonObject = {name: a[rows] for name, a in columns.items() if isinstance(a, np.ndarray)}
        return replace(track, **parts, readings=None)
