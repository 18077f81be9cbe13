"""What a recording's barometer and satellite receiver saw, as the driver takes it: one number of one row at a time."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead import atmosphere
from levelhead.filters.contract import HEIGHT, POSITION, VELOCITY
from levelhead.recording import Array, Recording

EARLY = 1.0  # s before the first sample from which a reading is still taken


class Sightings(NamedTuple):
    """Numbers in the order of the samples; of sample i those from ``first[i]`` to before ``first[i + 1]``."""

    first: NDArray[np.int64]  # (n + 1,)
    row: NDArray[np.int64]
    value: Array
    sigma: Array
    age: Array  # s since it was taken, at its sample

    def part(self, start: int, stop: int) -> "Sightings":
        """Those of some samples."""
        first = self.first[start : stop + 1]
        rows = slice(first[0], first[-1])
        return Sightings(first - first[0], self.row[rows], self.value[rows], self.sigma[rows], self.age[rows])


def sightings(recording: Recording) -> Sightings | None:
    """What was seen beside the IMU, each reading at the first sample that is not before it; None if nothing was."""
    columns: list[tuple[int, Array, Array, Array]] = []
    if (air := recording.pressure) is not None:
        # Number by number, as a stream does: NumPy's power of an array has other last bits than that of a number.
        heights = np.array([atmosphere.height(p) for p in air.values.tolist()])
        slopes = np.array([atmosphere.metres_per_pascal(p) for p in air.values.tolist()])
        columns.append((HEIGHT, air.t, heights, np.asarray(air.sigma) * slopes))
    if (gnss := recording.gnss) is not None:
        for kind, values, deviation in (
            (POSITION, gnss.position, gnss.sigma_position),
            (VELOCITY, gnss.velocity, gnss.sigma_velocity),
        ):
            if values is not None:
                columns += [(kind + i, gnss.t, values[:, i], np.asarray(deviation)[:, i]) for i in range(3)]
    if not columns:
        return None
    n = len(recording)
    stamp = np.concatenate([t for _, t, _, _ in columns])
    row = np.concatenate([np.full(len(t), which) for which, t, _, _ in columns])
    value = np.concatenate([values for _, _, values, _ in columns])
    sigma = np.concatenate([sigma for _, _, _, sigma in columns])
    at = np.searchsorted(recording.t, stamp)
    taken = np.flatnonzero((at < n) & (stamp > recording.t[0] - EARLY) & np.isfinite(value))
    taken = taken[np.lexsort((row[taken], stamp[taken]))]
    at = at[taken]
    first = np.searchsorted(at, np.arange(n + 1))
    return Sightings(first, row[taken], value[taken], sigma[taken], recording.t[at] - stamp[taken])
