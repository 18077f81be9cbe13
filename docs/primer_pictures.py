"""The pictures of docs/explanation/primer.md: earth frames, the signs of three angles, and specific force.

python docs/primer_pictures.py          writes docs/pictures/frames.png, angles.png and force.png
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot

PICTURES = Path(__file__).parent / "pictures"
COLOURS = ("#c2413a", "#2a8a3e", "#1f6fd0")  # x, y, z
SIDE, UP = np.array([0.86, -0.42]), np.array([0.0, 1.0])  # on the paper, of a step to the right or north, and up
EAST, NORTH = np.array([0.95, -0.22]), np.array([0.55, 0.48])
ARROW = {"arrowstyle": "-|>,head_length=.5,head_width=.25", "lw": 2.2, "shrinkA": 0, "shrinkB": 0}


def arrow(axes, start, end, colour, text="", bend=0.0):
    """An arrow with a word at its tip."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    axes.annotate("", end, start, arrowprops={**ARROW, "color": colour, "connectionstyle": f"arc3,rad={bend}"})
    if text:
        away = (end - start) / max(1e-9, np.hypot(*(end - start)))
        axes.text(*(end + 0.16 * away), text, color=colour, ha="center", va="center", fontsize=11)


def empty(axes, title, width=1.5, height=1.35):
    """A panel without axes."""
    axes.set(xlim=(-width, width), ylim=(-height, height), aspect="equal")
    axes.set_title(title, fontsize=12)
    axes.axis("off")


def frames():
    """ENU, NED and NWU in the same view: east to the right, north into the paper."""
    figure, panels = pyplot.subplots(1, 3, figsize=(10, 3.4), layout="constrained")
    ways = {"east": EAST, "north": NORTH, "west": -EAST, "up": UP, "down": -UP}
    kinds = {
        "ENU: levelhead, ROS, vqf": ("east", "north", "up"),
        "NED: aviation, PX4": ("north", "east", "down"),
        "NWU: imufusion's default": ("north", "west", "up"),
    }
    for axes, (title, names) in zip(panels, kinds.items(), strict=True):
        empty(axes, title)
        axes.fill(*np.array([EAST + NORTH, EAST - NORTH, -EAST - NORTH, NORTH - EAST]).T * 0.6, color="#eee")
        for letter, name, colour in zip("xyz", names, COLOURS, strict=True):
            arrow(axes, (0, 0), ways[name], colour, f"{letter} {name}")
    return figure


def angles():
    """A board from behind, from its right side and from above, turned by a positive angle."""
    figure, panels = pyplot.subplots(1, 3, figsize=(10, 3.4), layout="constrained")
    views = (
        ("roll > 0: the right side sinks", "seen from behind", -25, ("left", "right"), 2),
        ("pitch > 0: the nose sinks", "seen from the right", -25, ("tail", "nose"), 1),
        ("yaw > 0: anticlockwise", "seen from above", 25, ("tail", "nose"), 2),
    )
    for axes, (title, view, degrees, ends, colour) in zip(panels, views, strict=True):
        empty(axes, title, 1.5, 1.1)
        turn = np.radians(degrees)
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        board = np.array([(-1, -0.08), (1, -0.08), (1, 0.08), (-1, 0.08)])
        axes.fill(*board.T, facecolor="none", edgecolor="#999", ls="--")
        axes.fill(*(board @ rotation.T).T, color=COLOURS[colour], alpha=0.8)
        for x, name in zip((-1.25, 1.25), ends, strict=True):
            axes.text(*(rotation @ (x, 0.0)), name, ha="center", va="center", fontsize=10)
        arrow(
            axes,
            (0.9, 0.12 if degrees > 0 else -0.12),
            rotation @ (0.9, 0.1 if degrees < 0 else -0.1),
            "#333",
            bend=0.0,
        )
        axes.text(0, -1.0, view, ha="center", fontsize=9, color="#555")
    return figure


def force():
    """Readings at rest, in a push, and in free fall."""
    figure, panels = pyplot.subplots(1, 3, figsize=(10, 3.2), layout="constrained")
    cases = (
        ("at rest", "(0, 0, +9.81)", (0, 1), True),
        ("pushed forward at 5 m/s²", "(5, 0, +9.81)", (0.5, 1), True),
        ("free fall", "(0, 0, 0)", None, False),
    )
    for axes, (title, reading, reads, table) in zip(panels, cases, strict=True):
        empty(axes, title, 1.5, 1.2)
        axes.fill([-0.6, 0.6, 0.6, -0.6], [-0.35, -0.35, 0, 0], color="#d8dee8")
        axes.text(0, -0.18, "x →   z ↑", ha="center", va="center", fontsize=9)
        if table:
            axes.plot([-1.2, 1.2], [-0.37, -0.37], color="#777", lw=3)
        if reads:
            arrow(axes, (0, 0), reads, COLOURS[0], "")
        axes.text(0, -0.75, f"reads {reading}", ha="center", fontsize=10, color=COLOURS[0])
    return figure


if __name__ == "__main__":
    for make in (frames, angles, force):
        make().savefig(PICTURES / f"{make.__name__}.png", dpi=90)
