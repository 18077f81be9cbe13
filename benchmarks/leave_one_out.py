"""How the ESKF's defaults do on data that they were not chosen on: one whole data set is left out at a time.

    python benchmarks/leave_one_out.py shared/data --candidates 24

A pool of parameter sets is drawn at random about the defaults (each parameter of ``SEARCHED`` times exp of a normal
number, 1σ 0.5; the defaults are the first of the pool). Each runs over all recordings, with and without their
magnetometers. For every data set in turn the candidate is chosen that has the smallest geometric mean of error/VQF's
over the *other* sets, each set counting alike, and its ratio on the set that was left out is printed.
"""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

import levelhead as lh
from levelhead.bench.datasets import load
from levelhead.bench.error_figures import measure
from levelhead.bench.groups import group_of
from levelhead.bench.methods import Method
from levelhead.bench.processes import run_parallel
from levelhead.bench.ratios import LEAST, geometric_mean
from levelhead.bench.reference import align_sensor
from levelhead.bench.survey import survey

SEARCHED = (
    "gyr_noise", "gyr_share", "bias_walk", "bias_start", "scale_start", "acc_noise", "acc_bias", "speed", "speed_max",
    "travel", "travel_time", "mag_noise", "mag_place", "place_time", "mag_gate", "field_gate", "mag_offset",
)  # fmt: skip
SPREAD = 0.5
SEED = 1


class Task(NamedTuple):
    """All candidates on one recording."""

    path: Path
    with_mag: bool
    candidates: tuple[lh.ESKF, ...]


def error(recording: lh.Recording, method: Method, frame: object) -> float:
    """Degrees: rotated with a magnetometer, drift without."""
    quat, _ = method.run(recording)
    figures = measure(recording, np.asarray(quat, dtype=float), False, None, frame)  # type: ignore[arg-type]
    value = figures.rotated if recording.mag is not None else figures.drift
    return max(value if value is not None else figures.heading, LEAST)


def run(task: Task) -> list[float]:
    """The ratio of every candidate's error to VQF's."""
    recording = load(task.path, task.with_mag)
    frame = align_sensor(recording)
    peer = error(recording, Method("vqf.VQF"), frame)
    return [error(recording, Method("ESKF", params), frame) / peer for params in task.candidates]


def pool(count: int) -> tuple[lh.ESKF, ...]:
    """The defaults, and others about them."""
    random = np.random.default_rng(SEED)
    default = lh.ESKF()
    return (default,) + tuple(
        default._replace(**{name: getattr(default, name) * math.exp(random.normal(0.0, SPREAD)) for name in SEARCHED})
        for _ in range(count - 1)
    )


def table(groups: Sequence[tuple[str, bool]], ratios: np.ndarray) -> list[str]:
    """A row per data set: candidate chosen on the others, its ratio there and here, and the default's here."""
    logs = np.log(ratios)
    sets = sorted({name for name, _ in groups})
    kinds = sorted(set(groups))
    mean = {kind: logs[[i for i, group in enumerate(groups) if group == kind]].mean(axis=0) for kind in kinds}
    lines = ["| left out | runs | chosen | on the others | on it | the default on it |", "|---|--:|--:|--:|--:|--:|"]
    left = []
    for name in sets:
        others = np.mean([mean[kind] for kind in kinds if kind[0] != name], axis=0)
        best = int(np.argmin(others))
        rows = [i for i, group in enumerate(groups) if group[0] == name]
        left += list(ratios[rows, best])
        here, default = (geometric_mean(list(ratios[rows, column])) for column in (best, 0))
        lines.append(f"| {name} | {len(rows)} | {best} | {math.exp(others[best]):.3f} | {here:.3f} | {default:.3f} |")
    whole = geometric_mean(list(ratios[:, 0]))
    return [*lines, f"| all | {len(groups)} | | | {geometric_mean(left):.3f} | {whole:.3f} |"]


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", nargs="+", type=Path)
    parser.add_argument("--candidates", type=int, default=24)
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    candidates = pool(args.candidates)
    entries, _ = survey(args.places, True)
    tasks = [Task(entry.path, True, candidates) for entry in entries if entry.magnetometer]
    tasks += [Task(entry.path, False, candidates) for entry in entries]
    found = dict(run_parallel(run, tasks, args.jobs))
    kinds = [(group_of(task.path).dataset, task.with_mag) for task in tasks]
    print("\n".join(table(kinds, np.array([found[task] for task in tasks]))))


if __name__ == "__main__":
    main()
