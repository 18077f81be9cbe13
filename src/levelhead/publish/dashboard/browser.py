"""The page with Python in the browser itself (Pyodide): a file that was dropped there becomes a ``RecordingView``."""

import json
from pathlib import Path

from levelhead import filters
from levelhead.errors import LevelheadError
from levelhead.inspection import inspect
from levelhead.open_types import JsonObject
from levelhead.publish.dashboard.block import pack_block
from levelhead.publish.dashboard.recording_view import RecordingView
from levelhead.simulate import recording as simulate
from levelhead.sources import parse_counts, parse_map, parse_units
from levelhead.sources.hints import check_options
from levelhead.sources.pipeline import interpret, read_file

MOTION = ("MPU-6050", "hand", 20.0, 100.0)  # what is shown to those who have no log: 20 s at 100 Hz


class BrowserView:
    """Calls of a page in the browser: open, and those of the recording that is open."""

    def __init__(self) -> None:
        self._shown: RecordingView | None = None

    def call(self, name: str, arguments: str) -> bytes:
        """Answers with a block; a sentence for people stands in its header as "error"."""
        asked = json.loads(arguments)
        try:
            if name == "open":
                return self.open(asked)
            if self._shown is None:
                raise LevelheadError("open a log first")
            return self._shown.calls[name](asked)
        except LevelheadError as error:
            return pack_block({"error": str(error)})

    def open(self, asked: JsonObject) -> bytes:
        """Reads a log, or simulates one where no path is given; answers with the reports on it."""
        if not asked.get("path"):
            sensor, motion, duration, rate = MOTION
            self._shown = RecordingView(simulate(sensor, motion, duration=duration, rate=rate), filters.EKF())
            return pack_block({"reports": []})
        path, hints = Path(asked["path"]), hints_of(asked)
        recording = read_file(path, check_options(hints))
        reports = [("Doctor", str(inspect(path, **hints))), ("Columns and units", str(interpret(path, **hints)))]
        self._shown = RecordingView(recording, filters.default())
        return pack_block({"reports": [{"title": title, "text": text} for title, text in reports]})


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
