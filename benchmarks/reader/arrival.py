"""Stamps of arrival: how far they are from the sensor's clock, before and after the reader, and what they cost in tilt.

A simulated sensor in a hand samples at 100 Hz on a clock that is 100 ppm slow; its samples arrive in order, 20 µs
apart at least, each with a latency. The log is written as CSV and read. Stamps are compared with the true ones up to a
constant, tilt of the default filter with the simulated truth, both rms; means over seeds. Readings are the same.
"""

import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from benchmarks.measure import options, show

import levelhead as lh
from levelhead.bench.timing import Table
from levelhead.evaluate import evaluate
from levelhead.evaluate.text_table import Cell
from levelhead.recording import Array, Recording
from levelhead.sources.formats.csv_writer import write_csv

DRIFT, APART = 1e-4, 2e-5  # of the clock; s between arrivals
LOOP = "none, a loop of 10 ± 3.5 ms"  # the sensor itself samples unevenly
Latency = Callable[[Array, np.random.Generator], Array]  # of samples at some times, s

KINDS: dict[str, Latency] = {
    "none": lambda t, random: np.zeros(len(t)),
    "uniform, ±2 ms": lambda t, random: random.uniform(-2e-3, 2e-3, len(t)),
    "uniform, ±5 ms": lambda t, random: random.uniform(-5e-3, 5e-3, len(t)),
    "normal, 3 ms": lambda t, random: random.normal(0.0, 3e-3, len(t)),
    "exponential, 3 ms": lambda t, random: random.exponential(3e-3, len(t)),
    "exponential, 10 ms": lambda t, random: random.exponential(10e-3, len(t)),
    "50 ms, 1 of 100": lambda t, random: np.where(random.random(len(t)) < 0.01, 50e-3, 0.0),
    "rounded to 1 ms": lambda t, random: np.floor(t * 1e3) * 1e-3 - t,
    "rounded to 10 ms": lambda t, random: np.floor(t * 1e2) * 1e-2 - t,
    "bursts of 10": lambda t, random: t[np.minimum(np.arange(len(t)) // 10 * 10 + 9, len(t) - 1)] - t,
    LOOP: lambda t, random: np.zeros(len(t)),
}


def sampled(fine: Recording, kind: str, lost: float, random: np.random.Generator) -> Recording:
    """What a sensor takes of a recording at 400 Hz, less what is lost, on the sensor's clock."""
    if kind == LOOP:
        taken = np.cumsum(random.integers(2, 7, len(fine) // 4))
        taken = taken[taken < len(fine)]
    else:
        taken = np.arange(0, len(fine), 4)
    taken = taken[random.random(len(taken)) >= lost]
    truth = None if fine.truth is None else fine.truth[taken]
    return Recording(fine.t[taken] * (1.0 + DRIFT), fine.gyr[taken], fine.acc[taken], truth=truth)


def arrived(t: Array, latency: Array) -> Array:
    """Stamps in the order of arrival."""
    found, last = np.empty(len(t)), -np.inf
    for row, stamp in enumerate((t + latency).tolist()):
        found[row] = last = max(stamp, last + APART)
    return found - found[0]


def stamped(recording: Recording, t: Array) -> Recording:
    """The same readings with other stamps."""
    return Recording(t, recording.gyr, recording.acc, truth=recording.truth)


def off(t: Array, true: Array) -> float:
    """ms, rms of stamps up to a constant."""
    return 1e3 * float(np.std(t - true))


def row(kind: str, lost: float, seeds: int) -> dict[str, Cell]:
    """One line of the table."""
    found: dict[str, list[float]] = {}
    for seed in range(seeds):
        random = np.random.default_rng(seed)
        fine = lh.simulate.recording("BMI160", "hand", 120.0, 400.0, seed=seed)
        sound = sampled(fine, kind, lost, random)
        late = stamped(sound, arrived(sound.t, KINDS[kind](sound.t, random)))
        with tempfile.TemporaryDirectory() as folder:
            write_csv(late, Path(folder, "log.csv"))
            read = lh.read(Path(folder, "log.csv"))
        restored = stamped(sound, read.t)
        found.setdefault("written", []).append(off(late.t, sound.t))
        found.setdefault("read", []).append(off(read.t, sound.t))
        found.setdefault("restored", []).append(float(any(one.reason == "arrival" for one in read.meta["conclusions"])))
        for name, one in (("true", sound), ("late", late), ("again", restored)):
            found.setdefault(name, []).append(evaluate(one, lh.fuse(one)).tilt)
    return {"case": kind, "lost": f"{100 * lost:g} %"} | {
        key: statistics.fmean(values) for key, values in found.items()
    }


def main() -> None:
    """Every kind of latency, without and with lost samples."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=4, help="recordings of each kind (default 4)")
    given = parser.parse_args()
    columns = {
        "case": "latency",
        "lost": "lost",
        "written": "stamps as written [ms]",
        "read": "as read [ms]",
        "restored": "share restored",
        "true": "tilt, true stamps [°]",
        "late": "as written [°]",
        "again": "as read [°]",
    }
    rows = [row(kind, lost, given.seeds) for kind in KINDS for lost in (0.0, 0.01)]
    show([Table("stamps of arrival", columns, rows)], given.json)


if __name__ == "__main__":
    main()
