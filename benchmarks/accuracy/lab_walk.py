"""From a sensor to C in five commands: what each takes, and the error after it, docs/explanation/tuning-accuracy.md.

    python -m benchmarks.accuracy.lab_walk

Three logs of one simulated specimen of an ICM-20948 (still, poses, hand), the commands as README has them, each taking
the files of those before it, and a motion of the same specimen that was not used (walking). Errors are against the
truth, the best constant heading removed; "the same as C" is the exported C in single precision, compiled here.
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.accuracy.single import fused
from benchmarks.measure import once, options, show

import levelhead as lh
from levelhead.bench.timing import Table
from levelhead.calibration import Calibration
from levelhead.cli.calibrated_log import read_calibrated
from levelhead.cli.options import Reading
from levelhead.evaluate import evaluate
from levelhead.export import ExportConfig

SPECIMEN = "--sensor ICM-20948 --seed 5"
LOGS = (
    f"simulate still {SPECIMEN} --duration 600 -o still.csv",
    f"simulate poses {SPECIMEN} -o poses.csv",
    f"simulate hand {SPECIMEN} --duration 120 -o motion.csv",
    f"simulate walking {SPECIMEN} --duration 120 -o walk.csv",
)
KNOWN = "--calibration poses-calibration.json"
COMMANDS = (
    "noise still.csv",
    "calibrate poses.csv",
    f"tune motion.csv -f EKF --noise still-noise.json {KNOWN}",
    f"stress motion.csv --params tuned.json {KNOWN}",
    f"export EKF --params tuned.json {KNOWN} --arduino",
)


def main() -> None:
    """Both tables."""
    given = options(__doc__, repeats=1).parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        typed: list[dict[str, Any]] = []
        for line in (*LOGS, *COMMANDS):
            seconds, _ = once([sys.executable, "-m", "levelhead", *line.split()], cwd=folder)
            if line in COMMANDS:
                typed.append({"command": f"levelhead {line}", "seconds": round(seconds, 1)})
        file = folder / "poses-calibration.json"
        noise = lh.NoiseModel.read(folder / "still-noise.json").parameters(lh.EKF())
        tuned = lh.ParameterFile.read(folder / "tuned.json").params
        config = ExportConfig(tuned, real="float", calibration=Calibration.read(file))
        steps: dict[str, Any] = {
            "`EKF` as it comes": lambda log: lh.fuse(Reading().read(log), lh.EKF()),
            "calibrated": lambda log: lh.fuse(read_calibrated(Reading(), log, file), lh.EKF()),
            "and with its noise": lambda log: lh.fuse(read_calibrated(Reading(), log, file), noise),
            "and tuned": lambda log: lh.fuse(read_calibrated(Reading(), log, file), tuned),
            "the same as C, in float": lambda log: fused(config, Reading().read(log)),
        }
        logs = {"hand": folder / "motion.csv", "walking, not used": folder / "walk.csv"}
        rows = [
            {"step": step}
            | {name: round(evaluate(lh.read(log), run(log)).total_aligned, 2) for name, log in logs.items()}
            for step, run in steps.items()
        ]
    commands = Table("The five commands", {"command": "command", "seconds": "s"}, typed, "Whole processes.")
    errors = Table("Total error, ° RMS", {"step": "step"} | {name: name for name in logs}, rows, "Against the truth.")
    show([commands, errors], given.json)


if __name__ == "__main__":
    main()
