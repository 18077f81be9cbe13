"""The error of a track by how fast it changes: drift, sway and jitter, and its lag.

The error's rotation vector is split by moving means over 10 s and 1 s: the rest of the first is drift, the rest of the
second is sway, and faster changes are jitter. Each has parameters that raise and lower it, which ``advice`` finds by
trying: every parameter doubled and halved.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.evaluate.attitude_error import error_quaternion, heading_offset
from levelhead.evaluate.lag import lag
from levelhead.evaluate.score import absolute_heading, require_truth, rms, scored_rows
from levelhead.recording import Array, Recording
from levelhead.rotations import turn_heading
from levelhead.track import Track

SLOW, FAST = 10.0, 1.0  # s
LESS = 0.95  # of a part of the error: a parameter that lowers it so far is worth naming
MIN_ERROR = 0.05  # °, parts of the error that are smaller are not worth a word
LATE = 10.0  # ms, the same for lag


class Bands(NamedTuple):
    """RMS in degrees of the parts of an error, and its lag in ms (None: the motion is too small)."""

    drift: float
    sway: float
    jitter: float
    lag: float | None


MEANING = {
    "drift": "error that changes over more than 10 s",
    "sway": "error that changes within 1 to 10 s",
    "jitter": "error that changes within 1 s",
    "lag": "delay behind the motion",
}


def _moving_mean(t: Array, values: Array, rows: NDArray[np.bool_], span: float) -> Array:
    """(n, 3) the mean over ``span`` seconds around each sample of the rows that count."""
    sums = np.vstack([np.zeros(3), np.cumsum(np.where(rows[:, None], values, 0.0), axis=0)])
    counts = np.concatenate([[0], np.cumsum(rows)])
    first, last = np.searchsorted(t, t - 0.5 * span), np.searchsorted(t, t + 0.5 * span, side="right")
    found: Array = (sums[last] - sums[first]) / np.maximum(counts[last] - counts[first], 1)[:, None]
    return found


def error_bands(recording: Recording, track: Track, tilt_only: bool) -> Bands:
    """The parts of the error of a track against the recording's truth; ``tilt_only``: heading does not count."""
    truth = require_truth(recording, track)
    rows = scored_rows(truth)
    error = error_quaternion(track.quat, truth.quat)
    absolute = absolute_heading(recording, track)
    if not absolute:
        error = turn_heading(error, -heading_offset(error, rows))
    vectors = np.degrees(2.0 * np.where(error[:, :1] < 0.0, -1.0, 1.0) * error[:, 1:])
    vectors = np.where(rows[:, None], vectors, 0.0)
    if tilt_only:
        vectors[:, 2] = 0.0
    slow, fast = (_moving_mean(recording.t, vectors, rows, span) for span in (SLOW, FAST))
    drift, sway, jitter = (rms(np.linalg.norm(one[rows], axis=1)) for one in (slow, fast - slow, vectors - fast))
    late = lag(recording.t, track.quat, truth.quat, rows, with_heading=absolute)
    return Bands(drift, sway, jitter, None if late is None else 1e3 * late)


class Advice(NamedTuple):
    """The parameter that lowers one part of the error, as tried on the log.

    Attributes:
        symptom: the part.
        now: of the filter as tuned, ° or ms.
        parameter: which one lowers it most; "": none of those searched does.
        factor: by which it was multiplied.
        then: the part with it.
        worst: which other part grows most by it, "": none.
        worst_now: that part before, ° or ms.
        worst_then: and with it.
    """

    symptom: str
    now: float
    parameter: str = ""
    factor: float = 1.0
    then: float = 0.0
    worst: str = ""
    worst_now: float = 0.0
    worst_then: float = 0.0

    def __str__(self) -> str:
        unit = " ms" if self.symptom == "lag" else "°"
        head = f"{self.symptom} ({MEANING[self.symptom]}) {self.now:.2g}{unit}"
        if not self.parameter:
            return f"{head}: no single parameter lowers it by 5 %"
        more = "raise" if self.factor > 1.0 else "lower"
        head += f": {more} {self.parameter} ({'doubled' if self.factor > 1.0 else 'halved'}: {self.then:.2g}{unit}"
        if not self.worst:
            return f"{head}, nothing else grows)"
        other = " ms" if self.worst == "lag" else "°"
        return f"{head}, but {self.worst} {self.worst_now:.2g} → {self.worst_then:.2g}{other})"


def advice(now: Bands, tried: Mapping[tuple[str, float], Bands]) -> list[Advice]:
    """For each part of the error that is worth a word the parameter that lowers it most.

    Args:
        now: of the filter as tuned.
        tried: (parameter, factor) to the parts with that parameter multiplied.
    """
    found = []
    for symptom in Bands._fields:
        size = _size(now, symptom)
        if size < (LATE if symptom == "lag" else MIN_ERROR):
            continue
        best = min(tried, key=lambda key: _size(tried[key], symptom), default=None)
        if best is None or _size(tried[best], symptom) > LESS * size:
            found.append(Advice(symptom, size))
            continue
        then = tried[best]
        grown = {one: _size(then, one) / max(_size(now, one), 1e-9) for one in Bands._fields if one != symptom}
        worst = max(grown, key=grown.__getitem__)
        said = Advice(symptom, size, *best, _size(then, symptom))
        if grown[worst] > 1.0 / LESS:
            said = said._replace(worst=worst, worst_now=_size(now, worst), worst_then=_size(then, worst))
        found.append(said)
    return found


def _size(bands: Bands, symptom: str) -> float:
    return abs(float(getattr(bands, symptom) or 0.0))
