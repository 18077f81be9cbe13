"""From a table to a Recording: ``interpret`` finds the meaning of its columns, ``apply`` uses it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.open_types import ReadOnlyJson
from levelhead.recording import Array, Recording, median
from levelhead.signals.field_turn import field_turn, free_correlation, is_normalised
from levelhead.signals.gravity_turn import excerpt, median_norm
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import MEANING, Hints, Scale
from levelhead.sources.interpret.accelerometer import GyroscopeRows, acc_scale
from levelhead.sources.interpret.choice import choose_columns
from levelhead.sources.interpret.clock import MAX_LOSS, MIN_DURATION, MIN_ROWS, FoundClock, apply_clock, find_clock
from levelhead.sources.interpret.declared import declared_scale
from levelhead.sources.interpret.evidence import Evidence
from levelhead.sources.interpret.gyroscope import gyr_scale
from levelhead.sources.interpret.interleaved_rows import count_interleaved
from levelhead.sources.interpret.magnetometer import is_explained_by_offset, mag_scale
from levelhead.sources.interpret.reference_columns import judge_reference, make_reference
from levelhead.sources.interpret.roles import Roles
from levelhead.sources.interpret.sign import add_gravity, judge_start, sign_of_acceleration
from levelhead.sources.interpret.temperature import celsius, find_temperature, temperature_scale
from levelhead.sources.interpretation import RELATIVE_SCALE, SENSORS, Interpretation
from levelhead.sources.names.column_name import RELATIVE
from levelhead.sources.table import Column, Table, stack

MAX_INTERVAL = 0.75  # s between complete samples; at half a turn a second, 135 degrees lie between them
RARE = 0.05  # share of complete rows below which a log is refused


class Readings(NamedTuple):
    """Columns of a table on the rows that are kept, and their time.

    Attributes:
        t: (n,) s.
        columns: position to (n,) numbers as they stand in the table.
        interpolates_acc: whether the accelerometer was set to the gyroscope's rows.
    """

    t: Array
    columns: Mapping[int, Column]
    interpolates_acc: bool = False


def interpret(table: Table, hints: Hints) -> Interpretation:
    """The meaning of the columns of ``table``: by hints, header, vendor, or their numbers.

    Raises:
        LevelheadError: one sentence with file, line and column; ``NeedsHints`` where a hint would settle it.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return _interpret(table, hints)


def apply(found: Interpretation, table: Table) -> Recording:
    """The Recording of a table by an interpretation of it, or of another part of the same log.

    Raises:
        LevelheadError: a value is infinite, or stamps do not increase.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return _apply(found, table)


def _interpret(table: Table, hints: Hints) -> Interpretation:
    roles, columns = choose_columns(table, hints)
    made: list[Conclusion] = [*table.conclusions, *roles.conclusions]
    stride = count_interleaved(stack(columns, roles.columns["acc"]))
    if stride > 1:
        columns = {i: column[::stride] for i, column in columns.items()}
        made.append(Conclusion("sensor", "rows_in_turn", 1, Basis.GUESS, {"count": stride}))
    clock = find_clock(table, roles, hints, columns)
    made += clock.conclusions
    readings = _complete_rows(table, roles, clock, columns)
    if readings.interpolates_acc:
        made.append(Conclusion("acc.stamps", "other_rows", "interpolated", Basis.NUMBERS))
    evidence = Evidence(made)
    scales: dict[str, Scale] = {}
    unused: set[str] = set()
    acc = _interpret_acc(table, roles, hints, readings, evidence, scales)
    gyr = _interpret_gyr(table, roles, hints, readings, acc, evidence, scales)
    if not _interpret_mag(table, roles, hints, readings, gyr, evidence, scales):
        unused.add("mag")
    if "q" in roles.columns and not judge_reference(table, roles, readings.columns, acc, made):
        unused.add("q")
    positions = _positions(table, roles, clock, readings, evidence, scales)
    used = {i for role in positions for i in positions[role]}
    return Interpretation(
        source=table.source,
        columns={role: tuple(table.names[i] for i in places) for role, places in positions.items()},
        scales=scales,
        clock=clock.rule,
        conclusions=tuple([*made, *_undisputed(table, roles, hints, scales, made)]),
        streamable=not (clock.rule.repairs or stride > 1 or readings.interpolates_acc or _needs_all(table)),
        ignored=tuple(name or f"(column {i + 1})" for i, name in enumerate(table.names) if i not in used),
        unused=frozenset(unused & positions.keys()),
        stride=stride,
        interpolates_acc=readings.interpolates_acc,
        positions=positions,
        hints=hints,
    )


def _apply(found: Interpretation, table: Table) -> Recording:
    positions = _find_positions(found, table)
    times = positions.get("t", ())
    columns = table.read(sorted({i for places in positions.values() for i in places}), frozenset(times))
    if found.stride > 1:
        columns = {i: column[:: found.stride] for i, column in columns.items()}
    n = len(next(iter(columns.values())))
    rows: NDArray[np.intp] | None = None
    if times:
        sensors = stack(columns, [i for role in SENSORS for i in positions.get(role, ())])
        t, rows = apply_clock(found.clock, table, found.clock.stamps([columns[i] for i in times]), sensors)
    else:
        t = found.clock.rows(n)
    if rows is not None:
        columns = {i: column[rows] for i, column in columns.items()}
    if found.interpolates_acc:
        t, columns = _set_to_gyroscope(t, columns, positions["gyr"], positions["acc"])
    values: dict[str, Array | None] = {"mag": None}
    for role in SENSORS:
        if role in positions and role not in found.unused:
            values[role] = _scaled(found, role, table, positions, columns)
    truth = make_reference(found, table, positions, columns)
    warmth = None
    if "temperature" in positions:
        warmth = celsius(found.scales["temperature"], columns[positions["temperature"][0]])
    gyr, acc = values["gyr"], values["acc"]
    assert gyr is not None and acc is not None
    return Recording(t, gyr, acc, values["mag"], truth, found.meta() | {"source": table.source}, temperature=warmth)


def _find_positions(found: Interpretation, table: Table) -> Mapping[str, tuple[int, ...]]:
    """Role to the positions of its columns in a table, which may have others beside them."""
    names = list(table.names)
    same = all(
        names[i : i + 1] == [name]
        for role, places in found.positions.items()
        for i, name in zip(places, found.columns[role], strict=True)
    )
    if same:
        return found.positions
    missing = [name for wanted in found.columns.values() for name in wanted if name not in names]
    if missing:
        raise LevelheadError(f"{table.source} has no column '{missing[0]}', which its beginning has")
    return {role: tuple(names.index(name) for name in wanted) for role, wanted in found.columns.items()}


def _scaled(
    found: Interpretation, role: str, table: Table, positions: Mapping[str, tuple[int, ...]],
    columns: Mapping[int, Column],
) -> Array:  # fmt: skip
    """The (n, 3) readings of a sensor in SI units, or without unit."""
    values = _values(table, positions[role], columns)
    if role == "acc" and "gravity" in positions:
        values = values + stack(columns, positions["gravity"])
    return _scale_columns(role, values, found.scales[role], table, positions[role])


def _positions(
    table: Table, roles: Roles, clock: FoundClock, readings: Readings, evidence: Evidence, scales: dict[str, Scale]
) -> dict[str, tuple[int, ...]]:
    """Role to the positions of the columns that are used; adds the scale of a temperature."""
    made = dict(roles.columns)
    if "t" in made:
        made["t"] = clock.positions
    if not evidence.adds_gravity:
        made.pop("gravity", None)
    place = find_temperature(table.names, roles.used)
    if place is not None and place in readings.columns:
        scale = temperature_scale(table.names[place], readings.columns[place])
        if scale is not None:
            made["temperature"], scales["temperature"] = (place,), scale
    return made


def _undisputed(
    table: Table, roles: Roles, hints: Hints, scales: Mapping[str, Scale], made: Sequence[Conclusion]
) -> list[Conclusion]:
    """Conclusions about columns and units of which header or hints left no choice."""
    known = {one.about for one in made}
    own_names = {"columns", "clock"} & known  # of this program, not of the file
    found = []
    for role in ("gyr", "acc", "mag", "q"):
        if role in roles.columns and f"{role}.columns" not in known and not own_names:
            names = ", ".join(table.names[i] for i in roles.columns[role])
            reason, basis = ("hint", Basis.HINT) if role in roles.mapped else ("named", Basis.HEADER)
            found.append(Conclusion(f"{role}.columns", reason, names, basis))
        if role in scales and not {f"{role}.unit", f"{role}.used"} & known:
            reason, basis = ("hint", Basis.HINT) if role in hints.scale else ("declared", Basis.HEADER)
            found.append(Conclusion(f"{role}.unit", reason, scales[role].name, basis))
    return found


def _needs_all(table: Table) -> bool:
    """Whether the rows of a table are not those of its file."""
    return any(one.about in _REARRANGED or one.reason == "torn" for one in table.conclusions)


_REARRANGED = {"rows", "clock", "sensor", "columns"}


def _complete_rows(table: Table, roles: Roles, clock: FoundClock, columns: Mapping[int, Column]) -> Readings:
    """The rows that the clock keeps; those with a gyroscope, where gyroscope and accelerometer stand on other rows.

    Raises:
        LevelheadError: complete samples are rarer than ``MAX_INTERVAL``, or few are left of the rows.
    """
    if clock.rows is not None:
        columns = {i: column[clock.rows] for i, column in columns.items()}
    t = clock.t
    gyr, acc = (_finite_rows(columns, roles.columns[role]) for role in ("gyr", "acc"))
    both: NDArray[np.bool_] = np.logical_and(gyr, acc)
    if len(t) > 20 and both.mean() < 0.2 and min(float(gyr.mean()), float(acc.mean())) > 0.15:
        return Readings(*_set_to_gyroscope(t, columns, roles.columns["gyr"], roles.columns["acc"]), True)
    complete = t[both]
    lost = len(t) - complete.size > MAX_LOSS * len(t)
    few = complete.size < MIN_ROWS or float(complete[-1] - complete[0]) < MIN_DURATION
    if len(t) > MIN_ROWS and ((lost and few) or both.mean() < RARE or median(np.diff(complete)) > MAX_INTERVAL):
        every = f"one every {median(np.diff(complete)):.2g} s" if len(complete) > 2 else f"{len(complete)} in all"
        raise LevelheadError(
            f"{table.source} has too few samples in which gyroscope and accelerometer are both there: {every} "
            f"({int(both.sum())} of {len(both)} rows); expected one every {MAX_INTERVAL:g} s or more often"
        )
    return Readings(t, columns)


def _finite_rows(columns: Mapping[int, Column], positions: Sequence[int]) -> NDArray[np.bool_]:
    """(n,) whether all of some columns have a finite number."""
    found: NDArray[np.bool_] = np.logical_and.reduce([np.isfinite(columns[i]) for i in positions])
    return found


def _set_to_gyroscope(
    t: Array, columns: Mapping[int, Column], gyr: Sequence[int], acc: Sequence[int]
) -> tuple[Array, dict[int, Column]]:
    """Time and columns on the rows with a gyroscope, the accelerometer interpolated."""
    kept, there = (np.isfinite(stack(columns, positions)).all(axis=1) for positions in (gyr, acc))
    placed = {i: column[kept] for i, column in columns.items()}
    for i in acc:
        placed[i] = np.interp(t[kept], t[there], columns[i][there].astype(np.float64))
    return t[kept], placed


def _interpret_acc(
    table: Table, roles: Roles, hints: Hints, readings: Readings, evidence: Evidence, scales: dict[str, Scale]
) -> Array:
    """The (n, 3) specific force in m/s²; the gyroscope helps to judge its unit."""
    positions, columns, t = roles.columns["acc"], readings.columns, readings.t
    _refuse_empty(table, positions, columns)
    values = _values(table, positions, columns)
    scale = declared_scale("acc", table, roles, hints, evidence.conclusions)
    gravity = stack(columns, roles.columns["gravity"]) if "gravity" in roles.columns else None
    values, scale = add_gravity(values, scale, gravity, [table.names[i] for i in positions], evidence)
    rows = excerpt(len(t))
    rates = stack({i: columns[i][rows] for i in roles.columns["gyr"]}, roles.columns["gyr"])
    turning = GyroscopeRows(rows, t[rows], rates, declared_scale("gyr", table, roles, hints, []))
    scale = acc_scale(values, scale, "acc" in hints.scale, turning, table, evidence)
    sign = 1.0 if "acc" in hints.map else sign_of_acceleration([*table.names, *table.origin], scale, gravity, evidence)
    scales["acc"] = replace(scale, factor=sign * scale.factor)
    acc = _scale_columns("acc", values, scales["acc"], table, positions)
    if not {"acc"} & {*hints.map, *hints.scale}:
        judge_start(t, acc, scale.name, table, evidence)
    return acc


def _interpret_gyr(
    table: Table, roles: Roles, hints: Hints, readings: Readings, acc: Array, evidence: Evidence,
    scales: dict[str, Scale],
) -> Array:  # fmt: skip
    """The (n, 3) rates in rad/s; ``acc`` (n, 3) m/s² helps to judge their unit."""
    positions = roles.columns["gyr"]
    _refuse_empty(table, positions, readings.columns)
    values = _values(table, positions, readings.columns)
    scale = declared_scale("gyr", table, roles, hints, evidence.conclusions)
    mag = stack(readings.columns, roles.columns["mag"]) if "mag" in roles.columns else None
    scales["gyr"] = gyr_scale(values, scale, "gyr" in hints.scale, readings.t, acc, mag, table, evidence)
    return _scale_columns("gyr", values, scales["gyr"], table, positions)


def _interpret_mag(
    table: Table, roles: Roles, hints: Hints, readings: Readings, gyr: Array, evidence: Evidence,
    scales: dict[str, Scale],
) -> bool:  # fmt: skip
    """Whether the field may turn with the body, perhaps with a constant offset: any other makes heading wrong.

    Its scale is found.
    """
    if "mag" not in roles.columns:
        return False
    scales["mag"] = RELATIVE_SCALE
    positions = roles.columns["mag"]
    values = _values(table, positions, readings.columns)
    known = values[~np.isnan(values).any(axis=1)]
    if len(known) == 0 or not known.any():
        evidence.conclusions.append(
            Conclusion("mag.used", "zero" if len(known) else "incomplete", False, Basis.NUMBERS, {}, _LEAVE_OUT)
        )
        return False
    declared = declared_scale("mag", table, roles, hints, evidence.conclusions)
    relative = roles.units.get("mag") == RELATIVE
    if "mag" not in hints.scale and is_normalised(values):
        evidence.conclusions.append(Conclusion("mag.unit", "normalised", None, Basis.NUMBERS))
        declared, relative = None, True
    turn = field_turn(readings.t, gyr, values)
    scales["mag"] = mag_scale(values, declared, relative, evidence, turn) or RELATIVE_SCALE
    mag = _scale_columns("mag", values, scales["mag"], table, positions)
    if "mag" in hints.map or turn is None or not turn.unusable:
        return True
    free = free_correlation(readings.t, gyr, values)
    facts = {
        "correlation": turn.correlation, "scale": turn.scale, "offset": turn.offset, "free": free,
        "length": median_norm(mag),
    }  # fmt: skip
    if is_explained_by_offset(turn, free):
        evidence.conclusions.append(Conclusion("mag.used", "offset", True, Basis.NUMBERS, facts))
        return True
    evidence.conclusions.append(Conclusion("mag.used", "does_not_turn", False, Basis.NUMBERS, facts, _LEAVE_OUT))
    return False


_LEAVE_OUT: ReadOnlyJson = {"map": {"mag": []}}


def _refuse_empty(table: Table, positions: Sequence[int], columns: Mapping[int, Column]) -> None:
    for i in positions:
        if np.isnan(columns[i]).all():
            raise LevelheadError(f"{table.source}, column '{table.names[i]}': every value is missing; expected numbers")


def _values(table: Table, positions: Sequence[int], columns: Mapping[int, Column]) -> Array:
    values = stack(columns, positions)
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
