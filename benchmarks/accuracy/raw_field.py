"""A raw magnetometer in front of the filters that do not learn its offset: as it is, by a first pass, and recursively.

    python -m benchmarks.accuracy.raw_field DIR

DIR holds recordings with a reference. On BROAD hard iron of 30 and 300 % of the field is added; ``mag_raw`` of an array
file counts as a recording of its own; a raw ICM-20948 is simulated. "kept" is the filter on the readings as they are
(``Guard(iron=0)``), "first pass" after ``correct_magnetometer``, "twin" the guard's recursive estimate. All errors are
of the second half of a recording, by which the recursive estimate has its offset where the motion shows one, and
without the best constant rotation.
"""

import statistics
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from benchmarks.accuracy.iron import bend, directions
from benchmarks.measure import options, run_script, run_tasks, show

import levelhead as lh
from levelhead.bench.datasets import list_logs, load_recording
from levelhead.bench.error_figures import measure_errors
from levelhead.bench.ratios import geometric_mean
from levelhead.bench.reference import align_sensor
from levelhead.bench.timing import Table
from levelhead.errors import LevelheadError
from levelhead.filters.health import IRON_FOUND
from levelhead.recording import Recording
from levelhead.sources.formats.npz import load_arrays

FILTERS = ("EKF", "Mahony", "Madgwick", "Complementary", "Triad")
WAYS = ("kept", "first pass", "twin")
SHARES = (0.3, 3.0)
SEEDS = 8
KEPT = lh.Guard(iron=0.0)


class Case(NamedTuple):
    """A recording and what is done to its magnetometer."""

    dataset: str
    path: Path | None
    share: float  # of the field; negative: ``mag_raw``
    seed: int

    def load(self) -> Recording:
        """The recording."""
        if self.path is None:
            return lh.simulate.recording("ICM-20948", "hand", 60.0, seed=self.seed)
        recording = load_recording(self.path, True)
        if self.share < 0.0:
            return replace(recording, mag=np.asarray(load_arrays(self.path)["mag_raw"], dtype=float))
        return bend(recording, self.share, directions(self.seed + 1)[-1]) if self.share else recording


class Errors(NamedTuple):
    """Of one case.

    Attributes:
        figures: (filter, way) to °.
        corrected: whether the first pass took an offset off.
        found: s after which the recursive estimate did; None: never.
    """

    figures: dict[tuple[str, str], float]
    corrected: bool
    found: float | None


def cases(places: Sequence[Path]) -> Iterator[Case]:
    """All recordings in some folders that have a reference and a magnetometer."""
    broad = 0
    for path in list_logs(places):
        recording = load_recording(path, True)
        if recording.truth is None or not has_second_half(recording):
            continue
        name = path.parent.name if path.parent.name != "truth" else path.name
        if path.suffix == ".npz" and "mag_raw" in load_arrays(path):
            yield Case(f"{name}, raw", path, -1.0, 0)
        if recording.mag is None:
            continue
        yield Case(name, path, 0.0, 0)
        if name == "broad":
            for share in SHARES:
                yield Case(f"broad + {share:.0%}", path, share, broad)
            broad += 1
    for seed in range(SEEDS):
        yield Case("raw ICM-20948 (simulated)", None, 0.0, seed)


def has_second_half(recording: Recording) -> bool:
    """Whether the second half has a reference while the sensor moves."""
    truth = recording[len(recording) // 2 :].truth
    assert truth is not None
    seen = ~np.isnan(truth.quat[:, 0])
    return bool(np.any(seen if truth.moving is None else seen & truth.moving))


def second_half(recording: Recording, track: lh.Track) -> float:
    """Total error in °."""
    half = len(recording) // 2
    frame = align_sensor(recording)
    return measure_errors(recording[half:], track.quat[half:], False, None, frame).rotated


def measure(case: Case) -> Errors:
    """Every filter, each way."""
    recording = case.load()
    better, found, figures = lh.correct_magnetometer(recording), None, dict[tuple[str, str], float]()
    for name in FILTERS:
        runs = (lh.fuse(recording, name, guard=KEPT), lh.fuse(better, name, guard=KEPT), lh.fuse(recording, name))
        for way, track in zip(WAYS, runs, strict=True):
            figures[name, way] = second_half(recording, track)
        rows = np.flatnonzero(runs[2].health & np.uint32(IRON_FOUND))
        found = float(recording.t[rows[0]] - recording.t[0]) if len(rows) else found
    return Errors(figures, better is not recording, found)


def table(results: dict[str, list[Errors]]) -> Table:
    """Every filter on every set, and how often an offset was taken off."""
    columns = {"case": "set", "count": "recordings"} | {name: f"{name} °" for name in FILTERS}
    columns |= {"first": "first pass", "twin": "in the stream", "time": "after s"}
    rows: list[dict[str, object]] = []
    for dataset, found in results.items():
        row: dict[str, object] = {"case": dataset, "count": len(found)}
        for name in FILTERS:
            means = (geometric_mean([one.figures[name, way] for one in found]) for way in WAYS)
            row[name] = ", ".join(f"{mean:.3g}" for mean in means)
        times = [one.found for one in found if one.found is not None]
        row |= {"first": sum(one.corrected for one in found), "twin": len(times)}
        rows.append(row | {"time": round(statistics.median(times)) if times else None})
    note = "Three numbers: readings as they are, after a first pass, and with the guard's estimate."
    return Table("Total error of the second half, geometric mean", columns, rows, note)


def main() -> None:
    """A table of each filter."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("places", nargs="+", type=Path, help="folders with recordings that have a reference")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    given = parser.parse_args()
    every = list(cases(given.places))
    if all(case.path is None for case in every):
        raise LevelheadError(f"{given.places[0]}: no recording with a reference and a magnetometer")
    done = run_tasks(measure, every, given.jobs, lambda _: None)
    results: dict[str, list[Errors]] = defaultdict(list)
    for case in every:
        results[case.dataset].append(done[case])
    show([table(results)], given.json)


if __name__ == "__main__":
    run_script(main)
