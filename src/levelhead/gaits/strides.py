"""Strides of a walk, and a floor that stays level."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.gaits.stance import Stance
from levelhead.recording import Array
from levelhead.track import Track

LEAST_LENGTH = 0.1  # m: a foot that turns on its place makes no stride
UNEVEN = 0.01  # m, 1σ of a floor's rise over a stride
RISE_ERROR = 0.015  # m, 1σ of the error of a rise that all strides of a walk share
LARGE = 3.0  # σ: a rise beyond
NEIGHBOURS = 9  # strides over which a ramp shows


class Strides(NamedTuple):
    """Strides, from stance to stance of one foot.

    Attributes:
        start: (k,) s, middle of the stance before.
        end: (k,) s, middle of the stance after.
        length: (k,) m, horizontal distance between the two.
        rise: (k,) m, change of height.
        level: (k,) whether the stride counts as level.
    """

    start: Array
    end: Array
    length: Array
    rise: Array
    level: NDArray[np.bool_]

    def columns(self) -> dict[str, Array]:
        """The strides as columns with their units."""
        return {
            "start [s]": self.start, "end [s]": self.end, "length [m]": self.length, "rise [m]": self.rise,
            "speed [m/s]": self.speed, "level": self.level.astype(float),
        }  # fmt: skip

    @property
    def duration(self) -> Array:
        """(k,) s."""
        return self.end - self.start

    @property
    def speed(self) -> Array:
        """(k,) m/s."""
        speed: Array = self.length / self.duration
        return speed


def cut_strides(track: Track, stance: Stance) -> Strides:
    """The strides of a track with position, none of them level yet."""
    assert track.position is not None
    middles = []
    for k, (first, last) in enumerate(stance.runs):  # of standing before and after the walk its inner end
        if k == 0 or k == len(stance.runs) - 1:
            middles.append(last - 1 if k == 0 else first)
        else:
            middles.append(first + int(np.argmin(stance.statistic[first:last])))
    places = track.position[middles]
    kept = [0]
    for k in range(1, len(middles)):
        if np.hypot(*(places[k] - places[kept[-1]])[:2]) >= LEAST_LENGTH:
            kept.append(k)
    rows = np.array(middles)[kept]
    step = np.diff(track.position[rows], axis=0)
    t = track.t[rows]
    return Strides(t[:-1], t[1:], np.hypot(step[:, 0], step[:, 1]), step[:, 2], np.zeros(len(step), bool))


def level_floor(track: Track, strides: Strides) -> tuple[Track, Strides]:
    """Both with a rise of zero where a stride's own rise and that of its neighbours are within their errors.

    Between two stances the change goes linearly with time, as the smoother spreads an error of velocity. The variance
    of height grows by ``UNEVEN``² with each level stride, and as before with others.
    """
    assert track.position is not None and track.sigma_position is not None and track.velocity is not None
    t, count = track.t, len(strides.rise)
    if count == 0:
        return track, strides
    knots = np.append(strides.start, strides.end[-1])
    variance = np.interp(knots, t, track.sigma_position[:, 2] ** 2)
    grown = np.maximum(np.diff(variance), 0.0)
    own = np.abs(strides.rise) <= LARGE * np.sqrt(grown + RISE_ERROR**2)
    half = NEIGHBOURS // 2
    padded = np.pad(strides.rise, half, "edge")
    around = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1), axis=1)
    flat = own & (np.abs(around) <= 2.0 * RISE_ERROR + LARGE * np.sqrt(grown / NEIGHBOURS))
    removed = np.where(flat, strides.rise, 0.0)
    drift = np.interp(t, knots, np.concatenate([[0.0], np.cumsum(removed)]))
    pace = np.concatenate([removed / (strides.end - strides.start), [0.0]])
    inside = np.clip(np.searchsorted(knots, t, "right") - 1, 0, count)
    change = np.where((t >= knots[0]) & (t < knots[-1]), pace[inside], 0.0)
    floor = np.concatenate([[variance[0]], variance[0] + np.cumsum(np.where(flat, UNEVEN**2, grown))])
    before = np.interp(t, knots, variance)
    height = np.maximum(track.sigma_position[:, 2] ** 2 - before, 0.0) + np.interp(t, knots, floor)
    position, velocity, sigma = track.position.copy(), track.velocity.copy(), track.sigma_position.copy()
    position[:, 2] -= drift
    velocity[:, 2] -= change
    sigma[:, 2] = np.sqrt(height)
    return (
        replace(track, position=position, velocity=velocity, sigma_position=sigma),
        strides._replace(rise=strides.rise - removed, level=flat),
    )
