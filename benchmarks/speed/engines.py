"""When is compiled work done sooner than plain Python? The figures behind SAMPLES_COLD and SAMPLES_WARM.

Per filter: CPU time per sample on both engines, in turn; wall time that the first compiled call of a process adds
(Numba's start and reading the filter's machine code from the cache, which a run before has filled), the same once
another filter has been through Numba in that process, and the numbers of samples from which compiled is faster.
"""

import statistics
import sys

from benchmarks.measure import once, options, show

from levelhead.bench.inputs import imu_arrays
from levelhead.bench.timing import Case, Table, time_interleaved

PLAIN = 2_000  # samples of a repeat in plain Python
COMPILED = 200_000
START = """
import sys, time
import levelhead as lh
from levelhead import engine
recording = lh.Recording([0.0, 0.01], [[0.0, 0.1, 0.0]] * 2, [[0.0, 0.0, 9.81]] * 2)
lh.fuse(recording, sys.argv[1], engine="python")
for name in sys.argv[1:]:
    began = time.perf_counter()
    lh.fuse(recording, name, engine="compiled")
    print(time.perf_counter() - began)
"""


def starts(names: list[str], repeats: int) -> dict[str, tuple[float, float]]:
    """Filter -> median seconds of its first compiled call in a process: as the first of all, and after another one."""

    def run(first: str, second: str) -> list[float]:
        _, done = once([sys.executable, "-c", START, first, second])
        return [float(line) for line in done.stdout.split()]

    for name in names:
        run(name, name)  # fills the cache
    found = {}
    for i, name in enumerate(names):
        after = names[(i + 1) % len(names)]
        cold = [run(name, after)[0] for _ in range(repeats)]
        warm = [run(after, name)[1] for _ in range(repeats)]
        found[name] = statistics.median(cold), statistics.median(warm)
    return found


def main() -> None:
    """Run all of it."""
    given = options(__doc__, repeats=5).parse_args()
    import levelhead as lh
    from levelhead import filters
    from levelhead.engine.binding import SAMPLES_COLD, SAMPLES_WARM

    names = [flt.name for flt in filters.ALL]
    first = starts(names, given.repeats)
    long = lh.Recording(*imu_arrays(COMPILED))
    short = long[:PLAIN]
    cases = []
    for name in names:
        cases.append(Case(f"{name}, python", lambda name=name: lh.fuse(short, name, engine="python"), PLAIN))
        cases.append(Case(f"{name}, compiled", lambda name=name: lh.fuse(long, name, engine="compiled"), COMPILED))
    timings = time_interleaved(cases, given.repeats)
    rows = []
    for name, plain, fast in zip(names, timings[::2], timings[1::2], strict=True):
        saved = (plain.median - fast.median) * 1e-9
        start, another = first[name]
        rows.append({
            "filter": name, "python_us": plain.median / 1e3, "compiled_ns": fast.median, "ratio": plain.over(fast),
            "start_s": start, "another_s": another,
            "worth_starting": round(start / saved), "worth_when_started": round(another / saved),
        })  # fmt: skip
    columns = {
        "filter": "filter", "python_us": "python µs/sample", "compiled_ns": "compiled ns/sample", "ratio": "ratio",
        "start_s": "first in process s", "another_s": "after another s",
        "worth_starting": "worth starting", "worth_when_started": "worth when started",
    }  # fmt: skip
    middle = [round(statistics.median(row[key] for row in rows)) for key in ("worth_starting", "worth_when_started")]
    note = (
        f"Samples from which compiled is done sooner: median {middle[0]:,} and {middle[1]:,}; "
        f"in use are SAMPLES_COLD = {SAMPLES_COLD:,} and SAMPLES_WARM = {SAMPLES_WARM:,}."
    )
    show([Table("Plain Python and compiled", columns, rows, note)], given.json)


if __name__ == "__main__":
    main()
