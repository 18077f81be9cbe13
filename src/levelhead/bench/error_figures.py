"""Errors of one method on one recording."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.bench.reference import SensorFrame
from levelhead.evaluate.attitude_error import Errors, error_quaternion, heading_offset, split_error
from levelhead.evaluate.score import rms, scored_rows
from levelhead.recording import Array, Recording
from levelhead.rotations import mean, relative_rotation, turn_heading

WINDOW = 60.0  # s, over which heading drifts; half of a recording that is shorter than two of these
STRIDE = 10.0  # s from one window to the next, a sixth of a shorter window
EDGE = 0.5  # s, half of the averaging time at either end of a window
MAX_SIGMAS = 4.0  # σ
REFERENCE = np.radians(0.3)  # 1σ of a reference's own heading, which a σ of zero has to meet


class ErrorFigures(NamedTuple):
    """RMS errors over the movement phases, in degrees, as ``levelhead.evaluate.attitude_error`` defines them.

    ``aligned`` is the total error once the best constant heading offset of the whole recording is removed; where the
    recording's heading is relative it is the same as ``total``. ``drift`` is the RMS change of the heading
    error over 60 s, or over half of a recording that is shorter than two minutes; None where there is too little.

    The other figures are taken with the reference turned into the sensor's frame (``bench.reference``) and the best
    constant rotation of its earth frame removed: neither a filter nor its σ can include it. ``rotated`` is the total
    error, ``rotated_tilt`` its tilt, ``beyond_tilt`` and ``beyond_heading`` the share of samples whose error is more
    than four of their σ, ``tilt_ratio`` and ``heading_ratio`` the RMS of error/σ; None for a method without σ. Of
    heading these are without the constant that fits best with weights 1/σ².
    """

    total: float
    heading: float
    tilt: float
    aligned: float
    drift: float | None
    rotated: float
    rotated_tilt: float
    beyond_tilt: float | None = None
    beyond_heading: float | None = None
    tilt_ratio: float | None = None
    heading_ratio: float | None = None


def measure_errors(
    recording: Recording, quat: Array, absolute: bool, sigma: Array | None = None, frame: SensorFrame | None = None
) -> ErrorFigures:
    """The figures of (n, 4) orientations wxyz, none of them NaN.

    Args:
        recording: with truth.
        quat: one per sample.
        absolute: whether heading counts as it is; if not, the best constant offset is removed first.
        sigma: (n, 3) 1σ of the attitude error about east, north and up, rad.
        frame: the rotation between the reference's body and the sensor, if it was found.
    """
    assert recording.truth is not None
    rows = scored_rows(recording.truth)
    error = error_quaternion(quat, recording.truth.quat)
    aligned = split_error(turn_heading(error, -heading_offset(error, rows)))
    plain = split_error(error) if absolute else aligned
    truth = recording.truth.quat if frame is None else frame.turn(recording.truth.quat)
    rotated = split_error(_remove_mean_rotation(error_quaternion(quat[rows], truth[rows])))
    found = ErrorFigures(
        total=_degrees(plain.total[rows]),
        heading=_degrees(plain.heading[rows]),
        tilt=_degrees(plain.tilt[rows]),
        aligned=_degrees(aligned.total[rows]),
        drift=drift(recording.t, plain, rows),
        rotated=_degrees(rotated.total),
        rotated_tilt=_degrees(rotated.tilt),
    )
    if sigma is None:
        return found
    tilt = rotated.tilt / np.maximum(np.hypot(sigma[rows, 0], sigma[rows, 1]), 1e-9)
    heading = _heading_over_sigma(rotated.heading, sigma[rows, 2])
    return found._replace(
        beyond_tilt=float(np.mean(tilt > MAX_SIGMAS)),
        beyond_heading=float(np.mean(heading > MAX_SIGMAS)),
        tilt_ratio=rms(tilt),
        heading_ratio=rms(heading),
    )


def _heading_over_sigma(heading: Array, sigma: Array) -> Array:
    """(n,) absolute heading errors (rad) over their 1σ (rad), without the constant that these σ make most likely.

    A heading without magnetometer is right by definition where it starts, and its σ grows from there. The plain mean
    would charge that start with the drift of the whole recording.
    """
    known = np.hypot(sigma, REFERENCE)
    turn = np.exp(1j * heading)
    offset = np.angle(np.sum(turn / known**2))
    ratio: Array = np.abs(np.angle(turn * np.exp(-1j * offset))) / known
    return ratio


def _remove_mean_rotation(error: Array) -> Array:
    """(n, 4) errors without their mean rotation."""
    return relative_rotation(mean(error), error)


def _degrees(values: Array) -> float:
    return float(np.degrees(rms(values)))


def drift(t: Array, errors: Errors, rows: NDArray[np.bool_]) -> float | None:
    """RMS in degrees of how far the heading error moves in 60 s, over windows that start every 10 s.

    Either end of a window is the circular mean over a second. Windows lie between the first and the last row that
    counts; rest in between belongs to them, for heading drifts then too. A shorter recording than two minutes has
    windows of half its length, every sixth of that.
    """
    counting = t[rows]
    window = min(WINDOW, 0.5 * float(counting[-1] - counting[0]))
    starts = np.arange(counting[0] + EDGE, counting[-1] - window - EDGE, STRIDE if window == WINDOW else window / 6.0)
    known = ~np.isnan(errors.heading)
    moved = [_level(t, errors, known, start + window) - _level(t, errors, known, start) for start in starts]
    change = np.array([step for step in moved if np.isfinite(step)])
    if len(change) == 0:
        return None
    return _degrees((change + np.pi) % (2.0 * np.pi) - np.pi)


def _level(t: Array, errors: Errors, known: NDArray[np.bool_], when: float) -> float:
    """Circular mean of the heading error, rad, within half a second of an instant; NaN where no truth is known."""
    near = slice(*np.searchsorted(t, (when - EDGE, when + EDGE)))
    here = errors.heading[near][known[near]]
    return float(np.arctan2(np.sin(here).sum(), np.cos(here).sum())) if len(here) else np.nan
