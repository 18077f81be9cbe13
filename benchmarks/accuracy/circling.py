"""A walk in circles, with and without the model of body velocity: docs/pictures/circling.png.

python -m benchmarks.accuracy.circling -o docs/pictures/circling.png
"""

import argparse
from pathlib import Path

import numpy as np

import levelhead as lh
from levelhead import simulate
from levelhead.evaluate.attitude_error import error_quaternion, split_error
from levelhead.publish.plots import style

# One density of velocity and one wide prior, as for a laboratory
LABORATORY = lh.ESKF(
    body_velocity=0.0,
    max_velocity_density=0.4,
    bias_start=10.0,
    gyr_noise=0.04,
    gyr_noise_per_rate=0.0005,
    acc_noise=0.01,
)


def heading(track: lh.Track, recording: lh.Recording) -> np.ndarray:
    """Degrees by which the heading error has moved since the start."""
    assert recording.truth is not None
    moved = np.unwrap(split_error(error_quaternion(track.quat, recording.truth.quat)).heading)
    return np.degrees(moved - moved[0])


def main() -> None:
    """The picture, and the drift in degrees a minute."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=Path("docs/pictures/circling.png"))
    args = parser.parse_args()
    recording = simulate.observe(simulate.circles(), simulate.imu("LSM6DSO32"), seed=1)
    made = style.figure(9.0, 4.5, "A velocity that turns with the sensor looks like a gyroscope bias")
    axes = made.subplots()
    for name, params, color in (
        ("white velocity", LABORATORY, style.VERMILION),
        ("body velocity, found density", lh.ESKF(), style.BLUE),
    ):
        track = lh.fuse(recording, params)
        moved = heading(track, recording)
        assert track.sigma is not None
        axes.plot(track.t, moved, color=color, label=name)
        bound = 2.0 * np.degrees(track.sigma[:, 2])
        axes.plot(track.t, np.stack([bound, -bound], axis=1), color=color, linewidth=0.7, linestyle="--")
        print(f"{name}: heading moves by {np.abs(moved).max():.1f}° in {track.t[-1]:.0f} s")
    style.format_axes(axes, "dashed: 2σ", "heading error [°]", "time [s]")
    style.legend(axes)
    style.save(made, args.out)


if __name__ == "__main__":
    main()
