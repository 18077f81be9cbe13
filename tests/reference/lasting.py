"""A gyroscope that warms, and a recording without its magnetometer for an hour."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import levelhead as lh
from levelhead.evaluate.score import error_angles

WARMING = np.radians(0.5) * np.array([1.0, -1.0, 1.0])  # rad/s, by which the bias runs,
WARM_UP = 600.0  # s, in this time
BEFORE, HOUR, AFTER = 240.0, 3600.0, 120.0  # s with, without and again with a magnetometer
SLOW = 50.0  # Hz, of that recording
BACK = 3.0  # °
SHORT = 10.0  # s after a return in which tilt must not jump


def warming(motion: str, seed: int) -> tuple[lh.Recording, lh.Recording]:
    """A recording, and the same with a bias that runs away."""
    steady = lh.simulate.recording("LSM6DSO32", motion, WARM_UP, seed=seed, mag="HMC5883L")
    assert steady.truth is not None and steady.truth.bias is not None
    ramp = np.outer(steady.t / WARM_UP, WARMING)
    truth = replace(steady.truth, bias=steady.truth.bias + ramp)
    return steady, replace(steady, gyr=steady.gyr + ramp, truth=truth)


class Gone(NamedTuple):
    """What an hour without a magnetometer did. Angles in °."""

    sigma: float  # of heading, at the end of the hour
    error: float  # of heading, there
    back: float  # s until it is right again
    step: float  # largest change from one sample to the next, after the return, of the tilt that it causes
    tilt: float  # RMS tilt error in the hour and after it,
    tilt_with: float  # and had it never been gone


def hidden(motion: str, seed: int, chip: str = "LSM6DSO32") -> tuple[lh.Recording, lh.Recording]:
    """A recording, and the same without the magnetometer for an hour."""
    whole = lh.simulate.recording(chip, motion, BEFORE + HOUR + AFTER, SLOW, seed, mag="HMC5883L")
    mag = np.array(whole.mag)
    mag[int(BEFORE * SLOW) : int((BEFORE + HOUR) * SLOW)] = np.nan
    return whole, replace(whole, mag=mag)


def gone(whole: lh.Recording, without: lh.Recording, params: Any) -> Gone:
    """A filter on both."""
    tracks = [lh.fuse(recording, params, engine="compiled") for recording in (whole, without)]
    with_it, errors = (error_angles(whole, track) for track in tracks)
    end = int((BEFORE + HOUR) * SLOW)
    heading = np.degrees(np.abs(errors.heading))
    far = np.flatnonzero(heading[end:] > BACK)
    between = tracks[1].as_rotation() * tracks[0].as_rotation().inv()
    up = np.degrees(np.arccos(np.clip(between.apply([0.0, 0.0, 1.0])[:, 2], -1.0, 1.0)))
    rest = slice(int(BEFORE * SLOW), None)
    tilts = [float(np.degrees(np.sqrt(np.mean(e.tilt[rest] ** 2)))) for e in (errors, with_it)]
    sigma = tracks[1].sigma_heading
    assert sigma is not None
    return Gone(
        float(np.degrees(sigma[end - 1])),
        float(heading[end - 1]),
        (far[-1] + 1) / SLOW if len(far) else 0.0,
        float(np.abs(np.diff(up[end - 1 : end + int(SHORT * SLOW)])).max()),
        *tilts,
    )
