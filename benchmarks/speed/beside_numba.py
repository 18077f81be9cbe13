"""The native engine beside Numba's and vqf: ns a sample in a batch and live, in turns, least processor time of each.

The filter's run alone: arrays in and out, no checks of a Recording.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from benchmarks.measure import options, show

import levelhead as lh
from levelhead import filters
from levelhead.bench.inputs import imu_arrays
from levelhead.bench.timing import Table

BATCH, LIVE = 100_000, 5_000


def least(works: dict[str, Callable[[], Any]], count: int, repeats: int) -> dict[str, float]:
    """ns a sample of each, least of several turns: what else runs on the machine takes its time from all."""
    best = dict.fromkeys(works, float("inf"))
    for _ in range(repeats):
        for name, work in works.items():
            began = time.process_time()
            work()
            best[name] = min(best[name], 1e9 * (time.process_time() - began) / count)
    return best


def live(params: Any, engine: str, gyr: Any, acc: Any) -> None:
    """A stream through all samples."""
    stream = lh.Stream(params, engine=engine)
    for rate, force in zip(gyr, acc, strict=True):
        stream.update(rate, force, dt=0.01)


def peer_batch(gyr: Any, acc: Any) -> None:
    """VQF over all samples."""
    import vqf

    vqf.VQF(0.01).updateBatch(gyr, acc)


def line(name: str, found: dict[str, float], batch: bool) -> dict[str, Any]:
    """One line of the table."""
    how = "batch" if batch else "live"
    ratio = found["native"] / found["compiled"]
    return {"case": f"{name}, {how}", **found, "ratio": ratio}


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=15)
    parser.add_argument("--filter", action="append", help="only these (default: all)")
    given = parser.parse_args()
    t, gyr, acc = imu_arrays(BATCH)
    recording = lh.Recording(t, gyr, acc)
    triples = [list(map(tuple, values[:LIVE].tolist())) for values in (gyr, acc)]
    flat = np.ascontiguousarray(gyr), np.ascontiguousarray(acc)
    rows = []
    for name in given.filter or [flt.name for flt in filters.ALL]:
        params = filters.find(name).params()
        works: dict[str, Callable[[], Any]] = {
            engine: lambda params=params, engine=engine: lh.fuse(recording, params, engine=engine)  # type: ignore[misc]
            for engine in ("native", "compiled")
        }
        rows.append(line(name, least(works | {"vqf": lambda: peer_batch(*flat)}, BATCH, given.repeats), True))
        works = {
            engine: lambda params=params, engine=engine: live(params, engine, *triples)  # type: ignore[misc]
            for engine in ("native", "compiled")
        }
        rows.append(line(name, least(works, LIVE, given.repeats), False))
    smoothers: dict[str, Callable[[], Any]] = {
        engine: lambda engine=engine: lh.smooth(recording[:20_000], engine=engine)  # type: ignore[misc]
        for engine in ("native", "compiled")
    }
    if not given.filter or "ESKF" in given.filter:
        rows.append(line("smoother", least(smoothers, 20_000, given.repeats), True))
    columns = {
        "case": "case",
        "native": "native ns",
        "compiled": "Numba ns",
        "ratio": "native / Numba",
        "vqf": "vqf ns",
    }
    show([Table("Native engine beside Numba's and vqf", columns, rows, "The same bits from both engines.")], given.json)


if __name__ == "__main__":
    main()
