"""
Count steps in any pocket
=========================

The orientation turns the acceleration of a phone into the earth's frame. Its vertical part shows steps, its level
part shakes. In the phone's own frame a step changes its axis whenever the hand turns.

::

    python examples/steps.py          # draws docs/pictures/steps.png
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.signal import butter, find_peaks, sosfiltfilt

import levelhead as lh
from levelhead import simulate

RATE = 100.0  # Hz
STILL = 2.0  # s at the start, at rest
STEPS, FIRST, INTERVAL = 60, 6.0, 0.55  # how many, s when they begin, s between two
SHAKES = (42.0, 47.0, 52.0)  # s: three gestures of one second
GRAVITY = 9.81  # m/s²


def walk(seed: int = 0) -> lh.Recording:
    """A phone in a turning hand: 60 steps, then three shakes; its gyroscope was calibrated while it was kept still."""
    hand = simulate.motion(seed, 56.0, RATE, style="hand", translation=0.02)
    t = hand.t - hand.t[0]
    acceleration = 0.2 * hand.acceleration
    for step in range(STEPS):  # the foot lands: up, then down
        phase = (t - FIRST - step * INTERVAL) / 0.25
        acceleration[:, 2] += np.where(
            np.abs(phase) < 1.0, 3.5 * np.sin(np.pi * (phase + 1.0)) * (1 - np.abs(phase)), 0.0
        )
    for begin in SHAKES:
        during = (t >= begin) & (t < begin + 1.0)
        acceleration[during, 0] += 9.0 * np.sin(2.0 * np.pi * 4.0 * (t[during] - begin))
    recording = simulate.observe(replace(hand, acceleration=acceleration), simulate.imu("MPU-6050"), seed)
    return replace(recording, gyr=recording.gyr - recording.gyr[: round(STILL * RATE)].mean(axis=0))


def band(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """What lies between two frequencies (Hz), without delay."""
    filtered: np.ndarray = sosfiltfilt(butter(2, [low, high], "bandpass", fs=RATE, output="sos"), values, axis=0)
    return filtered


def count_steps(vertical: np.ndarray) -> np.ndarray:
    """Rows of the steps in a vertical acceleration (m/s²)."""
    rows, _ = find_peaks(band(vertical, 0.8, 4.0), height=0.8, distance=round(0.35 * RATE))
    return rows


def count_shakes(level: np.ndarray) -> np.ndarray:
    """Rows of the shakes in a level acceleration (n, 2): bursts of more than 3 m/s² for half a second."""
    strength = np.convolve(np.linalg.norm(band(level, 2.5, 8.0), axis=1), np.ones(50) / 50.0, mode="same")
    rows, _ = find_peaks(strength, height=3.0, distance=round(2.0 * RATE))
    return rows


def features(recording: lh.Recording) -> np.ndarray:
    """(n, 3) acceleration in the earth's frame, m/s², gravity taken off."""
    track = lh.fuse(recording)
    turned: np.ndarray = track.as_rotation().apply(recording.acc.copy())
    return turned - [0.0, 0.0, GRAVITY]


def picture(path: Path) -> None:
    """The same steps in both frames."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    recording = walk()
    earth, t = features(recording), recording.t - recording.t[0]
    figure, (above, below) = pyplot.subplots(2, 1, figsize=(9, 5.0), sharex=True, layout="constrained")
    sensor = recording.acc[:, 2] - GRAVITY
    above.plot(t, sensor, color="tab:orange", lw=0.7)
    above.set(ylabel="m/s²", title=f"z of the phone, less g: {len(count_steps(sensor))} peaks")
    steps, shakes = count_steps(earth[:, 2]), count_shakes(earth[:, :2])
    below.plot(t, earth[:, 2], color="tab:blue", lw=0.7, label="up")
    below.plot(t, np.linalg.norm(earth[:, :2], axis=1), color="grey", lw=0.5, label="level")
    below.plot(t[steps], earth[steps, 2], "k.", ms=4, label=f"{len(steps)} steps")
    below.plot(t[shakes], np.full(len(shakes), 9.0), "rv", label=f"{len(shakes)} shakes")
    below.set(xlabel="t [s]", ylabel="m/s²", title="Earth frame")
    below.legend(loc="upper left", fontsize=8, ncols=4)
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs/pictures/steps.png")
    picture(target)
    sys.stdout.write(f"written: {target}\n")
