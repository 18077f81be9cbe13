"""The angle of a joint from a sensor on each of its two segments, without a magnetometer.

``hinge`` finds the axis and the relative heading, ``angle`` the angle and its σ, ``result`` holds both.
"""

from dataclasses import replace

import numpy as np

from levelhead.engine.smoothing import smooth
from levelhead.errors import LevelheadError
from levelhead.joints.angle import hinge_angle, hinge_sigma
from levelhead.joints.hinge import MIN_SAMPLES, fit_hinge
from levelhead.joints.result import Joint
from levelhead.recording import Array, Recording
from levelhead.rotations import interpolate, matrix
from levelhead.track import Track

MIN_OVERLAP = 5.0  # s
ABSENT_TILT = np.radians(2.0)  # rad, 1σ of a tilt whose track has no σ

__all__ = ["Joint", "joint"]


def joint(upper: Recording | Track, lower: Recording | Track, *, zero: float | None = None) -> Joint:
    """The angle of a hinge between two segments, each with a sensor in any mounting.

    The axis in either sensor and the relative heading are found from the motion: both sensors have to agree on the
    direction of the axis at every instant (T. Seel, J. Raisch, T. Schauer, Sensors 14(4), 2014, section 3.1; D. Laidig,
    D. Lehmann, M.-A. Bégin, T. Seel, IEEE EMBC 2019, eq. 5). No magnetometer is used.

    Args:
        upper: the sensor of the segment that counts as fixed; a Recording is smoothed without its magnetometer first.
        lower: the sensor of the other segment, on the same clock.
        zero: stamp in s at which the angle is zero; None: the first common stamp.

    Returns:
        A Joint with the stamps of ``upper`` that both sensors cover.

    Raises:
        LevelheadError: neither a Recording nor a Track, less than 5 s in common, or ``zero`` outside of them.
    """
    first, second = _track(upper, "upper"), _track(lower, "lower")
    t, rows = _common_stamps(first.t, second.t)
    start = t[0] if zero is None else float(zero)
    if not t[0] <= start <= t[-1]:
        raise LevelheadError(f"zero is {start:g} s; expected a stamp between {t[0]:g} and {t[-1]:g} s")
    upper_axes, lower_axes = matrix(first.quat[rows]), matrix(interpolate(t, second.t, second.quat))
    fit = fit_hinge(t, upper_axes, lower_axes)
    angle = hinge_angle(fit, upper_axes, lower_axes)
    angle -= np.interp(start, t, angle)
    variance = _tilt_variance(first, t) + _tilt_variance(second, t)
    sigma = hinge_sigma(fit, lower_axes, variance)
    return Joint(t, np.degrees(angle), np.degrees(sigma), fit)


def _track(sensor: object, name: str) -> Track:
    if isinstance(sensor, Track):
        return sensor.to_frame("ENU")
    if isinstance(sensor, Recording):
        return smooth(replace(sensor, mag=None))
    raise LevelheadError(f"{name} is of type {type(sensor).__name__}; expected a Recording or a Track")


def _common_stamps(upper: Array, lower: Array) -> tuple[Array, slice]:
    """The stamps of ``upper`` within ``lower``, and their rows."""
    first, last = np.searchsorted(upper, lower[0], "left"), np.searchsorted(upper, lower[-1], "right")
    t = upper[first:last]
    if len(t) < MIN_SAMPLES or t[-1] - t[0] < MIN_OVERLAP:
        raise LevelheadError(
            f"the sensors have {max(0.0, min(upper[-1], lower[-1]) - max(upper[0], lower[0])):.3g} s in common "
            f"(upper {upper[0]:g} to {upper[-1]:g} s, lower {lower[0]:g} to {lower[-1]:g} s); expected one clock and "
            f"at least {MIN_OVERLAP:g} s"
        )
    return t, slice(int(first), int(last))


def _tilt_variance(track: Track, t: Array) -> Array:
    """(n,) rad², the variance of tilt about one horizontal axis at the stamps ``t``."""
    sigma = track.sigma_tilt
    if sigma is None:
        return np.full(len(t), ABSENT_TILT**2)
    return 0.5 * np.interp(t, track.t, sigma) ** 2
