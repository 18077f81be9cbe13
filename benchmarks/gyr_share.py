"""Whether the gyroscope's noise in proportion to its rate can be found from innovations: ``ESKF``'s ``gyr_share``.

    python benchmarks/gyr_share.py DIR

Each recording with a reference in DIR is fused with every share of a grid. Of these, one is chosen by the likelihood of
the innovations over five seconds (``levelhead.tune.innovations``), with all of the recording known, so that no rule in
a filter could choose better by them; and one by the reference, which is the most that any rule could gain. The
figures are errors by VQF's, geometric means.
"""

import statistics
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

import levelhead as lh
from levelhead.bench.accuracy import accuracy
from levelhead.bench.datasets import load_recording
from levelhead.bench.error_figures import measure_errors
from levelhead.bench.methods import find_method
from levelhead.bench.ratios import LEAST, compared_error, geometric_mean
from levelhead.bench.reference import align_sensor
from levelhead.bench.survey import Entry
from levelhead.bench.timing import Progress, Table
from levelhead.open_types import Fields
from levelhead.publish.progress import progress
from levelhead.tune.innovations import innovations_of
from measure import options, part_of, run_script, run_tasks, show

DEFAULT = lh.ESKF().gyr_share
SHARES = tuple(DEFAULT * factor for factor in (0.25, 0.5, 1.0, 2.0, 4.0, 8.0))
PEER = "vqf.VQF"
COLUMNS = {
    "case": "set",
    "recordings": "recordings",
    "default": f"{DEFAULT:g} √s",
    "likelihood": "by likelihood",
    "reference": "by reference",
    "tilt default": f"tilt: {DEFAULT:g} √s",
    "tilt likelihood": "tilt: by likelihood",
    "tilt reference": "tilt: by reference",
    "chosen": "median share by likelihood √s",
    "best": "by reference √s",
}


class Trial(NamedTuple):
    """A recording with one share: the error that is compared and its tilt in degrees, and the innovations' scale."""

    share: float
    error: float
    tilt: float
    scale: float


class Task(NamedTuple):
    """A recording, and whether its magnetometer is used."""

    entry: Entry
    with_mag: bool


def trials(task: Task) -> list[Trial]:
    """One of each share; none where heading's drift cannot be measured."""
    recording = load_recording(task.entry.path, task.with_mag)
    innovations = innovations_of(recording, np.ones(len(recording), dtype=bool))
    frame, found = align_sensor(recording), []
    for share in SHARES:
        track = lh.fuse(recording, lh.ESKF(gyr_share=share))
        figures = measure_errors(recording, track.quat, task.entry.north, frame=frame)
        error = compared_error(task.entry, figures, task.with_mag)
        if error is None:
            return []
        found.append(Trial(share, max(error, LEAST), max(figures.rotated_tilt, LEAST), innovations.scales(track)[0]))
    return found


class Choice(NamedTuple):
    """What was chosen on a recording, with the peer's error and tilt in degrees."""

    dataset: str
    default: Trial
    likely: Trial
    best: Trial
    level: Trial  # the best by its tilt
    error: float
    tilt: float


def choose(dataset: str, found: Sequence[Trial], error: float, tilt: float) -> Choice:
    """The default, the most likely one and the best of these."""
    return Choice(
        dataset,
        next(one for one in found if one.share == DEFAULT),
        min(found, key=lambda one: one.scale),
        min(found, key=lambda one: one.error),
        min(found, key=lambda one: one.tilt),
        max(error, LEAST),
        max(tilt, LEAST),
    )


def table(with_mag: bool, choices: Sequence[Choice]) -> Table:
    """A row of each set, and one of all."""
    sets = list(dict.fromkeys(one.dataset for one in choices))
    rows = [_row(name, [one for one in choices if one.dataset == name]) for name in sets]
    return Table(
        f"gyr_share {'with' if with_mag else 'without'} magnetometer",
        COLUMNS,
        [*rows, _row("all", choices)],
        f"{'Total error' if with_mag else 'Drift of heading'}, and tilt, by VQF's; shares from {SHARES[0]:g} to "
        f"{SHARES[-1]:g} √s.",
    )


def _row(name: str, some: Sequence[Choice]) -> Fields:
    return {
        "case": name,
        "recordings": len(some),
        "default": geometric_mean([one.default.error / one.error for one in some]),
        "likelihood": geometric_mean([one.likely.error / one.error for one in some]),
        "reference": geometric_mean([one.best.error / one.error for one in some]),
        "tilt default": geometric_mean([one.default.tilt / one.tilt for one in some]),
        "tilt likelihood": geometric_mean([one.likely.tilt / one.tilt for one in some]),
        "tilt reference": geometric_mean([one.level.tilt / one.tilt for one in some]),
        "chosen": statistics.median(one.likely.share for one in some),
        "best": statistics.median(one.best.share for one in some),
    }


def tables(places: Sequence[Path], jobs: int, report: Progress) -> Iterator[Table]:
    """With magnetometers, and without."""
    for half, with_mag in enumerate((True, False)):
        result = accuracy(places, [find_method(PEER)], with_mag=with_mag, jobs=jobs, progress=lambda done: None)
        tasks = [Task(entry, with_mag) for entry in result.entries]
        found = run_tasks(trials, tasks, jobs, part_of(report, 0.5 * half, 0.5))
        choices = []
        for i, task in enumerate(tasks):
            peer, some = result.outcomes[i, 0].figures, found[task]
            if peer is not None and some:
                error = compared_error(task.entry, peer, with_mag)
                choices.append(choose(task.entry.group.dataset, some, error or LEAST, peer.rotated_tilt))
        yield table(with_mag, choices)


def main() -> None:
    """Both tables."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("places", nargs="+", type=Path, help="folders with recordings that have a reference")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    given = parser.parse_args()
    with progress("shares") as report:
        found = list(tables(given.places, given.jobs, report))
    show(found, given.json)


if __name__ == "__main__":
    run_script(main)
