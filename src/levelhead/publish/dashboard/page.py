"""The page and its 3-D view: the body, the cone of its heading, and where charts, events and parameters go."""

import io
import math
from collections.abc import Sequence
from contextlib import redirect_stdout

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import Untyped
from levelhead.publish.dashboard.charts import ChartSet
from levelhead.publish.dashboard.parameter_panel import ParameterPanel
from levelhead.recording import Array

PORT, LAST_PORT = 8080, 65_535
BODY = (0.9, 0.6, 0.15)  # m: x forward, y left, z up
CONE_RADIUS, CONE_PARTS = 1.3, 24  # m, and triangles of the cone
CONE_CHANGE = 0.1  # by which share its angle changes before it is drawn anew
# On a phone: the 3-D view above, the panel below it and as wide as the screen.
NARROW = """<style>@media (max-width: 576px) {
  .mantine-Paper-root[style*="20em"] [style*="width: 20em"] { width: 100% !important; }
  .mantine-Paper-root[style*="20em"] { width: 100% !important; height: 58%; max-height: 58% !important; }
  [style*="flex-grow: 1"][style*="height: 100%"] { height: 42% !important; }
}</style>"""
# A label that is longer than its button goes on in a second line.
LABELS = """<style>h3 { overflow-wrap: anywhere; }
  .mantine-Button-root { height: auto !important; min-height: 2em; padding-block: 0.2em; }
  .mantine-Button-label { white-space: normal; line-height: 1.2; }</style>"""
TRUSTED, INVALID = (90, 140, 200), (160, 160, 160)


def plain_text(text: str) -> str:
    """Text of whatever origin, so that the page shows it as it is: viser's Markdown would run what stands in braces."""
    return "".join(f"&#{ord(sign)};" if sign in "{}<>&`\\*_[]" else sign for sign in text)


def sector(half_angle: float) -> Array:
    """(CONE_PARTS + 2, 3) a level fan about the x axis, ± ``half_angle`` rad, its tip first."""
    angles = np.linspace(-half_angle, half_angle, CONE_PARTS + 1)
    rim = CONE_RADIUS * np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
    return np.vstack([np.zeros(3), rim])


class Page:
    """A page and its server.

    Args:
        title: what it is about.
        port: of the server on 127.0.0.1; if it is taken, the next one that is free.

    Attributes:
        url: where it is.
        server: viser's.
        status: Markdown below the title.
        parameters: the panel of parameters.

    Raises:
        LevelheadError: viser is not installed, no such port, or none is free.
    """

    def __init__(self, title: str, port: int = PORT) -> None:
        if not 1 <= port <= LAST_PORT:
            raise LevelheadError(f"there is no port {port}; expected 1 to {LAST_PORT}, such as {PORT}")
        try:
            import viser
        except ImportError:
            raise LevelheadError("the dashboard needs viser: pip install 'levelhead[view]'") from None
        try:
            with redirect_stdout(io.StringIO()):  # it greets, whatever it is told
                self.server: Untyped = viser.ViserServer(host="127.0.0.1", port=port, label="levelhead", verbose=False)
        except OSError as error:
            raise LevelheadError(f"cannot open a page on 127.0.0.1:{port}: {error.strerror or error}") from None
        self.url = f"http://127.0.0.1:{self.server.get_port()}"
        gui, scene = self.server.gui, self.server.scene
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")  # sharing goes by a server
        gui.main_panel.dock_right()  # beside the 3-D view, not over it
        scene.configure_default_lights(cast_shadow=False)  # shadows cost half of a frame where there is no GPU
        scene.add_grid("/ground", width=4.0, height=4.0, position=(0.0, 0.0, -0.6))
        scene.add_frame("/earth", axes_length=0.4, axes_radius=0.008, position=(1.7, -1.7, -0.6))
        self._name_axes("/earth", 0.45, ("east", "north", "up"))
        self._body: Untyped = scene.add_frame("/body", axes_length=0.8, axes_radius=0.012)
        self._box = scene.add_box("/body/box", color=INVALID, dimensions=BODY, opacity=0.8, cast_shadow=False)
        self._name_axes("/body", 0.85, ("x", "y", "z"))
        fan = np.array([(0, i, i + 1) for i in range(1, CONE_PARTS + 1)])
        self._cone_angle = 0.1
        self._cone: Untyped = scene.add_mesh_simple(
            "/heading", sector(self._cone_angle), fan, color=(230, 150, 40), opacity=0.45, side="double",
            flat_shading=True, cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        gui.add_markdown(f"### {plain_text(title)}")
        self.status = gui.add_markdown("…")
        gui.add_html(NARROW + LABELS)
        self.charts: ChartSet | None = None
        self.parameters = ParameterPanel(gui)

    def _name_axes(self, frame: str, length: float, names: Sequence[str]) -> None:
        """Names at the ends of a frame's axes."""
        for i, name in enumerate(names):
            end = [0.0, 0.0, 0.0]
            end[i] = length
            self.server.scene.add_label(f"{frame}/{name}", name, position=tuple(end), anchor="center-center")

    def turn(self, quat: Sequence[float], heading_sigma: float = 0.0, valid: bool = True) -> None:
        """Sets the body's orientation (wxyz) and the cone of ±2σ about its heading; grey if it is not valid.

        Args:
            quat: sensor to earth.
            heading_sigma: 1σ of heading, rad; 0: not known, no cone.
            valid: whether the orientation may be trusted.
        """
        w, x, y, z = quat
        self._body.wxyz = np.array(quat)
        yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        self._cone.wxyz = np.array([math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)])
        half_angle = min(math.pi, 2.0 * heading_sigma)
        self._cone.visible = valid and half_angle > 0.0
        if half_angle > 0.0 and abs(half_angle - self._cone_angle) > CONE_CHANGE * self._cone_angle:
            self._cone_angle = half_angle
            self._cone.vertices = sector(half_angle).astype(np.float32)
        color = TRUSTED if valid else INVALID
        if tuple(self._box.color) != color:
            self._box.color = color

    def stop(self) -> None:
        """Closes the server."""
        with redirect_stdout(io.StringIO()):
            self.server.stop()


def status_text(angles: Sequence[float], band: Sequence[float], more: str) -> str:
    """Roll, pitch and yaw in degrees with 2σ, as Markdown."""
    named = zip(("roll", "pitch", "yaw"), angles, band, strict=True)
    return "  ".join(f"**{name}\u00a0{angle:+.1f}°**\u00a0±{two:.1f}°" for name, angle, two in named) + f"\n\n{more}"
