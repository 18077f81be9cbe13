"""The rotation between a reference's body and the sensor, found from the gyroscope alone.

Markers are glued on by eye: in RepoIMU's T-stick recordings the body of the reference is 2.7° away from the sensor,
which turns about with it and is an error of 1 to 3° of every filter alike. Increments of rotation over 0.1 s in the
body, h, and in the sensor, g, must agree:

    h = A (g − b T)                                                                                             (1)

A by Wahba's problem (F. L. Markley, J. L. Crassidis, Fundamentals of Spacecraft Attitude Determination, 2014, section
5.4), b by the median of the residual, in turn. No filter takes part, so that no filter is favoured.
"""

from typing import NamedTuple

import numpy as np

from levelhead.recording import Array, Recording
from levelhead.rotations import from_matrix, nearest_rotation, product, relative_rotation

SPAN = 0.1  # s of an increment
MIN_INCREMENT, MAX_INCREMENT = 0.005, 0.8  # rad: increments above the noise, and those of first order
MIN_INCREMENTS = 100  # increments
OUTLIER = 4.0  # times the median residual
ROUNDS = 20


class SensorFrame(NamedTuple):
    """The rotation A (3, 3) from the sensor into the reference's body."""

    rotation: Array

    def turn(self, quat: Array) -> Array:
        """(n, 4) orientations of the reference's body as those of the sensor."""
        return product(quat, from_matrix(self.rotation))

    @property
    def angle(self) -> float:
        """Degrees."""
        return float(np.degrees(np.arccos(np.clip((np.trace(self.rotation) - 1.0) / 2.0, -1.0, 1.0))))


def align_sensor(recording: Recording) -> SensorFrame | None:
    """A of eq. 1; None where the recording turns too little."""
    if recording.truth is None:
        return None
    turned, seen, spans = _increments(recording)
    size = np.linalg.norm(turned, axis=1)
    usable = (size > MIN_INCREMENT) & (size < MAX_INCREMENT)
    if usable.sum() < MIN_INCREMENTS:
        return None
    bias = np.zeros(3)
    chosen = usable
    for _ in range(ROUNDS):
        free = seen - bias * spans
        rotation = nearest_rotation(turned[chosen].T @ free[chosen])
        residual = np.linalg.norm(turned - free @ rotation.T, axis=1)
        bias = np.median(((seen - turned @ rotation) / spans)[chosen], axis=0)
        chosen = usable & (residual < OUTLIER * np.median(residual[chosen]) + 1e-6)
    return SensorFrame(rotation)


def _increments(recording: Recording) -> tuple[Array, Array, Array]:
    """Rotation vectors (n, 3) of the reference's body and ∫ω dt of the sensor over spans of 0.1 s, and these spans."""
    assert recording.truth is not None
    t, quat = recording.t, recording.truth.quat
    stride = max(1, round(SPAN * recording.rate))
    first = np.arange(0, len(t) - stride, stride)
    last = first + stride
    steps = np.diff(t, prepend=t[0])
    rate = np.where(np.isnan(recording.gyr).any(axis=1, keepdims=True), 0.0, recording.gyr)
    angle = np.cumsum(rate * steps[:, None], axis=0)
    spans = t[last] - t[first]
    known = ~np.isnan(quat[first, 0]) & ~np.isnan(quat[last, 0]) & (spans < 2.0 * SPAN)
    change = relative_rotation(quat[first[known]], quat[last[known]])
    change *= np.where(change[:, :1] < 0.0, -1.0, 1.0)
    vector = change[:, 1:]
    turned = 2.0 * vector * (1.0 + (vector * vector).sum(axis=1, keepdims=True) / 6.0)
    return turned, (angle[last] - angle[first])[known], spans[known][:, None]
