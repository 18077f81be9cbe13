"""Where a reference contradicts the gyroscope: an optical system has lost the body, or found another one.

Over ``SPAN`` s reference and gyroscope give two rotations. No sensor is wrong by more than ``MIN_ANGLE`` and ``SHARE``
of the rotation in so short a time, unless it is at full scale or has lost samples. Such spans do not count. The
reference is invalid from the last agreement to its end: markers that are found again may have moved on the body.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from levelhead.bench.reference import SensorFrame, align_sensor
from levelhead.engine import fuse
from levelhead.filters import GyroIntegration
from levelhead.recording import Recording
from levelhead.rotations import angle, relative_rotation

REFERENCE_ENDS = "reference ends"  # key of a recording's meta
SPAN = 0.25  # s
MIN_ANGLE = np.radians(15.0)
SHARE = 0.1  # of the turn
LOST = 3.0  # usual intervals without a sample
LATE = 10.0  # and so many: those that come next come late
SOON = 1.0  # s after it
MIN_CLUSTER = 5  # contradictory spans within two of their length; fewer are a single wrong sample
RANGE = 0.97  # of the largest rate: it may have been larger


def contradiction(recording: Recording, frame: SensorFrame | None) -> float | None:
    """Time (s on the recording's clock) at which the truth last agrees with the gyroscope; None: it does to the end.

    Args:
        recording: with truth.
        frame: the rotation from the truth's body to the sensor, if known.
    """
    assert recording.truth is not None
    quat = recording.truth.quat if frame is None else frame.turn(recording.truth.quat)
    known = np.flatnonzero(~np.isnan(quat[:, 0]))
    t = recording.t[known]
    last = np.searchsorted(t, t + SPAN)
    first = np.flatnonzero(last < len(t))
    last = last[first]
    near = t[last] - t[first] < 2.0 * SPAN
    first, last = first[near], last[near]
    usable = _usable(recording, known[first], known[last])
    first, last = first[usable], last[usable]
    turned = relative_rotation(quat[known[first]], quat[known[last]])
    seen = fuse(recording, GyroIntegration(), guard=None).quat
    measured = relative_rotation(seen[known[first]], seen[known[last]])
    apart = angle(relative_rotation(turned, measured))
    excess = apart - SHARE * angle(measured)
    wrong = np.flatnonzero(excess > MIN_ANGLE)
    close = t[first[wrong[MIN_CLUSTER - 1 :]]] - t[first[wrong[: 1 - MIN_CLUSTER]]] < 2.0 * SPAN
    if not close.any():
        return None
    sound = np.flatnonzero(excess[: wrong[close.argmax()]] < 0.2 * MIN_ANGLE)
    return float(t[first[sound[-1]]]) if len(sound) else float(t[0])


def _usable(recording: Recording, first: NDArray[np.intp], last: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Spans without lost or late samples, without missing rates and below full scale."""
    size = np.abs(recording.gyr).max(axis=1)
    t, steps = recording.t, np.diff(recording.t, prepend=recording.t[0])
    usual = np.median(steps)
    bad = np.isnan(size) | (size > RANGE * np.nanmax(size, initial=0.0)) | (steps > LOST * usual)
    for start in t[steps > LATE * usual]:
        bad |= (t >= start) & (t < start + SOON)
    count = np.cumsum(bad)
    kept: NDArray[np.bool_] = count[last] == count[first]
    return kept


def trust_until_contradiction(recording: Recording) -> Recording:
    """The recording without its truth from where a contradiction begins: ``REFERENCE_ENDS`` (s) of ``meta``."""
    if recording.truth is None:
        return recording
    start = contradiction(recording, align_sensor(recording))
    if start is None:
        return recording
    quat = recording.truth.quat.copy()
    quat[recording.t >= start] = np.nan
    meta = {**recording.meta, REFERENCE_ENDS: start}
    return replace(recording, truth=replace(recording.truth, quat=quat), meta=meta)
