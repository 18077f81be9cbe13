"""The moving picture of the README: three estimates of one simulated sensor, each a body that turns, and their errors.

    python docs/moving_picture.py          writes docs/pictures/moving.svg

An SVG of paths that change 12 times a second: sharp at any size, light and dark. All three bodies have the heading of
the truth, as none of them has one without a magnetometer; their tilt differs.
"""

from pathlib import Path

import numpy as np

import levelhead as lh
from levelhead.evaluate import error_angles
from levelhead.rotations import matrix, product

FRAMES, SECONDS = 12, 15.0  # a second; the length
START = 1.0  # s into the recording
WIDTH, HEIGHT = 840, 400
SIZE = np.array([1.0, 0.62, 0.14])  # half lengths of the body: x forward, y left, z up
SCALE, TOP = 78.0, 120.0
CHART = (56.0, 262.0, 756.0, 96.0)  # left, top, width, height
LARGEST = 30.0  # deg, of the chart
LOOK = np.array([[0.80, -0.60, 0.0], [-0.25, -0.33, -0.91]])  # rows: right and down on the paper, of east, north, up
TOWARDS = np.cross(LOOK[1], LOOK[0])  # to the eye
FACES = {  # the outward normal, and corners in turn
    name: (np.array(normal), np.array(corners) * SIZE)
    for name, normal, corners in (
        ("top", (0, 0, 1), [(1, 1, 1), (-1, 1, 1), (-1, -1, 1), (1, -1, 1)]),
        ("bottom", (0, 0, -1), [(1, 1, -1), (1, -1, -1), (-1, -1, -1), (-1, 1, -1)]),
        ("front", (1, 0, 0), [(1, 1, 1), (1, -1, 1), (1, -1, -1), (1, 1, -1)]),
        ("back", (-1, 0, 0), [(-1, 1, 1), (-1, 1, -1), (-1, -1, -1), (-1, -1, 1)]),
        ("left", (0, 1, 0), [(1, 1, 1), (1, 1, -1), (-1, 1, -1), (-1, 1, 1)]),
        ("right", (0, -1, 0), [(1, -1, 1), (-1, -1, 1), (-1, -1, -1), (1, -1, -1)]),
    )
}
ARROW = np.array([(0.8, 0, 0.16), (0.3, 0.3, 0.16), (0.3, 0.1, 0.16), (-0.7, 0.1, 0.16), (-0.7, -0.1, 0.16),
                  (0.3, -0.1, 0.16), (0.3, -0.3, 0.16)])  # fmt: skip
STYLE = """
text{font:15px system-ui,sans-serif;fill:#333}.name{font-weight:600;font-size:17px;text-anchor:middle}
.small{font-size:12px}.ground{fill:#fff}.grid{stroke:#ddd}
.truth{fill:none;stroke:#888;stroke-dasharray:5 4;stroke-width:1.6}
.top{stroke:#fff;stroke-width:.6}.side{stroke:#fff;stroke-width:.6;filter:brightness(.72)}.arrow{fill:#fff;opacity:.9}
.a{--c:#c98500}.b{--c:#c2413a}.c{--c:#1f6fd0}.fill{fill:var(--c)}.line{fill:none;stroke:var(--c);stroke-width:1.8}
.word{fill:var(--c)}
.now{stroke:#888}
@media(prefers-color-scheme:dark){text{fill:#ddd}.ground{fill:#14181e}.grid{stroke:#333}.truth{stroke:#aaa}
.a{--c:#f0b84a}.b{--c:#f07a72}.c{--c:#6fb1ff}
.top,.side{stroke:#14181e}.arrow{fill:#14181e}.word{fill:var(--c)}}
"""


def path(polygons: list[np.ndarray]) -> str:
    """The d of closed polygons; a point far away where there is none, so that each value is valid."""
    parts = ["M" + "L".join(f"{x:.0f} {y:.0f}" for x, y in polygon) + "z" for polygon in polygons]
    return "".join(parts) or "M-9-9z"


def on_paper(points: np.ndarray, turn: np.ndarray, centre: float) -> np.ndarray:
    """(k, 2) px of points (k, 3) of the body."""
    return (points @ turn.T) @ LOOK.T * SCALE + (centre, TOP)


def body(turns: np.ndarray, centre: float) -> dict[str, list[str]]:
    """A path for each frame: the top, the other visible faces, the arrow."""
    drawn: dict[str, list[str]] = {"side": [], "top": [], "arrow": []}
    for turn in turns:
        seen = [name for name, (normal, _) in FACES.items() if turn @ normal @ TOWARDS > 0]
        drawn["side"].append(path([on_paper(FACES[name][1], turn, centre) for name in seen if name != "top"]))
        drawn["top"].append(path([on_paper(FACES["top"][1], turn, centre)] if "top" in seen else []))
        drawn["arrow"].append(path([on_paper(ARROW, turn, centre)] if "top" in seen else []))
    return drawn


def moving(kind: str, frames: list[str]) -> str:
    """A path that changes with each frame."""
    values = ";".join(frames)
    return (
        f'<path class="{kind}" d="{frames[0]}"><animate attributeName="d" dur="{SECONDS:g}s" calcMode="discrete" '
        f'repeatCount="indefinite" values="{values}"/></path>'
    )


def tilt_only(quat: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """The estimate with the heading of the truth: the error, as a rotation in the earth's frame, without its twist."""
    error = product(quat, truth * (1, -1, -1, -1))
    twist = error * (1, 0, 0, 1)
    twist /= np.linalg.norm(twist, axis=1, keepdims=True)
    return product(product(twist * (1, -1, -1, -1), error), truth)


def picture() -> str:
    """The SVG."""
    rec = lh.simulate.recording("MPU-6050", "hand", duration=START + SECONDS + 1.0, rate=100, seed=6)
    assert rec.truth is not None
    keep = (rec.t >= START) & (rec.t < START + SECONDS)
    rows = np.flatnonzero(keep)[np.searchsorted(rec.t[keep], START + np.arange(0.0, SECONDS, 1.0 / FRAMES))]
    left, top, width, height = CHART
    parts, lines, values = [], [], []
    for i, (kind, name, params) in enumerate(
        (
            ("a", "accelerometer alone", lh.AccelTilt()),
            ("b", "gyroscope alone", lh.GyroIntegration()),
            ("c", "levelhead", None),
        )
    ):
        track = lh.fuse(rec, params)
        quat = track.quat
        centre = (i + 0.5) * WIDTH / 3.0
        parts.append(f'<g class="{kind}"><text class="name word" x="{centre:.0f}" y="30">{name}</text>')
        turns = matrix(tilt_only(quat[rows], rec.truth.quat[rows]))
        drawn = body(turns, centre)
        parts += [moving(f"{layer} fill" if layer != "arrow" else layer, frames) for layer, frames in drawn.items()]
        outline = body(matrix(rec.truth.quat[rows]), centre)
        parts.append(moving("truth", [a + b for a, b in zip(outline["side"], outline["top"], strict=True)]) + "</g>")
        tilt = np.degrees(error_angles(rec, track).tilt)
        rms = float(np.sqrt(np.mean(tilt[keep] ** 2)))
        values.append(rms)
        x = left + width * (rec.t[keep][::6] - START) / SECONDS
        y = top + height * (1.0 - np.minimum(tilt[keep][::6], LARGEST) / LARGEST)
        lines.append(
            f'<path class="{kind} line" d="M{"L".join(f"{a:.0f} {b:.1f}" for a, b in zip(x, y, strict=True))}"/>'
        )
        lines.append(
            f'<text class="{kind} word" x="{centre:.0f}" y="{HEIGHT - 10}" text-anchor="middle">{rms:.1f}° RMS</text>'
        )
    grid = "".join(
        f'<path class="grid" d="M{left} {y:.0f}h{width}"/><text class="small" x="{left - 8}" y="{y + 4:.0f}" '
        f'text-anchor="end">{deg:g}°</text>'
        for deg in (0.0, 10.0, 20.0, 30.0)
        for y in [top + height * (1.0 - deg / LARGEST)]
    )
    now = (
        f'<path class="now" d="M{left} {top}v{height}"><animateTransform attributeName="transform" type="translate" '
        f'from="0" to="{width}" dur="{SECONDS:g}s" repeatCount="indefinite"/></path>'
    )
    words = "Three bodies turn with a simulated sensor. " + "; ".join(
        f"{name}: {value:.1f}° RMS tilt error"
        for name, value in zip(("accelerometer alone", "gyroscope alone", "levelhead"), values, strict=True)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{words}">'
        f'<style>{STYLE}</style><rect class="ground" width="{WIDTH}" height="{HEIGHT}" rx="12"/>{"".join(parts)}'
        f'<text class="small" x="{left}" y="{top - 10}">tilt error; dashed: the truth</text>'
        f"{grid}{''.join(lines)}{now}</svg>\n"
    )


if __name__ == "__main__":
    (Path(__file__).parent / "pictures" / "moving.svg").write_text(picture(), encoding="utf-8")
