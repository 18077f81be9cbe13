"""Orientations from elsewhere in a comparison: a vendor's own, a colleague's, one from another clock or convention."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.evaluate.align import Alignment, align
from levelhead.evaluate.align.result import format_angle
from levelhead.evaluate.align.series import OrientationSeries
from levelhead.evaluate.score import absolute_heading
from levelhead.recording import Array, Recording
from levelhead.rotations import from_angles
from levelhead.track import Track

MAX_SHIFT = 1.0  # s, the longest delay that is looked for
MAX_HEADING_ERROR = 15.0  # °, a constant heading beyond which a contender's zero is taken as arbitrary, not as an error


class ExternalTrack(NamedTuple):
    """An orientation from elsewhere, ready for the table.

    Attributes:
        name: its row.
        track: in the recording's convention, at its samples; NaN where its source has no orientation.
        alignment: the conventions, rotations and shift that make it match.
        relative: whether its heading is relative, so that the best constant is removed before errors count.
    """

    name: str
    track: Track
    alignment: Alignment
    relative: bool

    @property
    def note(self) -> str:
        """The alignment found and the corrections made, in sentences."""
        found = self.alignment
        if found.before < 1e-6:
            return f"{self.name} is the reference itself."
        text = (
            f"{self.name}: {found.description}; {format_angle(found.before)} before, {format_angle(found.after)} after."
        )
        kept = ["its heading"] if found.freedom.earth == "heading" and not self.relative else []
        kept += ["its delay"] if found.has_delay else []
        if kept:
            text += f" {' and '.join(kept).capitalize()} stay{'s' * (len(kept) == 1)} in its errors."
        return " ".join([text, *found.ambiguities])


class Angle(NamedTuple):
    """One angle of an orientation, as a board with a filter of one axis has it.

    Attributes:
        name: "roll", "pitch" or "yaw", as in ``Track.euler``.
        t: s, (n,).
        value: rad, (n,); NaN: unknown.
    """

    name: str
    t: Array
    value: Array


def with_angle(recording: Recording, first: Track | None, angle: Angle) -> Track:
    """The truth, or without truth the ``first`` filter's track, with one of its angles replaced.

    Raises:
        LevelheadError: neither of the two is there.
    """
    whole = _reference(recording, first)
    angles = Track(recording.t, whole).euler(degrees=False)
    known = np.isfinite(angle.value)
    turn = np.interp(recording.t, angle.t[known], np.unwrap(angle.value[known]), left=float("nan"), right=float("nan"))
    angles[:, ("roll", "pitch", "yaw").index(angle.name)] = turn
    return Track(recording.t, from_angles(*angles.T))


def _reference(recording: Recording, first: Track | None) -> Array:
    """(n, 4) of the truth, or without truth of the ``first`` filter."""
    if recording.truth is not None:
        return recording.truth.quat
    if first is None:
        raise LevelheadError(
            "without a true orientation a track is compared with a filter (the default, where it is "
            "among them); expected at least one"
        )
    return first.quat


def align_external(recording: Recording, tracks: Mapping[str, Track], first: Track | None) -> list[ExternalTrack]:
    """Tracks of any convention, read in the one that fits the truth, or without truth the ``first`` filter.

    Corrected are order, direction and frames, never the delay, which is an error as any. A constant heading is removed
    only where it is relative.

    Raises:
        LevelheadError: a track that shares too little time with the recording, or nothing to hold it against.
    """
    return [_align_one(recording, name, track, first) for name, track in tracks.items()]


def _align_one(recording: Recording, name: str, track: Track, first: Track | None) -> ExternalTrack:
    reference = _reference(recording, first)
    try:
        found = align(
            track.t, track.quat, recording.t, reference, earth="heading", sensor="none", shift=MAX_SHIFT
        )  # fmt: skip
    except LevelheadError as error:
        raise LevelheadError(f"{name}: {error}") from None
    turned = _on_clock(found.apply(track, constant=False, clock=False), recording)
    north = absolute_heading(recording, turned)
    return ExternalTrack(name, turned, found, not north or abs(found.heading) > MAX_HEADING_ERROR)


def _on_clock(track: Track, recording: Recording) -> Track:
    """The track at the recording's samples; interpolated if it has others."""
    if np.array_equal(track.t, recording.t):
        return track
    quat = OrientationSeries.from_samples("the track", track.t, track.quat).at(recording.t)
    return replace(
        track, t=recording.t, quat=quat, bias=None, sigma=None, readings=None, health=np.zeros(len(quat), np.uint32)
    )
