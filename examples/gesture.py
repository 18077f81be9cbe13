"""
Gestures of a hand that turns
=============================

A stick in the hand draws strokes, circles and zigzags in the air. The orientation shows them as they are, however the
hand is turned about the stick. In the gyroscope's own axes a stroke to the left may look like one upwards.

::

    python examples/gesture.py          # draws docs/pictures/gesture.png
"""

import sys
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import simulate

RATE = 100.0  # Hz
STILL, GESTURE, PAUSE = 2.0, 1.0, 1.0  # s
COUNT = 30
POINTS = 32  # of a path that is compared
BUSY = 0.35  # rad/s: the stick points elsewhere
SHAPES = ("left", "right", "up", "down", "circle", "zigzag")


def shape(name: str, share: np.ndarray) -> np.ndarray:
    """(n, 2) to the left and up, about 0.5 rad wide, of a gesture's share (n,) from 0 to 1."""
    way = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    zero = np.zeros_like(way)
    if name == "circle":
        angle = 2.0 * np.pi * way
        return 0.25 * np.stack([np.sin(angle), 1.0 - np.cos(angle)], axis=1)
    if name == "zigzag":
        return 0.5 * np.stack([way, 0.4 * np.abs((3.0 * way + 1.0) % 2.0 - 1.0) - 0.4], axis=1)
    sign = 1.0 if name in ("left", "up") else -1.0
    return 0.5 * sign * np.stack([way, zero] if name in ("left", "right") else [zero, way], axis=1)


def draw(seed: int = 1) -> tuple[lh.Recording, list[str]]:
    """A stick (x along it) that draws gestures, with another turn of the hand for each; and their names."""
    random = np.random.default_rng(seed)
    names = [str(random.choice(SHAPES)) for _ in range(COUNT)]
    t = np.arange(round((STILL + COUNT * (GESTURE + PAUSE)) * RATE)) / RATE
    aim, roll = np.zeros((len(t), 2)), np.zeros(len(t))
    for k, name in enumerate(names):
        begin = STILL + k * (GESTURE + PAUSE)
        turned = np.clip((t - begin + 0.8 * PAUSE) / (0.6 * PAUSE), 0.0, 1.0) if k else np.zeros(len(t))
        roll += random.uniform(-80.0, 80.0) * (turned**2 * (3.0 - 2.0 * turned))
        size = random.uniform(0.7, 1.4)
        aim += size * shape(name, np.clip((t - begin) / GESTURE, 0.0, 1.0))
    aim[:, 1] -= savgol_filter(aim[:, 1], 2001, 1)  # the hand comes back to level
    angles = np.stack([aim[:, 0], -savgol_filter(aim[:, 1], 21, 3), np.radians(roll)], axis=1)
    quat = Rotation.from_euler("ZYX", angles)
    turns = (quat[:-2].inv() * quat[2:]).as_rotvec() * (0.5 * RATE)
    rate = np.concatenate([turns[:1], turns, turns[-1:]])
    arm = quat.apply([0.3, 0.0, 0.0])  # m, from the wrist to the sensor
    velocity = np.gradient(arm, t, axis=0)
    motion = simulate.Motion(t, quat.as_quat(scalar_first=True), rate, arm, velocity, np.gradient(velocity, t, axis=0))
    return simulate.observe(motion, simulate.imu("MPU-6050"), seed), names


def find(recording: lh.Recording) -> list[slice]:
    """The rows of each gesture: the stick points elsewhere; a turn about the stick does not count."""
    rest = recording.gyr[: round(0.8 * STILL * RATE)].mean(axis=0)
    busy = np.linalg.norm((recording.gyr - rest)[:, 1:], axis=1) > BUSY
    rows = np.flatnonzero(busy)
    parts = np.split(rows, np.flatnonzero(np.diff(rows) > 0.3 * RATE) + 1)
    return [slice(int(part[0]), int(part[-1]) + 1) for part in parts if len(part) > 0.3 * RATE]


def aim_by_orientation(recording: lh.Recording) -> np.ndarray:
    """(n, 2) rad to the left and up, by the orientation."""
    yaw_pitch = lh.fuse(recording).euler(degrees=False)
    found: np.ndarray = np.stack([np.unwrap(yaw_pitch[:, 2]), -yaw_pitch[:, 1]], axis=1)
    return found


def aim_by_gyroscope(recording: lh.Recording) -> np.ndarray:
    """The same by the gyroscope's z and y axes, as if the hand never turned about the stick."""
    rate = recording.gyr - recording.gyr[: round(0.8 * STILL * RATE)].mean(axis=0)
    found: np.ndarray = np.cumsum(rate[:, [2, 1]] * [1.0, -1.0], axis=0) / RATE
    return found


def even(path: np.ndarray) -> np.ndarray:
    """(32, 2) points at even steps along a path, about their middle, in shares of its length."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.linspace(0.0, length[-1], POINTS)
    points = np.stack([np.interp(at, length, column) for column in path.T], axis=1)
    middled: np.ndarray = (points - points.mean(axis=0)) / length[-1]
    return middled


def recognise(path: np.ndarray) -> str:
    """The shape nearest to a path (J. Wobbrock, A. Wilson, Y. Li, ACM UIST 2007, without its turn)."""
    share = np.linspace(0.0, 1.0, 200)
    return min(SHAPES, key=lambda name: float(np.linalg.norm(even(path) - even(shape(name, share)))))


def count_right(seed: int = 1) -> tuple[int, int]:
    """How many of the gestures are recognised, by the orientation and by the gyroscope's axes."""
    recording, names = draw(seed)
    rows = find(recording)
    assert len(rows) == len(names)
    by_orientation, by_gyroscope = (
        sum(recognise(aim[one]) == name for one, name in zip(rows, names, strict=True))
        for aim in (aim_by_orientation(recording), aim_by_gyroscope(recording))
    )
    return by_orientation, by_gyroscope


def picture(path: Path) -> None:
    """The first of each shape, in both axes."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    recording, names = draw()
    rows, right = find(recording), count_right()
    figure, panels = pyplot.subplots(2, len(SHAPES), figsize=(9, 3.6), layout="constrained")
    for line, aim, word, good in zip(
        panels,
        (aim_by_orientation(recording), aim_by_gyroscope(recording)),
        ("orientation", "gyroscope's axes"),
        right,
        strict=True,
    ):
        for panel, name in zip(line, SHAPES, strict=True):
            part = aim[rows[len(names) - 1 - names[::-1].index(name)]]
            panel.plot(*even(part).T * [[-1.0], [1.0]], color="tab:blue" if recognise(part) == name else "tab:orange")
            panel.plot(*even(part)[0] * [-1.0, 1.0], "k.")
            panel.set(title=name, xlim=(-0.6, 0.6), ylim=(-0.6, 0.6), xticks=[], yticks=[])
            panel.set_aspect("equal")
        line[0].set_ylabel(f"{word}:\n{good} of {len(names)}")
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs/pictures/gesture.png")
    picture(target)
    sys.stdout.write(f"written: {target}\n")
