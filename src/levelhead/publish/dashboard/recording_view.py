"""The page of a recording: play, pause, scrub, jump to events; another parameter fuses it again at once."""

import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from levelhead.engine import fuse
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.errors import LevelheadError
from levelhead.filters.health import FAULTS, NAMES
from levelhead.publish.dashboard.chart_data import ChartData, tilt_of, two_sigma, unwrap, unwrap_to
from levelhead.publish.dashboard.charts import ChartSet
from levelhead.publish.dashboard.page import PORT, Page, plain_text, status_text
from levelhead.publish.writers import SUFFIXES, write_track
from levelhead.recording import Array, Recording
from levelhead.track import Track

POINTS = 2000  # of a chart
FRAMES = 20.0  # of the 3-D view per second, while it plays
TEXTS = 4.0  # of cursor and text per second, while it plays
LISTED = 12  # events with a button at a time
SPEEDS = ("0.25", "0.5", "1", "2", "4", "8")
EPOCH = 1e9  # s: stamps beyond are since 1970, and shown as clock time


class RecordingView:
    """Shows a recording and a filter's track of it.

    Args:
        recording: what is shown.
        params: the filter.
        guard: as for ``fuse``.
        port: of the page.
        second: another filter, whose angles are drawn as well.

    Attributes:
        params: the parameters in use.
        track: the result with them.
        selection: rows that are exported: those between the edges of the last zoom.
    """

    def __init__(
        self, recording: Recording, params: Any, guard: Any = DEFAULT_GUARD, port: int = PORT, second: Any = None
    ) -> None:
        self.recording, self.params, self._guard = recording, params, guard
        self.track: Track = fuse(recording, params, guard=guard)
        self._second = None if second is None else fuse(recording, second, guard=guard)
        self.page = Page(file_name(recording.meta.get("source")), port)
        self.selection = slice(0, len(recording))
        clock_time = bool(recording.t[0] > EPOCH)
        self._origin = 0.0 if clock_time else float(recording.t[0])  # of the charts' x axis
        self._at = 0.0  # s since the beginning
        self._playing, self._over = False, threading.Event()
        self._changes: dict[str, Any] = {}
        self._cursor_drawn = 0.0
        gui = self.page.server.gui
        with gui.add_folder("Time"):
            self._scrub: Any = gui.add_slider("t", 0.0, max(recording.duration, 1e-3), 0.01, 0.0)
            self._time: Any = gui.add_number("t [s]", 0.0, min=0.0, max=max(recording.duration, 1e-3), step=0.01)
            self._button = gui.add_button("Play")
            self._speed = gui.add_dropdown("speed", SPEEDS, initial_value="1")
        truth, name = recording.truth is not None, "" if self._second is None else self._second.name
        self.page.charts = ChartSet(gui, clock_time, recording.mag is not None, truth, name)
        self._events_folder = gui.add_folder("Events")
        self._event_widgets: list[Any] = []
        with gui.add_folder("Selection"):
            self._selected = gui.add_markdown("")
            for suffix in SUFFIXES:
                button = gui.add_button(f"Download {suffix.lstrip('.')}")
                button.on_click(lambda event, suffix=suffix: self._download(event, suffix))
        self._scrub.on_update(lambda event: self.go_to(self._scrub.value) if event.client is not None else None)
        self._time.on_update(lambda event: self.go_to(self._time.value) if event.client is not None else None)
        self._button.on_click(lambda _: self.play(not self._playing))
        self.page.charts.on_select(lambda t: self.go_to(t + self._origin - float(recording.t[0])), self.select)
        self.page.parameters.show(params, self._change)
        self._show()
        self.select(-np.inf, np.inf)
        self._thread = threading.Thread(target=self._run, name="dashboard", daemon=True)
        self._thread.start()

    def play(self, on: bool) -> None:
        """Plays or pauses; from the end it begins again."""
        if on and self._at >= self.recording.duration:
            self._at = 0.0
        self._playing = on
        self._button.label = "Pause" if on else "Play"

    def go_to(self, seconds: float) -> None:
        """Shows an instant in the 3-D view, the charts' cursor and the time widgets."""
        self._at = min(max(0.0, seconds), self.recording.duration)
        self._scrub.value = self._time.value = round(self._at, 2)
        self._turn()
        self._show_text()
        self._draw_cursor()

    def select(self, low: float, high: float) -> None:
        """Takes the rows between two times of the charts' x axis for the export."""
        first, end = np.searchsorted(self.recording.t - self._origin, [low, high], side="left")
        self.selection = slice(int(first), max(int(end), int(first) + 1))
        t = self.recording.t[self.selection] - self.recording.t[0]
        self._selected.content = (
            f"{t[0]:.2f} to {t[-1]:.2f} s, {len(t)} samples; drag in a chart to zoom and select, double-click for all"
        )

    def export(self, suffix: str) -> bytes:
        """The selected part of the track as CSV or Parquet, as ``levelhead fuse`` writes it."""
        rows = self.selection
        arrays: dict[str, Any] = {field.name: getattr(self.track, field.name) for field in fields(self.track)}
        cut: dict[str, Any] = {name: value[rows] for name, value in arrays.items() if isinstance(value, np.ndarray)}
        readings = None if self.track.readings is None else self.track.readings[rows]
        part = replace(self.track, **cut, readings=readings)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"selection{suffix}"
            write_track(part, path)
            return path.read_bytes()

    def _download(self, event: Any, suffix: str) -> None:
        try:
            content = self.export(suffix)
        except LevelheadError as error:
            self.page.status.content = plain_text(str(error))
            return
        event.client.send_file_download(f"selection{suffix}", content, save_immediately=True)

    def _change(self, name: str, value: float | bool) -> None:
        self._changes[name] = value

    def _run(self) -> None:
        last = time.monotonic()
        while not self._over.wait(1.0 / FRAMES):
            now = time.monotonic()
            if self._changes:
                self._fuse()
            if self._playing:
                self._at += (now - last) * float(self._speed.value)
                if self._at >= self.recording.duration:
                    self._at = self.recording.duration
                    self.play(False)
                    self._cursor_drawn = 0.0
                self._turn()
                if now - self._cursor_drawn > 1.0 / TEXTS:
                    self._cursor_drawn = now
                    self._scrub.value = self._time.value = round(self._at, 2)
                    self._show_text()
                    self._draw_cursor()
            last = now

    def _draw_cursor(self) -> None:
        assert self.page.charts is not None
        self.page.charts.set_cursor(self._at + float(self.recording.t[0]) - self._origin)

    def _fuse(self) -> None:
        """Other parameters, another track."""
        changes = {name: self._changes.pop(name) for name in list(self._changes)}
        try:
            self.params = self.params._replace(**changes)
            self.track = fuse(self.recording, self.params, guard=self._guard)
        except LevelheadError as error:
            self.page.status.content = plain_text(str(error))
            return
        self._show()

    def _show(self) -> None:
        """Draws all charts, lists the events."""
        track, rec = self.track, self.recording
        rows = np.unique(np.linspace(0, len(track) - 1, POINTS).astype(int))
        angles = unwrap(track.euler())
        sigma = np.zeros((len(track), 3)) if track.sigma is None else track.sigma
        bias = np.zeros((len(track), 3)) if track.bias is None else np.degrees(track.bias)

        def curves(quat: Array) -> Array:
            return unwrap_to(Track(rec.t, quat).euler()[rows], angles[rows])

        assert self.page.charts is not None
        tilt = unwrap_to(tilt_of(rec.acc[rows]), angles[rows, :2])
        self.page.charts.set_data(
            ChartData(
                rec.t[rows] - self._origin, angles[rows], two_sigma(sigma[rows]), tilt, bias[rows],
                np.degrees(rec.gyr[rows]), rec.acc[rows], None if rec.mag is None else rec.mag[rows],
                None if rec.truth is None else curves(rec.truth.quat),
                None if self._second is None else curves(self._second.quat),
            )
        )  # fmt: skip
        self._list_events()
        self._turn()
        self._show_text()

    def _events(self) -> list[tuple[float, str]]:
        """When health bits began: s since the beginning, and what it was."""
        health = self.track.health & np.uint32(FAULTS)
        began = np.flatnonzero(health[1:] & ~health[:-1]) + 1
        found = []
        for row in began.tolist():
            new = int(health[row] & ~health[row - 1])
            words = ", ".join(words for bit, words in NAMES.items() if new & bit)
            found.append((float(self.recording.t[row] - self.recording.t[0]), words))
        return found

    def _list_events(self, first: int = 0) -> None:
        """A button per event, which goes to its time; a page of them, and buttons for the pages before and after."""
        gui = self.page.server.gui
        while self._event_widgets:
            self._event_widgets.pop().remove()
        events = self._events()
        end = min(first + LISTED, len(events))
        with self._events_folder:
            many = f"{first + 1} to {end} of {len(events)}" if len(events) > LISTED else ""
            if not events or many:
                self._event_widgets.append(gui.add_markdown(many or "none"))
            for seconds, words in events[first:end]:
                self._add_event_button(f"{seconds:.2f} s: {words}", "gray", self.go_to, seconds)
            if first > 0:
                self._add_event_button("Earlier events", None, self._list_events, max(0, first - LISTED))
            if end < len(events):
                self._add_event_button("Later events", None, self._list_events, end)

    def _add_event_button(self, label: str, color: Any, act: Callable[[Any], None], value: float) -> None:
        """A button that calls ``act(value)``."""
        button = self.page.server.gui.add_button(label, color=color)
        button.on_click(lambda _: act(value))
        self._event_widgets.append(button)

    def _row(self) -> int:
        """The row that is shown."""
        rec = self.recording
        return min(int(np.searchsorted(rec.t, rec.t[0] + self._at)), len(rec) - 1)

    def _turn(self) -> None:
        row, track = self._row(), self.track
        self.page.turn(track.quat[row].tolist(), 0.0 if track.sigma is None else float(track.sigma[row, 2]))

    def _show_text(self) -> None:
        rec, track, row = self.recording, self.track, self._row()
        sigma = np.zeros(3) if track.sigma is None else track.sigma[row]
        angles = Track(track.t[row : row + 1], track.quat[row : row + 1]).euler()[0].tolist()
        band = two_sigma(sigma[None, :])[0].tolist()
        self.page.status.content = status_text(
            angles, band, f"t {self._at:.2f} s of {rec.duration:.2f} s, {plain_text(track.name)}"
        )

    def wait(self) -> None:
        """Until Ctrl-C."""
        while not self._over.wait(1.0):
            pass

    def stop(self) -> None:
        """Closes the page."""
        self._over.set()
        self._thread.join()
        self.page.stop()


def file_name(source: object) -> str:
    """The name of a file without its folders."""
    return str(source or "recording").replace("\\", "/").rpartition("/")[2]
