"""From recordings of a sensor that was put down or held in several poses to its calibration."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.calibrate import accelerometer, faults, gyroscope
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
from levelhead.units import DEGREE, GRAVITY

MIN_DIRECTIONS = 4
FOLDS = 5  # parts of the poses or turns, each of which is held out once
MIN_JUDGES = 3  # poses or turns that were left out and that the others determine
MIN_NOISES = 3.0  # times the noise, from which errors are the sensor's where none could be left out
BIAS = 0.35  # rad/s (20 °/s), 1σ of a gyroscope's bias before any measurement
Progress = Callable[[float], None]


def calibrate_sensor(
    recordings: Recording | Sequence[Recording],
    *,
    gravity: float = GRAVITY,
    turn: float | None = None,
    progress: Progress = lambda fraction: None,
) -> PoseCalibration:
    """The errors of a sensor that was put down or held in several poses and turned between them, by hand.

    Args:
        recordings: one or several of the same sensor since it was switched on.
        gravity: m/s² at the place; 9.81 at 50° north. The accelerometer's scale is as right as this is.
        turn: degrees; turns on a level table, from edge to edge, are by a multiple of it. None: they are by any angle.
        progress: called with the fraction done.

    Returns:
        A PoseCalibration; filters, node and export take its ``calibration``. A sensor without a gain has no numbers in
        it.

    Raises:
        LevelheadError: never still, too few directions, no better than no calibration, an axis that is reversed,
            swapped, clipped or stuck, or SciPy is missing.
    """
    require("scipy", "calibration", "scipy")
    several = [recordings] if isinstance(recordings, Recording) else list(recordings)
    _require_angles(gravity, turn)
    poses, turns = find_poses(several)
    _require_poses(poses, several, turn is not None and len(turns) > 0)
    faults.require_moving_axes(several, poses)
    clipped = faults.clipped_axes(several, poses, turns)
    faults.require_turns(clipped)
    turns = [one for one, axis in zip(turns, clipped, strict=True) if not axis]
    progress(0.2)
    level = _accelerometer(poses, gravity)
    faults.require_true_scale(level.solution)
    progress(0.5)
    acc = np.array([pose.acc for pose in poses])
    force = accelerometer.correct_forces(level.solution.value, acc)
    rate = _gyroscope(turns, poses, level.solution, turn)
    progress(0.8)
    bias, bias_sigma = gyr_bias(poses)
    corrected = correct_logs(several, level.solution, None if rate is None else rate.solution, bias)
    field = _magnetometer(corrected)
    progress(1.0)
    _require_gain(level, rate, field, len(poses))
    advice = [_words_of_clipping(clipped)] if any(clipped) else []
    advice += _advice(level.solution, poses, gravity, None if rate is None else rate.solution)
    advice += _field_advice(field, poses)
    lengths = np.stack([np.linalg.norm(acc, axis=1), np.linalg.norm(force, axis=1)], 1)
    return PoseCalibration(
        _calibration(level, rate, bias, bias_sigma, field), acc, lengths,
        np.zeros((0, 2)) if rate is None else rate.angles, level.residual, None if rate is None else rate.residual,
        None if field is None else field[1], tuple(advice), gravity,
    )  # fmt: skip


class Found(NamedTuple):
    """A solution, its residual, and for a gyroscope the angles missed before and after."""

    solution: Solution
    residual: Residual
    angles: Array


def _require_gain(level: Found, rate: Found | None, field: tuple[FieldFit, Residual] | None, poses: int) -> None:
    """Makes sure that a sensor is better with its numbers.

    Raises:
        LevelheadError: none is.
    """
    if level.residual.better or field is not None or (rate is not None and rate.residual.better):
        return
    raise LevelheadError(
        f"these {poses} poses make no sensor better: |a| − g is {level.residual.before:.3g} m/s² without a calibration "
        f"and {level.residual.held_out:.3g} in poses that it has not seen; take more poses, 2 s each"
    )


def _field_advice(field: tuple[FieldFit, Residual] | None, poses: Sequence[Pose]) -> list[str]:
    """The numbers of a magnetometer that the motion has not determined."""
    if field is None:
        there = any(pose.mag is not None for pose in poses)
        return ["magnetometer: no better than no calibration, so the file leaves it out"] if there else []
    weak = " ".join(unobservable_field(field[0]))
    return [f"the magnetometer's offset {weak} is weak: turn the sensor through all directions"] if weak else []


def _calibration(
    level: Found, rate: Found | None, bias: Array, bias_sigma: Array, field: tuple[FieldFit, Residual] | None
) -> Calibration:
    """Parts that made their sensor better; the bias at rest, b = (1 − S) b₀, with the σ of b₀ and of S b₀."""
    turned = rate is not None and rate.residual.better
    s, spread = np.zeros((3, 3)), np.diag(gyroscope.PRIOR.ravel() ** 2)
    if rate is not None and turned:
        s, spread = rate.solution.value.reshape(3, 3), rate.solution.covariance
    by_scale = np.einsum("j,ijik,k->i", bias, spread.reshape(3, 3, 3, 3), bias)
    nothing = np.zeros(3), np.zeros(3), np.zeros(3)
    parts: dict[str, Quantity | None] = {
        "gyr_matrix": quantity(s, np.sqrt(np.diag(spread)).reshape(3, 3) * turned, gyroscope.PRIOR * turned),
        "gyr_bias": quantity(bias - s @ bias, np.sqrt(bias_sigma**2 + by_scale), np.array(BIAS)),
        "acc_bias": quantity(*nothing),
    }
    if level.residual.better:
        c, sigma = level.solution.value[:3], level.solution.sigma[:3]
        parts |= {"acc_bias": quantity(c, sigma, accelerometer.PRIOR[:3]), "acc_matrix": _upper(level.solution)}
    return Calibration(**parts | ({} if field is None else magnetic_parts(field[0])))


def _require_angles(gravity: float, turn: float | None) -> None:
    if not 9.7 < gravity < 9.9:
        raise LevelheadError(f"gravity is {gravity:g} m/s²; expected that of a place on earth, 9.76 to 9.84")
    if turn is not None and not 45.0 <= turn <= 36_000.0:
        raise LevelheadError(f"the known turn is {turn:g}°; expected 45 or more: 360 for a whole turn, 90 for a box")


def _require_poses(poses: Sequence[Pose], recordings: Sequence[Recording], turned: bool) -> None:
    """Makes sure that there are poses, and several directions of gravity or known turns.

    Raises:
        LevelheadError: there are not.
    """
    seconds = sum(one.duration for one in recordings)
    if not poses:
        raise LevelheadError(
            f"the sensor was never still in {seconds:.0f} s; expected it to be put down in at least {MIN_DIRECTIONS} "
            "poses, better 12, for 2 s each"
        )
    several = directions(poses)
    if several < MIN_DIRECTIONS and not turned:
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


def _judge(before: Array, after: Array, held: Array, unsure: Array, noise: Array, unit: str) -> Residual:
    """The RMS of errors without a calibration, with it, and where held out.

    Those judge that the others determine: whose 1σ by the others is less than the RMS without a calibration. With too
    few of them the noise replaces the residual, if the errors are clearly larger; else nothing is better.

    Args:
        before: (n,) errors without a calibration.
        after: (n,) with it.
        held: (n,) with one that has not seen this pose or turn.
        unsure: (n,) 1σ of ``held``.
        noise: (n,) 1σ of the errors with the right numbers.
        unit: of these.
    """
    judges = unsure < _rms(before)
    if int(judges.sum()) >= MIN_JUDGES:
        return Residual(_rms(before), _rms(after), _rms(held[judges]), unit, int(judges.sum()))
    left = max(_rms(after), float(noise.min()))
    return Residual(_rms(before), left, left if _rms(before / noise) > MIN_NOISES else _rms(before), unit, 0)


def _accelerometer(poses: Sequence[Pose], gravity: float) -> Found:
    """The accelerometer's numbers, and how much better they are."""
    acc, sigma = np.array([pose.acc for pose in poses]), np.array([pose.sigma for pose in poses])
    solution = accelerometer.fit_accelerometer(poses, gravity)
    rows = accelerometer.information(acc / np.linalg.norm(acc, axis=1, keepdims=True), gravity)
    held, unsure = np.empty(len(poses)), np.empty(len(poses))
    for out in _folds(len(poses)):
        others = accelerometer.fit_accelerometer([pose for pose, no in zip(poses, out, strict=True) if not no], gravity)
        held[out] = accelerometer.excess(others.value, acc[out], gravity)
        unsure[out] = np.sqrt(np.einsum("ki,ij,kj->k", rows[out], others.covariance, rows[out]))
    before = accelerometer.excess(np.zeros(9), acc, gravity)
    after = accelerometer.excess(solution.value, acc, gravity)
    residual = _judge(before, after, held, unsure, sigma * solution.scale, "m/s²")
    if directions(poses) < MIN_DIRECTIONS:  # of known turns alone
        residual = Residual(residual.before, residual.before, residual.before, "m/s²", 0)
    return Found(solution, residual, np.zeros((0, 2)))


def rate_solution(turns: Sequence[MeasuredTurn], poses: Sequence[Pose], level: Solution) -> Solution | None:
    """S of the gyroscope by rows; None without turns.

    Args:
        turns: the turns.
        poses: the poses.
        level: of the accelerometer.
    """
    return gyroscope.fit_gyroscope(_gather(turns, poses, level, level.value, None)) if turns else None


def _gather(
    turns: Sequence[MeasuredTurn], poses: Sequence[Pose], level: Solution, numbers: Array, step: float | None
) -> gyroscope.Turns:
    """The turns with directions of gravity by these numbers of the accelerometer."""
    acc = np.array([pose.acc for pose in poses])
    force, unsure = accelerometer.correct_forces(numbers, acc), accelerometer.direction_sigma(level.covariance, acc)
    return gyroscope.gather_turns(turns, poses, force, unsure, None if step is None else step * DEGREE)


def _gyroscope(
    turns: Sequence[MeasuredTurn], poses: Sequence[Pose], level: Solution, step: float | None
) -> Found | None:
    """The gyroscope's numbers, and how much better they are; None without turns."""
    if not turns:
        return None
    every = _gather(turns, poses, level, level.value, step)
    faults.require_true_turns(every)
    solution = gyroscope.fit_gyroscope(every)
    held, unsure = np.empty(len(turns)), np.empty(len(turns))
    known = np.isfinite(every.angle)
    noise = solution.scale * np.where(known, every.turn_sigma, np.sqrt(2.0) * every.sigma)
    for out in _folds(len(turns)):
        others = gyroscope.fit_gyroscope(every.part(~out))
        left, change = every.part(out).residuals(others.value.reshape(3, 3))
        held[out] = np.linalg.norm(left, axis=1)
        variance = np.einsum("kni,ij,knj->k", change, others.covariance, change)
        unsure[out] = np.sqrt(variance + noise[out] ** 2)
    angles = np.stack([every.misses(s.reshape(3, 3)) for s in (np.zeros(9), solution.value)], axis=1)
    before, after = np.degrees(angles).T
    residual = _judge(before, after, np.degrees(held), np.degrees(unsure), np.degrees(noise), "°")
    root = np.linalg.cholesky(level.covariance)
    around = [_gather(turns, poses, level, level.value + column, step) for column in root.T]
    extra = gyroscope.force_covariance(every, solution.value, around)
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
    """The magnetometer's numbers by eq. 2 of ``magnetometer``; None where there is none, or they bring no gain."""
    if not recordings:
        return None
    blocks = field_blocks(recordings, 0.0)
    fit = fit_field(blocks)
    gain = heading_gain(blocks, fit)
    return (fit, gain) if gain.better else None


def gyr_bias(poses: Sequence[Pose]) -> tuple[Array, Array]:
    """(3,) mean rate at rest and its 1σ; the spread between poses counts, for a bias walks."""
    rates, sigma = np.array([pose.gyr for pose in poses]), np.array([pose.gyr_sigma for pose in poses])
    weight = sigma**-2.0 / np.sum(sigma**-2.0)
    mean = weight @ rates
    spread = np.sqrt(weight @ (rates - mean) ** 2 / max(1, len(poses) - 1))
    return mean, np.maximum(np.sqrt(1.0 / np.sum(sigma**-2.0)), spread)


def _upper(solution: Solution) -> Quantity:
    """T and its σ; the numbers that the frame fixes are 0."""
    sigma = np.zeros((3, 3))
    prior = np.zeros((3, 3))
    for place, one, before in zip(accelerometer.UPPER, solution.sigma[3:], accelerometer.PRIOR[3:], strict=True):
        sigma[place], prior[place] = one, before
    return Quantity(accelerometer.triangular_matrix(solution.value), np.minimum(sigma, prior), prior, prior)


def _words_of_clipping(clipped: Sequence[str]) -> str:
    axes = " and ".join(sorted({axis for axis in clipped if axis}))
    return (
        f"the gyroscope's {axes} is clipped in {sum(map(bool, clipped))} of {len(clipped)} turns, which are left out: "
        "turn the sensor more slowly"
    )


def _advice(level: Solution, poses: Sequence[Pose], gravity: float, rate: Solution | None) -> list[str]:
    """The numbers that poses and turns have not determined, and the pose that would."""
    advice = []
    missing = unobservable_numbers(level.sigma)
    if missing:
        sides = next_poses(level.covariance, gravity, float(np.median([pose.sigma for pose in poses])) * level.scale)
        advice.append(
            f"these poses do not determine the accelerometer's {', '.join(missing)}: put the sensor down with "
            f"{'; then with '.join(sides)}"
        )
    axes = [] if rate is None else unobservable_rates(rate.sigma.reshape(3, 3))
    if axes:
        advice.append(
            f"these turns do not determine the gyroscope's scale {' '.join(axes)}: from one pose to the next turn the "
            f"sensor about {' and '.join(axes)} by a quarter or more, with that axis level"
        )
    return advice
