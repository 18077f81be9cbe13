"""The angles of a joint from a sensor on each of its two segments.

``hinge`` and ``two_axes`` find axes and relative heading by ``axes_fit``, ``hinge`` and ``cardan`` the angles and their
σ, ``result`` holds all.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from levelhead.engine.smoothing import smooth
from levelhead.errors import LevelheadError
from levelhead.joints.axes_fit import MIN_SAMPLES, AxesFit, about_vertical
from levelhead.joints.cardan import cardan_angles, cardan_sigma, frames_of_axes, frames_of_pose
from levelhead.joints.centre import Cost, centre_cost
from levelhead.joints.hinge import fit_hinge, hinge_angle, hinge_sigma
from levelhead.joints.result import Joint
from levelhead.joints.two_axes import fit_two_axes
from levelhead.recording import Array, Recording
from levelhead.rotations import interpolate, matrix
from levelhead.track import Track

MIN_OVERLAP = 5.0  # s
MAX_SKEW = 1e-3  # of a given rotation
ABSENT_TILT = np.radians(2.0)  # rad, 1σ of a tilt whose track has no σ

__all__ = ["Joint", "joint"]


def joint(
    upper: Recording | Track,
    lower: Recording | Track,
    *,
    axes: int = 1,
    frames: tuple[ArrayLike, ArrayLike] | None = None,
    zero: float | None = None,
) -> Joint:
    """The angles of a joint between two segments, each with a sensor in any mounting.

    **One axis** (knee, finger, robot): the axis in either sensor and the relative heading are found from the motion.
    Both sensors have to agree on the direction of the axis at every instant (T. Seel, J. Raisch, T. Schauer, Sensors
    14(4), 2014, section 3.1; D. Laidig, D. Lehmann, M.-A. Bégin, T. Seel, IEEE EMBC 2019, eq. 5).

    **Two axes** (elbow, wrist): likewise, from the constant angle between an axis of the upper and one of the lower
    segment (D. Laidig, P. Müller, T. Seel, Current Directions in Biomedical Engineering 3(2), 2017).

    **Three axes**: flexion, adduction and rotation by Grood and Suntay. The segments' frames are given, or follow from
    a neutral pose at ``zero``, with the segments upright, and the axis about which the joint bends most. The relative
    heading is that of this axis, or that of the tracks where both have north with a smaller σ.

    Args:
        upper: the sensor of the segment that counts as fixed; a Recording is smoothed first, without its magnetometer
            unless ``axes`` is 3.
        lower: the sensor of the other segment, on the same clock.
        axes: 1, 2 or 3.
        frames: of three axes: quaternions wxyz or matrices (3, 3) of both segments, from the segment's axes (x forward,
            y up, z to the right) to its sensor's.
        zero: stamp in s at which the angles are zero; None: the first common stamp. Given frames make their own zero.

    Returns:
        A Joint with the stamps of ``upper`` that both sensors cover.

    Raises:
        LevelheadError: neither a Recording nor a Track, less than 5 s in common, ``zero`` outside of them, another
            number of axes, or frames that are not rotations.
    """
    if axes not in (1, 2, 3) or (frames is not None and axes != 3):
        raise LevelheadError(f"axes is {axes!r}; expected 1, 2 or 3, and 3 with frames")
    first, second = _track(upper, "upper", axes == 3), _track(lower, "lower", axes == 3)
    t, rows = _common_stamps(first.t, second.t)
    start = _zero_stamp(t, zero)
    sensors = matrix(first.quat[rows]), matrix(interpolate(t, second.t, second.quat))
    tilt = _tilt_variance(first, t) + _tilt_variance(second, t)
    cost = None
    if isinstance(upper, Recording) and isinstance(lower, Recording):
        cost = centre_cost(t, *sensors, (upper, lower))
    if axes == 1:
        fit = fit_hinge(t, *sensors, cost)
        angle = hinge_angle(fit, *sensors)
        angle, sigma = angle - np.interp(start, t, angle), hinge_sigma(fit, sensors[1], tilt)
        return Joint(t, np.degrees(angle), np.degrees(sigma), fit)
    fit = fit_two_axes(t, *sensors) if axes == 2 else _fit_main_axis(t, sensors, first, second, cost)
    sensors = about_vertical(sensors[0], fit.heading), sensors[1]
    on_upper, on_lower = _segments(fit, axes, frames, sensors, int(np.argmin(np.abs(t - start))))
    angles = cardan_angles(on_upper, on_lower)
    sigma = cardan_sigma(angles, on_upper, on_lower, tilt, fit.sigma_heading**2)
    if axes == 2:  # the middle angle is the build of the joint, and has no zero of its own
        angles[:, [0, 2]] -= [np.interp(start, t, angles[:, i]) for i in (0, 2)]
    return Joint(t, np.degrees(angles), np.degrees(sigma), fit, axes)


def _zero_stamp(t: Array, zero: float | None) -> float:
    """The stamp at which the angles are zero; ``t`` are the common ones."""
    start = float(t[0]) if zero is None else float(zero)
    if not t[0] <= start <= t[-1]:
        raise LevelheadError(f"zero is {start:g} s; expected a stamp between {t[0]:g} and {t[-1]:g} s")
    return start


def _segments(
    fit: AxesFit,
    axes: int,
    frames: tuple[ArrayLike, ArrayLike] | None,
    sensors: tuple[Array, Array],
    row: int,
) -> tuple[Array, Array]:
    """(n, 3, 3) matrices from the axes of either segment to earth; ``row`` is the neutral pose."""
    if frames is not None:
        segments = _frame(frames[0], "upper"), _frame(frames[1], "lower")
    elif axes == 2:
        segments = frames_of_axes(fit)
    else:
        segments = frames_of_pose(fit.upper, sensors[0][row], sensors[1][row])
    return sensors[0] @ segments[0], sensors[1] @ segments[1]


def _fit_main_axis(t: Array, sensors: tuple[Array, Array], upper: Track, lower: Track, cost: Cost | None) -> AxesFit:
    """The axis about which a joint bends most; with the tracks' heading where both have north with a smaller σ."""
    fit = fit_hinge(t, *sensors, cost)
    if upper.relative is not False or lower.relative is not False or upper.sigma is None or lower.sigma is None:
        return fit
    sigma = np.hypot(np.interp(t, upper.t, upper.sigma[:, 2]), np.interp(t, lower.t, lower.sigma[:, 2]))
    trusted = not Joint(t, sigma, sigma, fit, 3).fault and np.median(fit.sigma_heading) < np.median(sigma)
    return fit if trusted else fit._replace(heading=np.zeros(len(t)), sigma_heading=sigma, referenced=True)


def _frame(given: ArrayLike, name: str) -> Array:
    """(3, 3) segment to sensor, of a quaternion or a matrix."""
    try:
        values = np.asarray(given, np.float64)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.shape == (4,) and abs(float(np.linalg.norm(values)) - 1.0) < MAX_SKEW:
        values = matrix(values[None] / np.linalg.norm(values))[0]
    if (
        values.shape != (3, 3)
        or not np.allclose(values @ values.T, np.eye(3), atol=MAX_SKEW)
        or np.linalg.det(values) < 0
    ):
        raise LevelheadError(
            f"the frame of the {name} segment is {given!r}; expected a unit quaternion wxyz or a (3, 3) rotation"
        )
    return values


def _track(sensor: object, name: str, with_mag: bool) -> Track:
    if isinstance(sensor, Track):
        return sensor.to_frame("ENU")
    if isinstance(sensor, Recording):
        return smooth(sensor if with_mag else replace(sensor, mag=None))
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
