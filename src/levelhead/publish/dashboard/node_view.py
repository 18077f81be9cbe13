"""The page of a node that runs: its last orientation, the course of the last seconds, sliders that it listens to."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np

from levelhead import filters
from levelhead.live.subscription import Subscription
from levelhead.publish.dashboard.page import PORT, ChartData, Page, plain, status_words, tilt_of, two_sigma

WINDOW = 10.0  # s in the charts
DENSE = 50.0  # points a second in the charts
FRAMES, CHARTS = 20.0, 4.0  # times a second that body and status, and the charts, are drawn
FRESH = 0.5  # s after which an orientation is called old
LISTED = 10
Row = tuple[float, ...]


class NodeView:
    """Follows a node through its four topics.

    Args:
        subscribe: gives the Subscription of a topic.
        ask: asks the node for other parameters, by keyword.
        title: what the page is about.
        port: of the page.
    """

    def __init__(
        self, subscribe: Callable[[str], Subscription], ask: Callable[..., None], title: str = "node", port: int = PORT
    ) -> None:
        self.page = Page(title, port)
        self._ask = ask
        self._rows: deque[Row] = deque(maxlen=round(WINDOW * DENSE))
        self._events: deque[str] = deque(maxlen=LISTED)
        self._tilt = (0.0, 0.0)
        self._last: Any = None
        self._arrived = self._kept = -math.inf
        self._params: Any = None
        self._over = threading.Event()
        self._subscriptions = {topic: subscribe(f"imu/{topic}") for topic in ("orientation", "raw", "health", "config")}
        self._threads = [threading.Thread(target=self._work, name="dashboard", daemon=True)]
        for one in self._threads:
            one.start()

    def _work(self) -> None:
        drawn = 0.0
        while not self._over.wait(1.0 / FRAMES):
            self._hear()
            now = time.monotonic()
            self._status(now)
            if now - drawn >= 1.0 / CHARTS:
                drawn = now
                self._chart()

    def _hear(self) -> None:
        """Takes all that came since the last time."""
        heard = self._subscriptions
        while (config := heard["config"].get(timeout=0.0)) is not None:
            self._configure(config.data)
        while (event := heard["health"].get(timeout=0.0)) is not None:
            bold = "**" if event.on else ""
            self._events.appendleft(f"- {bold}{plain(event.name)}{bold}: {plain(event.text)}")
            self.page.events.content = "\n".join(self._events)
        raw = heard["raw"].latest(timeout=0.0)
        if raw is not None:
            roll, pitch = tilt_of(np.array([raw.acc]))[0].tolist()
            self._tilt = (roll, pitch)
        while (said := heard["orientation"].get(timeout=0.0)) is not None:
            self._last, self._arrived = said, time.monotonic()
            if said.valid and not 0.0 <= said.t - self._kept < 1.0 / DENSE:
                self._kept = said.t
                bias = (math.degrees(rate) for rate in said.bias)
                self._rows.append((said.t, *map(math.degrees, said.euler), *said.sigma, *self._tilt, *bias))

    def _configure(self, config: dict[str, Any]) -> None:
        """Sliders for the node's filter; made anew only when it is another one."""
        params = filters.find(config["filter"]).params(**config["params"])
        if type(params) is not type(self._params):
            self.page.sliders(params, lambda name, value: self._ask(**{name: value}))
        self._params = params

    def _status(self, now: float) -> None:
        said = self._last
        if said is None:
            self.page.status.content = "no orientation yet"
            return
        age = now - self._arrived
        trusted = said.valid and age < FRESH
        self.page.turn(said.quat, trusted)
        if not trusted:
            self.page.status.content = f"**no valid orientation for {age:.1f} s**"
            return
        angles = [math.degrees(angle) for angle in said.euler]
        words = f"sample {said.seq}, stamp {said.stamp // 1_000_000} ms" + "".join(f", {word}" for word in said.words)
        self.page.status.content = status_words(angles, two_sigma(np.array([said.sigma]))[0].tolist(), words)

    def _chart(self) -> None:
        if len(self._rows) < 2:
            return
        table = np.array(self._rows)
        t, angles, sigma, raw, bias = np.split(table, [1, 4, 7, 9], axis=1)
        self.page.chart(ChartData(t[:, 0], angles, two_sigma(sigma), raw, bias))

    def wait(self) -> None:
        """Until Ctrl-C."""
        while not self._over.wait(1.0):
            pass

    def stop(self) -> None:
        """Closes the page and the subscriptions."""
        self._over.set()
        for one in self._threads:
            one.join()
        for subscription in self._subscriptions.values():
            subscription.close()
        self.page.stop()
