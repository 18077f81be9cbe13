"""The cost of a whole ``tune_filter``, three folds included, for a small filter and for the large ones.

    python benchmarks/tune_cost.py $LEVELHEAD_DATA/broad/07_undisturbed_fast_rotation_B.mat

The first ``--seconds`` of a recording with truth. Processor seconds count the work of all cores.
"""

import time
from pathlib import Path

import levelhead as lh
from levelhead.bench.timing import Table
from measure import options, run_script, show

SEARCHES = (("Mahony", ()), ("EKF", ()), ("ESKF", ()))


def main() -> None:
    """The table."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--seconds", type=float, default=120.0)
    given = parser.parse_args()
    recording = lh.read(given.recording)
    recording = recording[: round(given.seconds * recording.rate)]
    rows = []
    for name, names in SEARCHES:
        wall, busy = time.perf_counter(), time.process_time()
        found = lh.tune_filter(recording, name, names, goal="truth")
        rows.append(
            {
                "filter": name, "parameters": len(found.space.ranges), "runs of a search": found.runs,
                "processor s": time.process_time() - busy, "s": time.perf_counter() - wall,
            }
        )  # fmt: skip
        print(rows[-1], flush=True)
    show([Table("Cost of tune_filter", {key: key for key in rows[0]}, rows, f"{len(recording)} samples.")], given.json)


if __name__ == "__main__":
    run_script(main)
