"""The page itself, whatever it shows: body, charts, status, events, and a slider for every parameter of a filter."""

import io
import math
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from typing import Any, NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.filters.parameters import Param, param_table
from levelhead.recording import Array

PORT = 8080
NOTCHES = 200  # steps of a slider
BODY = (0.9, 0.6, 0.15)  # m: x forward, y left, z up
HEIGHT = 150  # pixels of a chart
LEAST_MARGIN = 2.0  # degrees above and below the data
SAID, RAW, BAND = "#1f77b4", "#ff7f0e", "rgba(31, 119, 180, 0.25)"
AXES = ("#d62728", "#2ca02c", "#1f77b4")


class ChartData(NamedTuple):
    """What the charts show.

    Attributes:
        t: (n,) s.
        angles: (n, 3) roll, pitch, yaw in degrees.
        two_sigma: (n, 3) 2σ of them in degrees.
        raw: (n, 2) roll and pitch by the accelerometer alone, degrees.
        bias: (n, 3) °/s.
    """

    t: Array
    angles: Array
    two_sigma: Array
    raw: Array
    bias: Array


NOTHING = ChartData(np.zeros(2), np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 2)), np.zeros((2, 3)))


def plain(text: str) -> str:
    """Text of whatever origin, so that the page shows it as it is: viser's Markdown would run what stands in braces."""
    return "".join(f"&#{ord(sign)};" if sign in "{}<>&`\\*_[]" else sign for sign in text)


def tilt_of(acc: Array) -> Array:
    """(n, 2) roll and pitch in degrees of (n, 3) specific forces: what the accelerometer alone would say."""
    x, y, z = acc.T
    tilt: Array = np.degrees(np.stack([np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))], axis=1))
    return tilt


def two_sigma(sigma: Array) -> Array:
    """(n, 3) 2σ of roll, pitch and yaw in degrees: tilt counts for both of the first, heading for the third."""
    tilt = np.hypot(sigma[:, 0], sigma[:, 1])
    return np.degrees(2.0 * np.stack([tilt, tilt, sigma[:, 2]], axis=1))


def edges(*data: Array) -> tuple[float, float]:
    """Where a chart of these ends: ±2σ that leads further, as in the first instant, would make all else a flat line."""
    low, high = min(float(one.min()) for one in data), max(float(one.max()) for one in data)
    margin = max(LEAST_MARGIN, 0.25 * (high - low))
    return low - margin, high + margin


class Scale:
    """A parameter's range as the notches of a slider, by factors where the parameter says so."""

    def __init__(self, param: Param, value: float) -> None:
        low, high = param.sweep or (min(0.5 * value, value - 1.0), max(2.0 * value, value + 1.0))
        self.low, self.high = max(min(low, value), param.low), min(max(high, value), param.high)
        self.log = param.log and self.low > 0.0

    def notch(self, value: float) -> int:
        """Where a value stands."""
        if self.high <= self.low:
            return 0
        if self.log:
            share = math.log(value / self.low) / math.log(self.high / self.low) if value > 0.0 else 0.0
        else:
            share = (value - self.low) / (self.high - self.low)
        return round(NOTCHES * min(1.0, max(0.0, share)))

    def value(self, notch: float) -> float:
        """The value of a notch, with four digits."""
        share = notch / NOTCHES
        value = self.low * (self.high / self.low) ** share if self.log else self.low + share * (self.high - self.low)
        return float(f"{value:.4g}")


class Page:
    """A page and its server.

    Args:
        title: what it is about.
        port: of the server on 127.0.0.1; if it is taken, the next one that is free.

    Attributes:
        url: where it is.

    Raises:
        LevelheadError: viser is not installed, or no port is free.
    """

    def __init__(self, title: str, port: int = PORT) -> None:
        try:
            import viser
        except ImportError:
            raise LevelheadError("the dashboard needs viser: pip install 'levelhead[view]'") from None
        try:
            with redirect_stdout(io.StringIO()):  # it greets, whatever it is told
                self.server: Any = viser.ViserServer(host="127.0.0.1", port=port, label="levelhead", verbose=False)
        except OSError as error:
            raise LevelheadError(f"cannot open a page on 127.0.0.1:{port}: {error.strerror or error}") from None
        self.url = f"http://127.0.0.1:{self.server.get_port()}"
        gui, scene = self.server.gui, self.server.scene
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")  # sharing goes by a server
        scene.add_grid("/ground", width=4.0, height=4.0, position=(0.0, 0.0, -0.6))
        scene.add_frame("/earth", axes_length=0.4, axes_radius=0.008, position=(1.7, -1.7, -0.6))
        self._name_axes("/earth", 0.45, ("east", "north", "up"))
        self._body: Any = scene.add_frame("/body", axes_length=0.8, axes_radius=0.012)
        self._box = scene.add_box("/body/box", color=(90, 140, 200), dimensions=BODY, opacity=0.8)
        self._name_axes("/body", 0.85, ("x", "y", "z"))
        gui.add_markdown(f"### {plain(title)}")
        self.status = gui.add_markdown("…")
        self._charts = [self._angle_chart(name, name != "yaw") for name in ("roll", "pitch", "yaw")]
        self._bias = self._bias_chart()
        with gui.add_folder("Events"):
            self.events = gui.add_markdown("none")
        self._sliders: dict[str, Any] = {}
        self._folder: Any = None

    def _name_axes(self, frame: str, length: float, names: Sequence[str]) -> None:
        """Words at the ends of a frame's axes."""
        for i, name in enumerate(names):
            end = [0.0, 0.0, 0.0]
            end[i] = length
            self.server.scene.add_label(f"{frame}/{name}", name, position=tuple(end), anchor="center-center")

    def _angle_chart(self, name: str, raw: bool) -> Any:
        series = [{"label": "t"}, {"label": f"{name} [°]", "stroke": SAID, "width": 2}]
        series += [{"label": "+2σ", "stroke": BAND}, {"label": "−2σ", "stroke": BAND}]
        series += [{"label": "accelerometer", "stroke": RAW, "width": 1}] if raw else []
        return self._chart(f"{name} [°]", series, bands=({"series": (2, 3), "fill": BAND},))

    def _bias_chart(self) -> Any:
        lines = ({"label": axis, "stroke": color} for axis, color in zip("xyz", AXES, strict=True))
        return self._chart("gyroscope bias [°/s]", [{"label": "t"}, *lines])

    def _chart(self, title: str, series: Sequence[Any], **more: Any) -> Any:
        empty = tuple(np.zeros(2) for _ in series)
        return self.server.gui.add_uplot(
            empty, tuple(series), title=title, scales={"x": {"time": False}}, legend={"live": False}, height=HEIGHT,
            **more,
        )  # fmt: skip

    def turn(self, quat: Sequence[float], trusted: bool = True) -> None:
        """Turns the body; one that is not to be trusted is grey."""
        self._body.wxyz = tuple(quat)
        color = (90, 140, 200) if trusted else (150, 150, 150)
        if self._box.color != color:
            self._box.color = color

    def chart(self, data: ChartData) -> None:
        """Draws the data."""
        if len(data.t) < 2:
            return
        for i, chart in enumerate(self._charts):
            said, two_sigma = data.angles[:, i], data.two_sigma[:, i]
            raw = (data.raw[:, i],) if i < 2 else ()
            low, high = edges(said, *raw)
            chart.data = (data.t, said, np.minimum(said + two_sigma, high), np.maximum(said - two_sigma, low), *raw)
        self._bias.data = (data.t, *data.bias.T)

    def sliders(self, params: Any, changed: Callable[[str, float | bool], None]) -> None:
        """A slider for every parameter, as the filter's Params describe them; ``changed`` gets name and value."""
        if self._folder is not None:
            self._folder.remove()
        self._sliders.clear()
        self._folder = self.server.gui.add_folder(f"Parameters of {type(params).__name__}")
        with self._folder:
            for name, param in param_table(type(params)).items():
                self._slider(name, param, getattr(params, name), changed)

    def _slider(self, name: str, param: Param, value: Any, changed: Callable[[str, float | bool], None]) -> None:
        gui = self.server.gui
        if isinstance(value, bool):
            box = gui.add_checkbox(name, value, hint=param.doc)
            box.on_update(lambda _: changed(name, bool(box.value)))
            return
        scale = Scale(param, value)
        marks = ((0, f"{scale.low:.4g}"), (NOTCHES, f"{scale.high:.4g}"))
        label, notch = _label(name, value, param), scale.notch(value)
        handle = gui.add_slider(label, 0, NOTCHES, 1, notch, marks=marks, hint=param.doc)
        self._sliders[name] = handle

        def moved(event: Any) -> None:
            if event.client is None:  # set by the program
                return
            chosen = scale.value(handle.value)
            handle.label = _label(name, chosen, param)
            changed(name, chosen)

        handle.on_update(moved)

    def stop(self) -> None:
        """Closes the server."""
        with redirect_stdout(io.StringIO()):
            self.server.stop()


def _label(name: str, value: float, param: Param) -> str:
    return f"{name} = {value:.4g}{f' {param.unit}' if param.unit else ''}"


def status_words(angles: Sequence[float], two_sigma: Sequence[float], more: str) -> str:
    """Roll, pitch and yaw with 2σ, as Markdown."""
    named = zip(("roll", "pitch", "yaw"), angles, two_sigma, strict=True)
    return "  ".join(f"**{name} {angle:+.1f}°** ±{two:.1f}°" for name, angle, two in named) + f"\n\n{more}"
