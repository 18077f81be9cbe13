"""Poses in which a sensor was put down, and the turns between them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from levelhead.recording import Array, Recording
from levelhead.signals.rest import StillStretch, still_stretches

MIN_POSE = 1.0  # s of a pose
TRIM = 0.25  # s at both ends of a pose, where the hand lets go
LONGEST_TURN = 30.0  # s: a longer one has forgotten where it began
TURN_STEP = 0.02  # s over which rates are averaged; a hand turns evenly for so long
LONGEST_GAP = 0.1  # s without a reading in a turn
FORCE_FLOOR = 1e-3  # m/s², 1σ of a pose's mean that no averaging lowers: bias instability, a table that gives
MIN_ANGLE = 0.35  # rad (20°): directions that are nearer to each other are one


class Pose(NamedTuple):
    """Means over one pose.

    Attributes:
        acc: (3,) specific force in m/s², as read.
        sigma: 1σ of each component.
        gyr: (3,) rate in rad/s, as read.
        noise: density of the rate in rad/s/√Hz.
        mag: (3,) field in µT as read, or None.
        log: number of its log.
        start: s on the log's clock.
        end: s, likewise.
    """

    acc: Array
    sigma: float
    gyr: Array
    noise: float
    mag: Array | None
    log: int
    start: float
    end: float


class MeasuredTurn(NamedTuple):
    """Rates between two poses that follow each other, as read minus those at rest.

    Attributes:
        first: number of the pose before; the next one is the pose after.
        rates: (k, 3) mean rates of k intervals, rad/s.
        steps: (k,) their lengths, s.
    """

    first: int
    rates: Array
    steps: Array


def find_poses(recordings: Sequence[Recording]) -> tuple[list[Pose], list[MeasuredTurn]]:
    """All poses, log by log in order of time, and the turns between neighbours."""
    poses: list[Pose] = []
    turns: list[MeasuredTurn] = []
    for log, recording in enumerate(recordings):
        before: StillStretch | None = None
        rate = recording.rate  # a median over the whole recording each time that it is asked for
        for stretch in still_stretches(recording, MIN_POSE):
            poses.append(_pose(recording, stretch, log, rate))
            if before is not None:
                turn = _turn(recording, before, stretch, poses, rate)
                turns += [] if turn is None else [turn]
            before = stretch
    return poses, turns


def directions(poses: Sequence[Pose]) -> int:
    """How many of the directions of gravity differ by more than 20°."""
    kept: list[Array] = []
    for pose in poses:
        unit = pose.acc / np.linalg.norm(pose.acc)
        if all(float(unit @ other) < np.cos(MIN_ANGLE) for other in kept):
            kept.append(unit)
    return len(kept)


def _pose(recording: Recording, stretch: StillStretch, log: int, rate: float) -> Pose:
    edge = min(round(TRIM * rate), (stretch.end - stretch.start) // 4)
    rows = slice(stretch.start + edge, stretch.end - edge)
    acc, gyr = recording.acc[rows], recording.gyr[rows]
    count = max(1, int(np.isfinite(acc[:, 0]).sum()))
    white = float(np.nanstd(acc, axis=0).max()) / np.sqrt(count)
    noise = float(np.nanstd(gyr, axis=0).max()) / np.sqrt(rate)
    mag = None
    if recording.mag is not None and np.isfinite(recording.mag[rows]).any(axis=0).all():
        mag = np.nanmean(recording.mag[rows], axis=0)
    return Pose(
        np.nanmean(acc, axis=0), float(np.hypot(white, FORCE_FLOOR)), np.nanmean(gyr, axis=0), noise, mag, log,
        float(recording.t[rows.start]), float(recording.t[rows.stop - 1]),
    )  # fmt: skip


def _turn(
    recording: Recording, before: StillStretch, after: StillStretch, poses: Sequence[Pose], rate: float
) -> MeasuredTurn | None:
    """The turn that ends at the last pose; None if a reading is missing in it, or it took too long."""
    rows = slice(before.end - 1, after.start + 1)
    t, gyr = recording.t[rows], recording.gyr[rows]
    steps = np.diff(t)
    if t[-1] - t[0] > LONGEST_TURN or steps.max() > max(LONGEST_GAP, 2.0 / rate) or not np.isfinite(gyr).all():
        return None
    share = np.linspace(0.0, 1.0, len(t))[:, None]
    free = gyr - (1.0 - share) * poses[-2].gyr - share * poses[-1].gyr
    starts = np.arange(0, len(steps), max(1, round(TURN_STEP * rate)))
    times = np.add.reduceat(steps, starts)
    angles = np.add.reduceat(0.5 * (free[1:] + free[:-1]) * steps[:, None], starts)
    return MeasuredTurn(len(poses) - 2, angles / times[:, None], times)
