"""From tables to one recording: which table holds which sensor, and their clocks side by side."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.recording import Array, median
from levelhead.signals.gravity_direction import keeps_length_of_gravity
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import MEANING, Hints, NeedsHints, Scale, SuggestsCommand
from levelhead.sources.interpret.accelerometer import lacks_gravity
from levelhead.sources.interpret.clock_choice import Candidate, beside_clock, choose, join_seconds, seconds, with_ticks
from levelhead.sources.interpret.roles import missing_sensor, plain_name
from levelhead.sources.interpret.suggestion import suggest
from levelhead.sources.join.division import divide
from levelhead.sources.join.windows import unroll
from levelhead.sources.names.column_groups import (
    ColumnGroup,
    best_pair,
    column_group,
    group_axes,
    nearest_group,
    order_positions,
)
from levelhead.sources.names.column_name import split, understand, unit_in
from levelhead.sources.table import ArrayTable, Column, Table

NANO = 1_000_000_000
_MIN_SLOW = 1.5  # the accelerometer's interval in gyroscope's ones from which it is called slower
_MAX_HOLE = 4.0  # own intervals across which values are interpolated
_MAX_LENGTH_SHARE = 0.001  # by which columns of other tables may be longer or shorter than the first one


class SensorColumns(NamedTuple):
    """The columns of one sensor in one table."""

    role: str
    table: Table
    group: ColumnGroup

    def read(self) -> Array:
        """(n, 3) numbers, as the table has them."""
        columns = self.table.read(list(self.group.positions))
        return np.column_stack([columns[i] for i in self.group.positions]).astype(np.float64)


class SensorClock(NamedTuple):
    """The clock of one sensor: stamps in ns, their rows (None: all), whether they count from a date."""

    stamps: NDArray[np.int64]
    rows: NDArray[np.intp] | slice | None
    dated: bool


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
    if whole and _one_file(whole):
        table = _with_mag(whole[0], tables, source)
        left = _without_sensor(hints, whole[0])
        return table, left if table is whole[0] else replace(left, scale=_without_time(left))
    if whole:
        raise _several(source, whole)
    return _merge_tables(source, tables, hints), _for_merged(hints)


def _several(source: str, whole: Sequence[Table]) -> SuggestsCommand:
    """The error of several recordings in one place, with the command that reads the first."""
    listed = ", ".join(table.context for table in whole[:4])
    inside = Path(whole[0].source).is_file()
    return SuggestsCommand(
        f"{source} holds {len(whole)} recordings: {listed}{', …' if len(whole) > 4 else ''}; name one of them",
        whole[0].source if inside else source,
        **({} if inside and whole[0].source != source else {"sensor": whole[0].context}),
    )


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


def _sensors(table: Table, rename: Callable[[str], str] | None = None) -> list[SensorColumns]:
    """The sensors in a table; with ``rename`` its accelerometers, by names that are changed before."""
    context = rename(table.context) if rename else table.context
    known = [understand(rename(name) if rename else name, context) for name in table.names]
    found = []
    for role in ("acc",) if rename else ("gyr", "acc", "mag"):
        for axes in group_axes(role, known, None)[0]:
            positions = order_positions(role, axes)
            group = column_group(positions, [table.names[i] for i in positions], table.context)
            found.append(SensorColumns(role, table, group))
    return found


def join_tables(source: str, tables: Sequence[Table]) -> list[Table]:
    """Tables without a clock side by side with one that has a clock only, or with each other, if they are as long.

    One axis in each file, or time in a file of its own.
    """
    bare = [table for table in tables if "t" not in sensors_of(table) and table.rate is None]
    clocks = [table for table in tables if len(table.names) <= 2 and sensors_of(table) == {"t"}]
    if len(bare) < 2 and not (bare and clocks):
        return list(tables)
    parts = [*clocks, *bare]
    found = [conclusion for table in parts for conclusion in table.conclusions]
    merged = ArrayTable(source, _columns_as_long_as_the_first(parts), conclusions=_once(found))
    return [*(table for table in tables if table not in parts), merged] if sensors_of(merged) - {"t"} else list(tables)


def _columns_as_long_as_the_first(tables: Sequence[Table]) -> dict[str, Column]:
    """The columns of all tables by name, but for those of another length than the first one's; cut to the shortest."""
    columns: dict[str, Column] = {}
    length: int | None = None
    for table in tables:
        wanted = list(range(len(table.names)))
        for i, column in table.read(wanted, frozenset(wanted)).items():
            length = len(column) if length is None else length
            if abs(len(column) - length) <= max(1, _MAX_LENGTH_SHARE * length):
                columns.setdefault(_title(table, i), column)
    shortest = min(map(len, columns.values()), default=0)
    return {name: column[:shortest] for name, column in columns.items()}


def _title(table: Table, position: int) -> str:
    """The name of a column beside those of other tables: its own, if that is clear, or its table's."""
    name = table.names[position]
    if (understand(name).role or not table.context) and not name.isdigit():
        return name
    return table.context if len(table.names) == 1 else f"{table.context} {name}"


def _merge_tables(source: str, tables: Sequence[Table], hints: Hints) -> ArrayTable:
    """One table on the gyroscope's stamps: the accelerometer interpolated, the magnetometer at the nearest sample.

    Raises:
        LevelheadError: no gyroscope or no accelerometer, no stamps, clocks that do not overlap.
    """
    groups = _sensors_by_role(source, tables)
    with_gravity = [sensor for sensor in groups["acc"] if not lacks_gravity(sensor.read())]
    less = [sensor for sensor in groups["acc"] if all(sensor is not kept for kept in with_gravity)]
    found: list[Conclusion] = []
    if with_gravity and less:
        groups["acc"] = with_gravity
        facts = {"rest": ", ".join(sensor.table.context for sensor in less)}
        found.append(Conclusion("acc.columns", "gravity_removed", None, Basis.NUMBERS, facts))
    chosen = _choose(groups)
    found += [conclusion for sensor in chosen.values() for conclusion in sensor.table.conclusions]
    clocks, said = _clocks(chosen, hints)
    found += said
    if not with_gravity and (gravity := _gravity_beside(tables, chosen["acc"])) is not None:
        chosen["gravity"] = gravity
        clocks["gravity"], _ = _clock(gravity, hints, clocks["gyr"].dated)
    arrays, said = _align(source, chosen, clocks)
    found += [*said, *_other_tables(groups, chosen)]
    if chosen["acc"].group.gravity_removed or chosen["gyr"].table is not chosen["acc"].table:
        parts = [f"{MEANING.get(role, role)} from {_place(sensor.table)}" for role, sensor in chosen.items()]
        found.append(Conclusion("clock", "merged", None, Basis.NUMBERS, {"parts": ", ".join(parts)}))
    units = {role: unit for sensor in chosen.values() for role, unit in sensor.table.units.items()}
    origin = [name for sensor in chosen.values() for name in sensor.table.names]
    return ArrayTable(source, arrays, units, conclusions=_once(found), origin=origin)


def _once(conclusions: Sequence[Conclusion]) -> list[Conclusion]:
    """The conclusions without repeats."""
    return [conclusion for i, conclusion in enumerate(conclusions) if conclusion not in conclusions[:i]]


def _place(table: Table) -> str:
    return table.context or table.source


def _sensors_by_role(source: str, tables: Sequence[Table]) -> dict[str, list[SensorColumns]]:
    """The sensors in all tables.

    Raises:
        LevelheadError: no gyroscope or no accelerometer.
    """
    sensors = [sensor for table in tables for sensor in _sensors(table)]
    groups = {role: [sensor for sensor in sensors if sensor.role == role] for role in ("gyr", "acc", "mag")}
    if len(groups["gyr"]) > 1:
        groups["gyr"] = _measured(groups["gyr"])
    if not (measured := _measured(groups["acc"])):  # a phone's gravity alone, or nothing
        groups["acc"] = [sensor for table in tables for sensor in _sensors(table, plain_name)]
    groups["acc"] = measured or _measured(groups["acc"]) or groups["acc"]
    for role in ("gyr", "acc"):
        if not groups[role]:
            names = ", ".join(dict.fromkeys(table.context or Path(table.source).name for table in tables))
            raise _suggest_file(missing_sensor(source, role, names, "one, with three axes"), tables)
    return groups


def _suggest_file(error: LevelheadError, tables: Sequence[Table]) -> LevelheadError:
    """The error, or the proposal for the first file whose numbers look like both sensors."""
    for table in tables:
        if Path(table.source).is_file() and isinstance(found := suggest(error, table, Hints()), NeedsHints):
            return NeedsHints(found.sentence, table.source, **found.suggested)
    return error


def _measured(sensors: Sequence[SensorColumns]) -> list[SensorColumns]:
    """The sensors without those whose length software keeps constant: no sensor measures such numbers."""
    return [sensor for sensor in sensors if not keeps_length_of_gravity(sensor.read())]


def _choose(groups: Mapping[str, Sequence[SensorColumns]]) -> dict[str, SensorColumns]:
    """The gyroscope, the accelerometer and the magnetometer to merge."""
    columns = {role: [sensor.group for sensor in sensors] for role, sensors in groups.items()}
    gyr, acc = best_pair(columns["gyr"], columns["acc"])
    chosen = {"gyr": gyr, "acc": acc, "mag": nearest_group(columns["mag"], gyr)}
    return {
        role: next(sensor for sensor in groups[role] if sensor.group is group)
        for role, group in chosen.items()
        if group is not None
    }


def _other_tables(
    groups: Mapping[str, Sequence[SensorColumns]], chosen: Mapping[str, SensorColumns]
) -> list[Conclusion]:
    """That gyroscopes and accelerometers of other tables were not taken."""
    found = []
    for role in ("gyr", "acc"):
        table = chosen[role].table
        others = [sensor.table.context for sensor in groups[role] if sensor.table is not table]
        if others:
            facts = {"rest": ", ".join(dict.fromkeys(others[:3]))}
            found.append(Conclusion(f"{role}.columns", "other_table", table.context, Basis.NUMBERS, facts))
    return found


def _gravity_beside(tables: Sequence[Table], acc: SensorColumns) -> SensorColumns | None:
    """The gravity vector in a file or sheet of its own, where the accelerometer has none of it; None: there is none.

    Its name shows it, or its length, which is 1 or that of gravity at every sample.
    """
    for table in tables:
        positions = _three_axes(table)
        if not positions or table is acc.table:
            continue
        found = SensorColumns("gravity", table, column_group(positions, [table.names[i] for i in positions]))
        if {"gravity", "grav"} & set(split(table.context)) or keeps_length_of_gravity(found.read()):
            return found
    return None


def _three_axes(table: Table) -> list[int]:
    """The positions of x, y, z in a table of one vector, whatever it is called; [] if it holds something else."""
    known = [understand(name, table.context) for name in table.names]
    free = [i for i, name in enumerate(known) if name.role != "t"]
    axes = {(split(table.names[i]) or [""])[-1][-1:]: i for i in free}
    if {"x", "y", "z"} <= set(axes):
        return [axes[axis] for axis in "xyz"]
    return free if len(free) == 3 else []


def _clocks(chosen: Mapping[str, SensorColumns], hints: Hints) -> tuple[dict[str, SensorClock], list[Conclusion]]:
    """The clocks of the sensors: all from a date, or all from the start of their files."""
    said: list[Conclusion] = []
    clocks: dict[str, SensorClock] = {}
    for absolute in (True, False):
        for role, sensor in chosen.items():
            clocks[role], conclusions = _clock(sensor, hints, absolute)
            said += conclusions
        if len({clock.dated for clock in clocks.values()}) == 1:
            break
    return clocks, said


def _clock(sensor: SensorColumns, hints: Hints, absolute: bool) -> tuple[SensorClock, list[Conclusion]]:
    """The clock of a sensor.

    Of several clocks in its table, one that counts from a date if ``absolute``: time since a file's own start has no
    meaning beside another file.

    Raises:
        LevelheadError: no stamps, or none that increase.
    """
    table = sensor.table
    options = _clock_candidates(sensor, hints)
    values = sensor.read()
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
    stamps = np.rint(clock.t * NANO).astype(np.int64) + (0 if clock.t0 is None else round(clock.t0 * NANO))
    said = [conclusion for conclusion in clock.conclusions if conclusion.about != "t.start"]
    return SensorClock(stamps, clock.rows, clock.t0 is not None), [*said, *beside_clock(best, hints.scale)]


def _clock_candidates(sensor: SensorColumns, hints: Hints) -> list[Candidate]:
    """The columns of a sensor's table that may be its stamps.

    Raises:
        NeedsHints: there are none.
    """
    table = sensor.table
    times = [i for i, name in enumerate(map(understand, table.names)) if name.role == "t"] or list(table.column_units)
    if not times:
        raise NeedsHints(f"{table.source} has no column with time stamps; expected such as 'time'", rate=100.0)
    columns = table.read([*times, *sensor.group.positions], frozenset(times))
    candidates = []
    for i in times:
        try:
            unit = table.column_units.get(i) or unit_in(table.names[i], "t", table.source)
        except LevelheadError:
            continue
        candidates.append(Candidate(table.names[i], columns[i], hints.scale.get("t") or unit))
    return with_ticks(join_seconds(candidates)) or [Candidate(table.names[times[0]], columns[times[0]], None)]


def _align(
    source: str, chosen: Mapping[str, SensorColumns], clocks: Mapping[str, SensorClock]
) -> tuple[dict[str, Column], list[Conclusion]]:
    """(the sensors as columns on the gyroscope's stamps, the conclusions about them).

    Raises:
        LevelheadError: gyroscope and accelerometer do not overlap in time.
    """
    t, limits = clocks["gyr"].stamps, clocks["acc"].stamps[[0, -1]]
    inside = (t >= limits[0]) & (t <= limits[1])
    if inside.sum() < 2:
        raise LevelheadError(
            f"{source}: gyroscope and accelerometer were not recorded at the same time; no stamp of "
            f"one lies within the other's"
        )
    said: list[Conclusion] = []
    if not inside.all():
        outside = int((~inside).sum())
        said.append(Conclusion("rows", "outside_overlap", outside, Basis.NUMBERS, {"count": len(t)}))
    kept = t[inside]
    arrays: dict[str, Column] = {"t [ns]": kept}
    for role, sensor in chosen.items():
        stamps, rows, _ = clocks[role]
        values = sensor.read() if rows is None else sensor.read()[rows]
        if role == "gyr":
            placed = values[inside]
        elif role == "mag":
            placed = _nearest(kept, stamps, values)
        else:
            placed, changed = _interpolate(kept, stamps, values)
            said += changed if role == "acc" else []
        for axis, position, column in zip("xyz", sensor.group.positions, placed.T, strict=True):
            unit = _unit(sensor, position)
            arrays[f"{role}_{axis}{f' [{unit}]' if unit else ''}"] = column
    return arrays, said


def _unit(sensor: SensorColumns, position: int) -> str | None:
    role, table = "acc" if sensor.role == "gravity" else sensor.role, sensor.table
    return table.column_units.get(position) or unit_in(table.names[position], role, table.source)


def _interpolate(t: Any, stamps: Any, values: Array) -> tuple[Array, list[Conclusion]]:
    """((n, 3) ``values`` at other stamps, by straight lines, NaN in holes; that they are, if the stamps differ)."""
    if len(t) == len(stamps) and (t == stamps).all():
        return values, []
    step = median(np.diff(stamps)) if len(stamps) > 1 else NANO
    right = np.clip(np.searchsorted(stamps, t), 1, len(stamps) - 1)
    a, b = stamps[right - 1], stamps[right]
    part = ((t - a) / np.maximum(b - a, 1))[:, None]
    placed: Array = values[right - 1] + part * (values[right] - values[right - 1])
    placed[(b - a) > _MAX_HOLE * step + 0.1 * NANO] = np.nan
    placed[t == b] = values[right][t == b]
    own = median(np.diff(t)) if len(t) > 1 else step
    reason = "slower" if step > _MIN_SLOW * own else "own_clock"
    return placed, [Conclusion("acc.stamps", reason, "interpolated", Basis.NUMBERS, {"rate": NANO / step})]


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
