"""A corpus of one-minute recordings: recordings a second, Dask beside a plain loop, two workers, memory, kill -9.

    python -m benchmarks.speed.corpus --recordings 10000

Writes Parquet files of a simulated IMU at 100 Hz into a temporary folder (a few of them, with hard links for the rest,
so that the disk's speed plays no part) and runs the default filter over them: in a plain loop, on one worker, on two,
and on two that are killed with their client at 30, 60 and 90 %. Rates are taken by the wall clock from the first task
to the last row; starting and ending processes stands apart. Processor time is counted between the first and the last
batch that is done, and does not depend on what else the machine does. Errors against truth are part of the work, as in
``corpus fuse``. How far it is stands on standard error; ``--markdown`` gives the table of
docs/explanation/benchmarks.md. On two idle cores 10000 recordings take 21 minutes, with ``--workers 2`` alone 8.
"""

import os
import pickle
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import psutil
from benchmarks.measure import options, show

import levelhead as lh
from levelhead.bench.timing import Table
from levelhead.corpora.results import list_parts
from levelhead.corpora.runner import Progress

DIFFERENT = 20  # recordings; the others are links to them
SECONDS, RATE = 60.0, 100.0
MB = 1e6
KILLED_AT = (0.3, 0.6, 0.9)
ROWS, TASKS, IDLE = 4000, 1000, 5.0  # and s, by which the costs of the gathering process are measured


def write_recordings(folder: Path, count: int) -> None:
    """So many files, in folders of a thousand."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    first: list[Path] = []
    for i in range(count):
        path = folder / f"{i // 1000:04d}" / f"{i:06d}.parquet"
        path.parent.mkdir(exist_ok=True)
        if i >= DIFFERENT:
            os.link(first[i % DIFFERENT], path)
            continue
        motion = ("walking", "hand", "drone", "robot")[i % 4]
        made = lh.simulate.recording("ICM-20948", motion, duration=SECONDS, rate=RATE, seed=i)
        columns: dict[str, Any] = {"t [s]": made.t}
        for name, unit in (("gyr", "rad/s"), ("acc", "m/s^2"), ("mag", "uT")):
            columns |= {f"{name}_{axis} [{unit}]": getattr(made, name)[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"q{axis}": made.truth.quat[:, k] for k, axis in enumerate("wxyz")}
        pq.write_table(pa.table(columns), path)
        first.append(path)


class Watch(threading.Thread):
    """The largest resident memory of a worker of this process, a number for each second; processor time of all."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.seconds: list[float] = []
        self.processor: dict[int, float] = {}  # of each worker, s
        self._ended = threading.Event()
        self.start()

    def run(self) -> None:
        """Looks once a second."""
        while not self._ended.wait(1.0):
            self.look()

    def look(self) -> float:
        """Looks at the workers now; their processor time so far, s."""
        sizes = []
        for process in psutil.Process().children(recursive=True):
            try:
                if "spawn_main" in "".join(process.cmdline()):
                    sizes.append(process.memory_info().rss / MB)
                    self.processor[process.pid] = sum(process.cpu_times()[:2])
            except psutil.NoSuchProcess:
                continue
        if sizes:
            self.seconds.append(max(sizes))
        return self.total

    @property
    def total(self) -> float:
        """Processor time of all workers when last looked at, s."""
        return sum(self.processor.values())

    def quarters(self) -> tuple[float, float]:
        """Most of the second and of the last quarter of the run, MB: the first one grows with imports."""
        self._ended.set()
        self.join()
        quarter = max(1, len(self.seconds) // 4)
        return max(self.seconds[quarter : 2 * quarter], default=0.0), max(self.seconds[-quarter:], default=0.0)


class Lines:
    """Progress: a line on standard error every ten seconds."""

    def __init__(self) -> None:
        self._last = 0.0

    def __call__(self, words: str) -> None:
        """Prints the words unless others have just been printed."""
        now = time.monotonic()
        if now - self._last > 10.0:
            self._last = now
            print(words, file=sys.stderr, flush=True)


def run(folder: Path, workers: int) -> dict[str, Any]:
    """One line of the table."""
    last, seen = Progress(), list[tuple[int, float, float]]()
    watch = Watch()

    bar, name = Lines(), f"{workers} workers"

    def keep(state: Progress) -> None:
        last.__dict__.update(state.__dict__)
        bar(f"{name}: {state.done:,} of {state.recordings:,}, {state.rate:.3g} recordings/s")
        if (state.done and not seen) or state.done == state.recordings:  # processes have imported what they need
            seen.append((state.done, time.process_time(), watch.look()))

    began = time.perf_counter()
    table = lh.corpus(folder, workers=workers, progress=keep)
    wall = time.perf_counter() - began
    done, own, theirs = (after - before for before, after in zip(*seen, strict=True))
    early, late = watch.quarters()
    rows = table.select(["read_s", "run_s", "error"]).to_pylist()
    assert all(row["error"] is None for row in rows)
    reading, fusing = sum(row["read_s"] for row in rows), sum(row["run_s"] for row in rows)
    busy = last.seconds * max(workers, 1)
    return {
        "case": f"{workers} workers of Dask" if workers else "plain loop", "recordings": last.done,
        "rate": last.rate, "core": done / (own + theirs), "client": 1e3 * own / done,
        "workers": 1e3 * theirs / done, "reading": 100.0 * reading / busy,
        "fusing": 100.0 * fusing / busy, "around": wall - last.seconds, "early": early, "late": late,
    }  # fmt: skip


def killed(folder: Path, out: Path, count: int) -> dict[str, Any]:
    """Client and workers killed at some shares of the run, which then goes on to its end."""
    import pyarrow.parquet as pq

    command = [sys.executable, "-m", "levelhead", "corpus", "fuse", str(folder), "-o", str(out), "--workers", "2",
               "--no-plot"]  # fmt: skip
    lost = list[int]()
    bar = Lines()
    for share in KILLED_AT:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while process.poll() is None and (rows := rows_in(out)) < share * count:
            bar(f"to be killed at {share:.0%}: {rows:,} of {count:,} rows")
            time.sleep(0.2)
        assert process.poll() is None, "it was over before it was killed"
        family = [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]
        for one in family:
            one.kill()
        psutil.wait_procs(family)
        lost.append(rows_in(out))
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    names = [name for path in list_parts(out) for name in pq.read_table(path, columns=["recording"])[0].to_pylist()]
    return {"rows": len(names), "missing": count - len(set(names)), "twice": len(names) - len(set(names)),
            "kept": ", ".join(f"{rows:,}" for rows in lost)}  # fmt: skip


def rows_in(out: Path) -> int:
    """Rows that have been written."""
    import pyarrow.parquet as pq

    return sum(pq.read_metadata(path).num_rows for path in list_parts(out))


def nothing() -> list[dict[str, Any]]:
    """A task without work."""
    return [{}]


def costs(folder: Path, out: Path) -> dict[str, Any]:
    """What the process that hands out and gathers does: for a task without work, and for a row of results."""
    from levelhead.corpora.cluster import open_pool
    from levelhead.corpora.job import FUSE, Batch, Job, choose_methods
    from levelhead.corpora.places import list_sources
    from levelhead.corpora.results import Results
    from levelhead.corpora.work import run_batch

    job = Job(FUSE, choose_methods(FUSE, ()))
    (row,) = run_batch(job, Batch(tuple(list_sources([folder])[:1])), {}, "")
    rows = [row | {"recording": f"{i:06d}"} for i in range(ROWS)]
    results = Results(out, job)
    began = time.process_time()
    results.add(rows)
    results.flush()
    written = time.process_time() - began
    results.add(rows)
    results.flush()
    began = time.process_time()
    results.finish([], lambda url: False)
    finished = time.process_time() - began
    with open_pool(1, None, None) as pool:
        pool.submit(nothing)
        pool.wait()
        began = time.process_time()
        for _ in range(TASKS):
            pool.submit(nothing)
            pool.wait()
        handed = time.process_time() - began
        began = time.process_time()
        time.sleep(IDLE)
        idle = (time.process_time() - began) / IDLE
    return {"idle": 1e3 * idle, "task": 1e3 * handed / TASKS,
            "bytes": float(len(pickle.dumps(row))), "write": 1e6 * written / ROWS,
            "finish": 1e6 * finished / (2 * ROWS)}  # fmt: skip


def markdown(rows: list[dict[str, Any]], kill: dict[str, Any] | None) -> str:
    """The table of the docs, and a line on the killed processes."""
    lines = [
        "| | recordings/s | CPU ms a recording: worker | scheduler and client | reading, % of the time | filter, % "
        "| memory of a worker, 2nd and 4th quarter |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for row in rows:
        plain = row["case"] == "plain loop"
        own, theirs = (row["workers"], row["client"]) if plain else (row["client"], row["workers"])
        memory = "" if plain else f"{row['early']:.0f}, {row['late']:.0f} MB"
        lines.append(
            f"| {row['case']} | {row['rate']:.1f} | {theirs:.1f} | {'–' if plain else f'{own:.1f}'} "
            f"| {row['reading']:.0f} | {row['fusing']:.0f} "
            f"| {memory} |"
        )
    loop = [row["client"] for row in rows if row["case"] == "plain loop"]
    one = [row["rate"] for row in rows if row["case"].startswith("1 ")]
    for row in rows:
        if loop and row["case"] != "plain loop":
            more = 100.0 * ((row["workers"] + row["client"]) / loop[0] - 1.0)
            lines.append(f"\n{row['case']}: {more:+.1f} % of processor time beside the loop.")
        if one and row["case"].startswith("2 "):
            lines.append(f"\n2 workers did {row['rate'] / one[0]:.2f} times what one did.")
    if kill:
        lines.append(
            f"\nKilled at 30, 60 and 90 % ({kill['kept']} rows then): {kill['rows']:,} rows, "
            f"{kill['missing']} missing, {kill['twice']} twice."
        )
    return "\n".join(lines)


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("--recordings", type=int, default=1000, help="how many (default 1000)")
    parser.add_argument("--workers", type=int, nargs="+", default=[0, 1, 2], help="0: a plain loop (default 0 1 2)")
    parser.add_argument("--without-kill", action="store_true", help="leave the killed runs out")
    parser.add_argument("--markdown", action="store_true", help="the table of docs/explanation/benchmarks.md")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name, "recordings")
        folder.mkdir()
        write_recordings(folder, given.recordings)
        rows, kill = list[dict[str, Any]](), None
        for _ in range(given.repeats):
            for workers in given.workers:
                rows.append(run(folder, workers))
                print(rows[-1], file=sys.stderr, flush=True)
        tables = [
            Table(
                "Default filter over one-minute recordings, Parquet, 100 Hz",
                {
                    "case": "case", "recordings": "recordings", "rate": "1/s", "core": "1/s of CPU",
                    "client": "this process: CPU ms a recording", "workers": "workers: CPU ms a recording",
                    "reading": "reading %", "fusing": "filter %", "around": "start, end s",
                    "early": "MB, 2nd quarter", "late": "4th",
                },
                rows,
            )
        ]  # fmt: skip
        if not given.without_kill:
            columns = {"rows": "rows", "missing": "missing", "twice": "twice", "kept": "rows after each kill"}
            kill = killed(folder, Path(name, "out"), given.recordings)
            tables.append(Table("Killed at 30, 60 and 90 %", columns, [kill]))
        columns = {"idle": "ms a second without work",
                   "task": "ms a task, scheduler and client", "bytes": "bytes a row on the wire",
                   "write": "µs a row to write", "finish": "µs a row at the end"}  # fmt: skip
        tables.append(Table("CPU of the process that gathers", columns, [costs(folder, Path(name, "costs"))]))
        if given.markdown:
            print(markdown(rows, kill), flush=True)
        show(tables, given.json)


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as in Dask's workers
    main()
