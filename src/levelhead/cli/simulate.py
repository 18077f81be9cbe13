"""``levelhead simulate -o FILE``: a recording with known truth."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead.cli.options import print_json, print_line, simulate_recording
from levelhead.errors import LevelheadError


def simulate(
    what: str = "hand",
    /,
    *,
    out: Annotated[Path, Parameter(name=["--out", "-o"], metavar="FILE")],
    sensor: Annotated[str | None, Parameter(metavar="NAME")] = None,
    duration: Annotated[float | None, Parameter(metavar="S")] = None,
    rate: Annotated[float | None, Parameter(metavar="HZ")] = None,
    seed: int | None = None,
    noise: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Simulate a recording with known truth and write it as .csv or .npz, or as a ROS 1 bag without the truth.

    Args:
        what: A motion (hand, walking, drone, robot, still), poses for a calibration, or lesson or hard.
        out: File to write; .npz keeps the truth and the true bias to the bit.
        sensor: Sensor with the errors of its data sheet: MPU-6050 (the default), BMI160, LSM6DS3, LSM6DSO32 or
            ICM-20948.
        duration: Length in seconds; 60 by default.
        rate: Samples per second; 100 by default.
        seed: Seed of motion, noise and the specimen of the sensor, which is the same for all motions. The same seed
            gives the same bits. 42 for the lessons, 0 otherwise.
        noise: A sensor's noise, as written by `levelhead noise`. It replaces the noise of --sensor; without --sensor it
            is the only error.
        json: Print the path and facts as JSON.
    """
    from levelhead.sources.formats.csv_writer import write_csv
    from levelhead.sources.formats.npz import write_npz
    from levelhead.sources.formats.rosbag import write_bag

    writers = {".csv": write_csv, ".npz": write_npz, ".bag": write_bag}
    if out.suffix.lower() not in writers:
        raise LevelheadError(f"cannot write {out}: it ends in '{out.suffix}'; expected .csv, .npz or .bag")
    recording = simulate_recording(what, seed, duration, rate, sensor, noise)
    writers[out.suffix.lower()](recording, out)
    if json:
        facts = {"samples": len(recording), "duration_s": recording.duration, "rate_hz": recording.rate, "what": what}
        made = {name: recording.meta[name] for name in ("sensor", "seed") if name in recording.meta}
        print_json(facts | made | {"written": [str(out)]})
        return
    print_line(f"{recording}")
    print_line(f"written: {out}")
