"""Time of a sample: levelhead beside its peers, in a batch and live, as ratios."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from levelhead import filters
from levelhead.bench import contenders, inputs
from levelhead.bench.methods import DEFAULT, OURS, SMOOTHER, Method, all_methods
from levelhead.bench.timing import Case, Progress, Table, Timing, machine, time_interleaved
from levelhead.engine import AxisStream, Stream, fuse, smooth
from levelhead.engine.stream import Triple
from levelhead.errors import LevelheadError
from levelhead.evaluate.text_table import Cell
from levelhead.filters.parameters import Params
from levelhead.recording import Array, Recording
from levelhead.units import GRAVITY

# Samples of a batch are divided by this: loops in Python and networks take long.
DIVISOR = {"vqf": 1, "imufusion": 10, "riann": 100, "ahrs": 1000}
MIN_SAMPLES = 200  # samples
LIVE = 20_000  # updates in one repeat
FIFO = 32  # rows of one update_rows, as a chip's FIFO holds them
REFERENCE = "vqf.VQF"
LIVE_PEERS = ("imufusion.Ahrs", REFERENCE)


@dataclass(frozen=True)
class Speed:
    """Tables of times and ratios, the machine, and remarks on methods that are left out."""

    tables: tuple[Table, ...]
    machine: dict[str, str]
    remarks: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Ready for JSON."""
        tables = [table.to_dict() for table in self.tables]
        return {"machine": self.machine, "notes": list(self.remarks), "tables": tables}


def speed(samples: int = 200_000, repeats: int = 9, progress: Progress | None = None) -> Speed:
    """Time all of them, in turn, in this process, on its CPU time.

    Args:
        samples: of a batch; slow loops get fewer.
        repeats: times that every case runs.
        progress: called with the fraction done, 0 to 1.

    Raises:
        LevelheadError: too few samples or repeats.
    """
    for name, value, least in (("samples", samples, 1_000), ("repeats", repeats, 1)):
        if value < least:
            raise LevelheadError(f"{value} {name} are too few to time anything; expected at least {least:,}")
    tables = []
    for i, (make, mag) in enumerate((make, mag) for make in (batch, live) for mag in (False, True)):

        def report(fraction: float, done: int = i) -> None:
            if progress is not None:
                progress((done + fraction) / 4)

        tables.append(make(mag, samples, repeats, report))
    return Speed(tuple(tables), machine(), tuple(all_methods()[1]))


def batch(mag: bool, samples: int, repeats: int, progress: Progress | None = None) -> Table:
    """All methods over one recording by the call that users make, against VQF and, where there is one, our own twin."""
    cases = []
    for method in all_methods()[0]:
        few = samples if method.package == OURS else max(MIN_SAMPLES, samples // DIVISOR[method.package])
        cases.append(Case(method.name, _run_whole(method, inputs.imu_recording(few, mag=mag)), few))
    timings = {one.name: one for one in time_interleaved(cases, repeats, progress)}
    rows = [_batch_row(one, timings) for one in timings.values()]
    return Table(
        f"{_sensors(mag)}: a batch of {samples:,} samples",
        {
            "case": "method",
            "ns": "ns/sample",
            "vqf": f"time to {REFERENCE}",
            "slower": "times slower than levelhead's",
            "twin": "which is",
        },
        rows,
        "The public calls with their checks and allocations; loops in Python over fewer samples. vqf does more per "
        "sample than most (rest detection, low-passes, rejection). Times slower: than our filter of that name, else "
        f"than {DEFAULT}.",
    )


def _run_whole(method: Method, recording: Recording) -> Callable[[], object]:
    if method.name == SMOOTHER:
        return lambda: smooth(recording)
    if method.package == OURS:
        return lambda: fuse(recording, method.params)
    return lambda: contenders.BY_NAME[method.name].run(recording)


def _batch_row(timing: Timing, timings: dict[str, Timing]) -> dict[str, Cell]:
    row: dict[str, Cell] = {"case": timing.name, "ns": timing.least, "median_ns": timing.median}
    row["vqf"] = timing.over(timings[REFERENCE]) if REFERENCE in timings else None
    if timing.name in contenders.BY_NAME:
        namesake = timing.name.partition(".")[2]
        twin = namesake if namesake in timings else DEFAULT
        row |= {"twin": twin, "slower": timing.over(timings[twin])}
    return row


def live(mag: bool, samples: int, repeats: int, progress: Progress | None = None) -> Table:
    """One update per sample, called from Python, against imufusion and vqf."""
    count = min(samples, LIVE)
    timings = {one.name: one for one in time_interleaved(_live_cases(mag, count), repeats, progress)}
    rows = []
    for one in timings.values():
        row: dict[str, Cell] = {"case": one.name, "ns": one.least, "median_ns": one.median}
        row |= {peer: one.over(timings[peer]) if peer in timings else None for peer in LIVE_PEERS}
        rows.append(row)
    return Table(
        f"{_sensors(mag)}: live, {count:,} updates called from Python",
        {"case": "method", "ns": "ns/update"} | {peer: f"time to {peer}" for peer in LIVE_PEERS},
        rows,
        "Each call updates and gives the orientation; the loop itself is in every case. Readings were sliced into rows "
        "before: NumPy rows for the peers, which take nothing else. AxisStream: one angle and its rate.",
    )


def _live_cases(mag: bool, count: int) -> list[Case]:
    recording = inputs.imu_recording(count, mag=mag)
    sensors = [recording.gyr, recording.acc] + ([] if recording.mag is None else [recording.mag])
    rows = list(zip(*map(list, sensors), strict=True))
    tuples = list(zip(*(map(tuple, values.tolist()) for values in sensors), strict=True))
    peers = [_imufusion(sensors), _vqf(rows)]
    cases = [Case(name, work, count) for name, work in zip(LIVE_PEERS, peers, strict=True) if _is_installed(name)]
    if not mag:
        for params in (flt.params() for flt in filters.ALL if flt.axis is not None):
            cases.append(Case(f"AxisStream({type(params).__name__})", _axis(params, count), count))
    choices = {DEFAULT: filters.default()} | {flt.name: flt.params() for flt in filters.ALL}
    for name, params in choices.items():
        cases.append(Case(f"Stream({name}), tuples", _stream(params, tuples), count))
        cases.append(Case(f"Stream({name}), NumPy rows", _stream(params, rows), count))
    default = filters.default()
    single = list(zip(*(list(values.astype(np.float32)) for values in sensors), strict=True))
    cases.append(Case(f"Stream({DEFAULT}), float32 rows", _stream(default, single), count))
    lists = list(zip(*(values.tolist() for values in sensors), strict=True))
    cases.append(Case(f"Stream({DEFAULT}), lists", _stream(default, lists), count))
    cases.append(Case(f"Stream({DEFAULT}), update_rows by {FIFO}", _stream_rows(default, sensors), count))
    return cases


def _is_installed(name: str) -> bool:
    return contenders.BY_NAME[name].installed


def _sensors(mag: bool) -> str:
    return "9-D, with magnetometer" if mag else "6-D, without magnetometer"


def _imufusion(sensors: Sequence[Array]) -> Callable[[], None]:
    gyr, acc, *mag = sensors
    rows = list(zip(np.degrees(gyr), acc / GRAVITY, *mag, strict=True))

    def work() -> None:
        import imufusion

        one = imufusion.Ahrs()
        one.set_sample_period(inputs.DT)
        update = one.update if mag else one.update_no_magnetometer
        for row in rows:
            update(*row)
            one.get_quaternion()

    return work


def _vqf(rows: Sequence[Sequence[Array]]) -> Callable[[], None]:
    def work() -> None:
        import vqf

        one = vqf.VQF(inputs.DT)
        orientation = one.getQuat6D if len(rows[0]) == 2 else one.getQuat9D
        for row in rows:
            one.update(*row)
            orientation()

    return work


def _stream(params: Params, rows: Sequence[Sequence[Triple]]) -> Callable[[], None]:
    stream = Stream(params)

    def without() -> None:
        for gyr, acc in rows:
            stream.update(gyr, acc, dt=inputs.DT)

    def with_mag() -> None:
        for gyr, acc, mag in rows:
            stream.update(gyr, acc, mag, dt=inputs.DT)

    return without if len(rows[0]) == 2 else with_mag


def _stream_rows(params: Params, sensors: Sequence[Array]) -> Callable[[], None]:
    stream = Stream(params)
    gyr, acc, *mag = [[values[i : i + FIFO] for i in range(0, len(values), FIFO)] for values in sensors]
    parts = list(zip(gyr, acc, mag[0] if mag else [None] * len(gyr), strict=True))

    def work() -> None:
        for part in parts:
            stream.update_rows(*part, inputs.DT)

    return work


def _axis(params: Params, count: int) -> Callable[[], None]:
    stream = AxisStream(params)
    t = np.arange(count) * inputs.DT
    pairs = list(zip((30.0 * np.sin(t)).tolist(), (30.0 * np.cos(t)).tolist(), strict=True))

    def work() -> None:
        for level, rate in pairs:
            stream.update(level, rate, inputs.DT)

    return work
