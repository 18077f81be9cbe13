"""Filters side by side on one recording: errors, lag, time per sample."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from levelhead.engine import fuse
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.binding import choose_engine
from levelhead.engine.native import has_imu
from levelhead.errors import LevelheadError
from levelhead.evaluate.attitude_error import error_quaternion, split_error
from levelhead.evaluate.external_track import Angle, ExternalTrack, align_external, with_angle
from levelhead.evaluate.score import Score, evaluate, rms
from levelhead.evaluate.text_table import Cell, Column, plain_table
from levelhead.filters import default, of, resolve
from levelhead.filters.parameters import FilterChoice, Params
from levelhead.guard import Guard
from levelhead.recording import Recording
from levelhead.track import Track

Progress = Callable[[float], None]  # takes the fraction done, 0 to 1

COLUMNS = (
    Column("filter", "filter"),
    Column("total", "total", "°", 3, "low"),
    Column("total_aligned", "total aligned", "°", 3, "low"),
    Column("tilt", "tilt", "°", 3, "low"),
    Column("heading", "heading", "°", 3, "low"),
    Column("worst", "worst", "°", 2, "low"),
    Column("bias", "bias", "°/s", 4, "low"),
    Column("lag", "lag", "ms", 1, "low"),
    Column("tilt_error_ratio", "tilt error/σ", "", 2, "one"),
    Column("heading_error_ratio", "heading error/σ", "", 2, "one"),
    Column("difference", "tilt against the reference", "°", 3),
    Column("ns", "time", "ns/sample", 0, "low"),
)


@dataclass(frozen=True)
class Row:
    """One filter's result, or that of an orientation from elsewhere.

    Attributes:
        track: the filter's result.
        score: its errors; None for a recording without truth.
        ns: wall time of the batch run in ns per sample, the fastest of a few runs, compilation left out; None for an
            orientation from elsewhere.
        difference: RMS angle in ° between its vertical and that of ``Comparison.reference``.
        external: for an orientation from elsewhere, its name and how it was made to match.
    """

    track: Track
    score: Score | None
    ns: float | None
    difference: float
    external: ExternalTrack | None = None

    @property
    def name(self) -> str:
        """The filter with its parameters, or the contender's name."""
        return self.track.name if self.external is None else self.external.name

    @property
    def cells(self) -> dict[str, Cell]:
        """Values by the keys of ``COLUMNS``."""
        own = {"filter": self.name, "ns": self.ns, "difference": None if self.score else self.difference}
        keys = [column.key for column in COLUMNS]
        return {key: own[key] if key in own else getattr(self.score, key, None) for key in keys}


@dataclass(frozen=True, eq=False)
class Comparison:
    """Several filters on one recording; printed, it is a table with the units in its head.

    Attributes:
        recording: the input of all of them.
        rows: one per filter, in the order given.
        engine: "native", "compiled" or "python", on which they ran and were timed; several are joined by "and".
        guard: the guard in front of each of them; None: there was none.
    """

    recording: Recording
    rows: tuple[Row, ...]
    engine: str
    guard: Guard | None = DEFAULT_GUARD

    @property
    def table(self) -> list[dict[str, Cell]]:
        """One mapping per filter from column key (see ``COLUMNS``) to value; None for a missing value."""
        rows = [row.cells for row in self.rows]
        if all(row.score is None or row.score.heading_offset is not None for row in self.rows):
            return [cells | {"total_aligned": None} for cells in rows]  # it would repeat the total
        return rows

    @property
    def best(self) -> Row:
        """The row with the smallest total error; the first one without truth."""
        return min(self.rows, key=lambda row: row.score.total if row.score is not None else 0.0)

    @property
    def reference(self) -> Row:
        """The row whose tilt the others are compared with if there is no truth: see ``_reference``."""
        chosen = _reference([row.track for row in self.rows])
        return next(row for row in self.rows if row.track is chosen)

    @property
    def notes(self) -> list[str]:
        """Sentences that explain the table."""
        others = [row.external.note for row in self.rows if row.external is not None]
        clock = [f"Time is wall time of the {self.engine} engine, compilation left out."]
        clock = clock if any(row.ns is not None for row in self.rows) else []
        if self.guard is None:
            others.append("Guard off: every filter saw all readings as they are.")
        elif self.guard != DEFAULT_GUARD:
            others.append(f"In front of every filter: {self.guard}.")
        scores = [row.score for row in self.rows if row.score is not None]
        if not scores:
            said = "nothing"
            if self.rows:
                why = "the default filter" if _is_default(self.reference.track) else "whose σ is the smallest"
                said = f"that of {self.reference.name}, {why}"
            return [f"No true orientation in the recording: tilt is compared with {said}.", *others, *clock]
        most = max(score.samples for score in scores)
        sentences = [f"RMS over the {most:,} samples whose truth is known and that count as movement."]
        sentences += [
            f"{row.name} is known at {row.score.samples:,} of them."
            for row in self.rows
            if row.score is not None and row.score.samples < most
        ]
        relative = sum(score.heading_offset is not None for score in scores)
        if relative:
            who = "Heading is relative" if relative == len(scores) else f"Heading is relative for {relative} of them"
            sentences.append(f"{who}: each one's best constant offset was removed first.")
        if relative < len(scores):
            sentences.append("Total aligned: each one's best constant heading offset is removed, known north or not.")
        return [*sentences, *others, *clock]

    def to_dict(self) -> dict[str, object]:
        """Everything but the samples, ready for JSON: numbers, texts, None; never NaN."""
        return {
            "samples": len(self.recording),
            "duration_s": self.recording.duration,
            "rate_hz": self.recording.rate,
            "engine": self.engine,
            "guard": None if self.guard is None else _plain(self.guard),
            "units": {column.key: column.unit for column in COLUMNS if column.unit},
            "notes": self.notes,
            "filters": [
                {"filter": row.name, "params": _plain(row.track.params), "ns_per_sample": row.ns}
                | {"score": None if row.score is None else row.score.to_dict()}
                | {"tilt_difference_deg": row.difference}
                | {"alignment": None if row.external is None else row.external.alignment.to_dict()}
                for row in self.rows
            ],
        }

    def __str__(self) -> str:
        return "\n".join([plain_table(COLUMNS, self.table), *self.notes])


def _plain(params: Params | Guard | None) -> dict[str, object]:
    return {} if params is None else dict(params._asdict())


def time_fuse(
    recording: Recording,
    params: Params,
    engine: str,
    progress: Progress | None = None,
    enough: float = 0.2,
    guard: Guard | None = DEFAULT_GUARD,
) -> tuple[Track, float]:
    """The track and the ns per sample: of the only run in plain Python; compiled, of the fastest of up to three more.

    A first run that takes longer than ``enough`` seconds is followed by one only, and by none beyond 30 s, where
    compilation no longer counts.
    """
    began = perf_counter()
    track = fuse(recording, params, guard=guard, engine=engine, progress=progress)
    first = perf_counter() - began
    compiles = engine != "python" and first <= 30.0
    best = np.inf if compiles else first
    for _ in range((1 if first > enough else 3) if compiles else 0):
        began = perf_counter()
        fuse(recording, params, guard=guard, engine=engine)
        best = min(best, perf_counter() - began)
    return track, 1e9 * float(best) / len(recording)


def compare(
    recording: Recording,
    filters: Sequence[FilterChoice],
    *,
    tracks: Mapping[str, Track] | None = None,
    angles: Mapping[str, Angle] | None = None,
    guard: Guard | None = DEFAULT_GUARD,
    engine: str = "auto",
    progress: Progress | None = None,
) -> Comparison:
    """Run every filter over the recording and score it, and score orientations from elsewhere beside them.

    Args:
        recording: with truth for errors; without, tilt is compared with that of the filter whose σ is the smallest.
        filters: Params objects, Params classes or names.
        tracks: name to an orientation from elsewhere, in any convention and at any rate; how it was made to match
            is in ``Comparison.notes`` (see ``align``).
        angles: name to one angle from elsewhere. The other two angles are those of the truth, or without truth of the
            reference, so that the errors are those of this angle.
        guard: as for ``fuse``; the same for all.
        engine: as for ``fuse``.
        progress: called with the fraction done, 0 to 1.
    """
    chosen = [resolve(choice) for choice in filters]
    if not chosen and not tracks and not angles:
        raise LevelheadError("there is no filter to compare; expected at least one")
    # At once: importing Numba on the way must not change the choice.
    guarded = guard is not None
    engines = [choose_engine(engine, len(recording), has_imu(of(params), guarded)) for params in chosen]
    found: list[tuple[Track, Score | None, float]] = []
    for i, params in enumerate(chosen):

        def report(fraction: float, done: int = i) -> None:
            if progress is not None:
                progress((done + fraction) / len(chosen))

        track, ns = time_fuse(recording, params, engines[i], report, guard=guard)
        score = None if recording.truth is None else evaluate(recording, track)
        found.append((track, score, ns))
        report(1.0)
    reference = _reference([track for track, _, _ in found])
    rows = [Row(track, score, ns, _difference(track, reference or track)) for track, score, ns in found]
    others = dict(tracks or {}) | {
        name: with_angle(recording, reference, angle) for name, angle in (angles or {}).items()
    }
    for other in align_external(recording, others, reference):
        score = None
        if recording.truth is not None:
            score = evaluate(recording, other.track, relative=other.relative, partial=True)
        rows.append(Row(other.track, score, None, _difference(other.track, reference or other.track), other))
    return Comparison(recording, tuple(rows), " and ".join(dict.fromkeys(engines)), guard)


def _is_default(track: Track) -> bool:
    return isinstance(track.params, type(default()))


def _reference(tracks: Sequence[Track]) -> Track | None:
    """The default filter's track, else the one with the smallest σ of tilt; None: there is none. The smallest σ of all
    would often be that of a filter which takes every acceleration for noise, and has a small σ for a wrong answer.
    """
    return min(tracks, key=lambda track: (not _is_default(track), _tilt_sigma(track)), default=None)


def _tilt_sigma(track: Track) -> float:
    """The median σ of tilt in rad; inf: it has none."""
    sigma = None if track.sigma is None else np.hypot(track.sigma[:, 0], track.sigma[:, 1])
    sigma = None if sigma is None else sigma[np.isfinite(sigma) & (sigma > 0.0)]
    return float("inf") if sigma is None or len(sigma) == 0 else float(np.median(sigma))


def _difference(track: Track, reference: Track) -> float:
    """RMS angle in ° between the two verticals, where both are known."""
    tilt = split_error(error_quaternion(track.quat, reference.quat)).tilt
    return float(np.degrees(rms(tilt[~np.isnan(tilt)])))
