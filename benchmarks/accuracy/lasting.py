"""What lasts, by filter: a gyroscope that warms by 0.5 °/s in ten minutes, and an hour without a magnetometer.

Simulated LSM6DSO32 with an HMC5883L, in several motions, two specimens each. The first table has the errors with a
gyroscope of steady temperature and with the ramp on all axes. In the second the magnetometer is missing for an hour
after its first four minutes: the filters' σ of heading and their error before it comes back, the time until heading is
within 3° for good, and what its return does to tilt, against a run in which it was never gone.
"""

from typing import Any

import numpy as np
from benchmarks.measure import options, show
from tests.reference.lasting import gone, hidden, warming

import levelhead as lh
from levelhead.bench.contenders import BY_NAME
from levelhead.bench.timing import Table
from levelhead.evaluate import evaluate

MOTIONS = ("hand", "walking", "drone", "robot")
SEEDS = (1, 2)


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
