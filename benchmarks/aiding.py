"""What a barometer and a satellite receiver add: errors of tilt, height, position and velocity, and error/σ.

Simulated drones (LSM6DSO32 with HMC5883L) and a car that accelerates with 3 m/s² for 4 s at a time; BMP280 at 25 Hz,
receiver at 1 Hz with 2 m and 0.1 m/s. RMS from the tenth second on, over all specimens.
"""

from dataclasses import replace
from typing import Any

import numpy as np

import levelhead as lh
from levelhead import simulate
from levelhead.bench.timing import Table
from measure import options, show

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


def row(motions: list[simulate.Motion], barometer: bool, receiver: bool) -> list[str]:
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
        track = lh.fuse(recording, "ESKF", engine="compiled")
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


def main() -> None:
    """Both motions, without and with each sensor."""
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
            rows.append(dict(zip(COLUMNS, [name, sensors, *row(motions, barometer, receiver)], strict=True)))
    show([Table("Aided: RMS error and error/σ", COLUMNS, rows)], args.json)


if __name__ == "__main__":
    main()
