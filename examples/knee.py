"""
A knee that walks
=================

One sensor on the thigh, one on the shank, strapped on anyhow and without a magnetometer. The walk shows the axis of the
knee and the relative heading. Skin moves under each step, so the angle is right to a few degrees, not to tenths.

::

    python examples/knee.py          # draws docs/pictures/knee-walk.png

With ``LEVELHEAD_DATA``, the folder of the recordings, the left knee of a person who walks and runs is drawn instead.
"""

import os
import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import simulate

RATE, DURATION, STILL = 100.0, 60.0, 3.0  # Hz; s, and the rest at the start
STRIDE = 1.1  # s
THIGH, SHANK = 0.25, 0.15  # m from the knee to the sensors
STRAPS = ((20.0, -35.0, 50.0), (-70.0, 15.0, 110.0))  # Euler angles of the sensors on the leg, degrees
SKIN = 2.0  # degrees by which it turns a sensor, RMS


def leg(t: np.ndarray) -> tuple[Rotation, Rotation, np.ndarray, np.ndarray]:
    """Thigh, shank (x ahead, y to the left, z up), the position of the knee (n, 3) in m, and its flexion in degrees."""
    begun = np.clip((t - STILL) / 2.0, 0.0, 1.0)
    begun = begun**3 * (10.0 - 15.0 * begun + 6.0 * begun**2)
    phase = 2.0 * np.pi * np.cumsum(begun) / RATE / STRIDE
    hip = 10.0 + 22.0 * np.cos(phase)
    flexion = begun * (24.0 - 19.0 * np.cos(phase - 1.2) - 13.0 * np.cos(2.0 * phase - 0.6))
    turn = np.cumsum(begun) / RATE * 6.0 + 8.0 * begun * np.sin(phase)  # degrees: a wide circle, and the pelvis
    lean = 4.0 * begun * np.sin(phase + 0.5) + 2.0 * begun * np.sin(0.4 * t)
    thigh = Rotation.from_euler("ZXY", np.stack([turn, lean, -begun * hip], axis=1), degrees=True)
    shank = thigh * Rotation.from_euler("y", flexion[:, None], degrees=True)
    speed = 1.3 * begun[:, None] * np.stack([np.cos(np.radians(turn)), np.sin(np.radians(turn)), 0.0 * t], axis=1)
    pelvis = np.cumsum(speed, axis=0) / RATE + [0.0, 0.0, 1.0] * (0.02 * begun * np.cos(2.0 * phase))[:, None]
    return thigh, shank, pelvis + thigh.apply([0.0, 0.0, -0.42]), flexion


def walk(seed: int = 0) -> tuple[lh.Recording, lh.Recording, np.ndarray]:
    """Recordings of both sensors, and the true flexion (n,) in degrees."""
    t = np.arange(round(DURATION * RATE)) / RATE
    thigh, shank, knee, flexion = leg(t)
    recordings = []
    for k, (segment, height, strap) in enumerate(zip((thigh, shank), (THIGH, -SHANK), STRAPS, strict=True)):
        beat = 2.0 * np.pi * (t[:, None] / STRIDE + np.array([0.1, 0.4, 0.8]) + 0.3 * k)
        skin = SKIN * 2.0**0.5 * np.sin(beat) * np.clip((t[:, None] - STILL) / 2.0, 0.0, 1.0)
        sensor = segment * Rotation.from_rotvec(skin, degrees=True) * Rotation.from_euler("zyx", strap, degrees=True)
        position = knee + segment.apply([0.0, 0.05, height])
        velocity = np.gradient(position, t, axis=0)
        turned = (sensor[:-2].inv() * sensor[2:]).as_rotvec() * (0.5 * RATE)
        rate = np.concatenate([turned[:1], turned, turned[-1:]])
        quat = sensor.as_quat(scalar_first=True)
        motion = simulate.Motion(t, quat, rate, position, velocity, np.gradient(velocity, t, axis=0))
        recordings.append(simulate.observe(motion, simulate.imu("LSM6DSO32"), seed + k))
    return recordings[0], recordings[1], flexion


def flexion_of(seed: int = 0) -> tuple[lh.Joint, np.ndarray, np.ndarray]:
    """The joint as found, its angle and the truth (n,) in degrees, with one sign and one mean."""
    thigh, shank, true = walk(seed)
    joint = lh.joint(thigh, shank)
    angle = joint.angle * np.sign(np.corrcoef(joint.angle, true)[0, 1])
    return joint, angle - angle.mean() + true.mean(), true


def recorded(file: Path) -> tuple[lh.Joint, np.ndarray, np.ndarray]:
    """The same of a person's left knee, beside calibrated segments whose sensors had a magnetometer."""
    from scipy.io import loadmat

    body = loadmat(file, simplify_cells=True)
    thigh, shank = (body[f"{part}_leg_left"] for part in ("upper", "lower"))
    joint = lh.joint(*(lh.Recording(body["t"], one["gyr"], one["acc"]) for one in (thigh, shank)))
    segments = [Rotation.from_quat(one["quat"], scalar_first=True) for one in (thigh, shank)]
    reference = (segments[0].inv() * segments[1]).as_euler("ZXY", degrees=True)[:, 0]
    angle = joint.angle * np.sign(np.corrcoef(joint.angle, reference)[0, 1])
    return joint, angle - np.mean((angle - reference)[100:]), reference  # 1 s in which the references begin


def picture_recorded(path: Path, file: Path) -> None:
    """The whole recording, and eight seconds of the run."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    joint, angle, reference = recorded(file)
    rms = np.sqrt(np.mean((angle - reference)[100:] ** 2))
    figure, panels = pyplot.subplots(2, 1, figsize=(9, 5.0), layout="constrained")
    fastest = joint.t[int(np.argmax(np.convolve(np.abs(np.diff(reference)), np.ones(800), "valid")))]
    for panel, limits in zip(panels, ((joint.t[0], joint.t[-1]), (fastest, fastest + 8.0)), strict=True):
        panel.plot(joint.t, reference, color="black", lw=2.2, label="reference")
        panel.plot(joint.t, angle, color="tab:blue", lw=1.0, label=f"lh.joint: {rms:.1f}° RMS")
        panel.set(xlim=limits, xlabel="t [s]", ylabel="flexion [°]")
    panels[0].legend(loc="upper left", fontsize=8)
    figure.savefig(path, dpi=90)


def picture(path: Path) -> None:
    """Ten seconds of the angle, and the strides one upon another."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    joint, angle, true = flexion_of()
    rms = np.sqrt(np.mean((angle - true) ** 2))
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.8), width_ratios=(2, 1), layout="constrained")
    left.plot(joint.t, true, color="black", lw=2.2, label="true")
    left.plot(joint.t, angle, color="tab:blue", lw=1.0, label=f"lh.joint: {rms:.1f}° RMS")
    left.set(xlim=(0, 14), xlabel="t [s]", ylabel="flexion [°]", title="A knee that walks, without a magnetometer")
    left.legend(loc="upper left", fontsize=8)
    size = round(STRIDE * RATE)
    begin = round((STILL + 3.0) * RATE)
    count = (len(angle) - begin) // size
    share = np.linspace(0.0, 100.0, size)
    strides = angle[begin : begin + count * size].reshape(count, size)
    right.plot(share, strides.T, color="tab:blue", lw=0.4, alpha=0.5)
    right.plot(share, true[begin : begin + count * size].reshape(count, size).mean(axis=0), color="black", lw=1.6)
    right.set(xlabel="stride [%]", title=f"{count} strides")
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs/pictures/knee-walk.png")
    walk_file = Path(os.environ.get("LEVELHEAD_DATA", "")) / "joints" / "qmt_full_body.mat"
    picture_recorded(target, walk_file) if walk_file.is_file() else picture(target)
    sys.stdout.write(f"written: {target}\n")
