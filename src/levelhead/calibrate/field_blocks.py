"""The field of recordings, turned by the gyroscope: means over short blocks, from which any calibration is judged.

With the attitude R of a filter that has only gyroscope and accelerometer, and N = (1 − M) [1 | −c], (3, 4):

    R (h − d ω × h) = (A − d D) : N,   h = (1 − M)(μ − c),   A = R ⊗ [μ, 1],   D = R [ω]× ⊗ [μ, 1]              (1)

A and D do not depend on the unknowns. Their means over a block are all that a fit needs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from levelhead.engine import smooth
from levelhead.recording import Array, Recording
from levelhead.rotations import matrix

BLOCK = 0.1  # s
MAX_BLOCKS = 700  # blocks of all recordings
KNOT, KNOTS = 2.0, 30  # s between two values of the heading's drift, and how many at most
CROSS_AXIS = 0.004  # rad, of a gyroscope that is not calibrated
DRIFT = np.radians(0.05)  # rad/√s, least 1σ of this drift, beside that of the filter


@dataclass(frozen=True, eq=False)
class FieldBlocks:
    """Means over n blocks of all recordings.

    Attributes:
        features: (n, 3, 3, 4) A of eq. 1.
        late: (n, 3, 3, 4) D of eq. 1.
        mag: (n, 3) reading, µT.
        time: (n,) s; one recording begins after the other.
        step: s of a block.
        knots: (n,) place on the row of knots.
        drift: (k − 1,) 1σ by which the drift changes from one knot to the next, rad; of another recording π.
        frame: rad, 1σ of the axes of the attitude's frame.
    """

    features: Array
    late: Array
    mag: Array
    time: Array
    step: float
    knots: Array
    drift: Array
    frame: float

    def __len__(self) -> int:
        return len(self.mag)

    @property
    def up(self) -> Array:
        """(n, 3) direction of the vertical in the sensor."""
        up: Array = self.features[:, 2, :, 3]
        return up

    def fields(self, linear: Array, delay: float = 0.0) -> Array:
        """(n, 3) field in the frame of the gyroscope, with N (3, 4)."""
        turned: Array = np.einsum("nijl,jl->ni", self.features - delay * self.late, linear)
        return turned


def field_blocks(recordings: Sequence[Recording], frame: float = CROSS_AXIS) -> FieldBlocks:
    """Blocks of recordings with a magnetometer, each with a heading of its own.

    Args:
        recordings: the recordings.
        frame: 1σ of the gyroscope's axes, rad; 0 for one that is calibrated.
    """
    seconds = sum(one.duration for one in recordings)
    step = max(BLOCK, seconds / MAX_BLOCKS, *(1.5 / one.rate for one in recordings))
    spacing = max(KNOT, seconds / KNOTS)
    parts = [_of_recording(one, step) for one in recordings]
    times, knots, drift = list[Array](), list[Array](), list[Array]()
    begin, first = 0.0, 0
    for (_, _, _, time, density), one in zip(parts, recordings, strict=True):
        count = int(one.duration / spacing) + 2
        times.append(time + begin)
        knots.append(time / spacing + first)
        drift.append(np.full(count, np.sqrt(density * spacing)))
        drift[-1][-1] = np.pi
        begin, first = begin + one.duration + step, first + count
    features, late, mag = (np.concatenate([part[i] for part in parts]) for i in range(3))
    return FieldBlocks(
        features,
        late,
        mag,
        np.concatenate(times),
        step,
        np.concatenate(knots),
        np.concatenate(drift)[:-1],
        frame,
    )


def _of_recording(recording: Recording, step: float) -> tuple[Array, Array, Array, Array, float]:
    """Features, late, mag, time from the start, and density of the heading's drift, rad²/s."""
    assert recording.mag is not None
    track = smooth(replace(recording, mag=None))
    assert track.sigma is not None
    rows = np.flatnonzero(
        np.isfinite(recording.mag).all(axis=1) & recording.mag.any(axis=1) & np.isfinite(recording.gyr).all(axis=1)
    )
    time = recording.t[rows] - recording.t[0]
    starts = _starts((time / step).astype(int))
    count = np.diff(np.append(starts, len(rows)))

    def means(values: Array) -> Array:
        made: Array = np.add.reduceat(values, starts, axis=0) / count.reshape(-1, *[1] * (values.ndim - 1))
        return made

    mag, turned = recording.mag[rows], matrix(track.quat[rows])
    whole = np.concatenate([mag, np.ones((len(rows), 1))], axis=1)
    turning = -np.cross(turned, recording.gyr[rows, None, :])  # rows of R times [ω]×
    density = float(track.sigma[-1, 2]) ** 2 / max(recording.duration, 1.0)
    return (
        means(turned[:, :, :, None] * whole[:, None, None, :]), means(turning[:, :, :, None] * whole[:, None, None, :]),
        means(mag), means(time), max(density, DRIFT**2),
    )  # fmt: skip


def _starts(number: NDArray[np.int_]) -> NDArray[np.intp]:
    """Where each run of equal numbers begins."""
    return np.flatnonzero(np.diff(number, prepend=-1))
