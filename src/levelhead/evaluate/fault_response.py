"""The response of a filter to a fault: its error, its recovery, its health bits, and whether σ stayed honest.

The truth, where a recording has one, is the reference. Without it, it is the same filter's run over the recording
without the fault, from which the error of that run is left out.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.evaluate.attitude_error import error_quaternion, heading_offset, split_error
from levelhead.evaluate.score import absolute_heading
from levelhead.filters import health
from levelhead.open_types import JsonObject
from levelhead.recording import Array, Recording
from levelhead.rotations import turn_heading
from levelhead.simulate.fault import Fault, Faulted
from levelhead.track import Track

MAX_EXCESS = 2.0  # deg beyond the error without the fault: right again, as in the filters' ``settles``
LAST = 1.0  # s before the end of a recording in which an error means that it did not end
BEYOND = 4.0  # σ: of a normal error 1 in 16,000 samples
GROWN = 2.0  # times σ without the fault, a growth of σ that counts as a report
POINTS = 600  # of a curve
SAID = health.FAULTS & ~health.NEAR_VERTICAL  # an ambiguous roll is not a sensor's fault
WORDS = {bit: name.lower() for name, bit in vars(health).items() if isinstance(bit, int) and bit in health.NAMES}


class ErrorCurve(NamedTuple):
    """Errors of a track in degrees: (n,) tilt and signed heading, and 1σ of each (None: it has no σ)."""

    tilt: Array
    heading: Array
    sigma_tilt: Array | None
    sigma_heading: Array | None

    def at(self, rows: NDArray[np.intp]) -> "ErrorCurve":
        """Of these rows."""
        return ErrorCurve(*(None if values is None else values[rows] for values in self))  # type: ignore[arg-type]

    def beyond(self, rows: slice) -> float | None:
        """The share of these rows on which tilt or heading is off by more than 4 σ; None without σ."""
        if self.sigma_tilt is None or self.sigma_heading is None:
            return None
        known = np.isfinite(self.tilt) & (self.sigma_tilt > 0.0)
        off = np.abs(self.tilt) > BEYOND * self.sigma_tilt
        off |= (np.abs(self.heading) > BEYOND * self.sigma_heading) & (self.sigma_heading > 0.0)
        return float(off[rows][known[rows]].mean()) if known[rows].any() else None


@dataclass(frozen=True, eq=False)
class FaultResponse:
    """One filter's way through one fault; angles in degrees, times in seconds.

    Attributes:
        fault: with all its numbers.
        method: the filter's name.
        tilt, heading: largest error while the fault lasts; of one that stays, from its start on.
        usual_tilt, usual_heading: the same without the fault.
        tilt_recovery, heading_recovery: s from the fault's end (of one that stays: from its start) until the error is
            below ``MAX_EXCESS`` more than without the fault, and stays there; None: it is not within the recording.
        said: names of the health bits that the fault sets, those of most samples first.
        said_after: s from its start until the first of them; None: none.
        growth: the largest σ over σ without the fault, from its start on; None without σ.
        beyond, usual_beyond: share of samples from its start on whose error exceeds 4 σ, with and without the fault.
        t, error: curve of the error (tilt and heading together) for a picture, the largest of each stretch.
    """

    fault: Fault
    method: str
    tilt: float
    heading: float
    usual_tilt: float
    usual_heading: float
    tilt_recovery: float | None
    heading_recovery: float | None
    said: Sequence[str]
    said_after: float | None
    growth: float | None
    beyond: float | None
    usual_beyond: float | None
    t: Array
    error: Array

    @property
    def harmless(self) -> bool:
        """Whether no angle was ever ``MAX_EXCESS`` worse than without the fault, while it lasted and later."""
        return (
            self.tilt <= self.usual_tilt + MAX_EXCESS
            and self.heading <= self.usual_heading + MAX_EXCESS
            and self.tilt_recovery == 0.0
            and self.heading_recovery == 0.0
        )

    @property
    def is_said(self) -> bool:
        """Whether the filter itself reported the fault, by health or by a larger σ."""
        return bool(self.said) or (self.growth is not None and self.growth >= GROWN)

    @property
    def is_recovered(self) -> bool:
        """Whether tilt and heading are right again within the recording."""
        return self.tilt_recovery is not None and self.heading_recovery is not None

    def to_dict(self) -> JsonObject:
        """The figures, ready for JSON."""
        lasting = self.fault.length is None or math.isinf(self.fault.length)
        return {
            "fault": self.fault.name,
            "size": self.fault.size,
            "unit": self.fault.kind.unit,
            "start_s": self.fault.start,
            "length_s": None if lasting else self.fault.length,
            "method": self.method,
            "tilt_deg": self.tilt,
            "heading_deg": self.heading,
            "tilt_without_deg": self.usual_tilt,
            "heading_without_deg": self.usual_heading,
            "tilt_recovery_s": self.tilt_recovery,
            "heading_recovery_s": self.heading_recovery,
            "recovered": self.is_recovered,
            "harmless": self.harmless,
            "said": list(self.said),
            "said_after_s": self.said_after,
            "sigma_growth": self.growth,
            "beyond_4_sigma": self.beyond,
            "beyond_4_sigma_without": self.usual_beyond,
        }


def error_curve(recording: Recording, track: Track, first: int, reference: Array | None = None) -> ErrorCurve:
    """Errors in degrees against ``reference`` (n, 4), or the truth.

    Where truth or filter has no north, the heading is that since the fault's ``first`` row: the best constant
    offset of the rows before it is removed. An orientation that is NaN counts as half a turn off.
    """
    truth = recording.truth
    if reference is None:
        assert truth is not None
        error = error_quaternion(track.quat, truth.quat)
        before = np.isfinite(error[:, 0]) & (np.arange(len(error)) < first)
        if not absolute_heading(recording, track) and before.any():
            error = turn_heading(error, -heading_offset(error, before))
        known = np.isfinite(truth.quat[:, 0])
    else:
        error, known = error_quaternion(track.quat, reference), np.isfinite(reference[:, 0])
    lost = np.isnan(track.quat).any(axis=1) & known
    found = split_error(error)
    tilt, heading = (np.where(lost, 180.0, np.degrees(values)) for values in (found.tilt, found.heading))
    sigma = None if track.sigma is None else np.degrees(track.sigma)
    if sigma is None:
        return ErrorCurve(tilt, heading, None, None)
    return ErrorCurve(tilt, heading, np.hypot(sigma[:, 0], sigma[:, 1]), sigma[:, 2])


def measure_response(faulted: Faulted, track: Track, recording: Recording, sound: Track, method: str) -> FaultResponse:
    """The figures of one filter and one fault.

    Args:
        faulted: the recording with the fault.
        track: the filter's, over it.
        recording: the one without the fault.
        sound: the same filter's track over that.
        method: the filter's name.
    """
    rows, first, t = faulted.rows, faulted.first, faulted.recording.t
    if recording.truth is None:
        now = error_curve(faulted.recording, track, first, sound.quat[rows])
        usual = error_curve(recording, sound, first, sound.quat).at(rows)
    else:
        now = error_curve(faulted.recording, track, first)
        usual = error_curve(recording, sound, int(rows[min(first, len(rows) - 1)])).at(rows)
    stays = faulted.last >= len(rows)
    during = slice(first, max(faulted.last, first + 1))
    new = track.health & ~sound.health[rows] & np.uint32(SAID)
    new[:first] = 0
    hits = np.flatnonzero(new)
    counts = {word: int(np.count_nonzero(new & np.uint32(bit))) for bit, word in WORDS.items()}
    times, curve = _thin(t, np.hypot(now.tilt, now.heading))
    return FaultResponse(
        fault=faulted.fault,
        method=method,
        tilt=_largest(now.tilt[during]),
        heading=_largest(now.heading[during]),
        usual_tilt=_largest(usual.tilt[during]),
        usual_heading=_largest(usual.heading[during]),
        tilt_recovery=_recovery(t, now.tilt, usual.tilt, first if stays else faulted.last),
        heading_recovery=_recovery(t, now.heading, usual.heading, first if stays else faulted.last),
        said=[word for word, count in sorted(counts.items(), key=lambda item: -item[1]) if count],
        said_after=float(t[hits[0]] - t[min(first, len(t) - 1)]) if len(hits) else None,
        growth=_growth(now, usual, first),
        beyond=now.beyond(slice(first, None)),
        usual_beyond=usual.beyond(slice(first, None)),
        t=times,
        error=curve,
    )


def _largest(values: Array) -> float:
    known = np.abs(values[np.isfinite(values)])
    return float(known.max(initial=0.0))


def _recovery(t: Array, error: Array, usual: Array, end: int) -> float | None:
    """Seconds from row ``end`` on until the error stays within MAX_EXCESS of the usual one; None: it does not."""
    wrong = np.flatnonzero(np.abs(error[end:]) > np.abs(usual[end:]) + MAX_EXCESS)
    if len(wrong) == 0:
        return 0.0
    last = end + int(wrong[-1])
    return None if t[-1] - t[last] < LAST else float(t[last] - t[min(end, len(t) - 1)])


def _growth(now: ErrorCurve, usual: ErrorCurve, first: int) -> float | None:
    """The largest ratio of σ to σ without the fault, of tilt or of heading."""
    pairs = ((now.sigma_tilt, usual.sigma_tilt), (now.sigma_heading, usual.sigma_heading))
    ratios = []
    for grown, before in pairs:
        if grown is None or before is None:
            return None
        good = (before[first:] > 0.0) & np.isfinite(grown[first:])
        ratios.append(float((grown[first:][good] / before[first:][good]).max(initial=1.0)))
    return max(ratios)


def _thin(t: Array, values: Array) -> tuple[Array, Array]:
    """At most POINTS times and the largest value of the stretch that begins at each; NaN where nothing is known."""
    starts = np.unique(np.linspace(0, len(t) - 1, min(POINTS, len(t))).astype(int))
    filled = np.where(np.isfinite(values), values, -np.inf)
    largest = np.maximum.reduceat(filled, starts)
    return t[starts], np.where(np.isfinite(largest), largest, np.nan)
