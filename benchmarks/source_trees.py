"""Two source trees beside each other: what a sample costs in an earlier state of levelhead, and today.

``python benchmarks/source_trees.py EARLIER`` with the folder of another checkout (``git worktree add EARLIER COMMIT``).
Each measurement is a process of its own, so that the imports of one tree never meet the other's; the trees take turns.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

from levelhead.bench.timing import Table
from measure import options, show

FILTERS = ("GyroIntegration", "Mahony", "Madgwick", "EKF", "ESKF")
ROWS = 20_000
WORKER = """
import json, sys, time
import numpy as np
import levelhead as lh
name, engine, rows = sys.argv[1], sys.argv[2], int(sys.argv[3])
t = np.arange(rows) / 100.0
random = np.random.default_rng(0)
wave = np.sin(2.0 * np.pi * np.outer(t, [0.3, 0.4, 0.5]))
gyr = wave + random.normal(0.0, 0.01, (rows, 3))
acc = [0.0, 0.0, 9.81] + wave + random.normal(0.0, 0.05, (rows, 3))
mag = [0.0, 20.0, -40.0] + random.normal(0.0, 0.5, (rows, 3))
recording, params = lh.Recording(t, gyr, acc, mag), getattr(lh, name)()
best = float("inf")
for _ in range(60):
    began = time.process_time()
    lh.fuse(recording, params, engine=engine)
    best = min(best, time.process_time() - began)
live = lh.Stream(params, engine=engine)
rows_ = list(zip(*(map(tuple, v[:5000].tolist()) for v in (gyr, acc, mag))))
streamed = float("inf")
for _ in range(12):
    began = time.process_time()
    for g, a, m in rows_:
        live.update(g, a, m, dt=0.01)
    streamed = min(streamed, time.process_time() - began)
print(json.dumps([1e9 * best / rows, 1e9 * streamed / len(rows_)]))
"""


def measure(tree: Path, name: str, engine: str) -> tuple[float, float]:
    """Nanoseconds of a sample, in a batch and live.

    Raises:
        SystemExit: that tree cannot do it.
    """
    command = [sys.executable, "-c", WORKER, name, engine, str(ROWS)]
    environment = os.environ | {"PYTHONPATH": str(tree / "src")}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    if done.returncode != 0:
        raise SystemExit(f"{tree}, {name}, {engine}:\n{done.stderr[-1500:]}")
    batch, live = json.loads(done.stdout.splitlines()[-1])
    return batch, live


def main() -> None:
    """A row for each filter: the earlier tree's compiled engine, today's, and today's native engine."""
    parser = options(__doc__, repeats=3)
    parser.add_argument("earlier", type=Path, help="a checkout of an earlier commit")
    given = parser.parse_args()
    here = Path(__file__).resolve().parents[1]
    cases = {"earlier": (given.earlier, "compiled"), "numba": (here, "compiled"), "native": (here, "native")}
    rows: list[dict[str, str | float | None]] = []
    for name in FILTERS:
        least = dict.fromkeys(cases, (float("inf"), float("inf")))
        for _ in range(given.repeats):
            for case, (tree, engine) in cases.items():
                batch, live = measure(tree, name, engine)
                least[case] = min(least[case][0], batch), min(least[case][1], live)
        row: dict[str, str | float | None] = {"filter": name}
        for k, kind in enumerate(("batch", "live")):
            for case in cases:
                row[f"{kind}_{case}"] = least[case][k]
                if case != "earlier":
                    row[f"{kind}_{case}_ratio"] = least[case][k] / least["earlier"][k]
        rows.append(row)
    columns = {"filter": "filter"}
    for kind in ("batch", "live"):
        columns |= {f"{kind}_earlier": f"{kind}, earlier, ns", f"{kind}_numba": "Numba today, ns"}
        columns |= {
            f"{kind}_numba_ratio": "ratio",
            f"{kind}_native": "native today, ns",
            f"{kind}_native_ratio": "ratio",
        }
    show([Table("A sample, by source tree", columns, rows, "")], given.json)


if __name__ == "__main__":
    main()
