"""The orientation that a filter's parameters are tuned to: the truth, or without it the smoother's.

The smoother uses the whole recording at every instant, so its error is a fraction of a filter's, and its σ shows its
accurate parts. Left out are samples whose σ of tilt (of heading, where that counts) is more than twice its median, and
rest, at which every filter is right. Of heading a constant does not count, with truth neither: it is the declination,
or the effect of a magnetometer's offset, and no parameter should be chosen to mend it.

With the likelihood of the innovations as the goal the smoother still shows the times of motion, and drift, lag and
jitter; the parameters are chosen by ``innovations``.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from levelhead.engine.smoothing import smooth
from levelhead.errors import LevelheadError
from levelhead.evaluate.score import scored_rows
from levelhead.filters.health import AT_REST
from levelhead.guard import Guard
from levelhead.recording import Array, Recording, Truth
from levelhead.rotations import angle, conjugate, mean, product
from levelhead.track import Track
from levelhead.tune.innovations import Innovations, innovations_of

Kind = Literal["truth", "smoother", "likelihood"]
MAX_SAMPLES = 4000  # samples of a recording that are scored: neighbours have the same error
MIN_TIME, SHORT_TIME = 10.0, 60.0  # s scored: less is refused, less is weak
STILL, CALM = 3.0, 10.0  # °, RMS turn of the sensor from its mean orientation: less is refused, less is weak
COVERED, MOSTLY = 0.8, 0.95  # share of the log that its truth spans: less is refused, less is weak
WIDE = 2.0  # times the median σ: not trusted
LOST = 10.0  # °, median σ of the smoother's tilt: no reference


@dataclass(frozen=True)
class Reference:
    """A recording with the orientation that a filter is held against.

    Attributes:
        recording: its ``truth`` is the reference, NaN at samples that do not count.
        kind: the reference of the filter.
        name: of the log.
        seconds: how much of the log counts.
        remarks: its weaknesses, a sentence each.
        smoothed: the smoother's track, where that is the reference.
        innovations: the readings to predict, where their likelihood is the goal.
    """

    recording: Recording
    kind: Kind
    name: str
    seconds: float
    remarks: tuple[str, ...]
    smoothed: Track | None = None
    innovations: Innovations | None = None

    def part(self, rows: slice, inside: bool) -> "Reference":
        """With the scored samples at these positions only, or with all others."""
        truth = self.recording.truth
        assert truth is not None
        scored = np.flatnonzero(scored_rows(truth))
        chosen = np.zeros(len(scored), bool)
        chosen[rows] = True
        quat = np.full_like(truth.quat, np.nan)
        kept = scored[chosen == inside]
        quat[kept] = truth.quat[kept]
        part = replace(self, recording=replace(self.recording, truth=replace(truth, quat=quat)))
        if self.innovations is None:
            return part
        nearest = np.minimum(np.searchsorted(scored, self.innovations.rows), len(scored) - 1)
        return replace(part, innovations=self.innovations.part(chosen[nearest] == inside))

    def alone(self, rows: slice) -> "Reference":
        """The stretch of the recording that these scored samples span, as a recording of its own."""
        truth = self.recording.truth
        assert truth is not None
        scored = np.flatnonzero(scored_rows(truth))[rows]
        first, last = int(scored[0]), int(scored[-1]) + 1
        part = replace(self, recording=self.recording[first:last])
        if self.innovations is None:
            return part
        inside = (self.innovations.rows >= first) & (self.innovations.rows < last)
        kept = self.innovations.part(inside)
        return replace(part, innovations=replace(kept, rows=kept.rows - first))


def name_of(recording: Recording, number: int) -> str:
    """The name of its file, or its number."""
    source = str(recording.meta.get("source") or "")
    return source.replace("\\", "/").rpartition("/")[2] or f"recording {number}"


def references(
    recordings: Sequence[Recording], kind: Kind | None, heading: bool, guard: Guard | None, engine: str = "auto"
) -> list[Reference]:
    """The reference of each recording; ``kind`` None: the truth where there is one.

    Args:
        recordings: to be tuned on.
        kind: which reference.
        heading: whether heading counts, and not tilt alone.
        guard: in front of the smoother.
        engine: of the smoother.

    Raises:
        LevelheadError: a recording cannot serve: no truth, too short a one, too short, still, or an unsure smoother.
    """
    found = []
    for number, recording in enumerate(recordings):
        name = name_of(recording, number)
        if (kind or ("smoother" if recording.truth is None else "truth")) == "truth":
            truth, remarks = _known_truth(name, recording)
            found.append(_check(name, recording, "truth", truth, scored_rows(truth), remarks))
        else:
            track = smooth(recording, guard=guard, engine=engine)
            rows, remarks = _trusted_rows(name, recording, track, heading)
            one = _check(name, recording, kind or "smoother", Truth(track.quat), rows, remarks)
            held = innovations_of(recording, rows) if one.kind == "likelihood" else None
            found.append(replace(one, smoothed=track, innovations=held))
    return found


def _known_truth(name: str, recording: Recording) -> tuple[Truth, list[str]]:
    if recording.truth is None:
        raise LevelheadError(f"{name} holds no true orientation; leave --goal truth out to tune to the smoother")
    rows = np.flatnonzero(~np.isnan(recording.truth.quat[:, 0]))
    if not len(rows):
        raise LevelheadError(f"{name}: the true orientation is missing (NaN) at every sample")
    span = float(recording.t[rows[-1]] - recording.t[rows[0]])
    share = span / recording.duration if recording.duration > 0.0 else 1.0
    words = f"{name}: the truth covers {span:.0f} s of {recording.duration:.0f} s"
    if share < COVERED:
        raise LevelheadError(f"{words}; cut the log to it, or tune to the smoother: --goal smoother")
    return recording.truth, [f"{words}; the rest is not scored"] if share < MOSTLY else []


def _trusted_rows(name: str, recording: Recording, track: Track, heading: bool) -> tuple[NDArray[np.bool_], list[str]]:
    """(n,) where the smoother is accurate and the sensor moves, and the weaknesses of this reference."""
    tilt, up = track.sigma_tilt, track.sigma_heading
    assert tilt is not None and up is not None
    median = float(np.degrees(np.median(tilt)))
    if not median <= LOST:
        raise LevelheadError(
            f"{name}: the smoother is not sure of tilt (σ of {median:.0f}°), so nothing can be tuned to it; record "
            "with truth, or with rest at the start"
        )
    rows = (tilt <= WIDE * np.median(tilt)) & recording.valid & ((track.health & np.uint32(AT_REST)) == 0)
    if heading:
        rows &= up <= WIDE * np.median(up)
    remarks = []
    trusted = float(rows.mean())
    if trusted < 0.3:
        remarks.append(f"{name}: only {100.0 * trusted:.0f} % of the samples are in motion and known well enough")
    return rows, remarks


def _check(
    name: str, recording: Recording, kind: Kind, truth: Truth, rows: NDArray[np.bool_], remarks: list[str]
) -> Reference:
    """The reference over these rows, once it is sure that there is enough motion in it."""
    seconds = float(rows.mean()) * recording.duration
    if seconds < MIN_TIME:
        whole = "" if seconds > 0.9 * recording.duration else f" of {recording.duration:.0f} s that can be scored"
        raise LevelheadError(
            f"{name}: {seconds:.0f} s{whole} are too short to tune on; expected {MIN_TIME:g} s of motion, better a few "
            "minutes"
        )
    scored = np.flatnonzero(rows)
    scored = scored[np.unique(np.linspace(0, len(scored) - 1, min(MAX_SAMPLES, len(scored))).astype(int))]
    turn = _spread(truth.quat[scored])
    if turn < STILL:
        raise LevelheadError(
            f"{name}: the sensor hardly turns ({turn:.1f}° RMS from its mean orientation), so all parameters are "
            "equally good; record the motion that the filter is for"
        )
    if seconds < SHORT_TIME:
        remarks = [*remarks, f"{seconds:.0f} s of motion in {name} are few; record a minute or more"]
    if turn < CALM:
        remarks = [*remarks, f"the sensor turns little in {name} ({turn:.1f}° RMS), so the minimum is flat"]
    quat = np.full_like(truth.quat, np.nan)
    quat[scored] = truth.quat[scored]
    held = replace(recording, truth=replace(truth, quat=quat, moving=None, north=False))
    return Reference(held, kind, name, seconds, tuple(remarks))


def _spread(quat: Array) -> float:
    """RMS angle in degrees from the mean orientation."""
    turns = angle(product(conjugate(mean(quat)[None]), quat))
    return float(np.degrees(np.sqrt(np.mean(turns**2))))
