"""Angles, velocities and time gained since the row before: rates and forces by division, a clock by the sum."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from levelhead import units
from levelhead.recording import Array, median
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.interpret.stamp_unit import guess_unit
from levelhead.sources.names.column_name import name_increment, understand, unit_in
from levelhead.sources.table import ArrayTable, Column, Table, in_memory, words_of

_UNIT = {"gyr": "rad/s", "acc": "m/s²"}
_USUAL_INTERVAL = 0.01  # s, where no clock shows the unit of an interval


class IncrementClock(NamedTuple):
    """The column of time, and its usual step in s; without one None and ``_USUAL_INTERVAL``."""

    stamps: Array | None
    step: float


def rates_of_increments(table: Table) -> ArrayTable | None:
    """The table with a gyroscope and an accelerometer in place of increments; None where it has not both of them."""
    gained = {i: name_increment(name) for i, name in enumerate(table.names)}
    found = {role: _axes(gained, role) for role in _UNIT}
    if any(len(axes) != 3 for axes in found.values()):
        return None
    if words_of(table) or any(understand(name).role in ("gyr", "acc") for name in table.names):
        return None
    columns = table.read(list(range(len(table.names))))
    clock = _clock(table, gained, columns)
    declared = ("gyr", "dt") in gained.values()  # PX4 and ArduPilot: rad and m/s
    rates: dict[str, Column] = {}
    steps = {}
    for role, positions in found.items():
        interval = _interval(gained, role, columns, clock)
        steps[role] = median(interval)
        if not steps[role] > 0.0:
            return None
        for axis, i in zip("xyz", positions, strict=True):
            title = f"{role}_{axis} [{_UNIT[role]}]" if declared else f"{role}_{axis}"
            rates[title] = np.where(interval > 0.0, columns[i] / interval, np.nan)
    facts = {"columns": ", ".join(table.names[found[role][0]] for role in found), "step": steps["gyr"]}
    rest = in_memory(table, "")
    replaced = {table.names[i] for positions in found.values() for i in positions}
    kept = {name: column for name, column in rest.arrays.items() if name not in replaced}
    conclusion = Conclusion("columns", "increments", list(rates), Basis.HEADER, facts)
    return ArrayTable(
        table.source, {**kept, **rates}, rate=table.rate, conclusions=[*table.conclusions, conclusion],
        context=table.context, origin=[*table.origin, *table.names],
    )  # fmt: skip


def clock_of_intervals(table: Table) -> ArrayTable | None:
    """The table with the sum of its intervals ("dt") as clock; None where it has a clock, or no such column."""
    names = table.names
    found = [i for i, name in enumerate(names) if name_increment(name) == ("t", "dt")]
    if len(found) != 1 or any(understand(name).role == "t" for name in names) or words_of(table):
        return None
    interval = np.nan_to_num(table.read(found)[found[0]].astype(np.float64))
    if not median(interval) > 0.0 or (interval < 0.0).any():
        return None
    rest = in_memory(table, "")
    name = names[found[0]]
    unit = unit_in(name, "t", table.source)
    title = f"time [{unit}]" if unit else "time"
    arrays = {title: np.cumsum(interval)} | {one: column for one, column in rest.arrays.items() if one != name}
    conclusion = Conclusion("t.column", "intervals", name, Basis.HEADER)
    return replace(rest, arrays=arrays, conclusions=[*table.conclusions, conclusion], column_units={})


def _axes(gained: Mapping[int, tuple[str, str]], role: str) -> list[int]:
    """The positions of three increments, in the order of their axes."""
    axes = {axis: i for i, (of, axis) in gained.items() if of == role and axis != "dt"}
    return [axes[axis] for axis in sorted(axes)] if sorted(axes) in (list("xyz"), list("012")) else []


def _clock(table: Table, gained: Mapping[int, tuple[str, str]], columns: Mapping[int, Column]) -> IncrementClock:
    for i, name in enumerate(table.names):
        if understand(name).role != "t" or gained[i][1] == "dt" or len(columns[i]) < 2:
            continue
        step = median(np.diff(columns[i]))
        if step > 0.0:
            factor = units.factor("time", guess_unit(columns[i]))
            return IncrementClock(columns[i].astype(np.float64) * factor, step * factor)
    return IncrementClock(None, _USUAL_INTERVAL)


def _interval(
    gained: Mapping[int, tuple[str, str]], role: str, columns: Mapping[int, Column], clock: IncrementClock
) -> Array:
    """(n,) s over which each row gained; its unit is the one nearest to the step of the clock."""
    own = [i for of in (role, "t") for i, found in gained.items() if found == (of, "dt")]
    for i in own:
        if (usual := median(columns[i])) > 0.0:
            factor = min((1.0, 1e-3, 1e-6, 1e-9), key=lambda one: abs(np.log(usual * one / clock.step)))
            return columns[i].astype(np.float64) * factor
    if clock.stamps is None:
        return np.zeros(len(next(iter(columns.values()))))
    return np.full(len(clock.stamps), clock.step)
