"""Many parameter sets over one recording side by side, to running them one by one; many recordings on all cores.

Lanes: CPU time of one thread, per sample and parameter set, in turn with the compiled batch driver's single runs,
60 s at 100 Hz. The lanes hold every orientation beside a truth: "ratio" gathers two sums of products from it, "with
errors" the squared total, tilt and heading error, three atan2 a sample. 74 sets' whole tracks are compared with those
of their single runs, bit by bit.

Threads: wall time of ``fuse_recordings`` over many recordings with one worker and with one for each core.
"""

import os
import statistics
import time
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # else NumPy itself takes all cores while one worker is timed

import numpy as np
from benchmarks.measure import options, show

import levelhead as lh
from levelhead import filters
from levelhead.bench.inputs import imu_arrays
from levelhead.bench.timing import Case, Table, time_interleaved
from levelhead.compiler.compile import compile_kernel
from levelhead.engine import lanes
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.binding import bind
from levelhead.engine.driver import Settings
from levelhead.engine.parallel import fuse_parameter_sets, fuse_recordings
from levelhead.engine.threads import cores
from levelhead.filters.parameters import param_table
from levelhead.tune.lane_score import OFFSET, SQUARES

SAMPLES = 6_000  # 60 s at 100 Hz
SETS = 1_024
SINGLE = 16  # of these run one by one in a repeat


def spread(flt: Any) -> list[Any]:
    """Parameter sets over the usual range of the filter's first parameter that is a number."""
    default = flt.params()
    for name, param in param_table(flt.params).items():
        if param.sweep is not None and not isinstance(getattr(default, name), bool):
            return [default._replace(**{name: float(value)}) for value in np.linspace(*param.sweep, SETS)]
    return [default] * SETS


def cases(flt: Any, recording: lh.Recording) -> list[Case]:
    """Lanes and single runs of a filter."""
    sets = spread(flt)
    driver = bind(flt)
    run = compile_kernel(driver.run)
    n = len(recording)
    mag = np.empty(0) if recording.mag is None else recording.mag.reshape(-1)
    mag.flags.writeable = False
    flat = [recording.t, recording.gyr.reshape(-1), recording.acc.reshape(-1), mag]
    out = [np.empty(4 * n), np.empty(3 * n), np.empty(3 * n), np.empty(n, np.uint32)]
    truth = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))

    def one_by_one() -> None:
        for params in sets[:: SETS // SINGLE]:
            settings = Settings(params, DEFAULT_GUARD)
            run(settings, driver.begin(settings), float(recording.t[0]), *flat, *out)

    def beside(observer: lanes.Observer) -> None:
        lanes.observe_lanes(recording, flt, sets, observer, truth, np.tile(observer.start, (SETS, 1)), workers=1)

    return [
        Case(f"{flt.name}, lanes", lambda: beside(OFFSET), n * SETS),
        Case(f"{flt.name}, lanes with all errors", lambda: beside(SQUARES), n * SETS),
        Case(f"{flt.name}, single", one_by_one, n * SINGLE),
    ]


def same(flt: Any, recording: lh.Recording) -> bool:
    """Whether every lane of a block and a part of one has the bits of its single run."""
    sets = spread(flt)[:: SETS // 70]  # 74 of them
    found = fuse_parameter_sets(recording, sets, engine="compiled")
    return all(
        np.array_equal(track.quat, lh.fuse(recording, params, engine="compiled").quat)
        for params, track in zip(sets, found, strict=True)
    )


def lanes_table(repeats: int, only: list[str]) -> Table:
    """The ratio of each filter, without and with a magnetometer."""
    t, gyr, acc = imu_arrays(SAMPLES)
    field = np.tile([0.0, 19.0, -45.0], (SAMPLES, 1))
    rows = []
    for flt in (f for f in filters.ALL if not only or f.name in only):
        row: dict[str, Any] = {"filter": flt.name}
        for name, mag in (("6", None), ("9", field)):
            recording = lh.Recording(t, gyr, acc, mag)
            beside, scored, single = time_interleaved(cases(flt, recording), repeats)
            row |= {f"lane_{name}": beside.least, f"single_{name}": single.least, f"ratio_{name}": beside.over(single)}
            row[f"scored_{name}"] = scored.over(single)
            row["same"] = row.get("same", True) and same(flt, recording)
        rows.append(row)
    columns = {"filter": "filter"}
    for name in ("6", "9"):
        columns |= {f"lane_{name}": f"{name}-D lane ns", f"single_{name}": "single ns", f"ratio_{name}": "ratio"}
        columns[f"scored_{name}"] = "with errors"
    return Table(f"{SETS:,} parameter sets over one recording, one core", columns | {"same": "same bits"}, rows)


def threads_table(repeats: int) -> Table:
    """One worker and one for each core, in turn."""
    recording = lh.Recording(*imu_arrays(200_000))
    wall: dict[int, list[float]] = {1: [], cores(): []}
    for repeat in range(repeats + 1):
        for workers, spent in wall.items():
            began = time.perf_counter()
            for _ in fuse_recordings([recording] * 12, lh.Kalman(), engine="compiled", workers=workers):
                pass
            if repeat:  # the first may compile
                spent.append(time.perf_counter() - began)
    one, all_of = wall[1], wall[cores()]
    ratio = statistics.median(a / b for a, b in zip(one, all_of, strict=True))
    row = {"workers": cores(), "one": statistics.median(one), "all": statistics.median(all_of), "ratio": ratio}
    columns = {"workers": "workers", "one": "one worker s", "all": "all s", "ratio": "times as fast"}
    return Table("12 recordings of 200,000 samples, Kalman, wall time", columns, [row])


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=5)
    parser.add_argument("--filter", action="append", default=[], help="only this one (may be given several times)")
    given = parser.parse_args()
    show([lanes_table(given.repeats, given.filter), threads_table(given.repeats)], given.json)


if __name__ == "__main__":
    main()
