"""
A head tracker that speaks OSC
==============================

Headphones with a sensor keep a scene of sound in place while the head turns. Each orientation goes out as an Open Sound
Control message, which the SceneRotator of the IEM Plug-in Suite and others read. A button takes the present view as
ahead. Without a magnetometer the view drifts by about one degree in three minutes.

::

    python examples/head_tracker.py                             # draws docs/pictures/head-tracker.png
    python examples/head_tracker.py PICTURE 127.0.0.1:9000      # sends the simulated head too, in real time
"""

import math
import socket
import struct
import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import simulate

ADDRESS = "/SceneRotator/quaternions"  # w, x, y, z
RATE, DURATION, BUTTON = 100.0, 180.0, 2.0  # Hz; s, and when the wearer presses the button
MOUNTING = Rotation.from_euler("yx", [15.0, -8.0], degrees=True)  # of the sensor on the headband: x ahead, but askew


def osc(address: str, *values: float) -> bytes:
    """A message of OSC 1.0: address and type tags, each ended by zeros to four bytes, then big-endian floats."""
    head = b"".join(text.encode("ascii") + b"\0" * (4 - len(text) % 4) for text in (address, "," + "f" * len(values)))
    return head + struct.pack(f">{len(values)}f", *values)


def wear(seed: int = 0) -> lh.Recording:
    """A head that looks about, with the sensor askew on the band; its truth is the sensor's."""
    head = simulate.motion(seed, DURATION, RATE, style="walking", rotation=(12.0, 12.0, 35.0), translation=0.4)
    sensor = Rotation.from_quat(head.quat, scalar_first=True) * MOUNTING
    worn = simulate.Motion(
        head.t,
        sensor.as_quat(scalar_first=True),
        head.gyr @ MOUNTING.as_matrix(),
        head.position,
        head.velocity,
        head.acceleration,
    )
    return simulate.observe(worn, simulate.imu("LSM6DSO32"), seed)


class HeadTracker:
    """The view of a head: its turn since the button was pressed, for a sensor whose x axis points roughly ahead."""

    def __init__(self) -> None:
        self.stream = lh.Stream(lh.ESKF())
        self.ahead = self.mounting = Rotation.identity()

    def update(self, gyr: np.ndarray, acc: np.ndarray, dt: float) -> Rotation:
        """The view after a sample: x is ahead, y to the left, z up."""
        self.stream.update(tuple(gyr.tolist()), tuple(acc.tolist()), dt=dt)
        return self.ahead.inv() * self.orientation() * self.mounting.inv()

    def press(self) -> None:
        """Takes the present view as level and ahead: the heading is ahead, and the tilt is the sensor's mounting."""
        now = self.orientation()
        self.ahead = Rotation.from_euler("z", self.stream.euler[2])
        self.mounting = self.ahead.inv() * now

    def orientation(self) -> Rotation:
        """The sensor in the earth frame."""
        return Rotation.from_quat(self.stream.quat, scalar_first=True)


def track(
    recording: lh.Recording, send: socket.socket | None = None, *, real_time: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) degrees: yaw, pitch, roll of the view since the button, and of the truth; each view is sent."""
    assert recording.truth is not None
    tracker, views = HeadTracker(), []
    button = round(BUTTON * RATE)
    begun = time.monotonic()
    for i, (gyr, acc) in enumerate(zip(recording.gyr, recording.acc, strict=True)):
        view = tracker.update(gyr, acc, 1.0 / RATE)
        if i == button:
            tracker.press()
        if i > button:
            views.append(view)
        if send is not None and i > button:
            send.send(osc(ADDRESS, *view.as_quat(scalar_first=True)))
            time.sleep(max(0.0, begun + i / RATE - time.monotonic()) if real_time else 0.0)
    true = Rotation.from_quat(recording.truth.quat, scalar_first=True) * MOUNTING.inv()
    seen = true[button].inv() * true[button + 1 :]
    return Rotation.concatenate(views).as_euler("ZYX", degrees=True), seen.as_euler("ZYX", degrees=True)


def main(picture: Path, receiver: str = "") -> None:
    """Yaw of the view beside the truth, and the errors."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    send = None
    if receiver:
        host, _, port = receiver.rpartition(":")
        send = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        send.connect((host, int(port)))
    found, true = track(wear(), send)
    error = (found - true + 180.0) % 360.0 - 180.0
    t = BUTTON + np.arange(1, len(found) + 1) / RATE
    figure, (above, below) = pyplot.subplots(2, 1, figsize=(9, 5.0), sharex=True, layout="constrained")
    above.plot(t, np.unwrap(true[:, 0], period=360.0), color="black", lw=2.2, label="true")
    above.plot(t, np.unwrap(found[:, 0], period=360.0), color="tab:blue", lw=1.0, label="sent as OSC")
    above.set(ylabel="yaw [°]", title="A head that looks about, without a magnetometer")
    above.legend(loc="upper left", fontsize=8)
    for i, (name, color) in enumerate((("yaw", "tab:blue"), ("pitch", "tab:green"), ("roll", "tab:red"))):
        rms = math.sqrt(np.mean(error[:, i] ** 2))
        below.plot(t, error[:, i], color=color, lw=0.9, label=f"{name}: {rms:.1f}° RMS")
    below.set(xlabel="t [s]", ylabel="error [°]")
    below.legend(loc="upper left", fontsize=8, ncols=3)
    figure.savefig(picture, dpi=90)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs/pictures/head-tracker.png")
    main(target, *sys.argv[2:3])
    sys.stdout.write(f"written: {target}\n")
