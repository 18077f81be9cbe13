"""The angle between two answers about one recording where nothing but rounding differs."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import levelhead as lh
from levelhead import rotations

ALIKE = 0.1  # deg, largest angle between two answers that are the same
CLOCK = 1e-9  # a quartz is wrong by 1e-5
LATE = 1e6  # s
RATE = 1e-15  # a few units in the last place


def _scaled(factor: float) -> Callable[[lh.Recording], lh.Recording]:
    return lambda recording: replace(recording, t=recording.t * factor)


CHANGES: dict[str, Callable[[lh.Recording], lh.Recording]] = {
    "slower": _scaled(1.0 + CLOCK),
    "faster": _scaled(1.0 - CLOCK),
    "later": lambda recording: replace(recording, t=recording.t + LATE),
    "rates": lambda recording: replace(recording, gyr=recording.gyr * (1.0 + RATE)),
}


class Apart(NamedTuple):
    """Two answers about one recording."""

    angle: float  # deg, the largest between them
    second: float  # s after the first sample, when it first exceeds ``ALIKE``; NaN: it never does
    sigmas: float  # the largest angle over the root sum of squares of both σ


def compare_answers(one: lh.Track, other: lh.Track) -> Apart:
    """How far two tracks over the same samples lie apart."""
    angle = rotations.angle(rotations.relative_rotation(one.quat, other.quat))
    variance = sum(np.square(track.sigma).sum(axis=1) for track in (one, other) if track.sigma is not None)
    beyond = np.flatnonzero(angle > np.radians(ALIKE))
    second = float(one.t[beyond[0]] - one.t[0]) if len(beyond) else float("nan")
    with np.errstate(divide="ignore", invalid="ignore"):
        sigmas = float(np.nanmax(angle / np.sqrt(variance)))
    return Apart(float(np.degrees(angle.max())), second, sigmas)


def change_answers(recording: lh.Recording, params: Any) -> dict[str, Apart]:
    """How far each change moves the answer of a filter."""
    track = lh.fuse(recording, params)
    return {name: compare_answers(track, lh.fuse(change(recording), params)) for name, change in CHANGES.items()}
