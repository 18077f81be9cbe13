"""How well a track predicts the readings that it has not seen: the likelihood of its innovations, as a goal for tuning.

From orientation and bias at an instant the gyroscope alone leads ``HORIZON`` seconds further. The mean of the specific
force over this time should then point up, and that of the field north; the angles by which they do not are the
innovations. Their noise is the motion, which no parameter changes; the parameters change the error of
orientation and bias before it. Readings, horizon and instants are the same for all parameters, so that likelihoods may
be compared; the innovations inside a filter are not: its low-pass and its blocks change the measurement.

Where the gyroscope's bias b is not in its integrated rate G, it is added to first order: with u = G a and C = ∫ G dt,
the mean force in the sensor frame at t is

    f(b) = Gᵀ mean(u) + J b,   J = Gᵀ (mean([u]× C) − [mean(u)]× C(t))                                          (1)

which costs a few sums once for a recording, and a product of matrices for each track.

The angles are taken to be of Student's t distribution with ν = 4 degrees of freedom (K. L. Lange, R. J. A. Little,
J. M. G. Taylor, Robust Statistical Modeling Using the t Distribution, JASA 84, 1989), so that shocks count little. With
the scale s at its most likely value, s and the logarithm of the likelihood order all tracks alike, so s is the error.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from levelhead.engine import fuse
from levelhead.filters import GyroIntegration
from levelhead.recording import Array, Recording
from levelhead.rotations import cross_matrix, matrix
from levelhead.track import Track

HORIZON = 5.0  # s
EVERY = 0.25  # s between two instants
FREEDOM = 4.0  # ν
ROUNDS = 20  # of the fit of s; each halves the rest, or better
MIN_VARIANCE = 1e-9  # rad², of s²


@dataclass(frozen=True)
class MeanReading:
    """A sensor's mean over the horizon after each instant, in the sensor frame at the instant, by eq. 1.

    Attributes:
        value: (k, 3) without bias.
        slope: (k, 3, 3) its change with the gyroscope's bias, per rad/s.
    """

    value: Array
    slope: Array

    def at(self, bias: Array) -> Array:
        """(k, 3) with the bias (k, 3) taken off the rate."""
        found: Array = self.value + np.einsum("kij,kj->ki", self.slope, bias)
        return found

    def part(self, rows: NDArray[np.bool_]) -> "MeanReading":
        """At some of the instants."""
        return MeanReading(self.value[rows], self.slope[rows])


@dataclass(frozen=True)
class Innovations:
    """The readings of a recording, ready to be held against a track.

    Attributes:
        rows: (k,) samples at which predictions start.
        force: the specific force after each.
        field: the magnetic field after each; None without a magnetometer.
    """

    rows: NDArray[np.int64]
    force: MeanReading
    field: MeanReading | None

    def part(self, kept: NDArray[np.bool_]) -> "Innovations":
        """Those that start at some of the instants: (k,)."""
        return replace(
            self, rows=self.rows[kept], force=self.force.part(kept),
            field=None if self.field is None else self.field.part(kept),
        )  # fmt: skip

    def scales(self, track: Track) -> tuple[float, float, float]:
        """s in degrees of all innovations, of tilt (root of the sum of two axes) and of heading (its mean removed).

        The first is the geometric mean over the three angles, that is, of the joint likelihood; without a magnetometer
        that of tilt, and the third is 0.
        """
        rotation = matrix(track.quat[self.rows])
        bias = np.zeros((len(self.rows), 3)) if track.bias is None else np.nan_to_num(track.bias[self.rows])
        force = np.einsum("kij,kj->ki", rotation, self.force.at(bias))
        level = np.hypot(force[:, 0], force[:, 1])
        tilt = np.degrees(math.sqrt(2.0) * most_likely_scale(np.arctan2(level, force[:, 2]), 2))
        if self.field is None:
            return float(tilt), float(tilt), 0.0
        field = np.einsum("kij,kj->ki", rotation, self.field.at(bias))
        angles = np.exp(1j * np.arctan2(field[:, 0], field[:, 1]))
        heading = np.degrees(most_likely_scale(np.angle(angles * np.conj(angles.mean())), 1))
        return float(np.cbrt(tilt * tilt * heading)), float(tilt), float(heading)


def most_likely_scale(lengths: Array, dimensions: int) -> float:
    """The scale s per axis of vectors of these lengths (k,) whose components have a t distribution, by iteration of

    s² = mean(w x²)/d,   w = (ν + d)/(ν + x²/s²)
    """
    squares = lengths * lengths
    s2 = max(float(np.median(squares)), MIN_VARIANCE)
    for _ in range(ROUNDS):
        weights = (FREEDOM + dimensions) / (FREEDOM + squares / s2)
        s2 = max(float(np.mean(weights * squares)) / dimensions, MIN_VARIANCE)
    return math.sqrt(s2)


def innovations_of(recording: Recording, counts: NDArray[np.bool_]) -> Innovations:
    """The measurements that tracks are to predict, from instants that count: (n,)."""
    t = recording.t
    start = np.searchsorted(t, np.arange(t[0], t[-1] - HORIZON, EVERY))
    start = np.unique(start[counts[start]])
    end = np.searchsorted(t, t[start] + HORIZON)
    turn = matrix(fuse(recording, GyroIntegration(), guard=None).quat)
    integral = np.cumsum(turn * np.diff(t, prepend=t[0])[:, None, None], axis=0)
    mag = recording.mag
    force = _mean_reading(recording.acc, turn, integral, start, end)
    return Innovations(start, force, None if mag is None else _mean_reading(mag, turn, integral, start, end))


def _mean_reading(
    readings: Array, turn: Array, integral: Array, start: NDArray[np.int64], end: NDArray[np.int64]
) -> MeanReading:
    """Eq. 1 for readings (n, 3), NaN where missing, with G (n, 3, 3) and C (n, 3, 3)."""
    known = np.asarray(np.isfinite(readings).all(axis=1))
    filled: Array = np.where(known[:, None], readings, 0.0)
    turned: Array = np.einsum("nij,nj->ni", turn, filled)
    count = np.maximum(_sum(known.astype(float), start, end), 1.0)
    mean = _sum(turned, start, end) / count[:, None]
    product = _sum(cross_matrix(turned) @ integral, start, end) / count[:, None, None]
    back = np.swapaxes(turn[start], 1, 2)
    slope = back @ (product - cross_matrix(mean) @ integral[start])
    return MeanReading(np.einsum("kij,kj->ki", back, mean), slope)


def _sum(values: Array, start: NDArray[np.int64], end: NDArray[np.int64]) -> Array:
    """The sums of values (n, …) from ``start`` (k,) to before ``end``."""
    sums = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
    found: Array = sums[end] - sums[start]
    return found
