"""The walk of a foot with a sensor on it: stance, strides and position, bounded by the ground that does not move.

``stance`` finds when the foot is on the ground; ``ESKF``'s smoother takes zero velocity there; ``strides`` cuts
the walk into strides and keeps a level floor level.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from levelhead.engine.smoothing import smooth
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import FilterChoice
from levelhead.gaits.live import GaitStream
from levelhead.gaits.stance import LEAST_RATE, LONGEST_SWING, Stance, find_stances
from levelhead.gaits.strides import Strides, cut_strides, level_floor
from levelhead.guard.stance import LASTING
from levelhead.recording import Recording, ZeroVelocity
from levelhead.track import Track

LEAST_CONTRAST = 5.0  # of the noises in motion to those of standing: of feet 8 and more, of a hand that walks 2

__all__ = ["Gait", "GaitStream", "Strides", "gait"]


@dataclass(frozen=True, eq=False)
class Gait:
    """A walk.

    Attributes:
        track: orientation, position and velocity of the sensor with their σ; position is zero at the start.
        standing: (n,) whether the foot stands at a sample.
        strides: the facts of each stride.
    """

    track: Track
    standing: NDArray[np.bool_]
    strides: Strides

    @property
    def distance(self) -> float:
        """Metres walked: the sum of the strides' lengths."""
        return float(np.sum(self.strides.length))

    @property
    def gap(self) -> float:
        """Metres from the first position to the last: of a loop the error of closure."""
        track = self.track
        assert track.position is not None
        return float(np.linalg.norm(track.position[-1] - track.position[0]))

    def __repr__(self) -> str:
        one = self.strides
        return (
            f"Gait({len(one.length)} strides, {self.distance:.1f} m; median length {np.median(one.length):.2f} m, "
            f"{np.median(one.duration):.2f} s, {np.median(one.speed):.2f} m/s)"
        )


def gait(
    recording: Recording,
    params: FilterChoice | None = None,
    *,
    level: bool = True,
    progress: Callable[[float], None] | None = None,
) -> Gait:
    """Position and strides of a foot, by a sensor on the shoe: velocity is zero where the foot is on the ground.

    Stances are found by a likelihood ratio (I. Skog, P. Händel, J.-O. Nilsson, J. Rantakokko, IEEE Trans. Biomed. Eng.
    57(11), 2010) whose noises the recording shows. The smoother of ``ESKF`` has the zero velocities as measurements.

    Args:
        recording: of a sensor on a foot, at least 50 samples a second; a magnetometer gives north.
        params: as for ``smooth``.
        level: strides whose rise is within its error count as level, so that a floor stays one; stairs and ramps above
            3 % are kept. False: no stride counts as level. Pressure or GNSS in the recording measure height instead.
        progress: as for ``smooth``.

    Raises:
        LevelheadError: no Recording, below 50 Hz, or no foot that stands again and again: nothing bounds position then.
    """
    if not isinstance(recording, Recording):
        raise LevelheadError(f"gait takes a Recording, not {type(recording).__name__}; levelhead.read(path) makes one")
    if recording.rate < LEAST_RATE:
        raise LevelheadError(
            f"the recording has {recording.rate:g} samples a second; a stance shows from {LEAST_RATE:g} on"
        )
    found = find_stances(recording)
    require_stances(recording, found)
    sigma = found.speed * max(1.0, LASTING * recording.rate) ** 0.5
    stood = ZeroVelocity(recording.t[found.standing], sigma)
    track = replace(smooth(replace(recording, zero_velocity=stood), params, progress=progress), readings=recording)
    strides = cut_strides(track, found)
    if level and recording.pressure is None and recording.gnss is None:
        track, strides = level_floor(track, strides)
    return Gait(track, found.standing, strides)


def require_stances(recording: Recording, found: Stance) -> None:
    """Refuses a position that nothing bounds.

    Raises:
        LevelheadError: fewer than two stances, or seconds without any.
    """
    t, runs = recording.t, found.runs
    if len(runs) < 2 or found.contrast < LEAST_CONTRAST:
        raise LevelheadError(
            "position is not bounded: the sensor never stands between two movements; gait needs a sensor on a foot"
        )
    begins = np.append(t[0], t[runs[:, 1] - 1])
    ends = np.append(t[runs[:, 0]], t[-1])
    worst = int(np.argmax(ends - begins))
    if ends[worst] - begins[worst] > LONGEST_SWING:
        raise LevelheadError(
            f"position is not bounded: the sensor does not stand between {begins[worst]:.1f} and {ends[worst]:.1f} s; "
            f"gait needs a sensor on a foot, which stands every {LONGEST_SWING:g} s"
        )
