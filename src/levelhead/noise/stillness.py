"""Where in a recording the sensor lay still, in half seconds."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array, Recording
from levelhead.units import DEGREE

WINDOW = 0.5  # s
AT_ONCE = 256  # windows: they stay in the processor's cache
QUIET = 4.0  # times the noise of the quietest windows from which a sensor is moved or touched
LEAST_RATE, MOST_RATE = 0.3 * DEGREE, 5.0 * DEGREE  # rad/s, bounds of that threshold; a hand at rest shakes by more
LEAST_FORCE, MOST_FORCE = 0.03, 0.3  # m/s², the same
RATE_CHANGE = 1.0 * DEGREE  # rad/s, of a window's mean off the stretch's median
FORCE_CHANGE = 0.15  # m/s², the same


class StillStretch(NamedTuple):
    """Samples at which the sensor was still: from ``start`` on and before ``end``."""

    start: int
    end: int


class Windows(NamedTuple):
    """Means and greatest standard deviations of (k,) windows of ``size`` samples."""

    size: int
    gyr: Array
    acc: Array
    rate_noise: Array
    force_noise: Array


def windows(recording: Recording) -> Windows:
    """Half seconds of a recording, at least 4 samples each; NaN where most readings are missing or time has a gap."""
    rate = recording.rate
    size = max(4, round(WINDOW * rate))
    count = len(recording) // size
    used = slice(0, count * size)
    time = recording.t[used].reshape(count, size)
    torn = time[:, -1] - time[:, 0] > 1.5 * size / max(rate, 1e-9)
    found = []
    for values in (recording.gyr, recording.acc):
        mean, noise = np.empty((count, 3)), np.empty(count)
        for first in range(0, count, AT_ONCE):
            part = slice(first, min(first + AT_ONCE, count))
            rows = values[used][part.start * size : part.stop * size].reshape(-1, size, 3)
            mean[part], noise[part] = _moments(rows)
        mean[torn] = np.nan
        noise[torn] = np.nan
        found += [mean, noise]
    return Windows(size, found[0], found[2], found[1], found[3])


def _moments(rows: Array) -> tuple[Array, Array]:
    """(k, 3) means of (k, size, 3) readings and (k,) their greatest standard deviations; NaN with fewer than 4."""
    missing = np.isnan(rows)
    if not missing.any():
        mean = np.einsum("kij->kj", rows) / rows.shape[1]
        centred = rows - mean[:, None]
        return mean, np.sqrt(np.einsum("kij,kij->kj", centred, centred).max(axis=1) / rows.shape[1])
    there = (rows.shape[1] - missing.sum(axis=1)).astype(np.float64)
    there[there < 4] = np.nan
    mean = np.where(missing, 0.0, rows).sum(axis=1) / there
    centred = np.where(missing, 0.0, rows - mean[:, None])
    return mean, np.sqrt((np.einsum("kij,kij->kj", centred, centred) / there).max(axis=1))


def quiet(noise: Array, least: float, most: float) -> NDArray[np.bool_]:
    """Where noise is at most 4 times that of the quietest twentieth."""
    known = noise[np.isfinite(noise)]
    floor = float(np.quantile(known, 0.05)) if len(known) else 0.0
    return np.asarray(noise <= min(max(QUIET * floor, least), most))


def still_stretches(recording: Recording, least: float = 1.0) -> list[StillStretch]:
    """Stretches of at least ``least`` s in which the sensor neither moved nor was touched, in order."""
    seen = windows(recording)
    still = quiet(seen.rate_noise, LEAST_RATE, MOST_RATE) & quiet(seen.force_noise, LEAST_FORCE, MOST_FORCE)
    with np.errstate(invalid="ignore"):
        change = np.linalg.norm(np.diff(seen.acc, axis=0), axis=1) > FORCE_CHANGE
        change |= np.linalg.norm(np.diff(seen.gyr, axis=0), axis=1) > RATE_CHANGE
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(np.int8), [0]])))
    shortest = max(1.0, least * recording.rate / seen.size)
    found = []
    for first, last in edges.reshape(-1, 2):
        cuts = [first, *(first + 1 + np.flatnonzero(change[first : last - 1])), last]
        for a, b in pairwise(cuts):
            if b - a >= shortest and _one_place(seen, a, b):
                found.append(StillStretch(int(a * seen.size), int(b * seen.size)))
    return found


def _one_place(seen: Windows, first: int, last: int) -> bool:
    """Whether the sensor is at the end of a stretch as it was at its start: no slow turn."""
    force = seen.acc[first:last]
    offset = np.linalg.norm(force - np.median(force, axis=0), axis=1)
    return bool(np.quantile(offset, 0.9) < FORCE_CHANGE)
