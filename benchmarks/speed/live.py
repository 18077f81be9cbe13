"""A 200 Hz node on an emulated MPU-6050 with the other cores busy: losses, missed ticks, lateness, cost of a tick.

Each case is a process of its own (`levelhead run --json`), with the black box and the default filter, once without
real-time priority and once with it, where that is allowed. Every other core runs an endless loop meanwhile.
"""

import json
import multiprocessing
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.measure import options, show

from levelhead.bench.timing import Table

RATE = 200


def spin() -> None:
    """Keeps a core busy."""
    while True:
        pass


def run(seconds: float, realtime: bool) -> dict[str, Any]:
    """The figures of one run."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "levelhead",
            "run",
            "--source",
            "emulated:mpu6050",
            "--rate",
            str(RATE),
            "--json",
        ]
        command += ["--duration", str(seconds), "--box", str(Path(folder) / "box.mcap")]
        command += ["--realtime" if realtime else "--no-realtime"]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    figures: dict[str, Any] = json.loads(done.stdout)
    return figures


def main() -> None:
    """Runs both cases beside the load."""
    parser = options(__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="length of each run (default 10)")
    given = parser.parse_args()
    load = [multiprocessing.Process(target=spin, daemon=True) for _ in range(max(1, (os.cpu_count() or 1) - 1))]
    for one in load:
        one.start()
    rows = []
    for realtime in (False, True):
        found = run(60.0 * given.minutes, realtime)
        rows.append(
            {
                "case": "real-time priority" if realtime else "no priority",
                "samples": found["samples"],
                "lost": found["lost"],
                "ticks missed": found["missed"],
                **{f"late {name}": found["lateness"][f"{name}_us"] for name in ("p50", "p99", "p99.9", "max")},
                "read p99": found["reading"]["p99_us"],
                "work p99": found["work"]["p99_us"],
                "tick p50": found["whole"]["p50_us"],
                "tick p99": found["whole"]["p99_us"],
            }
        )
    for one in load:
        one.terminate()
    title = f"A node at {RATE} Hz for {given.minutes:g} min, other cores busy; times in µs"
    show([Table(title, {name: name for name in rows[0]}, rows)], given.json)


if __name__ == "__main__":
    main()
