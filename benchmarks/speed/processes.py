"""What a user waits for: wall and processor time of whole levelhead processes, and what they must not do in it.

``levelhead --help``; ``levelhead fuse`` of two minutes of data, by the default filter with and without a picture;
``levelhead run`` until it has an orientation and ends; ``import levelhead``; a stream in Python; ``levelhead demo``.
None of them may compile anything or start Numba.
"""

import os
import re
import resource
import statistics
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.measure import once, options, show

from levelhead.bench.inputs import imu_arrays
from levelhead.bench.timing import Table
from levelhead.units import GRAVITY

LEVELHEAD = [sys.executable, "-m", "levelhead"]
HEADER = ",".join(["Time (s)", *(f"Gyroscope {a} (deg/s)" for a in "XYZ"), *(f"Accelerometer {a} (g)" for a in "XYZ")])


def two_minutes(path: Path) -> None:
    """A log of two minutes at 100 Hz."""
    import numpy as np

    t, gyr, acc = imu_arrays(12_000)
    np.savetxt(path, np.column_stack([t, np.degrees(gyr), acc / GRAVITY]), "%.7g", ",", header=HEADER, comments="")


def environment(folder: Path, **more: str) -> dict[str, str]:
    """This process's, with byte code kept as an installed package has it, whatever was said about it outside."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    return kept | {"PYTHONPYCACHEPREFIX": str(folder / "bytecode")} | more


def interpreter(arguments: Sequence[str]) -> list[str]:
    """What runs them: Python for ``-c CODE``, else levelhead."""
    return [sys.executable] if arguments[0] == "-c" else LEVELHEAD


def compilations(arguments: Sequence[str], folder: Path) -> int:
    """Functions that the process compiled and put into Numba's cache."""
    _, done = once([*interpreter(arguments), *arguments], cwd=folder, env=environment(folder, NUMBA_DEBUG_CACHE="1"))
    return len(re.findall(r"data saved to", done.stdout + done.stderr))


def imports(package: str, arguments: Sequence[str], folder: Path) -> bool:
    """Whether the process imports the package."""
    _, done = once(
        [sys.executable, "-X", "importtime", *interpreter(arguments)[1:], *arguments],
        cwd=folder,
        env=environment(folder),
    )
    return re.search(rf"\|\s*{package}\s*$", done.stderr, re.MULTILINE) is not None


def timed(command: Sequence[str], folder: Path) -> tuple[float, float]:
    """Wall time and processor time of a whole process, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds, _ = once(command, cwd=folder, env=environment(folder))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return seconds, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measured(name: str, arguments: Sequence[str], target: float, repeats: int, folder: Path) -> dict[str, Any]:
    """One line of the table; the first run, which may compile, stands apart."""
    command = [*interpreter(arguments), *arguments]
    first, _ = once(command, cwd=folder, env=environment(folder))
    seconds, processor = zip(*(timed(command, folder) for _ in range(repeats)), strict=True)
    return {"command": name, "first_s": first, "least_s": min(seconds), "median_s": statistics.median(seconds),
            "processor_s": min(processor),
            "target": f"≤ {target:g} s", "numba": imports("numba", arguments, folder),
            "compiled": compilations(arguments, folder)}  # fmt: skip


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=5)
    parser.add_argument("--without-demo", action="store_true", help="leave out the slowest one")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        two_minutes(folder / "log.csv")
        bare = [sys.executable, "-c", "import numpy"]
        wall, processor = map(min, zip(*(timed(bare, folder) for _ in range(1 + given.repeats)), strict=True))
        rows = [measured("levelhead --help", ["--help"], 0.5, given.repeats, folder)]
        for arguments, target in (
            (["fuse", "log.csv", "--no-plot", "-o", "out"], 0.4),
            (["fuse", "log.csv", "-o", "out"], 1.0),
            (["run", "--source", "emulated:mpu6050", "--calibrate", "0", "--duration", "0.1"], 1.5),
            (["-c", "import levelhead"], 0.15),
            (["-c", "import levelhead; levelhead.Stream()"], 0.2),
        ):
            shown = " ".join(["python" if arguments[0] == "-c" else "levelhead", *arguments])
            rows.append(measured(shown, arguments, target, given.repeats, folder))
        if not given.without_demo:
            rows.append(measured("levelhead demo", ["demo", "-o", "demo"], 3.0, given.repeats, folder))
    columns = {
        "command": "command", "first_s": "first s", "least_s": "least s", "median_s": "median s",
        "processor_s": "processor, least s", "target": "target",
        "numba": "starts Numba", "compiled": "functions compiled",
    }  # fmt: skip
    note = (
        "First: without byte code, and maybe without machine code. "
        f"Python alone with NumPy takes {wall:.2f} s, of which {processor:.2f} s of a processor."
    )
    show([Table("Whole processes, wall time", columns, rows, note)], given.json)


if __name__ == "__main__":
    main()
