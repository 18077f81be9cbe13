"""What is measured of one method on one recording."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.evaluate.attitude_error import Errors, error_quaternion, heading_offset, split, turn_heading
from levelhead.evaluate.score import rms, scored_rows
from levelhead.recording import Array, Recording

WINDOW = 60.0  # s, over which heading drifts
STRIDE = 10.0  # s from one window to the next
EDGE = 0.5  # s, half of what is averaged at either end of a window


class ErrorFigures(NamedTuple):
    """RMS errors over the movement phases, in degrees, as ``levelhead.evaluate.attitude_error`` defines them.

    ``aligned`` is the total error once the best constant heading offset of the whole recording is removed; where the
    recording knows heading only relatively it is the same as ``total``. ``drift`` is the RMS change of the heading
    error over 60 s; None in a recording that is shorter.
    """

    total: float
    heading: float
    tilt: float
    aligned: float
    drift: float | None


def measure(recording: Recording, quat: Array, absolute: bool) -> ErrorFigures:
    """The figures of (n, 4) orientations wxyz, none of them NaN.

    Args:
        recording: with truth.
        quat: one per sample.
        absolute: whether heading counts as it is; if not, the best constant offset is removed first.
    """
    assert recording.truth is not None
    rows = scored_rows(recording.truth)
    error = error_quaternion(quat, recording.truth.quat)
    aligned = split(turn_heading(error, -heading_offset(error, rows)))
    plain = split(error) if absolute else aligned
    return ErrorFigures(
        total=_degrees(plain.total[rows]),
        heading=_degrees(plain.heading[rows]),
        tilt=_degrees(plain.tilt[rows]),
        aligned=_degrees(aligned.total[rows]),
        drift=drift(recording.t, plain, rows),
    )


def _degrees(values: Array) -> float:
    return float(np.degrees(rms(values)))


def drift(t: Array, errors: Errors, rows: NDArray[np.bool_]) -> float | None:
    """RMS in degrees of how far the heading error moves in 60 s, over windows that start every 10 s.

    Either end of a window is the circular mean over a second. Windows lie between the first and the last row that
    counts; rest in between belongs to them, for heading drifts then too.
    """
    counting = t[rows]
    starts = np.arange(counting[0] + EDGE, counting[-1] - WINDOW - EDGE, STRIDE)
    known = ~np.isnan(errors.heading)
    moved = [_level(t, errors, known, start + WINDOW) - _level(t, errors, known, start) for start in starts]
    change = np.array([step for step in moved if np.isfinite(step)])
    if len(change) == 0:
        return None
    return _degrees((change + np.pi) % (2.0 * np.pi) - np.pi)


def _level(t: Array, errors: Errors, known: NDArray[np.bool_], when: float) -> float:
    """Circular mean of the heading error, rad, within half a second of an instant; NaN where no truth is known."""
    near = slice(*np.searchsorted(t, (when - EDGE, when + EDGE)))
    here = errors.heading[near][known[near]]
    return float(np.arctan2(np.sin(here).sum(), np.cos(here).sum())) if len(here) else np.nan
