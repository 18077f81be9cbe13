"""The smoother on a whole day at 100 Hz: peak memory of the process, and how long it took.

Twenty-four simulated hours, one after the other, in a process of their own: an LSM6DSO32 with an HMC5883L, now in a
hand, now walking, on a drone, on a robot, at rest. Between two of them nobody knows for a second what becomes of it.
"""

import argparse
import json
import sys
import time
from typing import Any

import numpy as np
from benchmarks.measure import once, options, show
from benchmarks.speed.large import peak

import levelhead as lh
from levelhead.bench.timing import Table
from levelhead.evaluate import evaluate

RATE = 100.0  # Hz
HOUR = 3600.0  # s
MOTIONS = ("hand", "still", "walking", "robot", "drone")
PAUSE = 1.0  # s, more than the filter calls a gap


def hour(k: int) -> lh.Recording:
    """The k-th, with truth."""
    return lh.simulate.recording("LSM6DSO32", MOTIONS[k % len(MOTIONS)], HOUR, RATE, seed=k, mag="HMC5883L")


def hours(count: int) -> lh.Recording:
    """That many in one recording."""
    n = round(HOUR * RATE)
    t = np.empty(count * n)
    sensors = [np.empty((count * n, 3)) for _ in range(3)]
    for k in range(count):
        rows = slice(k * n, (k + 1) * n)
        one = hour(k)
        t[rows] = one.t + k * (HOUR + PAUSE)
        for into, values in zip(sensors, (one.gyr, one.acc, one.mag), strict=True):
            into[rows] = values
    return lh.Recording(t, *sensors)


def child(count: int) -> dict[str, Any]:
    """Smooths them; peaks of memory in bytes."""
    found: dict[str, Any] = {"samples": count * round(HOUR * RATE)}
    lh.smooth(lh.simulate.recording("LSM6DSO32", "hand", 5.0, mag="HMC5883L"))  # compiles
    found["start_b"] = peak()
    recording = hours(count)
    found["read_b"] = peak()
    began = time.perf_counter()
    track = lh.smooth(recording)
    found["seconds"] = time.perf_counter() - began
    found["smooth_b"] = peak()
    first = hour(0)
    n = len(first)
    return found | {"first_hour": evaluate(first, lh.Track(first.t, track.quat[:n])).total}


def main() -> None:
    """An hour, and the day."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("--hours", type=int, nargs="+", default=[1, 24], help="lengths to try (default 1 24)")
    parser.add_argument("--child", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child:
        print(json.dumps(child(given.child)))
        return
    rows = []
    for count in given.hours:
        found = json.loads(once([sys.executable, "-m", __spec__.name, "--child", str(count)])[1].stdout)
        gib = {f"{name}_gib": found[f"{name}_b"] / 2**30 for name in ("start", "read", "smooth")}
        data = 8 * (10 + 10) * found["samples"] / 2**30
        rows.append({"case": f"{count} h, {found['samples']:,} samples", **gib, "data_gib": data, **found})
    columns = {
        "case": "recording",
        "start_gib": "peak GiB: imports",
        "read_gib": "recording",
        "smooth_gib": "smoothed",
        "data_gib": "in and out GiB",
        "seconds": "smoothing s",
        "first_hour": "total error of the first hour °",
    }
    note = "In and out: float64 of time, rates, forces, field, and orientation, bias and σ. Target: a day below 4 GiB."
    show([Table("Smoothing in bounded memory", columns, rows, note)], given.json)


if __name__ == "__main__":
    main()
