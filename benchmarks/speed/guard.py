"""What the guard costs: a batch with and without it, every filter that has one, in ns a sample."""

from collections.abc import Callable
from typing import Any

from benchmarks.measure import options, show

import levelhead as lh
from levelhead import filters
from levelhead.bench.inputs import imu_recording as made
from levelhead.bench.timing import Case, Table, time_interleaved
from levelhead.engine.binding import is_guarded

COLUMNS = {"case": "filter", "with": "with guard [ns]", "without": "without [ns]", "cost": "difference [ns]"}


def fusing(recording: lh.Recording, params: Any, guard: lh.Guard | None) -> Callable[[], Any]:
    """A batch to be timed."""
    return lambda: lh.fuse(recording, params, guard=guard, engine="compiled")


def table(recording: lh.Recording, repeats: int) -> Table:
    """All filters on one recording."""
    n, rows = len(recording), []
    for flt in filter(is_guarded, filters.ALL):
        cases = [Case(str(guard), fusing(recording, flt.params(), guard), n) for guard in (lh.Guard(), None)]
        on, off = (timing.least for timing in time_interleaved(cases, repeats))
        rows.append({"case": flt.name, "with": round(on, 1), "without": round(off, 1), "cost": round(on - off, 1)})
    kind = "6-D" if recording.mag is None else "9-D"
    return Table(f"The guard, {kind}, {n:,} samples", COLUMNS, rows, "The fastest repeat of each.")


def main() -> None:
    """Without and with magnetometer."""
    parser = options(__doc__, repeats=9)
    parser.add_argument("--samples", type=int, default=100_000, help="of the batch")
    given = parser.parse_args()
    show([table(made(given.samples, mag=mag), given.repeats) for mag in (False, True)], given.json)


if __name__ == "__main__":
    main()
