"""What a barometer and a satellite receiver add: errors of tilt, height, position and velocity, and error/σ.

Simulated drones (LSM6DSO32 with HMC5883L) and a car that accelerates with 3 m/s² for 4 s at a time; BMP280 at 25 Hz,
receiver at 1 Hz with 2 m and 0.1 m/s. RMS from the tenth second on, over all specimens; online, and smoothed.

The second table is heading without a magnetometer, which a receiver teaches to what accelerates: a start that is off by
some angle, after how many seconds heading is within 5° for good (the slowest specimen; –: not in this minute), and the
mean error and σ of the last second.
"""

import itertools
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from benchmarks.measure import options, show
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import simulate
from levelhead.bench.timing import Table

SPECIMENS = range(6)
COLUMNS = {
    "motion": "motion",
    "sensors": "sensors",
    "tilt": "tilt °",
    "height": "height m",
    "place": "east, north m",
    "speed": "velocity m/s",
    "height_sigma": "height/σ",
    "place_sigma": "place/σ",
    "speed_sigma": "velocity/σ",
}
SECONDS, RATE, SETTLED = 60, 100, 1000
OFF = (0.0, 45.0, 90.0, 135.0, 180.0)  # °
NEAR = 5.0  # °


def car() -> simulate.Motion:
    """East, straight on: pushes and brakes of 4 s."""
    n = SECONDS * RATE
    t = np.arange(n) / RATE
    push = 3.0 * np.sign(np.sin(2 * np.pi * (t - 5) / 16)) * (np.abs((t - 5) % 8 - 4) < 2) * (t > 5)
    acceleration = np.outer(push, [1.0, 0.0, 0.0])
    velocity = np.cumsum(acceleration, axis=0) / RATE
    position = np.cumsum(velocity, axis=0) / RATE
    return simulate.Motion(t, np.tile([1.0, 0, 0, 0], (n, 1)), np.zeros((n, 3)), position, velocity, acceleration)


def rms(parts: list[Any]) -> float:
    """Over all of them."""
    return float(np.sqrt(np.mean(np.square(np.concatenate([np.ravel(part) for part in parts])))))


def row(motions: list[simulate.Motion], barometer: bool, receiver: bool, smoothed: bool) -> list[str]:
    """Errors of one set of sensors over all specimens."""
    tilts: list[Any] = []
    found: dict[str, list[Any]] = {"height": [], "place": [], "speed": [], "height/σ": [], "place/σ": [], "speed/σ": []}
    for seed, motion in zip(SPECIMENS, motions, strict=True):
        recording = simulate.observe(motion, simulate.imu("LSM6DSO32", mag="HMC5883L"), seed)
        recording = replace(
            recording,
            pressure=simulate.pressure(motion, seed=seed) if barometer else None,
            gnss=simulate.gnss(motion, seed=seed) if receiver else None,
        )
        run = lh.smooth if smoothed else lh.fuse
        track = run(recording, "ESKF")
        up = track.as_rotation().inv().apply([0.0, 0.0, 1.0])
        cosine = np.sum(up * motion.to_body(np.array([0.0, 0.0, 1.0])), axis=1)
        tilts.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))[SETTLED:])
        if track.position is None:
            continue
        place, speed = track.position - motion.position, track.velocity - motion.velocity
        for name, off, sigma, axes in (
            ("height", place, track.sigma_position, slice(2, 3)),
            ("place", place, track.sigma_position, slice(0, 2)),
            ("speed", speed, track.sigma_velocity, slice(0, 3) if receiver else slice(2, 3)),
        ):
            found[name].append(off[SETTLED:, axes])
            found[f"{name}/σ"].append(off[SETTLED:, axes] / sigma[SETTLED:, axes])
    if not receiver:
        found["place"], found["place/σ"] = [], []
    return [f"{rms(tilts):.2f}", *(f"{rms(parts):.2f}" if parts else "–" for parts in found.values())]


class Learned(NamedTuple):
    """Of heading without a magnetometer: when it is within ``NEAR`` for good, s, error and σ in the end, °."""

    near: float
    error: float
    sigma: float


def learned(motion: simulate.Motion, seed: int, off: float) -> Learned:
    """By a receiver whose frame is turned by so many degrees against the start."""
    turn = Rotation.from_euler("z", off, degrees=True)
    fixes = simulate.gnss(motion, seed=seed)
    assert fixes.velocity is not None
    seen = turn.apply(np.array(fixes.position)), turn.apply(np.array(fixes.velocity))
    turned = replace(fixes, position=seen[0], velocity=seen[1])
    recording = simulate.observe(motion, simulate.imu("LSM6DSO32"), seed)
    track = lh.fuse(replace(recording, gnss=turned), "ESKF")
    truth = turn * Rotation.from_quat(np.array(motion.quat), scalar_first=True)
    error = np.abs(np.degrees((track.as_rotation() * truth.inv()).as_rotvec()[:, 2]))
    far = np.flatnonzero(error > NEAR)
    sigma = np.degrees(track.sigma_heading)
    last = float(track.t[far[-1]]) if len(far) else 0.0
    return Learned(last, float(error[-RATE:].mean()), float(sigma[-RATE:].mean()))


def headings(motions: dict[str, list[simulate.Motion]]) -> Table:
    """Starts more and more wrong."""
    rows = []
    for (name, some), off in itertools.product(motions.items(), OFF):
        found = [learned(motion, seed, off) for seed, motion in zip(SPECIMENS, some, strict=True)]
        slowest = max(one.near for one in found)
        rows.append(
            {
                "motion": name,
                "off": off,
                "near": None if slowest > SECONDS - 1 else slowest,
                "error": np.mean([one.error for one in found]),
                "sigma": np.mean([one.sigma for one in found]),
            }
        )
    columns = {
        "motion": "motion",
        "off": "start off by °",
        "near": "within 5° after s",
        "error": "error °",
        "sigma": "σ °",
    }
    return Table("Heading from a receiver, without a magnetometer", columns, rows)


def main() -> None:
    """Both motions, without and with each sensor; heading."""
    args = options(__doc__).parse_args()
    rows = []
    drones = [simulate.motion(seed, SECONDS, RATE, style="drone") for seed in SPECIMENS]
    for name, motions in (("drone", drones), ("car", [car()] * len(SPECIMENS))):
        for sensors, barometer, receiver in (
            ("IMU", False, False),
            ("and barometer", True, False),
            ("and GNSS", False, True),
            ("and both", True, True),
        ):
            for smoothed in (False, True):
                label = f"{sensors}, smoothed" if smoothed else sensors
                figures = row(motions, barometer, receiver, smoothed)
                rows.append(dict(zip(COLUMNS, [name, label, *figures], strict=True)))
    walks = [simulate.motion(seed, SECONDS, RATE, style="walking") for seed in SPECIMENS]
    show(
        [Table("Aided: RMS error and error/σ", COLUMNS, rows), headings({"drone": drones, "walking": walks})], args.json
    )


if __name__ == "__main__":
    main()
