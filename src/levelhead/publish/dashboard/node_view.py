"""The page of a running node: its last orientation, the curves of the last seconds, parameters that it takes."""

import math
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from datetime import datetime

import numpy as np

from levelhead import filters
from levelhead.errors import LevelheadError
from levelhead.live.subscription import Subscription
from levelhead.open_types import JsonObject, Untyped
from levelhead.publish.dashboard.chart_data import ChartData, tilt_of, two_sigma, unwrap, unwrap_to
from levelhead.publish.dashboard.charts import ChartSet
from levelhead.publish.dashboard.page import PORT, Page, plain_text, status_text

WINDOW = 10.0  # s in the charts
DENSITY = 50.0  # points per second in the charts
FRAMES, CHARTS = 15.0, 2.0  # times per second that body and messages, and the charts and text, are drawn
LISTED = 10
COUNTED = frozenset({"late", "over_budget"})
Row = tuple[float, ...]
UNKNOWN = (math.nan, math.nan, math.nan)


class NodeView:
    """Follows a node through its four topics.

    Args:
        subscribe: gives the Subscription of a topic.
        set_params: sets parameters of the node, by keyword; raises LevelheadError where it refuses.
        title: what the page is about.
        port: of the page.
    """

    def __init__(
        self, subscribe: Callable[[str], Subscription], set_params: Callable[..., None], title: str = "node",
        port: int = PORT,
    ) -> None:  # fmt: skip
        self.page = Page(title, port)
        self._set_params = set_params
        self._rows: deque[Row] = deque(maxlen=round(WINDOW * DENSITY))
        self._lines: deque[tuple[str, str]] = deque(maxlen=LISTED)  # name of the event, and its line
        self._repeats: Counter[str] = Counter()
        self._raw: Untyped = None
        self._mag: tuple[float, ...] = UNKNOWN
        self._last: Untyped = None
        self._arrived = self._kept = -math.inf
        self._params: Untyped = None
        gui = self.page.server.gui
        self.page.charts = ChartSet(gui, clock_time=True, mag=True, truth=False, second="")
        with gui.add_folder("Events"):
            self._events = gui.add_markdown("none")
        self._over = threading.Event()
        self._subscriptions = {topic: subscribe(f"imu/{topic}") for topic in ("orientation", "raw", "health", "config")}
        self._thread = threading.Thread(target=self._run, name="dashboard", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        drawn = 0.0
        while not self._over.wait(1.0 / FRAMES):
            try:
                self._read()
            except LevelheadError as error:  # this reader gets nothing from the node
                if self._last is not None:
                    self.page.turn(self._last.quat, valid=False)
                self.page.status.content = f"**{plain_text(str(error))}**"
                return
            now = time.monotonic()
            if self._last is not None:
                self.page.turn(self._last.quat, self._last.sigma[2], self._last.valid)
            if now - drawn >= 1.0 / CHARTS:
                drawn = now
                self._show_status(now)
                self._draw_charts()

    def _read(self) -> None:
        """Takes all that came since the last time."""
        topics = self._subscriptions
        while (config := topics["config"].get(timeout=0.0)) is not None:
            self._configure(config.data)
        while (event := topics["health"].get(timeout=0.0)) is not None:
            bold = "**" if event.on else ""
            name, text = plain_text(event.name), plain_text(event.text)
            self._list_event(event.name, f"{clock(event.stamp)} {bold}{name}{bold}: {text}")
        while (raw := topics["raw"].get(timeout=0.0)) is not None:
            self._raw = raw
            self._mag = raw.mag or self._mag
        if (orientation := topics["orientation"].latest(timeout=0.0)) is not None:
            self._last, self._arrived = orientation, time.monotonic()
            t = 1e-9 * orientation.stamp
            if orientation.valid and self._raw is not None and not 0.0 <= t - self._kept < 1.0 / DENSITY:
                self._keep(orientation, t)

    def _keep(self, orientation: Untyped, t: float) -> None:
        """One more point of the charts; a node's clock that was set back begins them again."""
        if t < self._kept:
            self._rows.clear()
        self._kept = t
        angles, bias, rate = (
            [math.degrees(x) for x in values] for values in (orientation.euler, orientation.bias, self._raw.gyr)
        )
        self._rows.append((t, *angles, *orientation.sigma, *bias, *rate, *self._raw.acc, *self._mag))

    def _list_event(self, name: str, line: str) -> None:
        """One more line on top; events that come every second on a busy machine have one line and a count."""
        self._repeats[name] += 1
        if name in COUNTED:
            self._lines = deque((one for one in self._lines if one[0] != name), maxlen=LISTED)
            line += f" ({self._repeats[name]} so far)"
        self._lines.appendleft((name, f"- {line}"))
        self._events.content = "\n".join(line for _, line in self._lines)

    def _configure(self, config: JsonObject) -> None:
        """Parameters of the node's filter; the widgets are made anew only for another filter."""
        params = filters.find(config["filter"]).params(**config["params"])
        if type(params) is type(self._params):
            self.page.parameters.set(params)
        else:
            self.page.parameters.show(params, self._change)
        self._params = params

    def _change(self, name: str, value: float | bool) -> None:
        try:
            self._set_params(**{name: value})
        except LevelheadError as error:
            self._list_event("not_set", f"**{plain_text(name)}** was not set: {plain_text(str(error))}")
            if self._params is not None:
                self.page.parameters.set(self._params)

    def _show_status(self, now: float) -> None:
        orientation = self._last
        if orientation is None:
            self.page.status.content = "no orientation yet"
            return
        if not orientation.valid:
            self.page.status.content = f"**no valid orientation for {now - self._arrived:.1f} s**"
            return
        reader = self._subscriptions["orientation"]
        angles = [math.degrees(angle) for angle in orientation.euler]
        text = f"sample {orientation.seq}, {clock(orientation.stamp)}, age {1e3 * reader.age:.0f} ms"
        if reader.clock_uncertainty > 0.0:
            text += f", node's clock {1e3 * reader.clock_offset:+.1f} ± {1e3 * reader.clock_uncertainty:.1f} ms"
        text += "".join(f", {words}" for words in orientation.words)
        band = two_sigma(np.array([orientation.sigma]))[0].tolist()
        self.page.status.content = status_text(angles, band, text)

    def _draw_charts(self) -> None:
        if len(self._rows) < 2:
            return
        t, angles, sigma, bias, gyr, acc, mag = np.split(np.array(self._rows), [1, 4, 7, 10, 13, 16], axis=1)
        curves = unwrap(angles)
        assert self.page.charts is not None
        self.page.charts.set_data(
            ChartData(t[:, 0], curves, two_sigma(sigma), unwrap_to(tilt_of(acc), curves[:, :2]), bias, gyr, acc, mag)
        )

    def wait(self) -> None:
        """Until Ctrl-C."""
        while not self._over.wait(1.0):
            pass

    def stop(self) -> None:
        """Closes the page and the subscriptions."""
        self._over.set()
        self._thread.join()
        for subscription in self._subscriptions.values():
            subscription.close()
        self.page.stop()


def clock(stamp: int) -> str:
    """A stamp (ns since 1970) as this machine's clock time, to the millisecond."""
    return datetime.fromtimestamp(1e-9 * stamp).strftime("%H:%M:%S.%f")[:-3]
