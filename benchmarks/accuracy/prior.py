"""A sensor gets better each time it is used: several recordings in a row, each with the prior of the one before.

Every specimen of a chip keeps its turn-on bias, scale and cross-axis errors from use to use, but for a little bias that
is another one at every start, and is moved differently each time. RMS errors of a first minute, in which a filter
without a prior still learns, with the prior and without.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from benchmarks.measure import options, show

import levelhead as lh
from levelhead.bench.timing import Table
from levelhead.evaluate import Score, evaluate

CHIPS = ("MPU-6050", "LSM6DSO32")
MOTION = "hand"
USES = 5
SPECIMENS = 8
MINUTE = 60.0  # s: each use
SWITCHED_ON = np.radians(0.1)  # rad/s, 1σ by which the bias changes from one use to the next
START = 4.0  # s left away, in which the simulated sensor rests: nobody holds it still


def use(chip: str, specimen: int, number: int) -> lh.Recording:
    """One recording of a specimen: the seed of ``observe`` is the specimen's."""
    motion = lh.simulate.motion(1000 * specimen + number, START + MINUTE, 100.0, style=MOTION)
    recording = lh.simulate.observe(motion, lh.simulate.imu(chip, mag="HMC5883L"), seed=specimen)
    other = np.random.default_rng([specimen, number]).normal(0.0, SWITCHED_ON, 3)
    assert recording.truth is not None and recording.truth.bias is not None
    truth = replace(recording.truth, bias=recording.truth.bias + other)
    return replace(recording, gyr=recording.gyr + other, truth=truth)[round(START * 100.0) :]


def uses(chip: str, specimen: int, count: int = USES) -> list[tuple[Score, Score]]:
    """Of each use: the score with what was learned in those before, and that without."""
    prior, found = None, []
    for number in range(count):
        recording = use(chip, specimen, number)
        known, new = (lh.fuse(recording, lh.ESKF(), prior=one) for one in (prior, None))
        prior = known.calibration
        found.append((evaluate(recording, known), evaluate(recording, new)))
    return found


def main() -> None:
    """A table of each chip."""
    given = options(__doc__, repeats=1).parse_args()
    tables = []
    columns = {"case": "use"} | {
        f"{which} {name}": f"{which}: {name} °" for which in ("prior", "none") for name in ("total", "tilt", "heading")
    }
    for chip in CHIPS:
        runs = [uses(chip, specimen) for specimen in range(1, SPECIMENS + 1)]
        rows: list[dict[str, Any]] = []
        for number in range(USES):
            row: dict[str, Any] = {"case": f"{number + 1}"}
            for which, k in (("prior", 0), ("none", 1)):
                for name in ("total", "tilt", "heading"):
                    row[f"{which} {name}"] = float(np.mean([getattr(run[number][k], name) for run in runs]))
            rows.append(row)
        note = f"Mean over {SPECIMENS} specimens of the RMS of a minute in a hand; the first use has no prior."
        tables.append(Table(f"{chip} + HMC5883L, used {USES} times", columns, rows, note))
    show(tables, given.json)


if __name__ == "__main__":
    main()
