"""The charts of the page: angles with ±2σ, bias, raw sensors; one cursor and one zoom for all of them."""

from collections.abc import Callable, Sequence

import numpy as np

from levelhead.open_types import Untyped
from levelhead.publish.dashboard.chart_data import ChartData, at_edge, y_range
from levelhead.recording import Array

HEIGHT = 150  # pixels of a chart
PADDING = (10, 10, 0, 16)  # pixels above, right, below, left: labels at the ends stand out, and −10,000° of yaw is long
ESTIMATE, RAW, TRUTH, SECOND = "#1f77b4", "#ff7f0e", "#222222", "#9467bd"
BAND = "rgba(31, 119, 180, 0.25)"
AXES = ("#d62728", "#2ca02c", "#1f77b4")
CURSOR = {"sync": {"key": "levelhead", "scales": ["x", None]}, "drag": {"x": True, "y": True, "uni": 40}}
# viser hands no event of a chart to Python. This script, run once by an image that cannot be loaded, writes the time
# under a click, and the range of a zoom, into the text box LINK, and lets Python set the cursor of all charts.
LINK = "chart time"
SCRIPT = """
(function () {
  if (window.levelheadCharts) return;
  const all = () => Object.values((window.__viserTestpoints || {}).uplots || {}).map((one) => one.chart);
  const row = () => [...document.querySelectorAll("label")].find((one) => one.textContent.trim() === "%LINK%");
  const box = () => { let up = row(); while (up && !up.querySelector("input")) up = up.parentElement;
                      return up && up.querySelector("input"); };
  const hide = () => { const found = box(); if (!found) return setTimeout(hide, 200);
    let up = row(); while (!up.contains(found)) up = up.parentElement;
    Object.assign(up.style, { position: "absolute", opacity: 0, height: 0, overflow: "hidden" }); };
  const send = (text) => { const found = box(); if (!found) return;
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(found, text);
    found.dispatchEvent(new Event("input", { bubbles: true })); };
  const chartOf = (over) => all().find((chart) => chart.over === over);
  let down = null;
  document.addEventListener("mousedown", (event) => { down = event.clientX; }, true);
  document.addEventListener("mouseup", (event) => {
    const over = event.target.closest && event.target.closest(".u-over");
    const chart = over && chartOf(over);
    if (!chart) return;
    const dragged = Math.abs(event.clientX - down) > 4;
    const time = chart.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
    setTimeout(() => {
      const { min, max } = chart.scales.x;
      if (dragged) all().forEach((one) => one !== chart && one.setScale("x", { min, max }));
      send(dragged ? "zoom " + min + " " + max : "at " + time + " " + Math.random());
    }, 30);
  }, true);
  document.addEventListener("dblclick", (event) => {
    if (event.target.closest && event.target.closest(".u-over")) send("zoom");
  }, true);
  let shown = null;
  window.levelheadCharts = (time) => { shown = time; all().forEach((chart) => {
    const left = chart.valToPos(time, "x");
    chart.setCursor({ left, top: chart.over.clientHeight / 2 }, false);
  }); };
  const isChart = (place) => place && place.closest && place.closest(".u-over");
  document.addEventListener("mouseout", (event) => {  // the mouse took the cursor of all charts along
    if (shown !== null && isChart(event.target) && !isChart(event.relatedTarget))
      setTimeout(() => window.levelheadCharts(shown), 30);
  }, true);
  hide();
})();
""".replace("%LINK%", LINK)


def _run(script: str) -> str:
    """HTML that runs a script: an image without a picture fails at once."""
    return f'<img src="data:," style="display:none" onerror="{script.replace(chr(34), "&quot;")}">'


class ChartSet:
    """All charts of a page.

    Args:
        gui: viser's.
        clock_time: the x axis is s since 1970, shown as the clock's time.
        mag: whether there is a magnetometer.
        truth: whether there is a true orientation.
        second: name of a second filter, or "".
    """

    def __init__(self, gui: Untyped, clock_time: bool, mag: bool, truth: bool, second: str) -> None:
        self._gui, self._time = gui, clock_time
        self._truth, self._second = truth, second
        self._angles = [self._angle_chart(name, name != "yaw") for name in ("roll", "pitch", "yaw")]
        self._bias = self._vector_chart("gyroscope bias [°/s]")
        with gui.add_folder("Raw sensors", expand_by_default=True):
            self._gyr = self._vector_chart("gyroscope [°/s]")
            self._acc = self._vector_chart("accelerometer [m/s²]")
            self._mag = self._vector_chart("magnetometer [µT]") if mag else None
        self._link = gui.add_text(LINK, "")
        gui.add_html(_run(SCRIPT))
        self._cursor = gui.add_html("")

    def on_select(self, to: Callable[[float], None], zoom: Callable[[float, float], None]) -> None:
        """``to`` gets the time that is clicked in a chart, ``zoom`` the range that is shown (inf: all)."""

        def read(event: Untyped) -> None:
            words = self._link.value.split()
            if event.client is None or not words:
                return
            try:
                numbers = [float(word) for word in words[1:]]
            except ValueError:
                return
            if words[0] == "at" and numbers:
                to(numbers[0])
            elif words[0] == "zoom":
                zoom(*(numbers[:2] if len(numbers) >= 2 else (-np.inf, np.inf)))

        self._link.on_update(read)

    def set_cursor(self, t: float) -> None:
        """Draws the cursor of all charts at a time of their x axis."""
        self._cursor.content = _run(f"window.levelheadCharts &amp;&amp; levelheadCharts({t!r}) /* {t!r} */")

    def set_data(self, data: ChartData) -> None:
        """Draws the curves."""
        for i, chart in enumerate(self._angles):
            angle, band = data.angles[:, i], data.two_sigma[:, i]
            more = [data.tilt[:, i]] if i < 2 else []
            more += [data.truth[:, i]] if self._truth and data.truth is not None else []
            more += [data.second[:, i]] if self._second and data.second is not None else []
            low, high = y_range(data.t, angle, *more)
            curves = (angle, angle + band, angle - band, *more)
            chart.data = (data.t, *(at_edge(np.clip(curve, low, high), low) for curve in curves))
        self._set_vector(self._bias, data.t, data.bias)
        self._set_vector(self._gyr, data.t, data.gyr)
        self._set_vector(self._acc, data.t, data.acc)
        if self._mag is not None and data.mag is not None:
            self._set_vector(self._mag, data.t, data.mag)

    def _set_vector(self, chart: Untyped, t: Array, values: Array) -> None:
        low = y_range(t, *values.T)[0]
        chart.data = (t, *(at_edge(column, low) for column in values.T))

    def _angle_chart(self, name: str, tilt: bool) -> Untyped:
        series = [{"label": "t"}, {"label": name, "stroke": ESTIMATE, "width": 2}]
        series += [{"label": "+2σ", "stroke": BAND}, {"label": "−2σ", "stroke": BAND}]
        series += [{"label": "accelerometer", "stroke": RAW, "width": 1}] if tilt else []
        series += [{"label": "truth", "stroke": TRUTH, "width": 1}] if self._truth else []
        series += [{"label": self._second, "stroke": SECOND, "width": 1}] if self._second else []
        return self._chart(f"{name} [°]", series, bands=({"series": (2, 3), "fill": BAND},))

    def _vector_chart(self, title: str) -> Untyped:
        lines = ({"label": axis, "stroke": color} for axis, color in zip("xyz", AXES, strict=True))
        return self._chart(title, [{"label": "t"}, *lines])

    def _chart(self, title: str, series: Sequence[Untyped], **more: Untyped) -> Untyped:
        empty = tuple(np.zeros(2) for _ in series)
        return self._gui.add_uplot(
            empty, tuple(series), title=title, scales={"x": {"time": self._time}}, legend={"live": True},
            cursor=CURSOR, height=HEIGHT, padding=PADDING, **more,
        )  # fmt: skip
