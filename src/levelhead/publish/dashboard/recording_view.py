"""The page of a recording: its readings, tracks of any filter with any parameters, and parts of them as files."""

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from levelhead import filters
from levelhead.engine import fuse
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.errors import LevelheadError
from levelhead.evaluate import Score, evaluate
from levelhead.filters.parameters import Params, param_table
from levelhead.guard import Guard
from levelhead.open_types import JsonObject, Untyped
from levelhead.publish.dashboard.block import pack_block
from levelhead.publish.dashboard.description import filter_description, filter_names, health_names
from levelhead.publish.writers import SUFFIXES, write_track
from levelhead.recording import Array, Recording
from levelhead.rotations import turn_heading
from levelhead.track import Track

KEPT = 6  # tracks that are not fused again
EPOCH = 1e9  # s: stamps beyond are since 1970, and shown as clock time


class RecordingView:
    """Answers for a recording.

    Args:
        recording: its readings.
        params: the filter that the page shows first.
        guard: as for ``fuse``.
        second: another filter that the page shows beside it.
        engine: the function that fuses; ``fuse`` where there is no other.

    Attributes:
        calls: about, track, download.
    """

    def __init__(
        self, recording: Recording, params: Params, guard: Guard | None = DEFAULT_GUARD, second: Params | None = None,
        engine: Callable[..., Track] = fuse,
    ) -> None:  # fmt: skip
        self.recording, self.params, self.second, self._guard, self._fuse = recording, params, second, guard, engine
        self._tracks: dict[Params, tuple[Track, Score | None]] = {}
        self.track(params)
        self.calls = {
            "about": self._about, "track": self._answer_track, "download": self._download,
        }  # fmt: skip

    def track(self, params: Params) -> tuple[Track, Score | None]:
        """The track of a filter, and its score where there is a truth."""
        if params not in self._tracks:
            track = self._fuse(self.recording, params, guard=self._guard)
            score = None if self.recording.truth is None else evaluate(self.recording, track)
            while len(self._tracks) >= KEPT:
                del self._tracks[next(iter(self._tracks))]
            self._tracks[params] = track, score
        return self._tracks[params]

    def stream(self) -> Iterator[bytes]:
        """Nothing: a recording does not grow."""
        return iter(())

    def close(self) -> None:
        """Forgets the tracks."""
        self._tracks.clear()

    def _about(self, _: JsonObject) -> bytes:
        """The subject, with the readings and the first filter's track: the page draws from one answer."""
        recording, (header, columns) = self.recording, self._track_columns(self.params)
        header |= {
            "kind": "recording", "title": file_name(recording.meta.get("source")), "samples": len(recording),
            "clock": bool(recording.t[0] > EPOCH),
            "second": None if self.second is None else filter_description(self.second),
            "filters": filter_names(), "health": health_names(),
            "suffixes": list(SUFFIXES if find_spec("pyarrow") is not None else SUFFIXES[:1]),
            "notes": [str(note) for note in recording.meta.get("notes", ())],
        }  # fmt: skip
        return pack_block(header, columns | self._reading_columns())

    def _reading_columns(self) -> dict[str, NDArray[Untyped]]:
        """Time, readings and truth; a truth with a heading of its own is turned to that of the first filter."""
        recording = self.recording
        known = {"gyr": recording.gyr, "acc": recording.acc, "mag": recording.mag}
        columns: dict[str, NDArray[Untyped]] = {k: single(array) for k, array in known.items() if array is not None}
        columns["t"] = recording.t
        if recording.truth is not None:
            score = self.track(self.params)[1]
            offset = 0.0 if score is None or score.heading_offset is None else np.radians(score.heading_offset)
            columns["truth"] = single(turn_heading(recording.truth.quat, offset))
        return columns

    def _answer_track(self, asked: JsonObject) -> bytes:
        return pack_block(*self._track_columns(asked_params(asked)))

    def _track_columns(self, params: Params) -> tuple[JsonObject, dict[str, NDArray[Untyped]]]:
        """A track with its filter, and its score where there is a truth."""
        track, score = self.track(params)
        known = {"quat": track.quat, "sigma": track.sigma, "bias": track.bias}
        columns: dict[str, NDArray[Untyped]] = {k: single(array) for k, array in known.items() if array is not None}
        columns["health"] = track.health
        header: JsonObject = {"filter": filter_description(params), "relative": bool(track.relative)}
        if score is not None:
            header["score"] = {"tilt": score.tilt, "heading": score.heading, "total": score.total}
        return header, columns

    def _download(self, asked: JsonObject) -> bytes:
        """The rows between two times of a track, as ``levelhead fuse`` writes them."""
        track, _ = self.track(asked_params(asked))
        first, end = np.searchsorted(track.t, [float(asked["low"]), float(asked["high"])], side="left")
        rows = slice(int(first), max(int(end), int(first) + 1))
        suffix = str(asked["suffix"])
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"selection{suffix}"
            write_track(part(track, rows), path)
            content = np.frombuffer(path.read_bytes(), np.uint8)
        return pack_block(
            {"name": f"{file_name(self.recording.meta.get('source'))}-selection{suffix}"}, {"file": content}
        )


def part(track: Track, rows: slice) -> Track:
    """Some rows of a track, with their readings."""
    kept: JsonObject = {field.name: getattr(track, field.name) for field in fields(track)}
    cut: JsonObject = {name: value[rows] for name, value in kept.items() if isinstance(value, np.ndarray)}
    return replace(track, **cut, readings=None if track.readings is None else track.readings[rows])


def asked_params(asked: JsonObject) -> Params:
    """The filter of a call, with the values that it gives.

    Raises:
        LevelheadError: no such filter or parameter, or a value out of range.
    """
    flt, values = filters.find(str(asked["filter"])), asked.get("values", {})
    unknown = [name for name in values if name not in param_table(flt.params)]
    if unknown:
        raise LevelheadError(f"{flt.name} has no parameter '{unknown[0]}'")
    return flt.params(**values)


def single(values: Array) -> NDArray[np.float32]:
    """Single precision: the page draws 7 digits."""
    return values.astype(np.float32)


def file_name(source: object) -> str:
    """The name of a file without its folders."""
    return str(source or "recording").replace("\\", "/").rpartition("/")[2]
