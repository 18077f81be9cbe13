"""From recordings of a sensor that was put down in several poses to its calibration."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.calibrate import accelerometer, gyroscope
from levelhead.calibrate.coverage import next_poses, unobservable_field, unobservable_numbers, unobservable_rates
from levelhead.calibrate.field_blocks import field_blocks
from levelhead.calibrate.field_calibration import heading_gain, magnetic_parts
from levelhead.calibrate.least_squares import Solution
from levelhead.calibrate.magnetometer import FieldFit, fit_field
from levelhead.calibrate.pose_calibration import PoseCalibration, Residual, quantity
from levelhead.calibrate.poses import MeasuredTurn, Pose, directions, find_poses
from levelhead.calibration import Calibration, Quantity
from levelhead.errors import LevelheadError, require
from levelhead.recording import Array, Recording
from levelhead.units import GRAVITY

MIN_DIRECTIONS = 4
FOLDS = 5  # parts of the poses or turns, each of which is held out once
BIAS = 0.35  # rad/s (20 °/s), 1σ of a gyroscope's bias before any measurement
Progress = Callable[[float], None]


def calibrate_sensor(
    recordings: Recording | Sequence[Recording],
    *,
    gravity: float = GRAVITY,
    progress: Progress = lambda fraction: None,
) -> PoseCalibration:
    """The errors of a sensor that was put down in several poses and turned between them, by hand.

    Args:
        recordings: one or several of the same sensor since it was switched on.
        gravity: m/s² at the place; 9.81 at 50° north. The accelerometer's scale is as right as this is.
        progress: called with the fraction done.

    Returns:
        A PoseCalibration; its ``calibration`` is what filters, node and export take.

    Raises:
        LevelheadError: never still, too few directions, no better than no calibration, or SciPy is missing.
    """
    require("scipy", "calibration", "scipy")
    several = [recordings] if isinstance(recordings, Recording) else list(recordings)
    if not 9.7 < gravity < 9.9:
        raise LevelheadError(f"gravity is {gravity:g} m/s²; expected that of a place on earth, 9.76 to 9.84")
    poses, turns = find_poses(several)
    _require_poses(poses, several)
    progress(0.2)
    level = _accelerometer(poses, gravity)
    progress(0.5)
    force = accelerometer.correct_forces(level.solution.value, np.array([pose.acc for pose in poses]))
    rate = _gyroscope(turns, poses, force, level.solution)
    progress(0.8)
    bias, bias_sigma = gyr_bias(poses)
    field = _magnetometer(correct_logs(several, level.solution, None if rate is None else rate.solution, bias))
    progress(1.0)
    s = np.zeros((3, 3)) if rate is None else rate.solution.value.reshape(3, 3)
    s_sigma = np.full((3, 3), gyroscope.PRIOR) if rate is None else rate.solution.sigma.reshape(3, 3)
    parts: dict[str, Quantity | None] = {
        "gyr_matrix": quantity(s, s_sigma, np.array(gyroscope.PRIOR)),
        "gyr_bias": quantity(bias - s @ bias, bias_sigma, np.array(BIAS)),
        "acc_bias": quantity(level.solution.value[:3], level.solution.sigma[:3], accelerometer.PRIOR[:3]),
        "acc_matrix": _upper(level.solution),
    }
    advice = _advice(level.solution, poses, gravity, s_sigma, rate is not None)
    if field is not None:
        parts |= magnetic_parts(field[0])
        weak = unobservable_field(field[0])
        if weak:
            advice.append(f"the magnetometer's offset {' '.join(weak)} is weak: turn the sensor through all directions")
    elif any(pose.mag is not None for pose in poses):
        advice.append("magnetometer: no better than no calibration, so it stays as it is")
    lengths = np.stack(
        [np.linalg.norm(np.array([pose.acc for pose in poses]), axis=1), np.linalg.norm(force, axis=1)], 1
    )
    return PoseCalibration(
        Calibration(**parts), np.array([pose.acc for pose in poses]), lengths,
        np.zeros((0, 2)) if rate is None else rate.angles, level.residual, None if rate is None else rate.residual,
        None if field is None else field[1], tuple(advice), gravity,
    )  # fmt: skip


class Found(NamedTuple):
    """A solution, what is left of it, and for a gyroscope the angles missed before and after."""

    solution: Solution
    residual: Residual
    angles: Array


def _require_poses(poses: Sequence[Pose], recordings: Sequence[Recording]) -> None:
    seconds = sum(one.duration for one in recordings)
    if not poses:
        raise LevelheadError(
            f"the sensor was never still in {seconds:.0f} s; expected it to be put down in at least {MIN_DIRECTIONS} "
            "poses, better 12, for 2 s each"
        )
    several = directions(poses)
    if several < MIN_DIRECTIONS:
        raise LevelheadError(
            f"the sensor was still in {len(poses)} {'pose' if len(poses) == 1 else 'poses'} with {several} "
            f"{'direction' if several == 1 else 'directions'} of gravity; expected at least "
            f"{MIN_DIRECTIONS}, better all six sides and some edges, for 2 s each"
        )


def _folds(count: int) -> list[NDArray[np.bool_]]:
    """Which of ``count`` are held out, part by part; each is so once."""
    parts = min(FOLDS, count)
    return [np.arange(count) % parts == part for part in range(parts)]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _accelerometer(poses: Sequence[Pose], gravity: float) -> Found:
    """The accelerometer's numbers.

    Raises:
        LevelheadError: on poses that were held out they are no better than none.
    """
    acc = np.array([pose.acc for pose in poses])
    solution = accelerometer.fit_accelerometer(poses, gravity)
    held = np.empty(len(poses))
    for out in _folds(len(poses)):
        others = accelerometer.fit_accelerometer([pose for pose, no in zip(poses, out, strict=True) if not no], gravity)
        held[out] = accelerometer.excess(others.value, acc[out], gravity)
    before = accelerometer.excess(np.zeros(9), acc, gravity)
    residual = Residual(
        _rms(before), _rms(accelerometer.excess(solution.value, acc, gravity)), _rms(held), "m/s²"
    )  # fmt: skip
    if residual.ratio < 1.0:
        raise LevelheadError(
            f"these {len(poses)} poses make no better accelerometer: |a| − g is {residual.before:.3g} m/s² without a "
            f"calibration and {residual.held_out:.3g} in poses that it has not seen; take more poses, 2 s each"
        )
    return Found(solution, residual, np.zeros((0, 2)))


def rate_solution(turns: Sequence[MeasuredTurn], poses: Sequence[Pose], force: Array) -> Solution | None:
    """S of the gyroscope by rows; None without turns.

    Args:
        turns: the turns.
        poses: the poses.
        force: (k, 3) specific force of the poses as corrected.
    """
    return gyroscope.fit_gyroscope(gyroscope.Turns(turns, poses, force)) if turns else None


def _gyroscope(turns: Sequence[MeasuredTurn], poses: Sequence[Pose], force: Array, level: Solution) -> Found | None:
    """The gyroscope's numbers; None without turns, or where they are no better than none on turns held out."""
    solution = rate_solution(turns, poses, force)
    if solution is None:
        return None
    every = gyroscope.Turns(turns, poses, force)
    held = np.empty(len(turns))
    for out in _folds(len(turns)):
        seen = [turn for turn, no in zip(turns, out, strict=True) if not no]
        unseen = [turn for turn, no in zip(turns, out, strict=True) if no]
        others = gyroscope.fit_gyroscope(gyroscope.Turns(seen, poses, force)).value if seen else np.zeros(9)
        held[out] = gyroscope.Turns(unseen, poses, force).misses(others.reshape(3, 3))
    angles = np.stack([every.misses(s.reshape(3, 3)) for s in (np.zeros(9), solution.value)], axis=1)
    degrees = np.degrees(angles)
    residual = Residual(_rms(degrees[:, 0]), _rms(degrees[:, 1]), _rms(np.degrees(held)), "°")
    if residual.ratio < 1.0:
        nothing = Solution(np.zeros(9), np.eye(9) * gyroscope.PRIOR**2, 1.0)
        return Found(nothing, residual._replace(after=residual.before), np.stack([angles[:, 0]] * 2, axis=1))
    acc, root = np.array([pose.acc for pose in poses]), np.linalg.cholesky(level.covariance)
    around = [accelerometer.correct_forces(level.value + column, acc) for column in root.T]
    extra = gyroscope.force_covariance(turns, poses, solution.value, force, around)
    return Found(solution._replace(covariance=solution.covariance + extra), residual, angles)


def correct_logs(
    recordings: Sequence[Recording], level: Solution, rate: Solution | None, bias: Array
) -> list[Recording]:
    """The recordings without the errors of accelerometer and gyroscope; ``bias`` (3,) rad/s at rest, as read."""
    s = np.zeros((3, 3)) if rate is None else rate.value.reshape(3, 3)
    return [
        replace(one, gyr=(one.gyr - bias) @ (np.eye(3) - s).T, acc=accelerometer.correct_forces(level.value, one.acc))
        for one in recordings
        if one.mag is not None
    ]


def _magnetometer(recordings: Sequence[Recording]) -> tuple[FieldFit, Residual] | None:
    """The magnetometer's numbers by eq. 2 of ``magnetometer``; None where there is none, or they are no better."""
    if not recordings:
        return None
    blocks = field_blocks(recordings, 0.0)
    fit = fit_field(blocks)
    gain = heading_gain(blocks, fit)
    return (fit, gain) if gain.ratio >= 1.0 else None


def gyr_bias(poses: Sequence[Pose]) -> tuple[Array, Array]:
    """(3,) mean rate at rest and its 1σ; the spread between poses counts, for a bias walks."""
    rates = np.array([pose.gyr for pose in poses])
    weight = np.array([pose.end - pose.start for pose in poses])
    mean = np.average(rates, axis=0, weights=weight)
    noise = max(pose.noise for pose in poses) / np.sqrt(weight.sum())
    spread = np.sqrt(np.average((rates - mean) ** 2, axis=0, weights=weight))
    return mean, np.hypot(noise, spread / np.sqrt(max(1, len(poses) - 1)))


def _upper(solution: Solution) -> Quantity:
    """T and its σ; what the frame fixes is known to be 0."""
    sigma = np.zeros((3, 3))
    prior = np.zeros((3, 3))
    for place, one, before in zip(accelerometer.UPPER, solution.sigma[3:], accelerometer.PRIOR[3:], strict=True):
        sigma[place], prior[place] = one, before
    return Quantity(accelerometer.triangular_matrix(solution.value), np.minimum(sigma, prior), prior, prior)


def _advice(level: Solution, poses: Sequence[Pose], gravity: float, s_sigma: Array, turned: bool) -> list[str]:
    """What poses and turns have not told, and which would."""
    advice = []
    missing = unobservable_numbers(level.sigma)
    if missing:
        sides = next_poses(level.covariance, gravity, float(np.median([pose.sigma for pose in poses])) * level.scale)
        advice.append(
            f"these poses do not determine the accelerometer's {', '.join(missing)}: put the sensor down with "
            f"{'; then with '.join(sides)}"
        )
    axes = unobservable_rates(s_sigma)
    if axes and turned:
        advice.append(
            f"these turns do not determine the gyroscope's scale {' '.join(axes)}: from one pose to the next turn the "
            f"sensor about {' and '.join(axes)} by a quarter or more, with that axis level"
        )
    return advice
