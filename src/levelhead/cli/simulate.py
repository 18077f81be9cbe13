"""``levelhead simulate -o FILE``: a recording with known truth."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead.cli.options import say, say_json, simulated
from levelhead.errors import LevelheadError


def simulate(
    what: str = "hand",
    *,
    out: Annotated[Path, Parameter(name=["--out", "-o"], metavar="FILE")],
    sensor: str = "MPU-6050",
    duration: float = 60.0,
    rate: Annotated[float, Parameter(metavar="HZ")] = 100.0,
    seed: int = 0,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Simulate a recording with known truth and write it as .csv or .npz.

    Args:
        what: a motion (hand, walking, drone, robot, still), or lesson or hard.
        out: the file; .npz keeps the truth and the true bias to the bit.
        sensor: MPU-6050, BMI160, LSM6DS3, LSM6DSO32 or ICM-20948, errors as in its data sheet.
        duration: seconds.
        rate: samples a second.
        seed: the same seed gives the same bits; it picks motion, specimen and noise.
        json: print what was written as JSON.
    """
    from levelhead.sources.csv_writer import write_csv
    from levelhead.sources.npz import write

    writers = {".csv": write_csv, ".npz": write}
    if out.suffix not in writers:
        raise LevelheadError(f"cannot write {out}: it ends in '{out.suffix}'; expected .csv or .npz")
    recording = simulated(what, seed, duration, rate, sensor)
    writers[out.suffix](recording, out)
    if json:
        facts = {
            "written": [str(out)],
            "samples": len(recording),
            "rate_hz": recording.rate,
            "what": what,
            "seed": seed,
        }
        say_json(facts if what in ("lesson", "hard") else facts | {"sensor": sensor})
        return
    say(f"{recording}")
    say(f"written: {out}")
