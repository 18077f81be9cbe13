"""The page of a recording: play, pause, scrub; another parameter fuses it again at once."""

import threading
import time
from typing import Any

import numpy as np

from levelhead.engine import fuse
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.errors import LevelheadError
from levelhead.filters.health import FAULTS, NAMES
from levelhead.publish.dashboard.page import PORT, ChartData, Page, plain, status_words, tilt_of, two_sigma
from levelhead.recording import Recording
from levelhead.track import Track

POINTS = 1000  # of a chart
FRAMES = 30.0  # a second, while it plays
LISTED = 12  # events that are listed
SPEEDS = ("0.25", "0.5", "1", "2", "4", "8")


class RecordingView:
    """Shows a recording and a filter's track of it.

    Args:
        recording: what is shown.
        params: the filter.
        guard: as for ``fuse``.
        port: of the page.

    Attributes:
        params: the parameters in use.
        track: what they give.
    """

    def __init__(self, recording: Recording, params: Any, guard: Any = DEFAULT_GUARD, port: int = PORT) -> None:
        self.recording, self.params, self._guard = recording, params, guard
        self.track: Track = fuse(recording, params, guard=guard)
        self.page = Page(str(recording.meta.get("source", "recording")), port)
        gui = self.page.server.gui
        self._at = 0.0  # s since the beginning
        self._playing, self._over = False, threading.Event()
        self._wanted: dict[str, Any] = {}
        with gui.add_folder("Time", order=self.page.status.order + 0.5):  # above the charts
            self._scrub: Any = gui.add_slider("t [s]", 0.0, max(recording.duration, 1e-3), 0.01, 0.0)
            self._button = gui.add_button("Play")
            self._speed = gui.add_dropdown("speed", SPEEDS, initial_value="1")
        self._scrub.on_update(lambda event: self._to(self._scrub.value) if event.client is not None else None)
        self._button.on_click(lambda _: self.play(not self._playing))
        self.page.sliders(params, self._change)
        self._show()
        self._thread = threading.Thread(target=self._work, name="dashboard", daemon=True)
        self._thread.start()

    def play(self, on: bool) -> None:
        """Plays or pauses; from the end it begins anew."""
        if on and self._at >= self.recording.duration:
            self._at = 0.0
        self._playing = on
        self._button.label = "Pause" if on else "Play"

    def _to(self, seconds: float) -> None:
        self._at = seconds
        self._turn()

    def _change(self, name: str, value: float | bool) -> None:
        self._wanted[name] = value

    def _work(self) -> None:
        last = time.monotonic()
        while not self._over.wait(1.0 / FRAMES):
            now = time.monotonic()
            if self._wanted:
                self._again()
            if self._playing:
                self._at += (now - last) * float(self._speed.value)
                if self._at >= self.recording.duration:
                    self._at = self.recording.duration
                    self.play(False)
                self._scrub.value = round(self._at, 2)
                self._turn()
            last = now

    def _again(self) -> None:
        """Other parameters, another track."""
        wanted = {name: self._wanted.pop(name) for name in list(self._wanted)}
        try:
            self.params = self.params._replace(**wanted)
            self.track = fuse(self.recording, self.params, guard=self._guard)
        except LevelheadError as error:
            self.page.status.content = plain(str(error))
            return
        self._show()

    def _show(self) -> None:
        """All charts, and where things stand."""
        rows = np.unique(np.linspace(0, len(self.track) - 1, POINTS).astype(int))
        track, rec = self.track, self.recording
        sigma = np.zeros((len(track), 3)) if track.sigma is None else track.sigma
        bias = np.zeros((len(track), 3)) if track.bias is None else np.degrees(track.bias)
        t = rec.t[rows] - rec.t[0]
        self.page.chart(
            ChartData(t, track.euler()[rows], two_sigma(sigma[rows]), np.nan_to_num(tilt_of(rec.acc[rows])), bias[rows])
        )
        self.page.events.content = "\n".join(self._events()) or "none"
        self._turn()

    def _events(self) -> list[str]:
        """When the health bits began."""
        health = self.track.health & np.uint32(FAULTS)
        began = np.flatnonzero(health[1:] & ~health[:-1]) + 1
        lines = []
        for row in began[:LISTED].tolist():
            new = int(health[row] & ~health[row - 1])
            words = ", ".join(words for bit, words in NAMES.items() if new & bit)
            lines.append(f"- {self.recording.t[row] - self.recording.t[0]:.2f} s: {words}")
        if len(began) > LISTED:
            lines.append(f"- and {len(began) - LISTED} more")
        return lines

    def _turn(self) -> None:
        rec, track = self.recording, self.track
        row = min(int(np.searchsorted(rec.t, rec.t[0] + self._at)), len(rec) - 1)
        self.page.turn(track.quat[row].tolist())
        angles = Track(track.t[row : row + 1], track.quat[row : row + 1]).euler()[0].tolist()
        band = [0.0] * 3 if track.sigma is None else two_sigma(track.sigma[row : row + 1])[0].tolist()
        self.page.status.content = status_words(
            angles, band, f"t {self._at:.2f} s of {rec.duration:.2f} s, {plain(track.name)}"
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
