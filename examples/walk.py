"""
The path of a foot
==================

A sensor on the shoe stands still at each step. This bounds what the acceleration, integrated twice, would lose: the
path of a walk of 39 m closes within a few centimetres, and stairs come out as stairs.

::

    python examples/walk.py          # draws docs/pictures/walk.png
"""

import sys
from pathlib import Path

import numpy as np

import levelhead as lh
from levelhead import simulate

STRIDES, LENGTH, STAIR = 30, 1.3, 0.17  # how many, m long, m high
RATE = 200.0  # Hz


def walk(climb: float = 0.0, seed: int = 0) -> lh.Recording:
    """A walk along a circle, level or up a spiral staircase."""
    motion = simulate.foot(STRIDES, RATE, length=LENGTH, climb=climb)
    return simulate.observe(motion, simulate.imu("LSM6DSO32"), seed)


def dead_reckoning(recording: lh.Recording) -> np.ndarray:
    """(n, 3) m: acceleration by the same orientation, integrated twice without zero velocity."""
    acceleration = lh.smooth(recording).earth_acceleration().value
    step = 1.0 / RATE
    position: np.ndarray = np.cumsum(np.cumsum(acceleration, axis=0) * step, axis=0) * step
    return position


def picture(path: Path) -> None:
    """The path from above, and the height of both walks."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    level, stairs = walk(), walk(STAIR)
    gait, climb = lh.gait(level), lh.gait(stairs)
    assert level.truth is not None and level.truth.position is not None
    assert gait.track.position is not None and climb.track.position is not None
    lost = dead_reckoning(level)
    figure, (above, side) = pyplot.subplots(1, 2, figsize=(9, 4.2), layout="constrained")
    above.plot(
        *lost[:, :2].T, color="tab:orange", lw=0.9, label=f"without zero velocity: {np.linalg.norm(lost[-1]):.0f} m off"
    )
    above.plot(*level.truth.position[:, :2].T, color="black", lw=2.5, label="true")
    above.plot(*gait.track.position[:, :2].T, color="tab:blue", lw=1.0, label=f"lh.gait: {gait.gap:.2f} m off")
    above.set(xlabel="m", ylabel="m", xlim=(-10, 10), ylim=(-2, 16), title=f"{gait.distance:.1f} m from above")
    above.set_aspect("equal")
    above.legend(loc="upper left", fontsize=8)
    for found, name in ((gait, "level floor"), (climb, f"stairs of {100 * STAIR:.0f} cm")):
        assert found.track.position is not None
        side.plot(found.track.t, found.track.position[:, 2], lw=1.0, label=name)
    side.set(xlabel="t [s]", ylabel="height [m]", title="Height")
    side.legend(fontsize=8)
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs/pictures/walk.png")
    picture(target)
    sys.stdout.write(f"written: {target}\n")
