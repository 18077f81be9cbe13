"""The heading error that the field causes: its azimuth's change in a frame of gyroscope and gravity."""

import numpy as np

from levelhead.recording import Array, Recording
from levelhead.rotations import rotate
from levelhead.track import Track

WINDOW = 10.0  # s over which the azimuth is averaged: vibration and the swing of a step are gone
MIN_WINDOWS = 5  # windows; two are spent on the line of drift
FULL = 0.3  # share of a window's usual number of readings, at least
FOLLOWS = 0.5  # share of the wandering that is in a fused heading: see ``expected_heading_error``


def expected_heading_error(recording: Recording, plain: Track) -> float | None:
    """1σ of heading in deg that the field's disturbance causes; None if the recording is too short.

    ``plain`` is a track of the same samples without the magnetometer: its frame is level and turns only with the drift
    of the gyroscope. There the azimuth of the field is constant, but for that drift, which is taken out as a straight
    line, and for iron. A filter follows a part of the rest. The part was found on BROAD, tyrex and fiumarg, by the
    likelihood of the errors (``benchmarks/reader/expectations.py``): 0.53 on all, 0.45 to 0.6 with whole sets left out.
    """
    if recording.mag is None:
        return None
    known = np.isfinite(recording.mag).all(axis=1) & np.isfinite(plain.quat).all(axis=1)
    if not known.any():
        return None
    east, north, _ = rotate(plain.quat[known], recording.mag[known]).T
    wander = _scatter(recording.t[known] - recording.t[0], np.arctan2(north, east))
    return None if wander is None else min(FOLLOWS * wander, 90.0)


def _scatter(t: Array, azimuth: Array) -> float | None:
    """The standard deviation in deg of (n,) angles in rad, averaged over windows, about their straight line."""
    window = (t / WINDOW).astype(np.intp)
    counts = np.bincount(window)
    sums = np.bincount(window, np.cos(azimuth)) + 1j * np.bincount(window, np.sin(azimuth))
    full = counts > FULL * np.median(counts[counts > 0])
    if full.sum() < MIN_WINDOWS:
        return None
    middle = (np.flatnonzero(full) + 0.5) * WINDOW
    means = np.unwrap(np.angle(sums[full]))
    line = np.polyfit(middle - middle.mean(), means, 1)
    rest = means - np.polyval(line, middle - middle.mean())
    return float(np.degrees(np.sqrt((rest**2).sum() / (len(rest) - 2))))
