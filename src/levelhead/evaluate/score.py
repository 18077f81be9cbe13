"""A Score: a track against the truth, in the numbers that papers and data sheets use."""

from dataclasses import asdict, dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.evaluate.attitude_error import Errors, error_quaternion, heading_offset, split_error
from levelhead.evaluate.lag import lag
from levelhead.recording import Array, Recording, Truth
from levelhead.rotations import turn_heading
from levelhead.track import Track


@dataclass(frozen=True)
class Score:
    """Root mean square errors over the movement phases, in degrees.

    Attributes:
        total: RMS angle between estimate and truth, °.
        total_aligned: the same with the best constant heading removed (eq. 5 of ``attitude_error``), °, also where
            both are absolute: a recording's reference frame may be turned against magnetic north by some degrees.
        tilt: RMS inclination error, °.
        heading: RMS heading error, °.
        worst: largest angle between estimate and truth, °.
        heading_offset: constant heading removed first, °, because one of the two is relative; None if
            both are absolute.
        bias: RMS length of the bias error over the axes estimated, °/s; None without a true or an estimated bias.
        bias_axes: RMS bias error about x, y and z, °/s; None for an axis that the filter does not estimate.
        lag: ms by which the estimate trails the truth; None when the motion is too small.
        tilt_error_ratio: RMS of tilt error over its own σ: 1 if σ is right, more if σ is too small; None without σ.
        heading_error_ratio: the same for heading; None without σ or without absolute heading.
        samples: samples compared.
    """

    total: float
    total_aligned: float
    tilt: float
    heading: float
    worst: float
    heading_offset: float | None
    bias: float | None
    bias_axes: tuple[float | None, float | None, float | None] | None
    lag: float | None
    tilt_error_ratio: float | None
    heading_error_ratio: float | None
    samples: int

    def to_dict(self) -> dict[str, object]:
        """The attributes by name, ready for JSON (None, never NaN)."""
        return asdict(self)

    def __str__(self) -> str:
        parts = f"total {self.total:.4f}°, tilt {self.tilt:.4f}°, heading {self.heading:.4f}°"
        lines = [f"{parts} RMS, worst {self.worst:.4f}°"]
        if self.heading_offset is None:
            lines.append(f"total {self.total_aligned:.4f}° with the best constant heading removed")
        else:
            lines.append(f"heading is relative: a constant {self.heading_offset:.2f}° was removed first")
        if self.bias is not None:
            lines.append(f"bias {self.bias:.4f} °/s RMS")
        if self.lag is not None:
            lines.append(f"{abs(self.lag):.1f} ms {'late' if self.lag >= 0.0 else 'early'}")
        if self.tilt_error_ratio is not None:
            heading = "" if self.heading_error_ratio is None else f", heading {self.heading_error_ratio:.3g}"
            lines.append(f"error over its own σ: tilt {self.tilt_error_ratio:.3g}{heading} (1: σ is right)")
        return "\n".join(lines)


def require_truth(recording: Recording, track: Track, partial: bool = False) -> Truth:
    """The recording's truth, once it is sure that the track can be held against it.

    ``partial``: the track may be NaN where its source has no orientation.

    Raises:
        LevelheadError: no truth, another clock, or a track with a NaN orientation.
    """
    if recording.truth is None:
        raise LevelheadError("the recording holds no true orientation (Recording.truth), so no error can be computed")
    if len(track) != len(recording) or not np.array_equal(track.t, recording.t):
        raise LevelheadError(
            f"the track has {len(track)} samples from {track.t[0]:.6g} s, the recording {len(recording)} from "
            f"{recording.t[0]:.6g} s; expected one orientation per sample, at the same times"
        )
    lost = np.isnan(track.quat).any(axis=1)
    if lost.any() and not partial:
        raise LevelheadError(f"the track's orientation is NaN at row {int(lost.argmax())}; expected one per sample")
    return recording.truth


def scored_rows(truth: Truth) -> NDArray[np.bool_]:
    """(n,) the samples that count: truth known and, where ``moving`` exists, moving.

    Raises:
        LevelheadError: there is none.
    """
    rows = ~np.isnan(truth.quat[:, 0])  # Truth divides by the norm, so one NaN makes the whole row NaN
    if truth.moving is not None:
        rows &= truth.moving
    if not rows.any():
        raise LevelheadError("the true orientation is missing (NaN) or not moving at every sample: nothing to compare")
    return rows


def absolute_heading(recording: Recording, track: Track) -> bool:
    """Whether truth and track both have an absolute heading: the filter uses a magnetometer, and the truth has north.

    A track without params (from elsewhere) counts as one that uses the magnetometer.
    """
    if recording.truth is None or not recording.truth.north or recording.mag is None:
        return False
    if track.params is None:
        return True
    from levelhead.filters import of

    return "heading" in of(track.params).estimates


def error_angles(recording: Recording, track: Track) -> Errors:
    """Errors of every sample in rad (rest phases too), a relative heading aligned first as in ``evaluate``."""
    return _error_angles(recording, track.of_sensor()).errors


class _ErrorAngles(NamedTuple):
    """Errors in rad, the heading offset removed in rad (None: none was to be), the rows that count, and the total error
    in rad with the best offset removed in any case.
    """

    errors: Errors
    offset: float | None
    rows: NDArray[np.bool_]
    total: Array


def _error_angles(
    recording: Recording, track: Track, relative: bool | None = None, partial: bool = False
) -> _ErrorAngles:
    truth = require_truth(recording, track, partial)
    rows = scored_rows(truth)
    if partial:
        rows &= ~np.isnan(track.quat).any(axis=1)
        if not rows.any():
            raise LevelheadError("the track and the truth are never known at the same sample: nothing to compare")
    error = error_quaternion(track.quat, truth.quat)
    offset = heading_offset(error, rows)
    turned = split_error(turn_heading(error, -offset))
    if relative or (relative is None and not absolute_heading(recording, track)):
        return _ErrorAngles(turned, offset, rows, turned.total)
    return _ErrorAngles(split_error(error), None, rows, turned.total)


def rms(values: Array) -> float:
    """√ of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def root_mean_squares(recording: Recording, track: Track) -> tuple[float, float, float]:
    """RMS of total, tilt and heading error in degrees: the part of ``evaluate`` that a sweep needs."""
    truth = require_truth(recording, track)
    rows = np.flatnonzero(scored_rows(truth))
    error = error_quaternion(track.quat[rows], truth.quat[rows])
    if not absolute_heading(recording, track):
        error = turn_heading(error, -heading_offset(error, np.ones(len(rows), bool)))
    total, tilt, heading = (float(np.degrees(rms(values))) for values in split_error(error))
    return total, tilt, heading


def bias_errors(
    recording: Recording, track: Track, rows: NDArray[np.bool_]
) -> tuple[float | None, float | None, float | None] | None:
    """RMS bias error about x, y and z in °/s over ``rows``.

    An axis whose estimate is 0 from first to last was not estimated: None. So is one whose true bias is NaN.
    """
    truth = recording.truth
    if truth is None or truth.bias is None or track.bias is None:
        return None
    known = rows & ~np.isnan(truth.bias).any(axis=1)
    if not known.any() or not track.bias.any():
        return None
    difference = np.degrees(track.bias[known] - truth.bias[known])
    x, y, z = (rms(difference[:, axis]) if track.bias[:, axis].any() else None for axis in range(3))
    return x, y, z


def error_ratio(error: Array, sigma: Array | None, rows: NDArray[np.bool_]) -> float | None:
    """RMS of error over σ where σ is positive; None without such a σ. 1 when σ is right."""
    if sigma is None:
        return None
    good = rows & (sigma > 0.0)
    return rms(error[good] / sigma[good]) if good.any() else None


def evaluate(recording: Recording, track: Track, *, relative: bool | None = None, partial: bool = False) -> Score:
    """Errors of the track against the recording's truth.

    Only movement phases count (``truth.moving``) and only samples whose truth is known. Where truth or track has a
    relative heading, the best constant offset is removed first; it is ``Score.heading_offset``.

    Args:
        recording: with truth.
        track: one orientation per sample of it.
        relative: whether heading is relative; None: by recording and filter.
        partial: the track may have NaN rows, which do not count; else they are an error.

    Raises:
        LevelheadError: the recording holds no truth, or the track belongs to another recording.
    """
    track = track.of_sensor()
    found, offset, rows, aligned = _error_angles(recording, track, relative, partial)
    absolute = offset is None
    truth = require_truth(recording, track, partial)
    axes = bias_errors(recording, track, rows)
    late = lag(recording.t, track.quat, truth.quat, rows, with_heading=absolute)
    total, tilt, heading = (float(np.degrees(rms(values[rows]))) for values in found)
    return Score(
        total=total,
        total_aligned=float(np.degrees(rms(aligned[rows]))),
        tilt=tilt,
        heading=heading,
        worst=float(np.degrees(found.total[rows].max())),
        heading_offset=None if offset is None else float(np.degrees(offset)),
        bias=None if axes is None else float(np.sqrt(sum(value**2 for value in axes if value is not None))),
        bias_axes=axes,
        lag=None if late is None else 1e3 * late,
        tilt_error_ratio=error_ratio(found.tilt, track.sigma_tilt, rows),
        heading_error_ratio=error_ratio(found.heading, track.sigma_heading, rows) if absolute else None,
        samples=int(rows.sum()),
    )
