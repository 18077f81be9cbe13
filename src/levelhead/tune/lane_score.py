"""The errors of ``evaluate.score.root_mean_squares``, gathered while many parameter sets run side by side.

The formulas are those of ``evaluate.attitude_error``. Its heading offset is known at the end of a run only, so where
heading is relative the sets run twice: once for the offset, once for the errors without it. Sums are taken in another
order than NumPy's and angles by the kernels' own atan2, so the last few of the 16 digits may differ.
"""

from collections.abc import Callable, Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from levelhead.compiler.mark import kernel
from levelhead.engine import lanes
from levelhead.evaluate.score import scored_rows
from levelhead.filters.contract import Filter
from levelhead.filters.parameters import Params
from levelhead.kernels.quat import Quat
from levelhead.kernels.trig import atan2
from levelhead.recording import Array, Recording


class Offset(NamedTuple):
    """The two sums of eq. 5 of ``evaluate.attitude_error``: Σ 2wz and Σ (w² − z²)."""

    sine: float
    cosine: float


class Squares(NamedTuple):
    """Sums of squared angles, rad², of estimates turned back by a heading: cos and sin of its half."""

    cos: float
    sin: float
    total: float
    tilt: float
    heading: float


@kernel
def add_offset(sums: Offset, quat: Quat, truth: Quat) -> Offset:
    """One sample more for the heading offset."""
    a, b, c, d = quat
    w = a * truth.w + b * truth.x + c * truth.y + d * truth.z
    z = d * truth.w - a * truth.z - b * truth.y + c * truth.x
    return Offset(sums.sine + 2.0 * w * z, sums.cosine + (w * w - z * z))


@kernel
def add_squares(sums: Squares, quat: Quat, truth: Quat) -> Squares:
    """One sample more for the errors."""
    a, b, c, d = quat
    aligned_w = sums.cos * a + sums.sin * d
    aligned_z = sums.cos * d - sums.sin * a
    aligned_x = sums.cos * b + sums.sin * c
    aligned_y = sums.cos * c - sums.sin * b
    w = aligned_w * truth.w + aligned_x * truth.x + aligned_y * truth.y + aligned_z * truth.z
    x = aligned_x * truth.w - aligned_w * truth.x - aligned_y * truth.z + aligned_z * truth.y
    y = aligned_y * truth.w - aligned_w * truth.y - aligned_z * truth.x + aligned_x * truth.z
    z = aligned_z * truth.w - aligned_w * truth.z - aligned_x * truth.y + aligned_y * truth.x
    across = x * x + y * y
    total = atan2(sqrt(across + z * z), abs(w))
    tilt = atan2(sqrt(across), sqrt(w * w + z * z))
    heading = atan2(abs(z), abs(w))
    return Squares(
        sums.cos,
        sums.sin,
        sums.total + total * total,
        sums.tilt + tilt * tilt,
        sums.heading + heading * heading,
    )


OFFSET = lanes.Observer("offset", add_offset, Offset(0.0, 0.0))
SQUARES = lanes.Observer("squares", add_squares, Squares(1.0, 0.0, 0.0, 0.0, 0.0))


def lane_root_mean_squares(
    recording: Recording,
    flt: Filter,
    parameter_sets: Sequence[Params],
    progress: Callable[[float], None] | None = None,
) -> Array:
    """(k, 3) RMS of total, tilt and heading error in degrees, for each of k parameter sets of one filter."""
    truth = recording.truth
    if truth is None:
        raise ValueError("needs a recording with truth")
    rows = scored_rows(truth)
    real = np.where(rows[:, None], truth.quat, np.nan)
    start = np.tile(SQUARES.start, (len(parameter_sets), 1))
    share, done = 1.0, 0.0

    def report(part: float) -> None:
        if progress is not None:
            progress(done + share * part)

    if not (truth.north and recording.mag is not None and "heading" in flt.estimates):  # as score.absolute_heading
        share = 0.5
        sums = lanes.observe_lanes(
            recording, flt, parameter_sets, OFFSET, real, np.zeros((len(parameter_sets), 2)), progress=report
        )
        half = 0.5 * np.arctan2(sums[:, 0], sums[:, 1])
        start[:, 0], start[:, 1] = np.cos(half), np.sin(half)
        done = 0.5
    sums = lanes.observe_lanes(recording, flt, parameter_sets, SQUARES, real, start, progress=report)
    found: Array = np.degrees(2.0 * np.sqrt(sums[:, 2:] / np.count_nonzero(rows)))
    return found
