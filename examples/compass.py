"""
A compass that may be tilted
============================

The earth's field points steeply down in most places (67° here). Ten degrees of tilt turn the bearing of a two-axis
compass by more than twenty. The filter removes the tilt.

::

    python examples/compass.py          # draws docs/pictures/compass.png
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import levelhead as lh
from levelhead import simulate

RATE, DURATION = 100.0, 60.0
STILL = 2.0  # s at the start, at rest


def carry(seed: int = 0) -> lh.Recording:
    """A board carried in a hand; its magnetometer has been calibrated, and its gyroscope while it was kept still."""
    hand = simulate.motion(seed, DURATION, RATE, style="hand", rotation=(8.0, 8.0, 40.0), translation=0.1)
    chip = simulate.imu("MPU-6050", mag="HMC5883L")
    assert chip.mag is not None
    mag = replace(chip.mag, turn_on_bias=0.0, scale_factor=0.0, misalignment=0.0)
    recording = simulate.observe(hand, replace(chip, mag=mag), seed)
    return replace(recording, gyr=recording.gyr - recording.gyr[: round(STILL * RATE)].mean(axis=0))


def bearing(yaw: np.ndarray) -> np.ndarray:
    """Degrees from magnetic north, clockwise, of the board's x axis, from yaw (degrees from east, anticlockwise)."""
    degrees: np.ndarray = (90.0 - yaw) % 360.0
    return degrees


def bearings(recording: lh.Recording) -> dict[str, np.ndarray]:
    """(n,) bearings in degrees: true, of x and y alone, tilt-compensated (TRIAD), and filtered (ESKF)."""
    assert recording.truth is not None and recording.mag is not None
    return {
        "true": bearing(lh.Track(recording.t, recording.truth.quat).euler()[:, 2]),
        "x and y alone": np.degrees(np.arctan2(recording.mag[:, 1], recording.mag[:, 0])) % 360.0,
        "tilt-compensated": bearing(lh.fuse(recording, lh.Triad()).euler()[:, 2]),
        "filtered": bearing(lh.fuse(recording).euler()[:, 2]),
    }


def errors(found: dict[str, np.ndarray], settled: float = 5.0) -> dict[str, float]:
    """RMS in degrees of each bearing, the first seconds left out."""
    first = round(settled * RATE)
    off = {name: (values - found["true"] + 180.0) % 360.0 - 180.0 for name, values in found.items() if name != "true"}
    return {name: float(np.sqrt(np.nanmean(values[first:] ** 2))) for name, values in off.items()}


def picture(path: Path) -> None:
    """Errors of the three."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    recording = carry()
    found = bearings(recording)
    rms = errors(found)
    figure, axes = pyplot.subplots(figsize=(9, 3.6), layout="constrained")
    for (name, value), color in zip(rms.items(), ("tab:orange", "tab:green", "tab:blue"), strict=True):
        off = (found[name] - found["true"] + 180.0) % 360.0 - 180.0
        axes.plot(recording.t, off, color=color, lw=0.9, label=f"{name}: {value:.1f}° RMS")
    axes.set(xlabel="t [s]", ylabel="error of bearing [°]", ylim=(-100, 100), title="A compass in a hand")
    axes.legend(loc="upper left", fontsize=8)
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs/pictures/compass.png")
    picture(target)
    sys.stdout.write(f"written: {target}\n")
