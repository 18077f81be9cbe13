"""
Keep a camera level
===================

The base swings and sways; two motors hold the camera by one IMU on it. The accelerometer alone reads the sway as
tilt and leans the camera into it. The filter does not, because the gyroscope did not turn.

::

    python examples/gimbal.py          # draws docs/pictures/gimbal.png
"""

import math
import sys
from pathlib import Path

import numpy as np

import levelhead as lh

GRAVITY = 9.81  # m/s²
RATE, END, BEGIN = 200.0, 40.0, 5.0  # Hz; s: the end, and when the base begins to move
NOISE_ACC, NOISE_GYR, BIAS = 0.05, 0.003, 0.02  # 1σ: m/s², rad/s per sample, rad/s
FASTEST = 4.0  # rad/s of a motor


def rotation_x(angle: float) -> np.ndarray:
    """(3, 3) about x."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle: float) -> np.ndarray:
    """(3, 3) about y."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def base(t: float) -> tuple[np.ndarray, np.ndarray]:
    """Orientation (3, 3) of the base, and its acceleration (m/s², earth)."""
    grow = min(1.0, max(0.0, (t - BEGIN) / 3.0))
    roll, pitch = 0.30 * math.sin(2.2 * t), 0.20 * math.sin(3.1 * t + 1.0)
    sway = np.array([2.0 * math.sin(1.7 * t), 1.5 * math.sin(2.6 * t), 0.0])
    return rotation_y(grow * pitch) @ rotation_x(grow * roll), grow * sway


def run(by: str = "filter", seed: int = 0) -> dict[str, np.ndarray]:
    """A run, steered by the filter's roll and pitch or by the accelerometer's.

    Returns:
        (n,) arrays: t (s), tilt of the camera and of the base (degrees).
    """
    random, dt = np.random.default_rng(seed), 1.0 / RATE
    stream = lh.Stream(lh.EKF(acc_tau=5.0))
    offset = random.normal(0.0, BIAS, 3)
    roll_motor = pitch_motor = 0.0
    before, log = None, []
    for i in range(round(END * RATE)):
        t = i * dt
        carrier, sway = base(t)
        camera = carrier @ rotation_y(pitch_motor) @ rotation_x(roll_motor)
        turned = np.zeros((3, 3)) if before is None else before.T @ camera - camera.T @ before
        rate = np.array([turned[2, 1], turned[0, 2], turned[1, 0]]) / (2.0 * dt)
        before = camera
        acc = camera.T @ (sway + [0.0, 0.0, GRAVITY]) + random.normal(0.0, NOISE_ACC, 3)
        gyr = rate + offset + random.normal(0.0, NOISE_GYR, 3)
        stream.update(tuple(gyr.tolist()), tuple(acc.tolist()), dt=dt)
        roll, pitch, _ = stream.euler
        if by == "accelerometer":
            x, y, z = acc
            roll, pitch = math.atan2(y, z), math.atan2(-x, math.hypot(y, z))
        roll_motor -= max(-FASTEST, min(FASTEST, 30.0 * roll)) * dt
        pitch_motor -= max(-FASTEST, min(FASTEST, 30.0 * pitch)) * dt
        log.append(
            (t, math.degrees(math.acos(min(1.0, camera[2, 2]))), math.degrees(math.acos(min(1.0, carrier[2, 2]))))
        )
    return dict(zip(("t", "camera", "base"), np.array(log).T, strict=True))


def error(found: dict[str, np.ndarray]) -> float:
    """RMS tilt of the camera in degrees, once the base swings."""
    return float(np.sqrt(np.mean(found["camera"][found["t"] > BEGIN + 5.0] ** 2)))


def picture(path: Path) -> None:
    """Tilt of base and camera."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(9, 3.6), layout="constrained")
    ours, alone = run("filter"), run("accelerometer")
    axes.plot(ours["t"], ours["base"], color="grey", lw=0.8, label="base")
    axes.plot(alone["t"], alone["camera"], color="tab:orange", lw=0.8,
              label=f"camera by the accelerometer: {error(alone):.1f}° RMS")  # fmt: skip
    axes.plot(
        ours["t"], ours["camera"], color="tab:blue", lw=1.2, label=f"camera by the filter: {error(ours):.1f}° RMS"
    )
    axes.set(xlabel="t [s]", ylabel="tilt [°]", title="A camera on a base that swings and sways")
    axes.legend(loc="upper left", fontsize=8)
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs/pictures/gimbal.png")
    picture(target)
    sys.stdout.write(f"written: {target}\n")
