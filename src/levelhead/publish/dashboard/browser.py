"""The page with Python in the browser itself (Pyodide): a file that was dropped there becomes a ``RecordingView``."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from levelhead import filters
from levelhead.engine import fuse
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.errors import LevelheadError
from levelhead.evaluate import compare
from levelhead.filters.parameters import Params
from levelhead.guard import Guard
from levelhead.inspection import examine
from levelhead.inspection.explain import explain
from levelhead.open_types import JsonObject, Untyped
from levelhead.publish.dashboard.block import pack_block
from levelhead.publish.dashboard.recording_view import RecordingView
from levelhead.recording import Recording
from levelhead.simulate import recording as simulate
from levelhead.sources import parse_counts, parse_map, parse_units
from levelhead.sources.formats.text.delimited import BIG_READERS
from levelhead.sources.formats.text.layout import Layout
from levelhead.sources.hints import check_options
from levelhead.sources.interpretation import Interpretation
from levelhead.sources.pipeline import read_file
from levelhead.sources.table import Column
from levelhead.track import Track

LONGEST = 30_000  # samples that plain Python explains in some seconds
LARGEST_WHOLE = 2.0**53  # beyond it a double is not every whole number
COMPARED = ("ESKF", "EKF", "Mahony", "Madgwick", "Complementary")
MOTION = ("MPU-6050", "hand", 20.0, 100.0)  # shown without a log: 20 s at 100 Hz


class WasmEngine:
    """Filters as the modules that ``levelhead export --wasm`` makes, with the bits of Python; else ``fuse``.

    Args:
        run: the browser's: name, parameters as JSON, gyr, acc, mag and t as its arrays; its answer has quaternion, and
            bias, sigma and health where the filter has them.
        names: of the filters that it has.
    """

    def __init__(self, run: Callable[..., Untyped], names: Sequence[str]) -> None:
        self._run, self._names = run, frozenset(names)

    def fuse(self, recording: Recording, params: Params, *, guard: Guard | None) -> Track:
        """As ``levelhead.fuse``."""
        name = type(params).__name__
        aided = recording.pressure is not None or recording.gnss is not None
        if name not in self._names or aided or guard != DEFAULT_GUARD:
            return fuse(recording, params, guard=guard)
        from pyodide.ffi import to_js

        given = (recording.gyr, recording.acc, recording.mag, recording.t)
        found = self._run(
            name, json.dumps(params._asdict()), *(None if one is None else to_js(one.ravel()) for one in given)
        )
        known = {
            key: np.asarray(getattr(found, key).to_py())
            for key in ("quaternion", "bias", "sigma", "health")
            if hasattr(found, key)
        }
        n = len(recording)
        return Track(
            recording.t, known["quaternion"].reshape(n, 4), readings=recording, params=params,
            bias=known["bias"].reshape(n, 3) if "bias" in known else None,
            sigma=known["sigma"].reshape(n, 3) if "sigma" in known else None,
            health=known["health"].astype(np.uint32) if "health" in known else np.empty(0, np.uint32),
        )  # fmt: skip


class NumberReader:
    """Columns of big plain text files by the browser's own loop, as ``read_by_arrow`` reads them elsewhere.

    Args:
        read: the browser's: path, lines above the numbers, delimiter, cells of a line, positions; its answer has an
            array for each position and whether it is whole, or is None for a file that is not plain.
    """

    def __init__(self, read: Callable[..., Untyped]) -> None:
        self._read = read

    def __call__(
        self, path: str, layout: Layout, wanted: Sequence[int], exact: frozenset[int]
    ) -> dict[int, Column] | None:
        """(n,) numbers of each position; None: the caller reads them."""
        if layout.decimal_comma or layout.delimiter == " ":
            return None
        from pyodide.ffi import create_proxy

        found = self._read(path, layout.first, layout.delimiter, len(layout.names), create_proxy(list(wanted)))
        if found is None:
            return None
        columns: dict[int, Column] = {}
        for i, values, whole in zip(wanted, found.columns, found.whole, strict=True):
            column = np.asarray(values.to_py())
            if i in exact and whole:
                if np.abs(column).max(initial=0.0) >= LARGEST_WHOLE:
                    return None
                column = column.astype(np.int64)
            columns[i] = column
        return columns


class BrowserView:
    """Calls of a page in the browser: open, doctor, explain, compare, and those of the recording that is open.

    Args:
        run, names: as for ``WasmEngine``.
        read: as for ``NumberReader``.
    """

    def __init__(self, run: Callable[..., Untyped], names: Sequence[str], read: Callable[..., Untyped]) -> None:
        BIG_READERS[:] = [NumberReader(read)]
        self._shown: RecordingView | None = None
        self._engine = WasmEngine(run, names)
        self._reports: dict[str, Callable[[Recording], object]] = {
            "doctor": examine, "explain": explain, "compare": lambda recording: compare(recording, COMPARED),
        }  # fmt: skip

    def call(self, name: str, arguments: str) -> bytes:
        """Answers with a block; its header has a sentence for people as "error"."""
        asked = json.loads(arguments)
        try:
            if name == "open":
                return self.open(asked)
            if self._shown is None:
                raise LevelheadError("open a log first")
            if name in self._reports:
                whole = self._shown.recording
                part = whole if name == "doctor" else stretch(whole, float(asked["low"]), float(asked["high"]))
                return pack_block({"text": str(self._reports[name](part))})
            return self._shown.calls[name](asked)
        except LevelheadError as error:
            return pack_block({"error": str(error)})

    def open(self, asked: JsonObject) -> bytes:
        """Reads a log, or simulates one where no path is given; answers with the conclusions on its columns."""
        if not asked.get("path"):
            sensor, motion, duration, rate = MOTION
            recording = simulate(sensor, motion, duration=duration, rate=rate)
            self._shown = RecordingView(recording, filters.default(), engine=self._engine.fuse)
            return pack_block({"text": ""})
        path, hints = Path(asked["path"]), hints_of(asked)
        conclusions: list[Interpretation] = []

        def keep(found: Interpretation) -> Interpretation:
            conclusions.append(found)
            return found

        recording = read_file(path, check_options(hints), keep)
        self._shown = RecordingView(recording, filters.default(), engine=self._engine.fuse)
        return pack_block({"text": "\n".join(map(str, conclusions))})


def stretch(recording: Recording, low: float, high: float) -> Recording:
    """The rows between two times.

    Raises:
        LevelheadError: too many for plain Python.
    """
    first, end = (int(row) for row in np.searchsorted(recording.t, [low, high]))
    if end - first > LONGEST:
        raise LevelheadError(f"{end - first} samples are shown; zoom in until there are {LONGEST} or fewer")
    return recording[first : end + 1]


def hints_of(asked: JsonObject) -> JsonObject:
    """Hints for the reader from the words of a form, as options of the command line."""
    words = {name: [word for word in str(asked.get(name, "")).split() if word] for name in ("map", "units", "counts")}
    rate = str(asked.get("rate", "")).strip()
    try:
        number = float(rate) if rate else None
    except ValueError:
        raise LevelheadError(f"the rate is '{rate}'; expected samples a second, such as 100") from None
    hints = {
        "map": parse_map(words["map"]),
        "units": parse_units(words["units"]),
        "counts": parse_counts(words["counts"]),
    }
    return {name: value for name, value in hints.items() if value} | ({} if number is None else {"rate": number})
