"""Time to read and to examine a large CSV: wall-clock and CPU seconds of a process that has its imports done.

    python benchmarks/large_log.py [MEGABYTES] [--profile]

The log is made in a temporary folder: time in µs, gyroscope, accelerometer and magnetometer, as a logger writes it.
"""

import cProfile
import os
import pstats
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import levelhead as lh
from levelhead.inspection import examine

RUNS = 3


def log(path: Path, megabytes: float) -> None:
    """A CSV of about that size: a hand's motion of a minute, again and again."""
    made = lh.simulate.recording("ICM-20948", "hand", duration=60, seed=1)
    lines = [
        ",".join(f"{value:.6f}" for value in row)
        for row in np.hstack([made.gyr, made.acc, np.tile([0.2, 18, -45], (len(made), 1))])
    ]
    count = int(megabytes * 1e6 / (len("".join(lines)) / len(lines) + 12))
    step = round(1e6 * made.duration / (len(made) - 1))
    with open(path, "w", encoding="ascii") as file:
        file.write("time_us,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z,mag_x,mag_y,mag_z\n")
        for first in range(0, count, len(lines)):
            file.writelines(f"{(first + k) * step},{line}\n" for k, line in enumerate(lines[: count - first]))


def timed(what: str, function: Callable[[], Any]) -> Any:
    """Runs a function ``RUNS`` times and prints the least wall-clock and CPU seconds."""
    wall, cpu = [], []
    for _ in range(RUNS):
        began, before = time.perf_counter(), time.process_time()
        result = function()
        wall.append(time.perf_counter() - began)
        cpu.append(time.process_time() - before)
    print(f"{what:18} {min(wall):5.2f} s, {min(cpu):5.2f} s of CPU")
    return result


def main() -> None:
    """Prints the times."""
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.csv"
        log(path, float(words[0]) if words else 60.0)
        recording = timed("read", lambda: lh.read(path))
        print(f"{os.path.getsize(path) / 1e6:.0f} MB, {recording!r}")
        if "--profile" in sys.argv:
            with cProfile.Profile() as profile:
                examine(recording)
            pstats.Stats(profile).sort_stats("cumtime").print_stats(25)
        timed("examine", lambda: examine(recording))
        timed("read and examine", lambda: lh.inspect(path))


if __name__ == "__main__":
    main()
