"""What lasts, by filter: a gyroscope that warms by 0.5 °/s in ten minutes, and an hour without a magnetometer.

Simulated LSM6DSO32 with an HMC5883L, in several motions, two specimens each. The first table has the errors with a
gyroscope of steady temperature and with the ramp on all axes. In the second the magnetometer is missing for an hour
after its first four minutes: the filters' σ of heading and their error before it comes back, the time until heading is
within 3° for good, and what its return does to tilt, against a run in which it was never gone.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from benchmarks.measure import options, show

import levelhead as lh
from levelhead.bench.contenders import BY_NAME
from levelhead.bench.timing import Table
from levelhead.evaluate import evaluate
from levelhead.evaluate.score import error_angles

MOTIONS = ("hand", "walking", "drone", "robot")
SEEDS = (1, 2)
WARMING = np.radians(0.5) * np.array([1.0, -1.0, 1.0])  # rad/s, by which the bias runs,
WARM_UP = 600.0  # s, in this time
BEFORE, HOUR, AFTER = 240.0, 3600.0, 120.0  # s with, without and again with a magnetometer
SLOW = 50.0  # Hz, of that recording
BACK = 3.0  # °
SHORT = 10.0  # s after a return in which tilt must not jump


def warming(motion: str, seed: int) -> tuple[lh.Recording, lh.Recording]:
    """A recording, and the same with a bias that runs away."""
    steady = lh.simulate.recording("LSM6DSO32", motion, WARM_UP, seed=seed, mag="HMC5883L")
    assert steady.truth is not None and steady.truth.bias is not None
    ramp = np.outer(steady.t / WARM_UP, WARMING)
    truth = replace(steady.truth, bias=steady.truth.bias + ramp)
    return steady, replace(steady, gyr=steady.gyr + ramp, truth=truth)


class Gone(NamedTuple):
    """What an hour without a magnetometer did. Angles in °."""

    sigma: float  # of heading, at the end of the hour
    error: float  # of heading, there
    back: float  # s until it is right again
    step: float  # largest change from one sample to the next, after the return, of the tilt that it causes
    tilt: float  # RMS tilt error in the hour and after it,
    tilt_with: float  # and had it never been gone


def hidden(motion: str, seed: int, chip: str = "LSM6DSO32") -> tuple[lh.Recording, lh.Recording]:
    """A recording, and the same without the magnetometer for an hour."""
    whole = lh.simulate.recording(chip, motion, BEFORE + HOUR + AFTER, SLOW, seed, mag="HMC5883L")
    mag = np.array(whole.mag)
    mag[int(BEFORE * SLOW) : int((BEFORE + HOUR) * SLOW)] = np.nan
    return whole, replace(whole, mag=mag)


def gone(whole: lh.Recording, without: lh.Recording, params: Any) -> Gone:
    """A filter on both."""
    tracks = [lh.fuse(recording, params, engine="compiled") for recording in (whole, without)]
    with_it, errors = (error_angles(whole, track) for track in tracks)
    end = int((BEFORE + HOUR) * SLOW)
    heading = np.degrees(np.abs(errors.heading))
    far = np.flatnonzero(heading[end:] > BACK)
    between = tracks[1].as_rotation() * tracks[0].as_rotation().inv()
    up = np.degrees(np.arccos(np.clip(between.apply([0.0, 0.0, 1.0])[:, 2], -1.0, 1.0)))
    rest = slice(int(BEFORE * SLOW), None)
    tilts = [float(np.degrees(np.sqrt(np.mean(e.tilt[rest] ** 2)))) for e in (errors, with_it)]
    sigma = tracks[1].sigma_heading
    assert sigma is not None
    return Gone(
        float(np.degrees(sigma[end - 1])),
        float(heading[end - 1]),
        (far[-1] + 1) / SLOW if len(far) else 0.0,
        float(np.abs(np.diff(up[end - 1 : end + int(SHORT * SLOW)])).max()),
        *tilts,
    )


def ramp_rows() -> list[dict[str, Any]]:
    """Every motion and filter, means of the specimens."""
    rows = []
    for motion in MOTIONS:
        pairs = [warming(motion, seed) for seed in SEEDS]
        for name in ("ESKF", "EKF", "vqf.VQF"):
            row: dict[str, Any] = {"case": f"{motion}, {name}"}
            for k, label in enumerate(("steady", "warming")):
                scores = []
                for pair in pairs:
                    one = pair[k]
                    other = BY_NAME.get(name)
                    track = lh.Track(one.t, other.run(one)) if other else lh.fuse(one, name, engine="compiled")
                    scores.append(evaluate(one, track))
                for key in ("tilt", "heading", "tilt_error_ratio", "heading_error_ratio"):
                    values = [getattr(score, key) for score in scores]
                    row[f"{label} {key}"] = None if None in values else float(np.mean(values))
            rows.append(row)
    return rows


def hour_rows() -> list[dict[str, Any]]:
    """Every motion, specimen and filter."""
    rows = []
    for motion in MOTIONS:
        for seed in SEEDS:
            pair = hidden(motion, seed)
            for params in (lh.ESKF(), lh.EKF()):
                found = gone(*pair, params)
                rows.append({"case": f"{motion} {seed}, {type(params).__name__}", **found._asdict()})
    return rows


RAMP = {"case": "motion, filter"} | {
    f"{label} {key}": f"{label}: {words}"
    for label in ("steady", "warming")
    for key, words in (
        ("tilt", "tilt °"),
        ("heading", "heading °"),
        ("tilt_error_ratio", "error/σ tilt"),
        ("heading_error_ratio", "heading"),
    )
}
MISSING = {
    "case": "motion, specimen, filter",
    "sigma": "σ heading °",
    "error": "error °",
    "back": "back after s",
    "step": "largest step of tilt °",
    "tilt": "RMS tilt °",
    "tilt_with": "never gone °",
}


def main() -> None:
    """Run both."""
    given = options(__doc__, repeats=1).parse_args()
    tables = [
        Table("The bias runs by 0.5 °/s in ten minutes", RAMP, ramp_rows(), "RMS. VQF says no σ."),
        Table("An hour without a magnetometer", MISSING, hour_rows(), "Motions of the simulator, two specimens each."),
    ]
    show(tables, given.json)


if __name__ == "__main__":
    main()
