"""From tables to one recording: which table holds which sensor, and their clocks side by side."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array, median
from levelhead.sources.conclusion import Basis, Conclusion
from levelhead.sources.hints import MEANING, Hints, NeedsHints, Scale, SuggestsCommand
from levelhead.sources.interpret.clock_choice import Candidate, choose, join_seconds, seconds
from levelhead.sources.interpret.scales import lacks_gravity
from levelhead.sources.join.division import divide
from levelhead.sources.join.windows import unroll
from levelhead.sources.names.column_groups import (
    ColumnGroup,
    best_pair,
    best_partner,
    group_axes,
    made_group,
    order_positions,
)
from levelhead.sources.names.column_name import split, understand, unit_in
from levelhead.sources.table import ArrayTable, Column, Table

NANO = 1_000_000_000
_SLOW = 1.5  # the accelerometer's interval in gyroscope's ones from which the note says that values lie between
_HOLE = 4.0  # own intervals across which nothing is interpolated


class TableSensor(NamedTuple):
    """One sensor in one table."""

    role: str
    table: Table
    group: ColumnGroup


def single_table(source: str, tables: Sequence[Table], hints: Hints) -> tuple[Table, Hints]:
    """One table of those in ``source``, and the hints that are left for it.

    Raises:
        LevelheadError: a sensor is missing, or there are several whole recordings.
    """
    tables = [part for table in tables for part in divide(table, hints)]
    if len(tables) == 1:
        return tables[0], hints
    if hints.sensor is not None:
        named = [table for table in tables if hints.sensor.lower() in table.context.lower()]
        tables = named or tables
    tables = join_tables(source, [unroll(table) for table in tables])
    whole = [table for table in tables if {"gyr", "acc"} <= sensors_of(table)]
    if len(whole) == 1 or (whole and {Path(table.source).suffix for table in whole} and _one_file(whole)):
        table = _with_mag(whole[0], tables, source)
        left = _without_sensor(hints, whole[0])
        return table, left if table is whole[0] else replace(left, scale=_without_time(left))
    if whole:
        listed = ", ".join(table.context for table in whole[:4])
        inside = Path(whole[0].source).is_file()
        raise SuggestsCommand(
            f"{source} holds {len(whole)} recordings: {listed}{', …' if len(whole) > 4 else ''}; name one of them",
            whole[0].source if inside else source,
            **({} if inside and whole[0].source != source else {"sensor": whole[0].context}),
        )
    return _merge_tables(source, tables, hints), _for_merged(hints)


def _one_file(tables: Sequence[Table]) -> bool:
    """Whether tables come from one file: several units side by side, the first of which is taken."""
    return len({table.source for table in tables}) == 1


def _with_mag(table: Table, tables: Sequence[Table], source: str) -> Table:
    """A table with the magnetometer of another one of the same file beside it, if it has none."""
    if "mag" in sensors_of(table) or not any("mag" in sensors_of(other) for other in tables):
        return table
    try:
        return _merge_tables(source, [table, *[other for other in tables if other is not table]], Hints())
    except LevelheadError:
        return table


def _without_sensor(hints: Hints, table: Table) -> Hints:
    if hints.sensor is None or hints.sensor.lower() not in table.context.lower():
        return hints
    return replace(hints, sensor=None)


def _for_merged(hints: Hints) -> Hints:
    """Of a merged table the columns are chosen already, and stamps are in ns."""
    names = {role: names for role, names in hints.map.items() if not names}
    return replace(hints, map=names, scale=_without_time(hints), sensor=None)


def _without_time(hints: Hints) -> Mapping[str, Scale]:
    """The scales of the sensors."""
    return {role: scale for role, scale in hints.scale.items() if role != "t"}


def sensors_of(table: Table) -> set[str]:
    """Which of "gyr", "acc", "mag" and "t" the names of a table's columns give."""
    known = [understand(name, table.context) for name in table.names]
    found = {role for role in ("gyr", "acc", "mag") if group_axes(role, known, None)[0]}
    return found | ({"t"} if any(name.role == "t" for name in known) else set())


def _streams(table: Table) -> list[TableSensor]:
    """The sensors in a table."""
    known = [understand(name, table.context) for name in table.names]
    found = []
    for role in ("gyr", "acc", "mag"):
        for axes in group_axes(role, known, None)[0]:
            positions = order_positions(role, axes)
            group = made_group(positions, [table.names[i] for i in positions], table.context)
            found.append(TableSensor(role, table, group))
    return found


def join_tables(source: str, tables: Sequence[Table]) -> list[Table]:
    """Tables without a clock side by side with one that has a clock only, or with each other, if they are as long.

    One axis in each file, or time in a file of its own.
    """
    bare = [table for table in tables if "t" not in sensors_of(table) and table.rate is None]
    clocks = [
        table
        for table in tables
        if "t" in sensors_of(table) and len(table.names) <= 2 and not sensors_of(table) - {"t"}
    ]
    if len(bare) < 2 and not (bare and clocks):
        return list(tables)
    parts = [*clocks, *bare]
    columns: dict[str, Column] = {}
    length: int | None = None
    for table in parts:
        wanted = list(range(len(table.names)))
        for i, column in table.read(wanted, frozenset(wanted)).items():
            if length is None:
                length = len(column)
            if abs(len(column) - length) > max(1, 0.001 * length):
                continue
            name = table.names[i]
            single = len(table.names) == 1
            useful = understand(name).role or not table.context
            title = name if useful and not name.isdigit() else table.context if single else f"{table.context} {name}"
            columns.setdefault(title, column)
    shortest = min((len(column) for column in columns.values()), default=0)
    found = [conclusion for table in parts for conclusion in table.conclusions]
    merged = ArrayTable(source, {name: column[:shortest] for name, column in columns.items()}, conclusions=_once(found))
    return [*(table for table in tables if table not in parts), merged] if sensors_of(merged) - {"t"} else list(tables)


def _merge_tables(source: str, tables: Sequence[Table], hints: Hints) -> ArrayTable:
    """One table on the gyroscope's stamps: the accelerometer interpolated, the magnetometer at the nearest sample.

    Raises:
        LevelheadError: no gyroscope or no accelerometer, no stamps, clocks that do not overlap.
    """
    streams = [stream for table in tables for stream in _streams(table)]
    groups = {role: [one for one in streams if one.role == role] for role in ("gyr", "acc", "mag")}
    for role in ("gyr", "acc"):
        if not groups[role]:
            names = ", ".join(dict.fromkeys(table.context or Path(table.source).name for table in tables))
            raise LevelheadError(f"{source}: there is no {MEANING[role]} among {names}; expected one, with three axes")
    lost: list[Conclusion] = []
    with_gravity = [one for one in groups["acc"] if not _without_gravity(one)]
    if with_gravity and len(with_gravity) < len(groups["acc"]):
        less = [one for one in groups["acc"] if all(one is not kept for kept in with_gravity)]
        groups["acc"] = with_gravity
        rest = ", ".join(one.table.context for one in less)
        lost.append(Conclusion("acc.columns", "gravity_removed", None, Basis.NUMBERS, {"rest": rest}))
    gyr_group, acc_group = best_pair([one.group for one in groups["gyr"]], [one.group for one in groups["acc"]])
    gyr, acc = _of(groups["gyr"], gyr_group), _of(groups["acc"], acc_group)
    mag_group = best_partner([one.group for one in groups["mag"]], gyr_group)
    mag = _of(groups["mag"], mag_group) if mag_group is not None else None
    taken = [gyr, acc, *([mag] if mag is not None else [])]
    found = [*lost, *(conclusion for one in taken for conclusion in one.table.conclusions)]
    clocks = {one.role: _clock(one, hints, found, absolute=True) for one in taken}
    if len({clock[2] for clock in clocks.values()}) > 1:  # some count from a date and others do not
        clocks = {one.role: _clock(one, hints, found, absolute=False) for one in taken}
    if not with_gravity and (gravity := _gravity_beside(tables, acc)) is not None:
        taken.append(gravity)
        clocks["gravity"] = _clock(gravity, hints, [], absolute=clocks["gyr"][2])
    arrays = _align_streams(source, taken, clocks, found)
    for role, sensor in (("gyr", gyr), ("acc", acc)):
        others = [one for one in groups[role] if one.table is not sensor.table]
        if others:
            shown = ", ".join(dict.fromkeys(one.table.context for one in others[:3]))
            facts = {"rest": shown}
            found.append(Conclusion(f"{role}.columns", "other_table", sensor.table.context, Basis.NUMBERS, facts))
    if acc.group.gravity_removed or gyr.table is not acc.table:
        parts = [f"{MEANING.get(one.role, one.role)} from {one.table.context or one.table.source}" for one in taken]
        found.append(Conclusion("clock", "merged", None, Basis.NUMBERS, {"parts": ", ".join(parts)}))
    units = {k: v for one in taken for k, v in one.table.units.items()}
    origin = [name for one in taken for name in one.table.names]
    return ArrayTable(source, arrays, units, conclusions=_once(found), origin=origin)


def _once(conclusions: Sequence[Conclusion]) -> list[Conclusion]:
    """The conclusions without repeats."""
    return [one for i, one in enumerate(conclusions) if one not in conclusions[:i]]


def _gravity_beside(tables: Sequence[Table], acc: TableSensor) -> TableSensor | None:
    """The gravity vector in a file or sheet of its own, where the accelerometer has none of it; None: there is none."""
    for table in tables:
        axes = {split(name)[0]: i for i, name in enumerate(table.names) if split(name)[:1] in (["x"], ["y"], ["z"])}
        if {"gravity", "grav"} & set(split(table.context)) and len(axes) == 3 and table is not acc.table:
            positions = [axes[axis] for axis in "xyz"]
            return TableSensor("gravity", table, made_group(positions, [table.names[i] for i in positions]))
    return None


def _without_gravity(one: TableSensor) -> bool:
    columns = one.table.read(list(one.group.positions))
    values = np.column_stack([columns[i] for i in one.group.positions]).astype(np.float64)
    return lacks_gravity(values)


def _of(streams: Sequence[TableSensor], group: ColumnGroup | None) -> TableSensor:
    return next(one for one in streams if one.group is group)


def _clock(one: TableSensor, hints: Hints, found: list[Conclusion], absolute: bool) -> tuple[Any, Any, bool]:
    """(stamps in ns, rows kept or None, whether they count from a date) of a stream.

    Of several clocks in its table, one that counts from a date if ``absolute``: time since a file's own start says
    nothing beside another file.
    """
    table = one.table
    known = [understand(name) for name in table.names]
    times = [i for i, name in enumerate(known) if name.role == "t"] or list(table.column_units)
    if not times:
        raise NeedsHints(f"{table.source} has no column with time stamps; expected such as 'time'", rate=100.0)
    columns = table.read([*times, *one.group.positions], frozenset(times))
    values = np.column_stack([columns[i] for i in one.group.positions]).astype(np.float64)
    options = []
    for i in times:
        try:
            unit = table.column_units.get(i) or unit_in(table.names[i], "t", table.source)
        except LevelheadError:
            continue
        options.append(Candidate(table.names[i], columns[i], hints.scale.get("t") or unit))
    options = join_seconds(options) or [Candidate(table.names[times[0]], columns[times[0]], None)]
    read = []
    for option in options:
        try:
            read.append((option, seconds(option.stamps, option.declared, table, option.name, values, hints.session)))
        except LevelheadError:
            if len(options) == 1:
                raise
    if not read:
        raise LevelheadError(f"{table.source} has no column with time stamps that increase")
    dated = [(option, clock) for option, clock in read if (clock.t0 is not None) == absolute] or read
    best, _ = choose([option for option, _ in dated])
    clock = next(clock for option, clock in dated if option is best)
    found += [conclusion for conclusion in clock.conclusions if conclusion.about != "t.start"]
    stamps = np.rint(clock.t * NANO).astype(np.int64) + (0 if clock.t0 is None else round(clock.t0 * NANO))
    return stamps, clock.rows, clock.t0 is not None


def _align_streams(
    source: str, taken: Sequence[TableSensor], clocks: Mapping[str, tuple[Any, Any, bool]], found: list[Conclusion]
) -> dict[str, Column]:
    """The streams as columns on the gyroscope's stamps."""
    values = {}
    for one in taken:
        columns = one.table.read(list(one.group.positions))
        stacked = np.column_stack([columns[i] for i in one.group.positions]).astype(np.float64)
        rows = clocks[one.role][1]
        values[one.role] = stacked if rows is None else stacked[rows]
    t = clocks["gyr"][0]
    inside = (t >= clocks["acc"][0][0]) & (t <= clocks["acc"][0][-1])
    if inside.sum() < 2:
        raise LevelheadError(
            f"{source}: gyroscope and accelerometer were not recorded at the same time; no stamp of "
            f"one lies within the other's"
        )
    if not inside.all():
        outside = int((~inside).sum())
        found.append(Conclusion("rows", "outside_overlap", outside, Basis.NUMBERS, {"count": len(t)}))
    kept = t[inside]
    arrays: dict[str, Column] = {"t [ns]": kept}
    for one in taken:
        stamps = clocks[one.role][0]
        if one.role == "gyr":
            placed = values["gyr"][inside]
        elif one.role in ("acc", "gravity"):
            placed = _interpolate(kept, stamps, values[one.role], found if one.role == "acc" else [])
        else:
            placed = _nearest(kept, stamps, values["mag"])
        for axis, position, column in zip("xyz", one.group.positions, placed.T, strict=True):
            unit = _unit(one, position)
            arrays[f"{one.role}_{axis}{f' [{unit}]' if unit else ''}"] = column
    return arrays


def _unit(one: TableSensor, position: int) -> str | None:
    role = "acc" if one.role == "gravity" else one.role
    return one.table.column_units.get(position) or unit_in(one.table.names[position], role, one.table.source)


def _interpolate(t: Any, stamps: Any, values: Array, found: list[Conclusion]) -> Array:
    """(n, 3) ``values`` at other stamps, by straight lines; NaN in holes."""
    if len(t) == len(stamps) and (t == stamps).all():
        return values
    step = median(np.diff(stamps)) if len(stamps) > 1 else NANO
    right = np.clip(np.searchsorted(stamps, t), 1, len(stamps) - 1)
    a, b = stamps[right - 1], stamps[right]
    part = ((t - a) / np.maximum(b - a, 1))[:, None]
    placed: Array = values[right - 1] + part * (values[right] - values[right - 1])
    placed[(b - a) > _HOLE * step + 0.1 * NANO] = np.nan
    placed[t == b] = values[right][t == b]
    own = median(np.diff(t)) if len(t) > 1 else step
    reason = "slower" if step > _SLOW * own else "own_clock"
    found.append(Conclusion("acc.stamps", reason, "interpolated", Basis.NUMBERS, {"rate": NANO / step}))
    return placed


def _nearest(t: Any, stamps: Any, values: Array) -> Array:
    """(n, 3) readings at the samples nearest in time, NaN elsewhere."""
    placed = np.full((len(t), 3), np.nan)
    right = np.clip(np.searchsorted(t, stamps), 1, max(1, len(t) - 1))
    nearest = np.where(
        np.abs(t[right - 1] - stamps) <= np.abs(t[np.minimum(right, len(t) - 1)] - stamps), right - 1, right
    )
    nearest = np.minimum(nearest, len(t) - 1)
    near = np.abs(t[nearest] - stamps) <= (median(np.diff(t)) if len(t) > 1 else NANO)
    placed[nearest[near]] = values[near]
    return placed
