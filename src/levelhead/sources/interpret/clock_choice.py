"""Time stamps: which column is the clock, its unit, its start; stamps that repeat, step back or begin again."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.recording import Array, median
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import NeedsHints, Scale
from levelhead.sources.interpret.arrival import restore_clock
from levelhead.sources.interpret.clock_repair import Repair, first_of_bursts, repair_stamps
from levelhead.sources.interpret.stamp_unit import EPOCH, guess_unit, usual_interval
from levelhead.sources.interpretation import ClockRule, scale_stamps
from levelhead.sources.table import Column, Table

LONGEST_UPTIME = 1e8  # seconds; stamps beyond it count from some date, not from the start of the sensor
_MAX_RATE_ERROR = 0.25  # by which the rate of a guessed unit may differ from the rate that the file gives
_FAST = 2e-3  # s; a shorter interval could as well be a slow one in a larger unit
MIN_INTERVAL, _MAX_INTERVAL = 2.5e-5, 100.0  # s; no IMU is read at more than 40 kHz, nor less than once in 100 s
_MIN_SPAN, _MAX_TICKS_ERROR = 2.0, 0.02  # s that show a rate; by which it may differ from a round one
_ROUND_TICKS = [digit * 10.0**power for power in range(1, 8) for digit in (1.0, 2.0, 2.5, 5.0)] + [32768.0, 65536.0]
_UNUSABLE = 4.0  # unevenness of stamps that mostly stand still or go back
_MIN_ROWS = 20  # rows below which nothing is repaired
_STALE, _ALONE = 3, 100.0  # rows that may stand alone at the start; usual intervals between them and the others
_MISSING_SHARE = 0.01  # of the rows, at most, that may lack a stamp and are left out


class Clock(NamedTuple):
    """Time stamps in seconds.

    Attributes:
        t: (n,) seconds of the rows that are kept.
        scale: of one stamp.
        start: the subtracted start, in stamps; 0 if nothing was.
        t0: the same in seconds; None if nothing was.
        conclusions: the conclusions about them.
        rows: which rows of the table are kept; None: all.
    """

    t: Array
    scale: Scale
    start: float | int
    t0: float | None
    conclusions: Sequence[Conclusion]
    rows: NDArray[np.intp] | None = None


class Candidate(NamedTuple):
    """A column that may be the clock.

    Attributes:
        name: of the column, or of both.
        stamps: (n,).
        declared: the unit that its name or a hint gives; None without one.
        positions: of the column in its table, and of the one with the rest of a second.
        fraction: s that one number of that second column is; 0 without one.
    """

    name: str
    stamps: Column
    declared: Scale | str | None
    positions: tuple[int, ...] = ()
    fraction: float = 0.0


class CounterError(NeedsHints):
    """Stamps that count 1 a row and have no unit."""


def join_seconds(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The candidates, a column of whole seconds and the one of nanoseconds behind it (stamp.sec, stamp.nanosec) as one.

    Either alone would be a wrong clock: one repeats, the other begins again every second. Seconds may lack a unit.
    """
    found: list[Candidate] = []
    for one in candidates:
        before = found[-1] if found else None
        fraction = _fraction(one)
        if before is not None and fraction and _factor(before) in (None, 1.0) and _ticks_with(before, one):
            rule = ClockRule((before.name, one.name), fraction=fraction)
            joined = rule.stamps([before.stamps, one.stamps])
            found[-1] = Candidate(rule.name, joined, "ns", before.positions + one.positions, fraction)
        else:
            found.append(one)
    return found


def _factor(one: Candidate) -> float | None:
    """Seconds per number that the column's name or a hint declares; None if nothing does."""
    if isinstance(one.declared, Scale):
        return one.declared.factor / one.declared.divisor
    return None if one.declared is None else units.find_factor("time", one.declared)


def _fraction(one: Candidate) -> float | None:
    """The unit, in s, of a column that holds the fraction of a second: whole numbers that stay below a second."""
    factor = _factor(one)
    if factor not in (1e-9, 1e-6) or not _whole(one.stamps) or len(one.stamps) < 3:
        return None
    return factor if one.stamps.min() >= 0 and one.stamps.max() * factor < 1.0 else None


def _ticks_with(seconds: Candidate, rest: Candidate) -> bool:
    """Whether whole numbers step on where the rest of a second begins again, and only there."""
    if not _whole(seconds.stamps):
        return False
    if seconds.declared is not None:
        return True
    began, stepped = rest.stamps[1:] < rest.stamps[:-1], seconds.stamps[1:] > seconds.stamps[:-1]
    return bool(began.any()) and bool((began == stepped).all())


def _whole(stamps: Column) -> bool:
    return bool(np.isfinite(stamps).all()) and bool((stamps == np.rint(stamps)).all())


def with_ticks(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The candidates; a counter without unit gets that which a clock beside it shows, if its numbers contradict it.

    The other clock has a unit, counts from a date, or counts no ticks of this one. Only its rate is taken, since it may
    hold times of arrival.
    """
    return [
        one if (scale := next((made for other in candidates if (made := _ticks(one, other))), None)) is None
        else one._replace(declared=scale)
        for one in candidates
    ]  # fmt: skip


def _period(one: Candidate) -> tuple[float, bool]:
    """(s per number by its unit, a date or a guess; whether it is more than a guess)."""
    if one.declared is not None:
        return _factor(one) or 1.0, True
    if len(one.stamps) < _MIN_ROWS or not np.isfinite(one.stamps[[0, -1]]).all():
        return 1.0, False
    factor = units.find_factor("time", guess_unit(one.stamps)) or 1.0
    return factor, EPOCH[0] < float(one.stamps[0]) * factor < EPOCH[1]


def _ticks(one: Candidate, other: Candidate) -> Scale | None:
    """The unit of a counter by the clock beside it; None if its guessed unit is its own, or no round one fits."""
    (guessed, sure), (factor, known) = _period(one), _period(other)
    spans = [_span(clock.stamps, len(one.stamps)) for clock in (one, other)]
    if one is other or sure or spans[1] * factor < _MIN_SPAN or not spans[0] > 0.0:
        return None
    ratio = spans[0] / spans[1]  # numbers of one for a number of the other
    if abs(np.log(ratio * guessed / factor)) < _MAX_RATE_ERROR or (not known and _round(1.0 / (ratio * guessed))):
        return None
    near = _round(ratio / factor)
    return Scale(1.0, f"ticks of 1/{near:g} s", near) if near else None


def _round(ticks: float) -> float:
    """The usual number of ticks a second that is nearest; 0 if none is near."""
    near = min(_ROUND_TICKS, key=lambda one: abs(np.log(ticks / one)))
    return near if abs(ticks / near - 1.0) < _MAX_TICKS_ERROR else 0.0


def _span(stamps: Column, count: int) -> float:
    """From the first stamp to the last one, of stamps that do not go back; 0 for others."""
    ordered = len(stamps) == count > _MIN_ROWS and bool((stamps[1:] >= stamps[:-1]).all())
    return float(stamps[-1] - stamps[0]) if ordered else 0.0


def choose(candidates: Sequence[Candidate]) -> tuple[Candidate, list[Conclusion]]:
    """The clock among several columns with time in their names, and conclusions about the choice.

    The most even one is taken; of equals, the one whose rate most others have, then the first that is not a counter.
    """
    if len(candidates) == 1:
        return candidates[0], []
    fits = [_fit(one) for one in candidates]
    rates = [np.log(fit.interval) for fit in fits if fit.uneven < _UNUSABLE]

    def rank(place: int) -> tuple[float, int, bool]:
        fit = fits[place]
        sound = fit.uneven < _UNUSABLE
        others = sum(abs(np.log(fit.interval) - one) > _MAX_RATE_ERROR for one in rates) if sound else 0
        return fit.uneven, others, others > 0 and fit.is_counter

    best, *others = (candidates[place] for place in sorted(range(len(fits)), key=rank))
    rest = ", ".join(f"'{one.name}'" for one in others[:3])
    facts = {"count": len(candidates), "rest": rest}
    return best, [Conclusion("t.column", "most_even", best.name, Basis.NUMBERS, facts)]


class ClockFit(NamedTuple):
    """How uneven stamps are, in steps of √10, their usual interval in s, and whether they count something unknown."""

    uneven: float
    interval: float
    is_counter: bool


def _fit(one: Candidate) -> ClockFit:
    stamps = one.stamps.astype(np.float64)
    stamps = stamps[np.isfinite(stamps)]
    if len(stamps) < 3 or len(stamps) < 0.5 * len(one.stamps) or stamps.min() == stamps.max():
        return ClockFit(_UNUSABLE + 1.0, 0.0, False)
    steps = np.diff(stamps)
    still, back = float((steps == 0).mean()), float((steps < 0).mean())
    low, middle, high = np.quantile(steps, [0.05, 0.5, 0.95])
    factor, known = _period(one)
    interval, is_counter = middle * factor, not known and _whole(one.stamps)
    if still > 0.5 or back > 0.2 or middle <= 0:
        return ClockFit(_UNUSABLE, interval, is_counter)
    spread = max((high - low) / middle, 0.2)
    return ClockFit(float(np.floor(np.log10(spread) * 2.0)), interval, is_counter)


def seconds(
    stamps: Column,
    declared: Scale | str | None,
    table: Table,
    name: str,
    values: Array | None = None,
    session: int | None = None,
) -> Clock:
    """(n,) stamps of column ``name`` as seconds, checked, and repaired where that is clear.

    ``declared`` is the unit that the header or a hint gives; without one the unit follows from the median interval.
    Stamps that count from 1970 or another date become seconds since the first one. ``values`` (n, k) are the sensors'
    numbers, which distinguish a repeated row from a burst of samples with one stamp. ``session``, from 1, chooses among
    parts after each of which the clock began again; the longest is taken otherwise.

    Raises:
        LevelheadError: a stamp is missing or infinite, too few stamps increase; the line is named.
    """
    found: list[Conclusion] = []
    present = _rows_with_stamp(stamps, table, name, found)
    if present is not None:
        stamps = stamps[present]
    if declared is None:
        declared, inferred = _infer_unit(stamps, table, name)
        found.append(inferred)
    stale = _stale_rows(stamps)
    if stale:
        stamps, present = stamps[stale:], np.arange(len(stamps))[stale:] if present is None else present[stale:]
        found.append(Conclusion("t.rows", "stale", stale, Basis.NUMBERS, {"column": name}))
    if isinstance(declared, str):
        declared = _plausible(stamps, declared, name, found)
    scale = declared if isinstance(declared, Scale) else Scale(units.factor("time", declared), declared)
    beside = values if values is None or present is None else values[present]
    repaired = _repaired(stamps, table, name, beside, session)
    found += [one._replace(facts={"column": name, **one.facts}) for one in repaired.conclusions]
    kept = repaired.stamps
    first = kept[0]
    t0, start = None, 0
    if float(kept[-1]) - float(first) > 1e20 or abs(float(first)) > 1e20:
        raise LevelheadError(
            f"{table.source}, column '{name}': {kept[-1]:.6g} is not a unit of time; expected s, ms, us or ns"
        )
    if abs(float(first)) * scale.factor / scale.divisor > LONGEST_UPTIME:
        t0, start = float(scale_stamps(kept[:1].astype(np.float64), scale)[0]), first.item()
        kept = kept - first
        found.append(Conclusion("t.start", "date", t0, Basis.NUMBERS))
    rows = repaired.rows
    if present is not None:
        rows = present if rows is None else present[rows]
    return Clock(scale_stamps(kept.astype(np.float64), scale), scale, start, t0, found, rows)


def _repaired(stamps: Column, table: Table, name: str, values: Array | None, session: int | None) -> Repair:
    """(n,) stamps that increase.

    Raises:
        LevelheadError: they cannot be made to, or there is no such session.
    """
    increasing = len(stamps) < 2 or bool((stamps[1:] > stamps[:-1]).all())
    if increasing and first_of_bursts(stamps) is None:
        if session not in (None, 1):
            raise LevelheadError(f"{table.source} has one session, not session {session}")
        return Repair(stamps)
    if len(stamps) < _MIN_ROWS or not (stamps[1:] > stamps[:-1]).any():
        _refuse(stamps, table, name)
    repaired = repair_stamps(stamps, values, session)
    if len(repaired.stamps) > 1 and not (repaired.stamps[1:] > repaired.stamps[:-1]).all():
        _refuse(stamps, table, name)
    return repaired


def restore(clock: Clock, name: str, values: Array | None) -> Clock:
    """The sensor's own clock in place of times of arrival in column ``name``, where the readings show it.

    ``values`` (n, k) are the readings of all rows of the table.
    """
    restored = restore_clock(clock.t, values if values is None or clock.rows is None else values[clock.rows])
    if restored is None:
        return clock
    facts = {
        "column": name, "jitter_ms": 1e3 * restored.jitter, "rows": restored.rows, "missing": restored.lost,
    }  # fmt: skip
    arrival = Conclusion("t.stamps", "arrival", "sensor clock", Basis.NUMBERS, facts)
    return clock._replace(t=restored.t, conclusions=[*clock.conclusions, arrival])


def _stale_rows(stamps: Column) -> int:
    """How many rows stand alone at the start, a long time before all others: offsets, a reading that was left over."""
    if len(stamps) < _MIN_ROWS:
        return 0
    usual = median(np.diff(stamps[_STALE:]))
    jumps = np.flatnonzero(np.abs(np.diff(stamps[: _STALE + 1])) > _ALONE * usual)
    return int(jumps[-1]) + 1 if usual > 0.0 and len(jumps) else 0


def _plausible(stamps: Column, declared: str, name: str, found: list[Conclusion]) -> str:
    """The declared unit, or another where no sensor is read at the rate that it gives."""
    step = usual_interval(stamps)
    factor = units.factor("time", declared)
    other = guess_unit(stamps)
    if step == 0.0 or MIN_INTERVAL < step * factor < _MAX_INTERVAL or units.factor("time", other) == factor:
        return declared
    facts = {"declared": declared, "taken": other, "column": name, "step": step, "rate": 1.0 / (step * factor)}
    found.append(Conclusion("t.unit", "against_header", other, Basis.GUESS, facts, {"units": {"t": other}}))
    return other


def beside_clock(one: Candidate, hints: Mapping[str, Scale]) -> list[Conclusion]:
    """The conclusion that ``with_ticks`` found the unit of a clock."""
    if not isinstance(one.declared, Scale) or "t" in hints:
        return []
    facts = {"column": one.name, "ticks": one.declared.divisor}
    return [Conclusion("t.unit", "other_clock", one.declared.name, Basis.NUMBERS, facts)]


def _infer_unit(stamps: Column, table: Table, name: str) -> tuple[Scale | str, Conclusion]:
    """(unit, conclusion) of stamps without a given unit.

    Raises:
        NeedsHints: a counter.
    """
    step = usual_interval(stamps)
    unit = guess_unit(stamps)
    if table.rate is not None and step > 0.0:
        guessed = 1.0 / (step * units.factor("time", unit))
        if abs(guessed / table.rate - 1.0) > _MAX_RATE_ERROR:
            ticks = step * table.rate
            scale = Scale(1.0, f"ticks of 1/{ticks:.6g} s", ticks)
            facts = {"column": name, "step": step, "rate": table.rate, "ticks": ticks}
            return scale, Conclusion("t.unit", "file_rate", scale.name, Basis.NUMBERS, facts)
    elif step == 1.0 and unit != "s" and float((np.diff(stamps) == 1).mean()) > 0.9:
        raise CounterError(
            f"{table.source}, column '{name}': it counts 1 a row, which is a counter or whole milliseconds; expected "
            "its unit, or the rate and no stamps",
            units={"t": "ms"},
        )
    is_short = step * units.factor("time", unit) < _FAST
    return unit, Conclusion(
        "t.unit", "short_interval" if is_short else "interval", unit, Basis.GUESS if is_short else Basis.NUMBERS,
        {"column": name, "step": step}, {"units": {"t": unit}},
    )  # fmt: skip


def _rows_with_stamp(stamps: Column, table: Table, name: str, found: list[Conclusion]) -> NDArray[np.intp] | None:
    """The rows that have a stamp; None: all.

    Raises:
        LevelheadError: more than a few lack one, or one is infinite.
    """
    finite = np.isfinite(stamps)
    if finite.all():
        return None
    row = int(np.argmin(finite))
    missing = int((~finite).sum())
    if np.isinf(stamps[row]) or missing > _MISSING_SHARE * len(stamps):
        what = "missing" if np.isnan(stamps[row]) else "infinite"
        raise LevelheadError(
            f"{table.source}, {table.where(row)}, column '{name}': the time is {what}; expected a stamp on every line"
        )
    found.append(Conclusion("t.rows", "no_stamp", missing, Basis.NUMBERS, {"first": table.where(row)}))
    return np.flatnonzero(finite)


def _refuse(stamps: Column, table: Table, name: str) -> None:
    forward = stamps[1:] > stamps[:-1]
    row = int(np.argmin(forward)) + 1
    now, before = stamps[row], stamps[row - 1]
    what = f"stands still at {now}" if now == before else f"goes back from {before} to {now}"
    raise NeedsHints(
        f"{table.source}, {table.where(row)}, column '{name}': time {what}; expected stamps that increase, "
        "or the hints map t= and rate=…, which leave the stamps out",
        map={"t": []},
    )
