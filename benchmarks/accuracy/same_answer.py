"""How far one recording's answers lie apart where nothing but rounding differs: a decision on a tie shows here.

Every filter runs over every recording in the folders, and again with stamps × (1 ± 1e-9), with stamps + 10⁶ s, with
rates × (1 + 1e-15), and as exported C in single precision. The table gives, for each filter, the largest angle between
the answers and the recordings beyond ``ALIKE``. Each of those is listed with the second at which the answers part, the
largest angle in units of the filter's own σ, and the reason (``REASONS``). Exit code 1: one has no known reason.
"""

from functools import cache, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from benchmarks.measure import options, run_script, run_tasks, show
from benchmarks.speed.exported import attitude_run
from tests.reference.c_library import doubles
from tests.reference.same_answer import ALIKE, Apart, change_answers, compare_answers

import levelhead as lh
from levelhead import filters
from levelhead.bench.datasets import list_logs, load_recording
from levelhead.bench.groups import group_of
from levelhead.bench.timing import Table
from levelhead.export import ExportConfig

FLOAT = "float"
COLUMNS = {
    "filter": "filter",
    "recordings": "recordings",
    "slower": "t × (1 + 1e-9) [°]",
    "faster": "t × (1 − 1e-9) [°]",
    "later": "t + 10⁶ s [°]",
    "rates": "rates × (1 + 1e-15) [°]",
    "float": "float [°]",
    "beyond": "recordings beyond 0.1°",
}
PARTED = {
    "recording": "recording",
    "filter": "filter",
    "change": "change",
    "angle": "largest angle [°]",
    "second": "beyond 0.1° from [s]",
    "sigmas": "largest angle / σ",
    "reason": "reason",
}
DRIFT = "heading has no reference there; what float rounds adds up"
LENGTH = "the guard rejects the field one sample sooner in float (guard/field.py)"
WIDTH = "a prior becomes wider, one block later or 0.6 % less in float (eq. 25, adaptation.widen_prior)"
REASONS = {  # recording, filter, change: no decision on a tie is among them
    ("BROAD/34_disturbed_attached_magnet_3cm", "Mahony", FLOAT): LENGTH,
    ("euroc/V1_01_easy", "EKF", FLOAT): DRIFT,
    ("euroc/V1_02_medium", "BiasRateKalman", FLOAT): DRIFT,
    ("tyrex/Guillaume_Nexus5_Dist_Swinging", "RollPitchKalman", FLOAT): DRIFT,
    ("tyrex/Guillaume_iPhone5_NoDist_AR", "ESKF", FLOAT): WIDTH,
    ("tyrex/Guillaume_iPhone5_NoDist_RunningHand", "ESKF", FLOAT): WIDTH,
}


@lru_cache(maxsize=1)
def _load(path: Path) -> lh.Recording:
    return load_recording(path, with_mag=True)


@cache
def _build_single(name: str) -> Any:
    """The exported C of a filter in single precision, built once in a process."""
    return attitude_run(ExportConfig(filters.find(name).params(), real=FLOAT))


def fuse_single(recording: lh.Recording, name: str) -> lh.Track:
    """A recording through that filter's C, which takes and gives doubles here and computes in floats."""
    inputs = [np.ascontiguousarray(array) for array in (recording.t, recording.gyr, recording.acc)]
    field = None if recording.mag is None else np.ascontiguousarray(recording.mag)
    quat, bias = np.empty((len(recording), 4)), np.empty((len(recording), 3))
    run = _build_single(name)
    run(None, len(quat), *map(doubles, inputs), None if field is None else doubles(field), doubles(quat), doubles(bias))
    return lh.Track(recording.t, quat)


class Task(NamedTuple):
    """One filter on one recording."""

    path: Path
    filter: str
    with_float: bool


def run(task: Task) -> dict[str, Apart]:
    """The task's answers."""
    recording, params = _load(task.path), filters.find(task.filter).params()
    apart = change_answers(recording, params)
    if task.with_float:
        apart[FLOAT] = compare_answers(lh.fuse(recording, params), fuse_single(recording, task.filter))
    return apart


def summarize(found: dict[Task, dict[str, Apart]]) -> Table:
    """The largest angles of each filter."""
    rows: dict[str, dict[str, Any]] = {}
    for task, apart in found.items():
        row = rows.setdefault(task.filter, {"filter": task.filter, "recordings": 0, "beyond": 0})
        row["recordings"] += 1
        row["beyond"] += any(one.angle > ALIKE for one in apart.values())
        for name, one in apart.items():
            row[name] = max(row.get(name, 0.0), round(one.angle, 4))
    return Table("Largest angle between two answers", COLUMNS, list(rows.values()))


def list_parted(found: dict[Task, dict[str, Apart]]) -> Table:
    """Every pair of answers beyond ``ALIKE``."""
    rows = []
    for task, apart in sorted(found.items()):
        recording = f"{group_of(task.path).dataset}/{task.path.stem}"
        for name, one in apart.items():
            if one.angle > ALIKE:
                rows.append(
                    {
                        "recording": recording,
                        "filter": task.filter,
                        "change": name,
                        "angle": round(one.angle, 3),
                        "second": round(one.second, 2),
                        "sigmas": round(one.sigmas, 3),
                        "reason": REASONS.get((recording, task.filter, name), "UNKNOWN"),
                    }
                )
    return Table("Answers that part", PARTED, rows)


def main() -> None:
    """All filters over the recordings in the folders given."""
    parser = options(__doc__)
    parser.add_argument("places", nargs="+", type=Path, metavar="DIR", help="folders with recordings")
    parser.add_argument("--filter", action="append", dest="names", help="this filter only (may be repeated)")
    parser.add_argument("--without-float", action="store_true", help="leave exported C in single precision out")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    given = parser.parse_args()
    names = given.names or [flt.name for flt in filters.ALL]
    tasks = [Task(path, name, not given.without_float) for path in list_logs(given.places) for name in names]
    found = run_tasks(run, tasks, given.jobs, lambda share: None)
    parted = list_parted(found)
    show([summarize(found), parted], given.json)
    if any(row["reason"] == "UNKNOWN" for row in parted.rows):
        raise SystemExit(1)


if __name__ == "__main__":
    run_script(main)
