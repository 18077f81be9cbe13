"""How a filter's knowledge of its sensor grows over a recording."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead import filters
from levelhead.calibration import Calibration
from levelhead.engine.batch import DEFAULT_GUARD, Batch
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import Params
from levelhead.guard import Guard
from levelhead.recording import Array, Recording

POINTS = 600  # at most: about as many as a picture shows


class CalibrationHistory(NamedTuple):
    """The calibration of a sensor at k times."""

    t: Array  # (k,) s
    known: list[Calibration]

    def series(self, name: str, part: str = "value") -> Array:
        """(k, …) "value", "sigma" or "unlearned" of a quantity such as "gyr_bias"; NaN as long as it is not there."""
        numbers = [getattr(getattr(one, name), part, None) for one in self.known]
        shape = next((np.shape(one) for one in numbers if one is not None), ())
        return np.array([np.full(shape, np.nan) if one is None else one for one in numbers])


def calibration_history(
    recording: Recording,
    params: Params,
    *,
    guard: Guard | None = DEFAULT_GUARD,
    engine: str = "auto",
    prior: Calibration | None = None,
    every: float = 1.0,
) -> CalibrationHistory:
    """The filter's calibration of its sensor after each second of a recording.

    Args:
        recording: the sensors' readings.
        params: a filter that learns: ``ESKF``.
        guard: as for ``fuse``.
        engine: as for ``fuse``.
        prior: as for ``fuse``.
        every: s between two looks; longer where that would be more than 600 of them.

    Raises:
        LevelheadError: the filter learns nothing, or as for ``fuse``.
    """
    batch = Batch(recording, params, guard, engine, prior)
    if batch.filter.calibration is None:
        who = " or ".join(one.name for one in filters.ALL if one.calibration)
        raise LevelheadError(f"{batch.filter.name} learns no calibration; {who} does")
    if not every > 0.0:
        raise LevelheadError(f"every is {every!r}; it must be seconds, greater than 0")
    stops = sample_rows(recording.t, every)
    batch.forget(int(np.diff(stops, prepend=0).max()))
    known = []
    for stop in stops.tolist():
        batch.advance(stop)
        if (now := batch.calibration) is not None:
            known.append(now)
    return CalibrationHistory(recording.t[stops - 1], known)


def sample_rows(t: Array, every: float) -> NDArray[np.intp]:
    """Row after which each look is taken, the last of them after the last row."""
    step = max(every, float(t[-1] - t[0]) / POINTS)
    rows = np.searchsorted(t, np.arange(t[0], t[-1], step)[1:], side="right")
    found: NDArray[np.intp] = np.unique(np.append(rows, len(t)))
    return found
