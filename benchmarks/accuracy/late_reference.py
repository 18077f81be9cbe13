"""BROAD with its reference as late as it is, and brought to the gyroscope's time."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from benchmarks.accuracy.latency import lateness
from benchmarks.measure import run_tasks

from levelhead.bench.datasets import load_recording
from levelhead.bench.error_figures import measure_errors
from levelhead.bench.groups import BROAD
from levelhead.bench.methods import DEFAULT, SMOOTHER, find_method
from levelhead.bench.survey import survey
from levelhead.bench.timing import Progress, Table
from levelhead.recording import Recording
from levelhead.rotations import from_rotvec, product

METHODS = {"ours": DEFAULT, "vqf": "vqf.VQF", "smoother": SMOOTHER, "offline": "vqf.offlineVQF"}
COLUMNS = {"case": "recording", "lag": "reference's lag ms"} | {
    f"{key}_{part}{when}": f"{name} {part}{', without it' if when else ''} °"
    for key, name in METHODS.items()
    for part in ("total", "tilt")
    for when in ("", "_then")
    if key == "smoother" or part == "total"
}


class Late(NamedTuple):
    """A recording's lag in ms, and errors in ° by column."""

    lag: float
    errors: dict[str, float]


def in_time(recording: Recording, lag: float) -> Recording:
    """The recording with its reference turned on by the gyroscope's rate over ``lag`` s."""
    assert recording.truth is not None
    turn = from_rotvec(np.nan_to_num(recording.gyr) * lag)
    return replace(recording, truth=replace(recording.truth, quat=product(recording.truth.quat, turn)))


def late_of(path: Path) -> Late:
    """Of one recording with magnetometer."""
    recording = load_recording(path, True)
    lag = lateness(recording)
    errors = {}
    for key, name in METHODS.items():
        quat = find_method(name).run(recording)[0]
        for when, one in (("", recording), ("_then", in_time(recording, lag))):
            figures = measure_errors(one, quat, False)
            errors |= {f"{key}_total{when}": figures.aligned, f"{key}_tilt{when}": figures.tilt}
    return Late(-1e3 * lag, errors)


def lag_tables(places: Sequence[Path], jobs: int, report: Progress) -> Iterator[Table]:
    """What of BROAD's errors is the time between reference and gyroscope?"""
    entries = [entry for entry in survey(places, True)[0] if entry.group.dataset == BROAD]
    found = run_tasks(late_of, [entry.path for entry in entries], jobs, report)
    rows: list[dict[str, float | str]] = [
        {"case": entry.name, "lag": found[entry.path].lag} | found[entry.path].errors for entry in entries
    ]
    if rows:
        means = {key: float(np.mean([row[key] for row in rows])) for key in list(COLUMNS)[1:]}
        rows.append({"case": "mean", **means})
    yield Table(
        "BROAD without the lag of its reference",
        COLUMNS,
        rows,
        "The lag is that by which the gyroscope's rate explains the error of a smoother without magnetometer. Errors "
        "are without the best constant heading.",
    )
