"""From a log to C: the error of each step of the page on tuning, docs/explanation/tuning-accuracy.md.

    python -m benchmarks.accuracy.tune_walk $LEVELHEAD_DATA/broad

A small filter is tuned on ``LOGS`` to the smoother; ``OTHERS`` are of the same sensor and were not used. Errors are
those of `levelhead fuse` against the truth, with the best constant heading removed. "The same as C" is the exported C
in single precision, compiled here.
"""

from pathlib import Path
from typing import Any

from benchmarks.accuracy.single import fused
from benchmarks.measure import options, run_script, show

import levelhead as lh
from levelhead.bench.timing import Table
from levelhead.evaluate import evaluate
from levelhead.export import ExportConfig
from levelhead.publish.plots.tuning_panels import tuning_picture

LOGS = ("07_undisturbed_fast_rotation_B", "16_undisturbed_fast_translation_B", "21_undisturbed_fast_combined")
OTHERS = ("09_undisturbed_fast_rotation_with_breaks_B", "24_disturbed_tapping_A")


def main() -> None:
    """The table."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("folder", type=Path, help="BROAD's recordings")
    parser.add_argument("--filter", default="Mahony")
    parser.add_argument("--picture", type=Path, help="draw the search")
    given = parser.parse_args()
    recordings = {name: lh.read(given.folder / f"{name}.mat") for name in (*LOGS, *OTHERS)}
    logs = [recordings[name] for name in LOGS]
    found = lh.tune_filter(logs, given.filter, goal="smoother")
    known = lh.tune_filter(logs, given.filter, goal="truth", cross_validate=False)
    if given.picture is not None:
        tuning_picture(found, given.picture)
    before, after = found.space.params, found.params
    steps = {
        f"{given.filter} as it comes": lambda one: lh.fuse(one, before),
        "the smoother, which is the reference": lh.smooth,
        f"{given.filter} tuned to the smoother": lambda one: lh.fuse(one, after),
        "the same as C, in float": lambda one: fused(ExportConfig(after, real="float"), one),
        "for comparison: tuned to the truth": lambda one: lh.fuse(one, known.best),
    }
    rows = []
    for label, run in steps.items():
        row: dict[str, Any] = {"step": label}
        for name, recording in recordings.items():
            row[name] = round(evaluate(recording, run(recording)).total_aligned, 3)
        rows.append(row)
    columns = {"step": "step"} | {name: f"{name.split('_')[0]}{'' if name in LOGS else ', not used'}"
                                  for name in recordings}  # fmt: skip
    show([Table("Total error, ° RMS", columns, rows, "; ".join(found.verdict()))], given.json)


if __name__ == "__main__":
    run_script(main)
