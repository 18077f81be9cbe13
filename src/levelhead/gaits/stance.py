"""Stances of a foot: a likelihood ratio of two noises, whose sizes the recording shows.

Over windows of ``WINDOW`` s, with u the direction of the mean specific force there,

    a² = mean |f − g u|²,    w² = mean |ω|²                                                                     (1)

A foot that stands has the noises σ_a and σ_w along each axis, one that moves s_a and s_w. It stands where that is
likelier (I. Skog, P. Händel, J.-O. Nilsson, J. Rantakokko, IEEE Trans. Biomed. Eng. 57(11), 2010, with Gaussians on
both sides):

    a²/σ_a² + w²/σ_w² − a²/s_a² − w²/s_w² < 3 ln(s_a²/σ_a²) + 3 ln(s_w²/σ_w²)                                    (2)

All four are found in turn with (2): those of standing from the stances between strides, as somebody who waits is
quieter than a stance. ``guard.stance`` is the same sample by sample.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.atmosphere import Numbers
from levelhead.guard.stance import ARM, LEAST, LONGEST, MOVING, SHORTEST, STANDING, WINDOW
from levelhead.recording import Array, Recording
from levelhead.units import GRAVITY

LEAST_RATE = 50.0  # Hz: fewer samples do not show a stance
LONGEST_SWING = 4.0  # s without a stance, after which position is off by metres
ROUNDS = 20
SHORTEST_SWING = 0.15  # s: a shorter one is a tremor of the foot that stands


class Stance(NamedTuple):
    """Where a foot stands.

    Attributes:
        standing: (n,) whether it stands at a sample.
        runs: (k, 2) samples, the first of each stance and the one after its last.
        statistic: (n,) left side of (2): the smaller, the stiller; infinite where readings are missing.
        noise: m/s² and rad/s of a standing foot along each axis.
        contrast: how many times larger those of a moving foot are, the lesser of the two.
    """

    standing: NDArray[np.bool_]
    runs: NDArray[np.intp]
    statistic: Array
    noise: tuple[float, float]
    contrast: float

    @property
    def speed(self) -> float:
        """1σ in m/s of the sensor's mean velocity in stance: the foot rolls about a point below it."""
        return ARM * self.noise[1]


def find_stances(recording: Recording) -> Stance:
    """The stances of a recording of a foot, by (2)."""
    rate = recording.rate
    force, turn = _window_squares(recording)
    usable = np.isfinite(force)
    still, moving = np.sqrt(STANDING), np.sqrt(MOVING)
    standing = np.zeros(len(recording), bool)
    runs, statistic = np.empty((0, 2), np.intp), np.full(len(recording), np.inf)
    for _ in range(ROUNDS):
        before = standing
        sides = likelihood(force, turn, still, moving)
        statistic, limit = np.where(usable, sides[0], np.inf), sides[1]
        standing, runs = _clean(statistic < limit, rate)
        between = np.zeros(len(standing), bool)
        for first, last in runs[1:-1]:
            between[first:last] = last - first <= LONGEST * rate
        if between.any():
            still = np.maximum(np.sqrt([force[between].mean() / 3.0, turn[between].mean() / 3.0]), np.sqrt(LEAST))
        swing = usable & ~standing
        if swing.any():
            moving = np.maximum(np.sqrt([force[swing].mean() / 3.0, turn[swing].mean() / 3.0]), 2.0 * still)
        if np.array_equal(before, standing):
            break
    return Stance(standing, runs, statistic, (float(still[0]), float(still[1])), float(np.min(moving / still)))


def likelihood(force: Numbers, turn: Numbers, still: Array, moving: Array) -> tuple[Numbers, float]:
    """Both sides of (2), from a² and w², and the noises of standing and moving, (2,) each in m/s² and rad/s."""
    by_force = still[0] ** -2 - moving[0] ** -2
    by_turn = still[1] ** -2 - moving[1] ** -2
    return force * by_force + turn * by_turn, 6.0 * float(np.sum(np.log(moving / still)))


def _window_squares(recording: Recording) -> tuple[Array, Array]:
    """(n,) a² and w² of (1), NaN where the window has missing readings."""
    size = max(3, round(WINDOW * recording.rate) | 1)
    readings = np.concatenate([recording.acc, recording.gyr, recording.acc**2, recording.gyr**2], axis=1)
    half = size // 2
    padded = np.pad(readings, ((half + 1, half), (0, 0)), "edge")
    known = np.isfinite(padded)
    total = np.cumsum(np.where(known, padded, 0.0), axis=0)
    count = np.cumsum(known, axis=0)
    mean = (total[size:] - total[:-size]) / size
    whole = (count[size:] - count[:-size] == size).all(axis=1)
    square = mean[:, 6:9].sum(axis=1)
    force = square - 2.0 * GRAVITY * np.linalg.norm(mean[:, :3], axis=1) + GRAVITY**2
    return np.where(whole, np.maximum(force, 0.0), np.nan), np.where(whole, mean[:, 9:12].sum(axis=1), np.nan)


def _clean(standing: NDArray[np.bool_], rate: float) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Without tremors within a stance, and without stances that are none; and the runs."""
    runs = _runs(standing)
    if len(runs):
        joined = np.flatnonzero(runs[1:, 0] - runs[:-1, 1] >= SHORTEST_SWING * rate)
        runs = np.stack([runs[np.r_[0, joined + 1], 0], runs[np.r_[joined, len(runs) - 1], 1]], axis=1)
        runs = runs[runs[:, 1] - runs[:, 0] >= SHORTEST * rate]
    cleaned = np.zeros(len(standing), bool)
    for first, last in runs:
        cleaned[first:last] = standing[first:last]
    return cleaned, runs


def _runs(flags: NDArray[np.bool_]) -> NDArray[np.intp]:
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return np.stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)], axis=1)
