"""Poses in which a sensor was put down or held, and the turns between them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from levelhead.calibrate.held_stretches import held_stretches
from levelhead.recording import Array, Recording
from levelhead.signals.rest import StillStretch, still_stretches

MIN_POSE = 1.0  # s of a pose
TRIM = 0.25  # s at both ends of a pose, where the hand lets go
LONGEST_TURN = 30.0  # s: a longer one has forgotten where it began
TURN_STEP = 0.02  # s over which rates are averaged; a hand turns evenly for so long
LONGEST_GAP = 0.1  # s without a reading in a turn
FORCE_FLOOR = 5e-4  # m/s², 1σ of a pose's mean that no averaging lowers: bias instability, a table that gives
MIN_ANGLE = 0.35  # rad (20°): directions that are nearer to each other are one
BLOCK = 0.25  # s, of which a shaking hand's means are independent
BIAS_WALK = 1e-4  # rad/s/√s, of a gyroscope's bias between poses


class Pose(NamedTuple):
    """Means over one pose.

    Attributes:
        acc: (3,) specific force in m/s², as read.
        sigma: 1σ of its length, and of each component where the gyroscope allows for the tremor.
        gyr: (3,) rate in rad/s, as read.
        gyr_sigma: 1σ of each component as a bias: noise, and how far the hand may have turned.
        noise: density of the rate in rad/s/√Hz.
        mag: (3,) field in µT as read, or None.
        log: number of its log.
        start: s on the log's clock.
        end: s, likewise.
    """

    acc: Array
    sigma: float
    gyr: Array
    gyr_sigma: float
    noise: float
    mag: Array | None
    log: int
    start: float
    end: float


class MeasuredTurn(NamedTuple):
    """Rates between two poses that follow each other, without the bias.

    The first and the last interval turn the mean direction of gravity in a pose to its end, or from its start.

    Attributes:
        first: number of the pose before; the next one is the pose after.
        rates: (k, 3) mean rates of k intervals, rad/s.
        steps: (k,) their lengths, s.
        bias_sigma: 1σ of the bias that was subtracted, rad/s.
    """

    first: int
    rates: Array
    steps: Array
    bias_sigma: float


def find_poses(recordings: Sequence[Recording]) -> tuple[list[Pose], list[MeasuredTurn]]:
    """All poses, log by log in order of time, and the turns between neighbours."""
    poses: list[Pose] = []
    turns: list[MeasuredTurn] = []
    for log, recording in enumerate(recordings):
        rate = recording.rate  # a median over the whole recording each time that it is asked for
        rows = [_rows(one, rate) for one in pose_stretches(recording, MIN_POSE)]
        found = [_pose(recording, one, log, rate) for one in rows]
        for i in range(len(rows) - 1):
            bias, sigma = _local_biases(found, i)
            turn = _turn(recording, rows[i], rows[i + 1], bias, rate)
            if turn is not None:
                turns.append(MeasuredTurn(len(poses) + i, *turn, sigma))
        poses += found
    return poses, turns


def pose_stretches(recording: Recording, least: float) -> list[StillStretch]:
    """Stretches of at least ``least`` s in which the sensor lay still or a hand held it, in order of time.

    A tremor may divide the stillness of one held pose into several, so a held stretch replaces those.
    """
    still = still_stretches(recording, least)
    held = [one for one in held_stretches(recording, least) if sum(_overlap(one, other) for other in still) != 1]
    return sorted([*(one for one in still if not any(_overlap(one, other) for other in held)), *held])


def directions(poses: Sequence[Pose]) -> int:
    """How many of the directions of gravity differ by more than 20°."""
    kept: list[Array] = []
    for pose in poses:
        unit = pose.acc / np.linalg.norm(pose.acc)
        if all(float(unit @ other) < np.cos(MIN_ANGLE) for other in kept):
            kept.append(unit)
    return len(kept)


def _overlap(one: StillStretch, other: StillStretch) -> bool:
    return one.start < other.end and other.start < one.end


def _rows(stretch: StillStretch, rate: float) -> slice:
    """A stretch without its ends."""
    edge = min(round(TRIM * rate), (stretch.end - stretch.start) // 4)
    return slice(stretch.start + edge, stretch.end - edge)


def _pose(recording: Recording, rows: slice, log: int, rate: float) -> Pose:
    acc, gyr, t = recording.acc[rows], recording.gyr[rows], recording.t[rows]
    seconds = float(t[-1] - t[0]) + 1.0 / rate
    noise = float(np.nanstd(np.diff(gyr, n=3, axis=0), axis=0).max()) / np.sqrt(20.0 * rate)  # no tremor is in it
    mean = np.nanmean(gyr, axis=0)
    angle = np.nancumsum(gyr - mean, axis=0) / rate
    swing = np.sqrt(2.0) * float(angle.std(axis=0).max()) / seconds  # of the mean rate, by the turn from end to end
    mag = None
    if recording.mag is not None and np.isfinite(recording.mag[rows]).any(axis=0).all():
        mag = np.nanmean(recording.mag[rows], axis=0)
    return Pose(
        np.nanmean(acc, axis=0), float(np.hypot(_mean_sigma(np.linalg.norm(acc, axis=1), rate), FORCE_FLOOR)), mean,
        max(swing, noise / np.sqrt(seconds)), noise, mag, log, float(t[0]), float(t[-1]),
    )  # fmt: skip


def _mean_sigma(values: Array, rate: float) -> float:
    """1σ of the mean of (n,) values, of which those within a block may shake together."""
    white = float(np.nanstd(values)) / float(np.sqrt(max(1, int(np.isfinite(values).sum()))))
    size = max(1, round(BLOCK * rate))
    several = len(values) // size
    if several < 3:
        return white
    means = np.nanmean(values[: several * size].reshape(several, size), axis=1)
    return max(white, float(np.nanstd(means, ddof=1) / np.sqrt(several)))


def _local_biases(poses: Sequence[Pose], first: int) -> tuple[Array, float]:
    """(2, 3) biases in the poses ``first`` and the next, from all poses of the log, and 1σ of a component."""
    rates, sigma = np.array([pose.gyr for pose in poses]), np.array([pose.gyr_sigma for pose in poses])
    middle = np.array([0.5 * (pose.start + pose.end) for pose in poses])
    at = middle[first : first + 2]
    weight = 1.0 / (sigma**2 + BIAS_WALK**2 * np.abs(at[:, None] - middle))
    total = weight.sum(axis=1, keepdims=True)
    return (weight / total) @ rates, float(np.sqrt(1.0 / total.min()))


def _turn(recording: Recording, before: slice, after: slice, bias: Array, rate: float) -> tuple[Array, Array] | None:
    """Rates and steps of a turn; None if a reading is missing in it, or it took too long."""
    between = slice(before.stop - 1, after.start + 1)
    t, gyr = recording.t[between], recording.gyr[between]
    steps = np.diff(t)
    if t[-1] - t[0] > LONGEST_TURN or steps.max() > max(LONGEST_GAP, 2.0 / rate) or not np.isfinite(gyr).all():
        return None
    share = np.linspace(0.0, 1.0, len(t))[:, None]
    free = gyr - (1.0 - share) * bias[0] - share * bias[1]
    starts = np.arange(0, len(steps), max(1, round(TURN_STEP * rate)))
    times = np.add.reduceat(steps, starts)
    angles = np.add.reduceat(0.5 * (free[1:] + free[:-1]) * steps[:, None], starts)
    _, leave, waited = _half_pose(recording, before, bias[0])
    arrive, _, waits = _half_pose(recording, after, bias[1])
    whole = np.concatenate([leave[None], angles, arrive[None]])
    lengths = np.concatenate([[waited], times, [waits]])
    return whole / lengths[:, None], lengths


def _half_pose(recording: Recording, rows: slice, bias: Array) -> tuple[Array, Array, float]:
    """Angles from the start of a pose to its mean attitude, and from there to its end, and half of its time."""
    t = recording.t[rows]
    free = np.nan_to_num(recording.gyr[rows] - bias)
    steps = np.diff(t)[:, None]
    angle = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * (free[1:] + free[:-1]) * steps, axis=0)])
    mean = angle.mean(axis=0)
    return mean, angle[-1] - mean, 0.5 * float(t[-1] - t[0])
