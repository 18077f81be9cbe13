"""The expected errors of a fused track, and the verdict in one line."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from levelhead.engine import fuse
from levelhead.errors import LevelheadError
from levelhead.inspection.field_azimuth import expected_heading_error
from levelhead.inspection.findings import Finding
from levelhead.recording import Array, Recording
from levelhead.rotations import conjugate, rotate
from levelhead.track import Track

EXCERPT = 60_000  # samples that are fused for the expectation, at most: some 0.2 s
EXCERPT_PLAIN = 2_000  # without the native engine
WINDOW = 2.0  # s over which the forces of a track are averaged
MIN_WINDOWS = 4  # that make a mean
# deg, where a log is too short for ``expected_heading_error``
HEADING_ADDED = {"mag_offset": 15.0, "mag_disturbed": 15.0, "mag_axes": 30.0, "mag_strength": 10.0}  # deg
_NO_DRIFT = 0.05  # deg a minute, which would be written as 0
SETTLED = 5.0  # s of the start that do not count
POOR = 20.0  # deg of tilt that nothing can be built on


class Expectation(NamedTuple):
    """1σ of tilt and heading in deg, and drift of heading in deg a minute; None where there is none."""

    tilt: float | None
    heading: float | None
    drift: float | None


def expectation(recording: Recording, findings: Sequence[Finding]) -> Expectation:
    """The expected quality of a track fused from this recording.

    A finding with a repair counts with the tilt between the tracks fused with and without it. Tilt is at least that of
    the forces (``find_tilt_in_forces``), whatever its cause.
    """
    plain = replace(recording, mag=None)  # tilt hardly depends on the field
    mended = plain
    for one in findings:
        if one.mend is not None and one.mend.role != "mag":
            mended = one.mend.apply(mended)
    track = _fuse_start(plain)
    right = track
    if mended is not plain:
        track, right = _fuse_start(recording), _fuse_start(mended)
    if track is None or right is None or track.sigma is None or right.sigma is None:
        return Expectation(None, None, None)
    late = track.t > track.t[0] + min(SETTLED, 0.3 * (track.t[-1] - track.t[0]))
    sigma = np.degrees(right.sigma[late])
    away = 0.0
    if right is not track:
        away = float(np.nanmean(np.degrees(tilt_between(track.quat[late], right.quat[late])) ** 2))
    claimed = float(np.sqrt(np.nanmean(sigma[:, 0] ** 2 + sigma[:, 1] ** 2) + away))
    tilt = max(claimed, find_tilt_in_forces(track.t[late], track.quat[late], recording.acc[: len(late)][late]))
    if recording.mag is None:
        return Expectation(tilt, None, _drift(track.t[late], sigma[:, 2]))
    heading = expected_heading_error(recording[: len(track)], track)
    if heading is None and (whole := _fuse_start(recording)) is not None and whole.sigma is not None:
        unseen = sum(HEADING_ADDED[one] ** 2 for one in {one.name for one in findings} & set(HEADING_ADDED))
        heading = float(np.sqrt(np.nanmean(np.degrees(whole.sigma[late, 2]) ** 2) + unseen))
    return Expectation(tilt, heading, None)


def find_tilt_in_forces(t: Array, quat: Array, acc: Array) -> float:
    """RMS tilt error τ in deg that the forces of a track show; 0 where it is too short to show one.

    In the earth's frame the mean force over T is gravity and Δv/T. With tilt errors that last longer than 2T its angle
    from the vertical is α(T)² = τ² + (a/T)², so that τ² = (4 α(2T)² − α(T)²) / 3 for velocities that stay bounded.

    Args:
        t: (n,) s.
        quat: (n, 4) orientations of the track.
        acc: (n, 3) specific force, m/s².
    """
    known = np.isfinite(acc).all(axis=1) & np.isfinite(quat).all(axis=1)
    if not known.any():
        return 0.0
    since, force = (t - t[0])[known], rotate(quat[known], acc[known])
    squares = []
    for window in (WINDOW, 2.0 * WINDOW):
        index = (since / window).astype(np.intp)
        total = np.stack([np.bincount(index, axis)[: index[-1]] for axis in force.T], axis=1)
        total = total[total.any(axis=1)]
        if len(total) < MIN_WINDOWS:
            return 0.0
        angle = np.degrees(np.arctan2(np.hypot(total[:, 0], total[:, 1]), total[:, 2]))
        squares.append(float((angle**2).mean()))
    short, long = squares
    return float(np.sqrt(max(0.0, (4.0 * long - short) / 3.0)))


def tilt_between(a: Array, b: Array) -> Array:
    """(n,) angles in rad between the verticals of (n, 4) orientations, as the sensor sees them."""
    up = np.array([0.0, 0.0, 1.0])
    cosine = (rotate(conjugate(a), up) * rotate(conjugate(b), up)).sum(axis=1)
    made: Array = np.arccos(np.clip(cosine, -1.0, 1.0))
    return made


def _fuse_start(recording: Recording) -> Track | None:
    """The start of a recording through the default filter; None where it cannot be fused."""
    try:
        return fuse(recording[:EXCERPT], engine="native")
    except LevelheadError:
        pass
    try:
        return fuse(recording[:EXCERPT_PLAIN], engine="python")
    except LevelheadError:
        return None


def _drift(t: Array, sigma: Array) -> float:
    """By how much heading's σ grows in a minute, deg; the bias that is not known yet is most of it.

    From where σ is least in the first half: a raw gyroscope's is larger at the start, until its bias is found.
    """
    first = int(np.argmin(sigma[: (len(sigma) + 1) // 2]))
    minutes = max(float(t[-1] - t[first]) / 60.0, 1e-3)
    return float(np.sqrt(max(float(sigma[-1] ** 2 - sigma[first] ** 2), 0.0)) / minutes)


def verdict(recording: Recording, findings: Sequence[Finding], expected: Expectation) -> str:
    """One line."""
    broken = [one for one in findings if one.severity == "broken"]
    if broken or expected.tilt is None:
        size = "" if expected.tilt is None else f"; tilt would be off by about {expected.tilt:.2g}°"
        return f"not to be trusted as it is: {broken[0].what if broken else 'it cannot be fused'}{size}"
    words = f"good for tilt to {expected.tilt:.2g}°"
    if expected.tilt > POOR:
        words = f"tilt is known to {expected.tilt:.2g}° only"
    if expected.heading is not None:
        words += f", heading to {expected.heading:.2g}°"
    else:
        rest = ", no rest" if "never_still" in {one.name for one in findings} else ""
        slow = expected.drift is None or not expected.drift > _NO_DRIFT
        drift = "heading is relative" if slow else f"heading will drift about {expected.drift:.2g}° a minute"
        words += f", {drift}: no magnetometer{'' if slow else rest}"
    worse = [one.name for one in findings if one.severity == "warning"]
    count = "1 warning" if len(worse) == 1 else f"{len(worse)} warnings"
    return words + (f"; {count}: {', '.join(worse[:4])}" if worse else "")
