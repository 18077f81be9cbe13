"""The clock of a table: its columns, or rows at a rate."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.recording import Array
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import Hints, NeedsHints
from levelhead.sources.interpret.clock_choice import (
    MIN_INTERVAL,
    Candidate,
    Clock,
    CounterError,
    beside_clock,
    choose,
    join_seconds,
    restore,
    seconds,
    with_ticks,
)
from levelhead.sources.interpret.declared import declared_scale
from levelhead.sources.interpret.rate import guess_rate
from levelhead.sources.interpret.roles import Roles
from levelhead.sources.interpret.stamp_unit import guess_tick
from levelhead.sources.interpretation import ClockRule
from levelhead.sources.names.column_name import unit_in
from levelhead.sources.table import Column, Table, stack

MERGED = {("clock", "merged"), ("rows", "outside_overlap")}
ARRIVAL = "arrival"
_REPAIRS = {"t.rows", "t.stamps", "t.session"}
MAX_LOSS, MIN_DURATION, MIN_ROWS = 0.1, 1.0, 10  # of the rows; s, rows
_NEARLY_MS = 700.0  # Hz from which a stamp that counts 1 a row may well be milliseconds


class FoundClock(NamedTuple):
    """The clock of a table.

    Attributes:
        rule: for any rows of the log.
        t: (n,) s of the rows that were read.
        rows: which are kept; None: all.
        positions: of the columns.
        conclusions: in the order in which they were made.
    """

    rule: ClockRule
    t: Array
    rows: NDArray[np.intp] | None
    positions: tuple[int, ...]
    conclusions: Sequence[Conclusion]


def find_clock(table: Table, roles: Roles, hints: Hints, columns: Mapping[int, Column]) -> FoundClock:
    """The clock of the columns that were read: their stamps, or rows over the rate.

    Raises:
        LevelheadError: no stamps and no rate, both of them, or stamps that are none.
    """
    if "t" not in roles.columns:
        return _rows_at_rate(table, roles, hints, columns)
    positions = roles.columns["t"]
    if hints.rate is not None:
        raise LevelheadError(
            f"{table.source} has time stamps in column '{table.names[positions[0]]}', and rate={hints.rate:g} is "
            "given too; leave out the rate, or leave out the stamps with the hint map t="
        )
    candidates = [_candidate(table, i, hints, columns[i]) for i in sorted(positions)]
    joined = join_seconds(candidates)
    if len(joined) == len(candidates):
        joined = [_candidate(table, i, hints, columns[i]) for i in positions]
    chosen, choice = choose(with_ticks(joined))
    values = _sensor_values(roles, columns)
    try:
        clock = seconds(chosen.stamps, chosen.declared, table, chosen.name, values, hints.session)
    except CounterError as error:
        raise _without_counter(error, roles, columns) from None
    _refuse_loss(clock, len(chosen.stamps), table, chosen.name)
    if not any((one.about, one.reason) in MERGED for one in table.conclusions):
        clock = restore(clock, chosen.name, values)
    names = tuple(table.names[i] for i in chosen.positions)
    repairs = tuple(one.reason for one in clock.conclusions if one.about in _REPAIRS)
    rule = ClockRule(
        names, clock.scale, clock.start, clock.t0, fraction=chosen.fraction, repairs=repairs, session=hints.session
    )
    own_names = any(one.about in ("columns", "clock") for one in table.conclusions)
    unit = beside_clock(chosen, hints.scale) or _declared(chosen, clock)
    made = [*([] if own_names else _named(names, roles, choice)), *clock.conclusions, *unit]
    return FoundClock(rule, clock.t, clock.rows, chosen.positions, made)


def _refuse_loss(clock: Clock, count: int, table: Table, name: str) -> None:
    """Refuses stamps that would leave little of ``count`` rows; another session and repeated rows are not losses.

    Raises:
        NeedsHints: more than a tenth is lost, or less than a second is left.
    """
    reasons = {one.reason for one in clock.conclusions if one.about in ("t.rows", "t.session")}
    left, span = len(clock.t), float(clock.t[-1] - clock.t[0])
    lost = count - left > MAX_LOSS * count or span < (left - 1) * MIN_INTERVAL
    if (
        not lost
        or any(one.about == "t.session" for one in clock.conclusions)
        or (reasons == {"repeated"} and span >= MIN_DURATION and left >= MIN_ROWS)
    ):
        return
    raise NeedsHints(
        f"{table.source}: by the stamps in column '{name}' only {left} of {count} rows, {span:.3g} s, would be left; "
        "expected stamps that grow from row to row, with all their digits, or rows at a rate of their own",
        map={"t": []},
    )


def _named(names: tuple[str, ...], roles: Roles, choice: Sequence[Conclusion]) -> list[Conclusion]:
    """Conclusions about the column of the clock."""
    if choice or any(one.about == "t.column" for one in roles.conclusions):
        return list(choice)
    reason, basis = ("hint", Basis.HINT) if "t" in roles.mapped else ("named", Basis.HEADER)
    return [Conclusion("t.column", reason, " + ".join(names), basis)]


def _declared(chosen: Candidate, clock: Clock) -> list[Conclusion]:
    """The conclusion about a unit that a hint or the header gives."""
    if any(one.about == "t.unit" for one in clock.conclusions):
        return []
    reason, basis = ("declared", Basis.HEADER) if isinstance(chosen.declared, str) else ("hint", Basis.HINT)
    return [Conclusion("t.unit", reason, clock.scale.name, basis)]


def apply_clock(rule: ClockRule, table: Table, stamps: Column, values: Array) -> tuple[Array, NDArray[np.intp] | None]:
    """((n,) s, rows that are kept or None for all) of (m,) stamps by a rule; ``values`` (m, k) are the readings.

    Raises:
        LevelheadError: stamps that the rule does not fit.
    """
    if not rule.repairs:
        return rule.seconds(stamps), None
    clock = seconds(stamps, rule.scale, table, rule.name, values, rule.session)
    if ARRIVAL in rule.repairs:
        clock = restore(clock, rule.name, values)
    return clock.t, clock.rows


def _sensor_values(roles: Roles, columns: Mapping[int, Column]) -> Array | None:
    sensors = [i for role in ("gyr", "acc", "mag") for i in roles.columns.get(role, ())]
    return stack(columns, sensors) if sensors else None


def _candidate(table: Table, position: int, hints: Hints, stamps: Column) -> Candidate:
    name = table.names[position]
    unit = table.column_units.get(position) or table.units.get("t")
    if unit is None and "t" not in hints.scale:
        unit = guess_tick(stamps) if name == "SampleTimeFine" else unit_in(name, "t", table.source)
    return Candidate(name, stamps, hints.scale.get("t") or unit, (position,))


def _rows_at_rate(table: Table, roles: Roles, hints: Hints, columns: Mapping[int, Column]) -> FoundClock:
    n = len(next(iter(columns.values())))
    if hints.rate is not None and table.rate is not None and "t" not in hints.map:
        raise LevelheadError(
            f"{table.source} gives its rate as {table.rate:g} Hz; leave out rate={hints.rate:g}, "
            "or insist on it with the hint map t="
        )
    rate = hints.rate or table.rate
    if rate is None:
        scale = declared_scale("gyr", table, roles, hints, [])
        guess, words = guess_rate(roles.columns, columns, None if scale is None else scale.factor / scale.divisor)
        sentence = (
            f"{table.source} has no column with time stamps; expected such as 't' or 'time_ms', or the hint map t=…, "
            f"or the hint rate=… in Hz"
        )
        if n < guess * MIN_DURATION:
            raise LevelheadError(f"{sentence}; it has {n} rows, which are less than a second at {guess:g} Hz")
        raise NeedsHints(f"{sentence}{words}", rate=guess)
    reason, basis = ("file", Basis.HEADER) if hints.rate is None else ("hint", Basis.HINT)
    rule = ClockRule(rate=rate)
    return FoundClock(rule, rule.rows(n), None, (), [Conclusion("t.rate", reason, rate, basis)])


def _without_counter(error: CounterError, roles: Roles, columns: Mapping[int, Column]) -> NeedsHints:
    """The error of stamps that count the rows, with the hint that gravity's turn suggests: ms, or a rate."""
    rate, words = guess_rate(roles.columns, columns)
    if rate > _NEARLY_MS:
        return error
    return NeedsHints(f"{error}{words}", map={"t": []}, rate=rate)
