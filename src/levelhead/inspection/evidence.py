"""The evidence in a run itself: its health, its corrections, and its difference from the smoother."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from levelhead.engine.binding import is_guarded
from levelhead.evaluate.attitude_error import Errors, error_quaternion, heading_offset, split_error
from levelhead.filters import health, of
from levelhead.guard import Guard
from levelhead.guard.detectors import GROUP_DELAY
from levelhead.inspection.findings import Finding
from levelhead.recording import Array, Recording
from levelhead.rotations import conjugate, product, relative_rotation, rotate, turn_heading
from levelhead.signals.rest import rest_rows
from levelhead.track import Track

UNSEEN = 10.0  # s without a magnetometer, in which heading can drift
MAX_GAP = 0.5  # s between two samples across which no rate is integrated


class RunEvidence:
    """A recording, a filter's track of it, the smoother's, and the doctor's findings."""

    def __init__(self, recording: Recording, track: Track, smoothed: Track, findings: dict[str, Finding]) -> None:
        self.recording, self.track, self.smoothed, self.findings = recording, track, smoothed, findings
        self.t: Array = recording.t - recording.t[0]

    def runs(self, bit: int) -> list[tuple[int, int]]:
        """First and after-last rows of the stretches in which a health bit is set."""
        return runs((self.track.health & np.uint32(bit)) != 0)

    @cached_property
    def turns(self) -> Array:
        """(n − 1, 4) rotations from each sample to the next, sensor frame."""
        return relative_rotation(self.track.quat[:-1], self.track.quat[1:])

    @cached_property
    def corrections(self) -> Array:
        """(n, 3) rad, earth frame: the sum of the filter's turns beside the gyroscope's rate, up to a sample.

        The rate is that which the driver integrates, less the bias estimated: behind the guard the mean of the
        interval's two readings, else the later one. Where it is missing or the interval is too long for it the
        correction is taken to be 0.
        """
        recording, track = self.recording, self.track
        step = np.diff(recording.t)[:, None]
        bias = np.zeros(3) if track.bias is None else track.bias[1:]
        rate = recording.gyr[1:]
        if track.params is None or is_guarded(of(track.params)):
            rate = rate - np.maximum(0.5 - GROUP_DELAY / step, 0.0) * np.diff(recording.gyr, axis=0)
        turn = (rate - bias) * step
        unknown = ~np.isfinite(turn).all(axis=1) | (step[:, 0] > MAX_GAP)
        turn[unknown] = 0.0
        size = np.linalg.norm(turn, axis=1)
        half = 0.5 * np.sinc(0.5 * size / np.pi)  # sin(θ/2)/θ
        by_rate = np.column_stack([np.cos(0.5 * size), turn * half[:, None]])
        beside = product(self.turns, conjugate(by_rate))
        vector = 2.0 * beside[:, 1:] * np.where(beside[:, :1] < 0.0, -1.0, 1.0)
        vector[unknown] = 0.0
        total: Array = np.vstack([np.zeros(3), np.cumsum(rotate(track.quat[1:], vector), axis=0)])
        return total

    @cached_property
    def difference(self) -> Errors:
        """Track less smoother in rad; the best constant heading offset between them is removed."""
        error = error_quaternion(self.track.quat, self.smoothed.quat)
        return split_error(turn_heading(error, -heading_offset(error, np.ones(len(error), dtype=np.bool_))))

    @cached_property
    def distance(self) -> Array:
        """(n,) rad between track and smoother; of a filter without a gyroscope, which has no heading, that of tilt."""
        return self.difference.total if "gyr" in self.uses else self.difference.tilt

    @cached_property
    def unseen(self) -> list[tuple[int, int]]:
        """Stretches of UNSEEN seconds and more without a magnetometer's reading that was used."""
        silent = (self.track.health & np.uint32(health.MAG_REJECTED | health.MAG_MISSING)) != 0
        return [(first, last) for first, last in runs(silent) if self.t[last - 1] - self.t[first] > UNSEEN]

    @cached_property
    def longest_rest(self) -> float:
        """Seconds, as the doctor or the guard sees rest; a raw gyroscope's bias can hide it from the first."""
        seen = [self._length(one) for one in runs(rest_rows(self.recording))]
        return max([*seen, *(Guard().rest_time + self._length(one) for one in self.runs(health.AT_REST))], default=0.0)

    def _length(self, rows: tuple[int, int]) -> float:
        return float(self.t[rows[1] - 1] - self.t[rows[0]])

    @property
    def is_plain(self) -> bool:
        """Whether the filter is one that takes the specific force for gravity, and learns nothing of its sensor."""
        return self.track.params is not None and of(self.track.params).calibration is None

    @property
    def uses(self) -> frozenset[str]:
        """The sensors that the filter runs on."""
        return frozenset() if self.track.params is None else of(self.track.params).uses

    @property
    def by_angles(self) -> bool:
        """Whether the filter's state is roll, pitch and yaw, which are not defined everywhere."""
        return self.track.params is not None and of(self.track.params).axis is not None


def runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and after-last index of each stretch of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]
