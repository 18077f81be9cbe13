"""How the ESKF's numbers do on data that they were not chosen on: one whole data set is left out at a time.

    python -m benchmarks.accuracy.leave_one_out shared/data --steps 60

For every data set the numbers of ``SEARCHED`` are chosen on the other sets alone. The search starts from the power of
ten that is nearest to each default, and goes by random steps: one or two numbers times exp of a normal number, kept if
the cost becomes less. The score is the mean of log(error/VQF's) over the other sets, each set with and each without
magnetometers counting alike, on at most ``MOST`` recordings of each, and a ratio below ``ENOUGH`` as that. The cost is
the score and ``RIDGE`` times the squared logarithm of each number by its start, where it stays without evidence (A. E.
Hoerl, R. W. Kennard, Ridge regression, Technometrics 12, 1970). The model itself, and the constants in its code, are
the same throughout: they were found with all sets in view.
"""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from benchmarks.measure import run_script

import levelhead as lh
from levelhead.bench.datasets import load_recording
from levelhead.bench.error_figures import measure_errors
from levelhead.bench.groups import group_of
from levelhead.bench.methods import Method
from levelhead.bench.processes import run_parallel
from levelhead.bench.ratios import MIN_ERROR, geometric_mean
from levelhead.bench.reference import SensorFrame, align_sensor
from levelhead.bench.survey import survey
from levelhead.bench.timing import Progress
from levelhead.publish.progress import progress

SEARCHED = (
    "gyr_noise", "gyr_noise_per_rate", "bias_walk", "bias_start", "bias_uncalibrated", "scale_start", "acc_noise",
    "acc_bias", "velocity_density", "max_velocity_density", "body_velocity", "body_velocity_time", "mag_noise",
    "mag_place", "place_time", "mag_offset", "offset_walk",
)  # fmt: skip
STEP = 0.6  # 1σ of the logarithm of a step
ENOUGH = 0.2  # a smaller ratio counts as this one: where VQF fails on a sensor, how badly must not choose for others
RIDGE = 0.01
MOST = 6  # recordings of a set on which a step is judged
SEED = 1


class Run(NamedTuple):
    """A recording with or without its magnetometer, and VQF's error on it in degrees."""

    dataset: str
    recording: lh.Recording
    frame: SensorFrame | None
    peer: float

    @property
    def kind(self) -> tuple[str, bool]:
        """Its set, and whether there is a magnetometer."""
        return self.dataset, self.recording.mag is not None


class Fold(NamedTuple):
    """The set that is left out, all files, and how many steps."""

    left_out: str
    paths: tuple[Path, ...]
    steps: int


class Found(NamedTuple):
    """Of a fold: the score at the start and at the end, the choice, and the ratios on the set that was left out."""

    start: float
    end: float
    params: lh.ESKF
    chosen: list[float]
    default: list[float]


def error(recording: lh.Recording, method: Method, frame: SensorFrame | None) -> float:
    """Degrees: after one constant rotation with a magnetometer, drift in 60 s without."""
    quat, _ = method.run(recording)
    figures = measure_errors(recording, np.asarray(quat, dtype=float), False, None, frame)
    value = figures.rotated if recording.mag is not None else figures.drift
    return max(value if value is not None else figures.heading, MIN_ERROR)


def runs_of(paths: Sequence[Path], most: int | None) -> list[Run]:
    """Recordings with and without magnetometers, at most so many files of a set, evenly picked."""
    by_set: dict[str, list[Path]] = {}
    for path in paths:
        by_set.setdefault(group_of(path).dataset, []).append(path)
    runs = []
    for dataset, files in by_set.items():
        count = min(len(files), most or len(files))
        for k in range(count):
            path = files[k * len(files) // count]
            for with_mag in (True, False):
                recording = load_recording(path, with_mag)
                if with_mag and recording.mag is None:
                    continue
                frame = align_sensor(recording)
                runs.append(Run(dataset, recording, frame, error(recording, Method("vqf.VQF"), frame)))
    return runs


def ratios(params: lh.ESKF, runs: Sequence[Run]) -> list[float]:
    """Error/VQF's of each."""
    return [error(run.recording, Method("ESKF", params), run.frame) / run.peer for run in runs]


def score(params: lh.ESKF, runs: Sequence[Run]) -> float:
    """Mean over the sets of the mean logarithm."""
    logs = np.log(np.maximum(ratios(params, runs), ENOUGH))
    kinds = [run.kind for run in runs]
    return float(np.mean([np.mean([x for x, k in zip(logs, kinds, strict=True) if k == kind]) for kind in set(kinds)]))


def start() -> lh.ESKF:
    """Each number the power of ten that is nearest to the default."""
    default = lh.ESKF()
    return default._replace(**{name: 10.0 ** round(math.log10(getattr(default, name))) for name in SEARCHED})


def distance(params: lh.ESKF) -> float:
    """Sum of squared logarithms of the numbers by their start."""
    first = start()
    return sum(math.log(getattr(params, name) / getattr(first, name)) ** 2 for name in SEARCHED)


def search(fold: Fold) -> Found:
    """The choice without a set, and what it does there."""
    others = [path for path in fold.paths if group_of(path).dataset != fold.left_out]
    runs = runs_of(others, MOST)
    random = np.random.default_rng(SEED)
    best = start()
    first = least = lowest = score(best, runs)
    for _ in range(fold.steps):
        names = random.choice(SEARCHED, random.integers(1, 3), replace=False)
        tried = best._replace(**{str(n): getattr(best, str(n)) * math.exp(random.normal(0.0, STEP)) for n in names})
        value = score(tried, runs)
        cost = value + RIDGE * distance(tried)
        if cost < lowest:
            best, least, lowest = tried, value, cost
    left = runs_of([path for path in fold.paths if group_of(path).dataset == fold.left_out], None)
    return Found(first, least, best, ratios(best, left), ratios(lh.ESKF(), left))


def leave_out(paths: Sequence[Path], steps: int, jobs: int, report: Progress | None = None) -> dict[str, Found]:
    """What is found for each set while it is left out, by its name; ``report`` takes the fraction done."""
    folds = [Fold(name, tuple(paths), steps) for name in sorted({group_of(path).dataset for path in paths})]
    found: dict[str, Found] = {}
    for fold, result in run_parallel(search, folds, jobs):
        found[fold.left_out] = result
        if report is not None:
            report(len(found) / len(folds))
    return dict(sorted(found.items()))


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", nargs="+", type=Path)
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    paths = [entry.path for entry in survey(args.places, True)[0]]
    with progress("choosing") as report:
        found = leave_out(paths, args.steps, args.jobs, report)
    print(
        "| left out | runs | others, at the start | others, chosen | **left out, chosen on the others** | the default |"
    )
    print("|---|--:|--:|--:|--:|--:|")
    for name, one in found.items():
        here, default = geometric_mean(one.chosen), geometric_mean(one.default)
        print(
            f"| {name} | {len(one.chosen)} | {math.exp(one.start):.3f} | {math.exp(one.end):.3f} "
            f"| **{here:.3f}** | {default:.3f} |"
        )
    chosen, default = ([x for one in found.values() for x in getattr(one, which)] for which in ("chosen", "default"))
    print(f"| all | {len(chosen)} | | | **{geometric_mean(chosen):.3f}** | {geometric_mean(default):.3f} |")


if __name__ == "__main__":
    run_script(main)
