"""The readings beside a recording's IMU as the driver takes them, one number at a time: pressure, GNSS, rest."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead import atmosphere
from levelhead.filters.contract import HEIGHT, POSITION, VELOCITY, ZERO_VELOCITY
from levelhead.recording import Array, Recording

MOST_EARLY = 1.0  # s before the first sample: an older reading is not used


class AidingInputs(NamedTuple):
    """k numbers in the order of the samples; sample i has those from ``first[i]`` to ``first[i + 1]`` − 1."""

    first: NDArray[np.int64]  # (n + 1,)
    row: NDArray[np.int64]  # (k,) the quantity, as in ``filters.eskf.aiding``
    value: Array  # (k,) m or m/s
    sigma: Array  # (k,) 1σ in the same unit
    age: Array  # (k,) s from the reading to its sample

    def part(self, start: int, stop: int) -> "AidingInputs":
        """The numbers of samples ``start`` to ``stop`` − 1."""
        first = self.first[start : stop + 1]
        rows = slice(first[0], first[-1])
        return AidingInputs(
            first=first - first[0],
            row=self.row[rows],
            value=self.value[rows],
            sigma=self.sigma[rows],
            age=self.age[rows],
        )


def no_aiding(samples: int) -> AidingInputs:
    """No readings, for that many samples."""
    nothing = np.empty(0)
    first, row = np.zeros(samples + 1, np.int64), np.empty(0, np.int64)
    return AidingInputs(first=first, row=row, value=nothing, sigma=nothing, age=nothing)


def aiding_inputs(recording: Recording) -> AidingInputs | None:
    """The readings, each at the first sample that is not earlier than it; None for a recording without any."""
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
    if (still := recording.zero_velocity) is not None:
        zero, deviation = np.zeros(len(still)), np.asarray(still.sigma)
        columns += [(ZERO_VELOCITY + i, still.t, zero, deviation) for i in range(3)]
    if not columns:
        return None
    n = len(recording)
    stamp = np.concatenate([t for _, t, _, _ in columns])
    row = np.concatenate([np.full(len(t), which) for which, t, _, _ in columns])
    value = np.concatenate([values for _, _, values, _ in columns])
    sigma = np.concatenate([sigma for _, _, _, sigma in columns])
    at = np.searchsorted(recording.t, stamp)
    taken = np.flatnonzero((at < n) & (stamp > recording.t[0] - MOST_EARLY) & np.isfinite(value))
    taken = taken[np.lexsort((row[taken], stamp[taken]))]
    at = at[taken]
    first = np.searchsorted(at, np.arange(n + 1))
    return AidingInputs(
        first=first, row=row[taken], value=value[taken], sigma=sigma[taken], age=recording.t[at] - stamp[taken]
    )
