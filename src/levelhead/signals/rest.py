"""Rest in a recording: the one definition for the reader, the doctor, noise and calibration.

A recording is cut into half seconds. One is at rest if gyroscope and accelerometer are hardly noisier than in the
quietest twentieth. The guard decides sample by sample (``guard/rest.py``), a node before it starts
(``live/static_calibration.py``).
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array, Recording, median
from levelhead.units import DEGREE, GRAVITY

WINDOW = 0.5  # s
AT_ONCE = 256  # windows: they stay in the processor's cache
MAX_NOISE_RATIO = 4.0  # to the noise of the quietest windows; a sensor that is moved or touched exceeds it
MIN_RATE_LIMIT, MAX_RATE_LIMIT = 0.3 * DEGREE, 5.0 * DEGREE  # rad/s, bounds of that threshold
MIN_FORCE_LIMIT, MAX_FORCE_LIMIT = 0.03, 0.3  # m/s², the same
MAX_RATE_CHANGE = 1.0 * DEGREE  # rad/s, between the means of two windows in one stretch
MAX_FORCE_CHANGE = 0.15  # m/s², the same, and of a window off the stretch's median
MAX_UNHELD_NOISE = 1.5 * DEGREE  # rad/s: a hand that holds the sensor shakes it by more
MAX_BIAS = 8.0 * DEGREE  # rad/s: a faster mean rate is a slow turn
MAX_SCALE_ERROR = 0.25  # of gravity
MAX_DRIFT = 0.1  # m/s², of the specific force within a window, where the gyroscope's unit is open
MAX_RATE = 1e6  # of any unit


class StillStretch(NamedTuple):
    """Samples at rest: from ``start`` on and before ``end``."""

    start: int
    end: int


class Windows(NamedTuple):
    """Means and greatest standard deviations of (k,) windows of ``size`` samples."""

    size: int
    gyr: Array
    acc: Array
    rate_noise: Array
    force_noise: Array

    def are_quiet(self) -> NDArray[np.bool_]:
        """(k,) whether a window is hardly noisier than the quietest ones."""
        rate_limit = _noise_limit(self.rate_noise, MIN_RATE_LIMIT, MAX_RATE_LIMIT)
        return np.asarray((self.rate_noise <= rate_limit) & self.hold_force())

    def hold_force(self) -> NDArray[np.bool_]:
        """The same of the accelerometer alone."""
        return np.asarray(self.force_noise <= _noise_limit(self.force_noise, MIN_FORCE_LIMIT, MAX_FORCE_LIMIT))


class StillGyroscope(NamedTuple):
    """Bias and noise of a gyroscope in half seconds in which the accelerometer shows rest.

    Attributes:
        windows: half seconds at rest.
        rate: median rate across the vertical in them, in the unit of the readings; an accelerometer does not notice a
            rotation about the vertical.
        noise: median rms noise of the noisiest axis.
    """

    windows: int
    rate: float
    noise: float


def window_size(rate: float) -> int:
    """Samples in half a second at ``rate`` Hz, at least 4."""
    return max(4, round(WINDOW * rate))


def find_windows(t: Array, gyr: Array, acc: Array, rate: float) -> Windows:
    """Half seconds of ``t`` (n,) s, ``gyr`` and ``acc`` (n, 3) at ``rate`` Hz.

    A window is NaN if most readings are missing in it or time has a gap.
    """
    size = window_size(rate)
    count = len(t) // size
    used = slice(0, count * size)
    time = t[used].reshape(count, size)
    torn = time[:, -1] - time[:, 0] > 1.5 * size / max(rate, 1e-9)
    found = []
    for values in (gyr, acc):
        mean, noise = np.empty((count, 3)), np.empty(count)
        for first in range(0, count, AT_ONCE):
            part = slice(first, min(first + AT_ONCE, count))
            rows = values[used][part.start * size : part.stop * size].reshape(-1, size, 3)
            mean[part], noise[part] = _moments(rows)
        mean[torn] = np.nan
        noise[torn] = np.nan
        found += [mean, noise]
    return Windows(size=size, gyr=found[0], acc=found[2], rate_noise=found[1], force_noise=found[3])


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


def _noise_limit(noise: Array, least: float, most: float) -> float:
    """4 times the noise of the quietest twentieth, within bounds."""
    known = noise[np.isfinite(noise)]
    floor = float(np.quantile(known, 0.05)) if len(known) else 0.0
    return min(max(MAX_NOISE_RATIO * floor, least), most)


def rest_rows(recording: Recording) -> NDArray[np.bool_]:
    """(n,) whether a row lies in half a second of rest: quiet, in no hand, without a slow turn, and under 1 g."""
    windows = find_windows(recording.t, recording.gyr, recording.acc, recording.rate)
    still = np.zeros(len(recording), dtype=np.bool_)
    with np.errstate(invalid="ignore"):
        slow = (np.linalg.norm(windows.gyr, axis=1) < MAX_BIAS) & (windows.rate_noise < MAX_UNHELD_NOISE)
        upright = np.abs(np.linalg.norm(windows.acc, axis=1) / GRAVITY - 1.0) < MAX_SCALE_ERROR
    at_rest = windows.are_quiet() & slow & upright
    still[: len(at_rest) * windows.size] = np.repeat(at_rest, windows.size)
    return still


def still_stretches(recording: Recording, least: float = 1.0) -> list[StillStretch]:
    """Stretches of at least ``least`` s in which the sensor neither moved nor was touched, in order."""
    windows = find_windows(recording.t, recording.gyr, recording.acc, recording.rate)
    with np.errstate(invalid="ignore"):
        change = np.linalg.norm(np.diff(windows.acc, axis=0), axis=1) > MAX_FORCE_CHANGE
        change |= np.linalg.norm(np.diff(windows.gyr, axis=0), axis=1) > MAX_RATE_CHANGE
    edges = np.flatnonzero(np.diff(np.concatenate([[0], windows.are_quiet().astype(np.int8), [0]])))
    shortest = max(1.0, least * recording.rate / windows.size)
    found = []
    for first, last in edges.reshape(-1, 2):
        cuts = [first, *(first + 1 + np.flatnonzero(change[first : last - 1])), last]
        for a, b in pairwise(cuts):
            if b - a >= shortest and _is_one_place(windows, a, b):
                found.append(StillStretch(int(a * windows.size), int(b * windows.size)))
    return found


def _is_one_place(windows: Windows, first: int, last: int) -> bool:
    """Whether the sensor is at the end of a stretch as it was at its start: no slow turn."""
    force = windows.acc[first:last]
    offset = np.linalg.norm(force - np.median(force, axis=0), axis=1)
    return bool(np.quantile(offset, 0.9) < MAX_FORCE_CHANGE)


def find_still_gyroscope(t: Array, gyr: Array, acc: Array) -> StillGyroscope:
    """Bias and noise of (n, 3) ``gyr`` in any unit while (n, 3) ``acc`` in m/s² is at rest; ``t`` (n,) s."""
    step = median(np.diff(t)) if len(t) > 1 else 0.0
    with np.errstate(invalid="ignore", over="ignore"):
        windows = find_windows(t, gyr, acc, 1.0 / step if step > 0.0 else 0.0)
        length = np.linalg.norm(windows.acc, axis=1)
        still = windows.hold_force() & (np.abs(length / GRAVITY - 1.0) < MAX_SCALE_ERROR)
        still &= (_drift(acc, windows.size) < MAX_DRIFT) & (np.abs(windows.gyr).max(axis=1, initial=0.0) < MAX_RATE)
    if not still.any():
        return StillGyroscope(0, 0.0, 0.0)
    rate, up = windows.gyr[still], windows.acc[still] / length[still, None]
    across = rate - (rate * up).sum(axis=1)[:, None] * up
    return StillGyroscope(int(still.sum()), median(np.linalg.norm(across, axis=1)), median(windows.rate_noise[still]))


def _drift(acc: Array, size: int) -> Array:
    """(k,) how far the last quarter of a window is off its first."""
    count, quarter = len(acc) // size, size // 4
    rows = acc[: count * size].reshape(count, size, 3)
    return np.asarray(np.linalg.norm(rows[:, -quarter:].mean(axis=1) - rows[:, :quarter].mean(axis=1), axis=1))
