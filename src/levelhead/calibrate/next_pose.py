"""Calibration while the sensor is there: what to do next, from the poses that the offline command would find."""

from collections.abc import Sequence
from concurrent.futures import Executor, Future
from typing import NamedTuple

import numpy as np

from levelhead.calibrate import accelerometer
from levelhead.calibrate.coverage import (
    SIDES,
    lay_down,
    next_side,
    side_up,
    unobservable_field,
    unobservable_numbers,
    unobservable_rates,
)
from levelhead.calibrate.field_blocks import field_blocks
from levelhead.calibrate.growing_recording import GrowingRecording
from levelhead.calibrate.magnetometer import fit_field
from levelhead.calibrate.poses import MIN_ANGLE, MIN_POSE, find_poses, pose_stretches
from levelhead.calibrate.solve import correct_logs, gyr_bias, rate_solution
from levelhead.errors import LevelheadError
from levelhead.recording import Array, Recording
from levelhead.sample import Sample
from levelhead.signals.rest import WINDOW, window_size
from levelhead.units import GRAVITY

POSES = 12  # with fewer there is little to hold out
HOLD = 2.0  # s of a pose
PATIENCE = 2  # times as many poses after which it is done, whatever is still weak: the verdict lists it
STUCK = 2.0  # s of the same reading after which a sensor is refused


class Assessment(NamedTuple):
    """The knowledge that the poses so far give.

    Attributes:
        poses: how many.
        sides: (k, 3) directions that were up, of length 1.
        unknown: names of the accelerometer's numbers that they do not show.
        next: side to put up, (3,) of −1, 0 and 1.
        axes: of the gyroscope whose scale the turns do not show; only asked when the accelerometer is done.
        field: of the magnetometer whose offset is weak; likewise.
        done: whether all is known, or was asked for often enough.
    """

    poses: int
    sides: Array
    unknown: list[str]
    next: Array
    axes: list[str]
    field: list[str]
    done: bool


class Instruction(NamedTuple):
    """The instruction of the moment.

    Attributes:
        words: a sentence.
        side: to put up, (3,) of −1, 0 and 1; None while it must lie still.
        hold: s for which it must still lie still; 0: it may be moved.
        fraction: of the whole that is done, 0 to 1.
        up: which side is up now, in words.
        poses: taken so far.
        unknown: names of numbers that the poses so far do not show, each after its sensor: "accelerometer bias x".
        sides: of the six sides, those that have been up: "+x", …
        done: nothing more to do.
    """

    words: str
    side: Array | None
    hold: float
    fraction: float
    up: str
    poses: int
    unknown: list[str]
    sides: list[str]
    done: bool

    def unobservable_words(self) -> str:
        """The unknown numbers, sensor by sensor: "accelerometer bias x, scale z; gyroscope y"; nothing for none."""
        parts: dict[str, list[str]] = {}
        for one in self.unknown:
            sensor, _, name = one.partition(" ")
            parts.setdefault(sensor, []).append(name)
        return "; ".join(f"{sensor} {', '.join(names)}" for sensor, names in parts.items())


class Guide:
    """Takes samples and gives the next instruction.

    Args:
        executor: where fits run, so that reading goes on meanwhile.
        gravity: m/s² at the place.
        poses: how many at least.

    Raises:
        LevelheadError: fewer than 6 poses.
    """

    def __init__(self, executor: Executor, gravity: float = GRAVITY, poses: int = POSES) -> None:
        if poses < 6:
            raise LevelheadError(
                f"{poses} poses do not determine the nine numbers of an accelerometer; expected 6 or more"
            )
        self._samples = GrowingRecording()
        self._executor, self._gravity, self._least = executor, gravity, poses
        self._pending: Future[Assessment] | None = None
        self._seen = 0  # poses that the last assessment has been asked for
        self._known = Assessment(0, np.zeros((0, 3)), list(accelerometer.NAMES), SIDES[_UP], [], [], False)
        self._last = Instruction(
            "waiting for the sensor", None, 0.0, 0.0, "", 0, _names_of_unknown(self._known), [], False
        )
        self._windows = 0

    def add(self, samples: Sequence[Sample]) -> None:
        """The samples since the last time."""
        self._samples.add(samples)

    def recording(self) -> Recording:
        """All samples so far.

        Raises:
            LevelheadError: none came.
        """
        return self._samples.recording()

    def instruction(self, wait: bool = False) -> Instruction:
        """The instruction of the moment.

        Args:
            wait: until the poses so far have been assessed.

        Raises:
            LevelheadError: the sensor gives the same reading all the time.
        """
        if self._pending is not None and (wait or self._pending.done()):
            self._known, self._pending = self._pending.result(), None
        windows = int(self._samples.duration / WINDOW)
        if windows > self._windows or wait:
            self._windows = windows
            self._last = self._look(wait)
        return self._last

    def _look(self, wait: bool) -> Instruction:
        """Finds the poses anew, and has them assessed if there is one more."""
        if self._samples.duration < 2.0 * WINDOW:
            return self._last
        recording = self._samples.recording()
        _require_change(recording)
        stretches, rate = pose_stretches(recording, WINDOW), recording.rate
        size = window_size(rate)
        resting = bool(stretches) and len(recording) - stretches[-1].end < size
        held = WINDOW * round((stretches[-1].end - stretches[-1].start) / size) if resting else 0.0
        enough = sum(one.end - one.start >= MIN_POSE * rate - 1.0 for one in stretches)
        settled = enough - (resting and MIN_POSE <= held < HOLD)
        if settled != self._seen and self._pending is None:
            self._seen = settled
            self._pending = self._executor.submit(assess, recording, self._gravity, self._least)
            if wait:
                self._known, self._pending = self._pending.result(), None
        return self._say(resting, held, settled, recording)

    def _say(self, resting: bool, held: float, settled: int, recording: Recording) -> Instruction:
        known = self._known
        left = max(0.0, HOLD - held) if resting else 0.0
        if known.done:
            words = "done: it may be moved"
        elif left > 0.0:
            words = f"hold still: {left:.1f} s more"
        elif resting and self._pending is not None:
            words = "good; leave it there for a moment"
        else:
            words = _wish(known, settled, self._least)
        share = min(1.0, (settled + min(1.0, held / HOLD) * (left > 0.0)) / self._least)
        unknown = _names_of_unknown(known)
        sides = [side_up(side[None]) for side in SIDES if np.abs(side).sum() == 1 and _has(known.sides, side)]
        return Instruction(
            words,
            None if known.done or left > 0.0 else known.next,
            left,
            1.0 if known.done else min(share, 0.95),
            side_up(recording.acc[-20:]),
            settled,
            unknown,
            sides,
            known.done,
        )


_UP = next(i for i, side in enumerate(SIDES) if tuple(side) == (0.0, 0.0, 1.0))


def assess(recording: Recording, gravity: float, least: int) -> Assessment:
    """The knowledge that the poses in a recording give, by the fits of ``calibrate_sensor``."""
    poses, turns = find_poses([recording])
    if not poses:
        return Assessment(0, np.zeros((0, 3)), list(accelerometer.NAMES), SIDES[_UP], [], [], False)
    level = accelerometer.fit_accelerometer(poses, gravity)
    acc = np.array([pose.acc for pose in poses])
    force = accelerometer.correct_forces(level.value, acc)
    sides = force / np.linalg.norm(force, axis=1, keepdims=True)
    noise = float(np.median([pose.sigma for pose in poses])) * level.scale
    unknown = unobservable_numbers(level.sigma)
    further = next_side(level.covariance, gravity, noise, sides)
    axes: list[str] = []
    field: list[str] = []
    if not unknown and len(poses) >= least:
        rate = rate_solution(turns, poses, level)
        axes = list("xyz") if rate is None else unobservable_rates(rate.sigma.reshape(3, 3))
        logs = correct_logs([recording], level, rate, gyr_bias(poses)[0])
        field = unobservable_field(fit_field(field_blocks(logs, 0.0))) if logs else []
    done = len(poses) >= least and not (unknown or axes or field)
    done |= len(poses) >= PATIENCE * least
    return Assessment(len(poses), sides, unknown, further, axes, field, done)


def _names_of_unknown(known: Assessment) -> list[str]:
    """The unknown numbers, each after its sensor."""
    parts = {"accelerometer": known.unknown, "gyroscope": known.axes, "magnetometer": known.field}
    return [f"{sensor} {name}" for sensor, names in parts.items() for name in names]


def _wish(known: Assessment, settled: int, least: int) -> str:
    """The pose or turn that would show most of the unknown numbers."""
    head = f"pose {settled} of {max(least, settled + 1)} taken: " if settled else ""
    if known.axes and not known.unknown:
        several = " and ".join(known.axes)
        return f"{head}turn it about {several} by a quarter or more, with that axis level, and put it down again"
    if known.field and not known.unknown:
        return f"{head}now turn it slowly about each axis, through all directions, and put it down again"
    again = "turn it by hand and put it down" if settled else "put it down"
    return f"{head}{again} {lay_down(known.next)}"


def _has(sides: Array, side: Array) -> bool:
    """Whether a side has been up."""
    return bool(len(sides)) and bool((sides @ (side / np.linalg.norm(side)) > np.cos(1.2 * MIN_ANGLE)).any())


def _require_change(recording: Recording) -> None:
    """Makes sure that the sensor measures something.

    Raises:
        LevelheadError: the same reading for seconds.
    """
    first = recording.t <= recording.t[0] + STUCK
    if recording.duration > STUCK and not np.ptp(recording.acc[first], axis=0).any():
        raise LevelheadError(
            f"the accelerometer gives the same reading for {STUCK:g} s; expected noise at least: it is stuck, or sleeps"
        )
