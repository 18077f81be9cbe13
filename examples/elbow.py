"""
An elbow of two axes
====================

An elbow bends about an axis of the upper arm and turns about one of the forearm. One sensor is on each, strapped on
anyhow, without a magnetometer. The motion shows both axes and the relative heading.

::

    python examples/elbow.py          # draws docs/pictures/elbow.png
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import simulate

RATE, DURATION = 100.0, 60.0
CARRYING = 12.0  # degrees between the normal of the bending axis and the axis of the forearm
STRAPS = ((20.0, -35.0, 50.0), (-70.0, 15.0, 110.0))  # Euler angles of the sensors on the arm, degrees


def arm(seed: int = 0) -> tuple[lh.Recording, lh.Recording, np.ndarray]:
    """Recordings of both sensors, and the true angles (n, 3) in degrees."""
    moved = simulate.motion(seed, DURATION, RATE, style="hand", still=2.0)
    t = moved.t
    begun = np.clip((t - 2.0) / 2.0, 0.0, 1.0)
    begun = begun**3 * (10.0 - 15.0 * begun + 6.0 * begun**2)
    angles = np.stack(
        [begun * 45.0 * (1.0 - np.cos(1.9 * t)), 0.0 * t + CARRYING, begun * 60.0 * np.sin(1.1 * t)], axis=1
    )
    upper = Rotation.from_quat(moved.quat, scalar_first=True)
    lower = upper * Rotation.from_euler("ZXY", angles, degrees=True)
    recordings = []
    for k, (segment, strap) in enumerate(zip((upper, lower), STRAPS, strict=True)):
        sensor = segment * Rotation.from_euler("zyx", strap, degrees=True)
        turned = (sensor[:-2].inv() * sensor[2:]).as_rotvec() * (0.5 * RATE)
        rate = np.concatenate([turned[:1], turned, turned[-1:]])
        still = np.zeros_like(moved.position)
        motion = simulate.Motion(t, sensor.as_quat(scalar_first=True), rate, still, still, 0.3 * moved.acceleration)
        recordings.append(simulate.observe(motion, simulate.imu("LSM6DSO32"), seed + k))
    return recordings[0], recordings[1], angles


def angles_of(seed: int = 0) -> tuple[lh.Joint, np.ndarray]:
    """The joint as found, and the error (n, 3) of its angles in degrees, each after a constant and with its sign."""
    upper, lower, true = arm(seed)
    found = lh.joint(upper, lower, axes=2)
    signs = np.sign([np.cov(found.angle[:, i], true[:, i])[0, 1] for i in (0, 2)])
    errors = found.angle - true * [signs[0], signs[0] * signs[1], signs[1]]
    return found, errors - [*errors.mean(axis=0)[:1], 0.0, *errors.mean(axis=0)[2:]]


def picture(path: Path) -> None:
    """Angles with ±2σ, and their errors."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    found, errors = angles_of()
    rms = np.sqrt(np.mean(errors**2, axis=0))
    figure, (above, below) = pyplot.subplots(2, 1, figsize=(9, 5.0), sharex=True, layout="constrained")
    for i, (name, color) in enumerate((("bend", "tab:red"), ("carrying angle", "tab:green"), ("turn", "tab:blue"))):
        low, high = found.angle[:, i] - 2.0 * found.sigma[:, i], found.angle[:, i] + 2.0 * found.sigma[:, i]
        above.fill_between(found.t, low, high, color=color, alpha=0.2, lw=0.0)
        above.plot(found.t, found.angle[:, i], color=color, lw=1.0, label=name)
        below.plot(found.t, errors[:, i], color=color, lw=0.8, label=f"{name}: {rms[i]:.1f}° RMS")
    above.set(ylim=(-80, 140), ylabel="angle ± 2σ [°]", title="An elbow from two sensors without a magnetometer")
    above.legend(loc="upper left", fontsize=8, ncols=3)
    below.set(xlabel="t [s]", ylabel="error [°]")
    below.legend(loc="upper left", fontsize=8, ncols=3)
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs/pictures/elbow.png")
    picture(target)
    sys.stdout.write(f"written: {target}\n")
