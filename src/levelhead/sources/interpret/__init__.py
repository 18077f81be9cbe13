"""From a table to a Recording: roles, time, units from hint, header or evidence, signs, reference."""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.open_types import ReadOnlyFields
from levelhead.recording import Array, Recording, median
from levelhead.signals.field_turn import field_turn, is_normalised
from levelhead.signals.gravity_direction import is_gravity
from levelhead.sources.conclusion import Basis, Conclusion
from levelhead.sources.hints import MEANING, Hints, NeedsHints, Scale
from levelhead.sources.interpret import unit_inference
from levelhead.sources.interpret.clock_choice import (
    Candidate,
    Clock,
    CounterError,
    choose,
    join_seconds,
    restore,
    seconds,
)
from levelhead.sources.interpret.clock_column import with_clock
from levelhead.sources.interpret.rate import guess_rate
from levelhead.sources.interpret.reference_columns import find_truth
from levelhead.sources.interpret.roles import Roles, assign
from levelhead.sources.interpret.scales import (
    Evidence,
    Turning,
    acc_scale,
    find_scale,
    gyr_scale,
    lacks_gravity,
    list_units,
    mag_scale,
)
from levelhead.sources.interpret.sign import note_sign, points_down, whole_acceleration
from levelhead.sources.interpret.suggestion import suggest
from levelhead.sources.interpret.temperature import celsius, find_temperature
from levelhead.sources.join.turns import count_turns
from levelhead.sources.names.column_name import RELATIVE, unit_in
from levelhead.sources.sentences import notes
from levelhead.sources.table import Column, Table, stack, words_of

SLOWEST = 0.75  # s between complete samples; at half a turn a second, 135 degrees lie between them
RARE = 0.05  # share of complete rows below which a log is refused
MERGED = {("clock", "merged"), ("rows", "outside_overlap")}
_NEARLY_MS = 700.0  # Hz from which a stamp that counts 1 a row may well be milliseconds


def assemble(table: Table, hints: Hints) -> Recording:
    """The Recording in ``table``, in SI units; what was concluded stands in its ``meta``.

    ``meta`` has "source", "conclusions" (of ``Conclusion``), "notes" (their sentences), "ignored" (columns that nothing
    uses), "units" (what the file is in), "columns" (which were taken) and where they apply "t0" (s, subtracted from the
    stamps) and "mag_unit" ("relative").

    Raises:
        LevelheadError: one sentence with file, line and column.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return _assemble(table, hints)


def _assemble(table: Table, hints: Hints) -> Recording:
    roles, columns = _read(table, hints)
    _refuse_gravity(table, roles, columns)
    found = [*table.conclusions, *roles.conclusions]
    columns = _one_unit(roles, columns, found)
    clock = clock_of(table, roles, hints, columns, found)
    if clock.rows is not None:
        columns = {i: column[clock.rows] for i, column in columns.items()}
    evidence = Evidence({"t": clock.unit}, found)
    clock, columns = _dense(table, roles, clock, columns, found)
    acc = _acc(table, roles, hints, columns, clock.t, evidence)
    if not {"acc"} & {*hints.map, *hints.scale}:
        note_sign(clock.t, acc, table, evidence)
    gyr = _gyr(table, roles, hints, columns, clock.t, acc, evidence)
    mag = _mag(table, roles, hints, columns, evidence)
    if mag is not None and "mag" not in hints.map:
        mag = _check_field(clock.t, gyr, mag, evidence)
    truth = find_truth(table, roles, columns, acc, found)
    place = find_temperature(table.names, _used(roles))
    warmth = None if place is None or place not in columns else celsius(table.names[place], columns[place])
    meta: dict[str, Any] = {
        "source": table.source,
        "notes": notes(found),
        "conclusions": tuple(found),
        "ignored": [name for name in roles.ignored if warmth is None or place is None or name != table.names[place]],
        "units": list_units(evidence.found),
        "columns": {role: [table.names[i] for i in positions] for role, positions in roles.columns.items()},
    }
    if clock.t0 is not None:
        meta["t0"] = clock.t0
    if mag is not None and evidence.found.get("mag") == RELATIVE:
        meta["mag_unit"] = RELATIVE
    return Recording(clock.t, gyr, acc, mag, truth, meta, temperature=warmth)


def _refuse_gravity(table: Table, roles: Roles, columns: dict[int, Column]) -> None:
    if is_gravity(stack(columns, roles.columns["gyr"]), stack(columns, roles.columns["acc"])):
        names = ", ".join(table.names[i] for i in roles.columns["gyr"])
        raise LevelheadError(
            f"{table.source}: {names} keep one length while they turn and stay along the accelerometer: they are the "
            "direction of gravity, not rates; expected a gyroscope, such as gyr_x, gyr_y, gyr_z, or the hint map gyr=…"
        )


def _one_unit(roles: Roles, columns: dict[int, Column], found: list[Conclusion]) -> dict[int, Column]:
    """The columns, of rows in which several units of sensors take turns those of the first."""
    turns = count_turns(stack(columns, roles.columns["acc"]))
    if turns == 1:
        return columns
    found.append(Conclusion("sensor", "rows_in_turn", 1, Basis.GUESS, {"count": turns}))
    return {i: column[::turns] for i, column in columns.items()}


def _used(roles: Roles) -> set[int]:
    """Positions of the columns that have a role."""
    return {i for positions in roles.columns.values() for i in positions}


def _is_merged(conclusions: Sequence[Conclusion]) -> bool:
    """Whether readings of one sensor were set to another's stamps."""
    return any((one.about, one.reason) in MERGED for one in conclusions)


def _read(table: Table, hints: Hints) -> tuple[Roles, dict[int, Column]]:
    """The roles and their columns; columns in which nothing stands are no candidates, where there are others."""
    words = words_of(table)
    filled = frozenset(range(len(table.names))) - words if words else None
    first: LevelheadError | None = None
    for _ in range(4):
        try:
            roles = assign(
                table.names, hints.map, table.source, frozenset(hints.scale), sensor=hints.sensor,
                context=table.context, filled=filled,
            )  # fmt: skip
        except LevelheadError as error:
            raise first or suggest(error, table, hints) from None
        times = roles.columns.get("t", ())
        used = _used(roles)
        place = find_temperature(table.names, used | words)
        wanted = sorted(used if place is None else used | {place})
        columns = table.read(wanted, frozenset(times))
        if len(columns[wanted[0]]) == 0:
            raise LevelheadError(f"{table.source} has no line of numbers; expected one line per sample")
        if (
            "acc" not in hints.map
            and lacks_gravity(stack(columns, roles.columns["acc"]))
            and "gravity" not in roles.columns
        ):
            rest = (frozenset(range(len(table.names))) if filled is None else filled) - set(roles.columns["acc"])
            with suppress(LevelheadError):
                other = assign(table.names, hints.map, table.source, frozenset(hints.scale), sensor=hints.sensor,
                               context=table.context, filled=rest)  # fmt: skip
                del other
                filled = rest
                continue
        empty = {i for role, positions in roles.columns.items() if role in {"t", "gyr", "acc"} and role not in hints.map
                 for i in positions if np.isnan(columns[i]).all()}  # fmt: skip
        if not empty:
            untimed = not {"t"} & {*roles.columns, *hints.map} and hints.rate is None and table.rate is None
            return with_clock(table, roles, columns) if untimed else (roles, columns)
        name = next(table.names[i] for i in sorted(empty))
        first = first or LevelheadError(f"{table.source}, column '{name}': every value is missing; expected numbers")
        filled = (frozenset(range(len(table.names))) if filled is None else filled) - empty
    raise first or LevelheadError(f"{table.source} has too many empty columns")


def clock_of(table: Table, roles: Roles, hints: Hints, columns: dict[int, Column], found: list[Conclusion]) -> Clock:
    """The time stamps of the columns that were read: those of the file, or rows over the rate.

    Raises:
        LevelheadError: no stamps and no rate, both of them, or stamps that are none.
    """
    n = len(next(iter(columns.values())))
    if "t" in roles.columns:
        positions = roles.columns["t"]
        if hints.rate is not None:
            raise LevelheadError(
                f"{table.source} has time stamps in column '{table.names[positions[0]]}', and rate={hints.rate:g} is "
                "given too; leave out the rate, or leave out the stamps with the hint map t="
            )
        given = [_candidate(table, i, hints, columns[i]) for i in sorted(positions)]
        joined = join_seconds(given)
        if len(joined) == len(given):
            joined = [_candidate(table, i, hints, columns[i]) for i in positions]
        chosen, choice = choose(joined)
        found += choice
        sensors = [i for role in ("gyr", "acc", "mag") for i in roles.columns.get(role, ())]
        values = stack(columns, sensors) if sensors else None
        try:
            clock = seconds(chosen.stamps, chosen.declared, table, chosen.name, values, hints.session)
        except CounterError as error:
            raise _without_counter(error, roles, columns) from None
        if not _is_merged(table.conclusions):
            clock = restore(clock, chosen.name, values)
        found += clock.conclusions
        return clock
    if hints.rate is not None and table.rate is not None and "t" not in hints.map:
        raise LevelheadError(
            f"{table.source} says itself that its rate is {table.rate:g} Hz; leave out rate={hints.rate:g}, "
            "or insist on it with the hint map t="
        )
    rate = hints.rate or table.rate
    if rate is None:
        scale = find_scale("gyr", table, roles, hints, [])
        guess, said = guess_rate(roles, columns, None if scale is None else scale.factor / scale.divisor)
        raise NeedsHints(
            f"{table.source} has no column with time stamps; expected such as 't' or 'time_ms', or the hint map t=…, "
            f"or the hint rate=… in Hz{said}",
            rate=guess,
        )
    reason, basis = ("file", Basis.HEADER) if hints.rate is None else ("hint", Basis.HINT)
    found.append(Conclusion("t.rate", reason, rate, basis))
    return Clock(np.arange(n) / rate, "s", None, [])


def _without_counter(error: CounterError, roles: Roles, columns: dict[int, Column]) -> NeedsHints:
    """The error of stamps that count the rows, with the hint that gravity's turn suggests: ms, or a rate."""
    rate, said = guess_rate(roles, columns)
    if rate > _NEARLY_MS:
        return error
    return NeedsHints(f"{error}{said}", map={"t": []}, rate=rate)


def _dense(
    table: Table, roles: Roles, clock: Clock, columns: dict[int, Column], found: list[Conclusion]
) -> tuple[Clock, dict[int, Column]]:
    """The rows with a gyroscope, the accelerometer interpolated, where the two stand on different rows.

    Raises:
        LevelheadError: complete samples are rarer than ``SLOWEST``.
    """
    gyr, acc = (np.isfinite(stack(columns, roles.columns[role])).all(axis=1) for role in ("gyr", "acc"))
    both: NDArray[np.bool_] = np.logical_and(gyr, acc)
    if len(clock.t) > 20 and both.mean() < 0.2 and min(float(gyr.mean()), float(acc.mean())) > 0.15:
        kept = np.flatnonzero(gyr)
        placed = {i: column[kept] for i, column in columns.items()}
        for i in roles.columns["acc"]:
            placed[i] = np.interp(clock.t[kept], clock.t[acc], columns[i][acc].astype(np.float64))
        found.append(Conclusion("acc.stamps", "other_rows", "interpolated", Basis.NUMBERS))
        return clock._replace(t=clock.t[kept]), placed
    t = clock.t[both]
    if len(clock.t) > 10 and (t.size < 3 or both.mean() < RARE or median(np.diff(t)) > SLOWEST):
        every = f"one every {median(np.diff(t)):.2g} s" if len(t) > 2 else f"{len(t)} in all"
        raise LevelheadError(
            f"{table.source} has too few samples in which gyroscope and accelerometer are both there: {every} "
            f"({int(both.sum())} of {len(both)} rows); expected one every {SLOWEST:g} s or more often"
        )
    return clock, columns


def _candidate(table: Table, position: int, hints: Hints, stamps: Column) -> Candidate:
    name = table.names[position]
    unit = table.column_units.get(position) or table.units.get("t")
    if unit is None and "t" not in hints.scale:
        unit = unit_in(name, "t", table.source)
    return Candidate(name, stamps, hints.scale.get("t") or unit)


def _acc(table: Table, roles: Roles, hints: Hints, columns: dict[int, Column], t: Array, evidence: Evidence) -> Array:
    """The (n, 3) specific force in m/s²; the gyroscope helps to judge its unit."""
    positions = roles.columns["acc"]
    values = _values("acc", table, positions, columns)
    scale = find_scale("acc", table, roles, hints, evidence.conclusions)
    gravity = stack(columns, roles.columns["gravity"]) if "gravity" in roles.columns else None
    values, scale = whole_acceleration(values, scale, gravity, [table.names[i] for i in positions], evidence)
    rows = unit_inference.excerpt(len(t))
    rates = stack({i: columns[i][rows] for i in roles.columns["gyr"]}, roles.columns["gyr"])
    turning = Turning(rows, t[rows], rates, find_scale("gyr", table, roles, hints, []))
    scale = acc_scale(values, scale, "acc" in hints.scale, turning, table, evidence)
    evidence.found["acc"] = scale.name
    scaled = _scale_columns("acc", values, scale, table, positions)
    if "acc" not in hints.map and points_down([*table.names, *table.origin], scale, gravity, evidence):
        return -scaled
    return scaled


def _gyr(
    table: Table, roles: Roles, hints: Hints, columns: dict[int, Column], t: Array, acc: Array, evidence: Evidence
) -> Array:
    """The (n, 3) rates in rad/s; ``acc`` (n, 3) m/s² helps to judge their unit."""
    positions = roles.columns["gyr"]
    values = _values("gyr", table, positions, columns)
    scale = find_scale("gyr", table, roles, hints, evidence.conclusions)
    mag = stack(columns, roles.columns["mag"]) if "mag" in roles.columns else None
    scale = gyr_scale(values, scale, "gyr" in hints.scale, t, acc, mag, table, evidence)
    evidence.found["gyr"] = scale.name
    return _scale_columns("gyr", values, scale, table, positions)


def _mag(table: Table, roles: Roles, hints: Hints, columns: dict[int, Column], evidence: Evidence) -> Array | None:
    """The (n, 3) field in µT, or without unit; None if there is none."""
    if "mag" not in roles.columns:
        return None
    positions = roles.columns["mag"]
    values = _values("mag", table, positions, columns)
    known = values[~np.isnan(values).any(axis=1)]
    if len(known) == 0:
        evidence.conclusions.append(Conclusion("mag.used", "incomplete", False, Basis.NUMBERS))
        return None
    if not known.any():
        evidence.conclusions.append(Conclusion("mag.used", "zero", False, Basis.NUMBERS))
        return None
    said = find_scale("mag", table, roles, hints, evidence.conclusions)
    relative = roles.units.get("mag") == RELATIVE
    if "mag" not in hints.scale and is_normalised(values):
        evidence.conclusions.append(Conclusion("mag.unit", "normalised", None, Basis.NUMBERS))
        said, relative = None, True
    scale = mag_scale(values, said, relative, evidence)
    evidence.found["mag"] = RELATIVE if scale is None else scale.name
    return values if scale is None else _scale_columns("mag", values, scale, table, positions)


def _check_field(t: Array, gyr: Array, mag: Array, evidence: Evidence) -> Array | None:
    """The field, or None if it does not turn with the body: then it would teach a wrong heading."""
    turn = field_turn(t, gyr, mag)
    if turn is None or not turn.unusable:
        return mag
    length = unit_inference.median_norm(mag)
    facts = {"correlation": turn.correlation, "scale": turn.scale, "free": turn.free, "length": length}
    confirm: ReadOnlyFields = {"map": {"mag": []}}
    evidence.conclusions.append(Conclusion("mag.used", "does_not_turn", False, Basis.NUMBERS, facts, confirm))
    evidence.found.pop("mag", None)
    return None


def _values(role: str, table: Table, positions: Sequence[int], columns: dict[int, Column]) -> Array:
    values = stack(columns, positions)
    for i, column in zip(positions, values.T, strict=True):
        if np.isnan(column).all() and role != "mag":
            raise LevelheadError(f"{table.source}, column '{table.names[i]}': every value is missing; expected numbers")
    infinite = np.isinf(values)
    if infinite.any():
        row, axis = (int(k) for k in np.argwhere(infinite)[0])
        raise LevelheadError(
            f"{table.source}, {table.where(row)}, column '{table.names[positions[axis]]}': the value is infinite; "
            "expected a finite number, or a blank cell for a missing one"
        )
    return values


def _scale_columns(role: str, values: Array, scale: Scale, table: Table, positions: Sequence[int]) -> Array:
    if scale.factor == scale.divisor == 1.0:
        return values
    for i, column in zip(positions, values.T, strict=True):  # in place: a long recording's arrays are large
        scaled = column * (scale.factor / scale.divisor)
        beyond = np.isinf(scaled)
        if beyond.any():
            row = int(beyond.argmax())
            raise LevelheadError(
                f"{table.source}, {table.where(row)}, column '{table.names[i]}': {column[row]:.4g} {scale.name} is "
                f"beyond all numbers; expected a value of the {MEANING[role]}"
            )
        column[:] = scaled
    return values
