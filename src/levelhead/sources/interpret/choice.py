"""The columns of a table that are read: by name, and by the numbers in them where names leave a choice."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.signals.gravity_direction import excerpt_step, is_gravity, keeps_length_of_gravity
from levelhead.sources.hints import Hints
from levelhead.sources.interpret.accelerometer import lacks_gravity
from levelhead.sources.interpret.clock_column import with_clock
from levelhead.sources.interpret.roles import Roles, assign, user_acceleration
from levelhead.sources.interpret.suggestion import suggest
from levelhead.sources.interpret.temperature import find_temperature
from levelhead.sources.table import Column, Table, stack, words_of

_MAX_BACK = 0.2  # of the steps, from which a column is not a clock
_TRIES = 4  # sets of columns, each without the useless ones of the set before


def choose_columns(table: Table, hints: Hints) -> tuple[Roles, dict[int, Column]]:
    """The roles and their columns; empty columns are ignored, where there are others.

    Raises:
        LevelheadError: no such columns, or no numbers in them.
    """
    words = words_of(table)
    filled = frozenset(range(len(table.names))) - words
    error: LevelheadError | None = None
    for _ in range(_TRIES):
        try:
            roles = _assign(table, hints, filled)
        except LevelheadError as refused:
            raise error or suggest(refused, table, hints) from None
        columns = _read(table, roles)
        useless = _without_gravity(table, roles, columns, hints, filled)
        if not useless:
            useless = _useless(table, roles, columns)
            if not useless:
                break
            name = next(table.names[i] for i in sorted(useless))
            missing = f"{table.source}, column '{name}': every value is missing; expected numbers"
            error = error or LevelheadError(missing)
        filled -= useless
    else:
        raise error or LevelheadError(f"{table.source} has too many empty columns")
    roles, columns = _with_gravity_vector(table, roles, columns, hints)
    _refuse_gravity(table, roles, columns)
    is_timed = "t" in {*roles.columns, *hints.map} or hints.rate is not None or table.rate is not None
    return (roles, columns) if is_timed else with_clock(table, roles, columns)


def _assign(table: Table, hints: Hints, filled: frozenset[int]) -> Roles:
    everything = len(filled) == len(table.names)
    return assign(
        table.names, hints.map, table.source, frozenset(hints.scale), sensor=hints.sensor, context=table.context,
        filled=None if everything else filled, stamps=frozenset(table.column_units),
    )  # fmt: skip


def _read(table: Table, roles: Roles) -> dict[int, Column]:
    used = roles.used
    place = find_temperature(table.names, used | words_of(table))
    wanted = sorted(used if place is None else used | {place})
    columns = table.read(wanted, frozenset(roles.columns.get("t", ())))
    if len(columns[wanted[0]]) == 0:
        raise LevelheadError(f"{table.source} has no line of numbers; expected one line per sample")
    return columns


def _without_gravity(
    table: Table, roles: Roles, columns: dict[int, Column], hints: Hints, filled: frozenset[int]
) -> frozenset[int]:
    """The columns of an accelerometer without gravity, where another one can be taken in its place."""
    positions = frozenset(roles.columns["acc"])
    if "acc" in hints.map or "gravity" in roles.columns or not lacks_gravity(stack(columns, roles.columns["acc"])):
        return frozenset()
    with suppress(LevelheadError):
        _assign(table, hints, filled - positions)
        return positions
    return frozenset()


def _with_gravity_vector(
    table: Table, roles: Roles, columns: dict[int, Column], hints: Hints
) -> tuple[Roles, dict[int, Column]]:
    """Roles and columns; where the accelerometer keeps one length, that of gravity, the user's acceleration beside it.

    Software works such a vector out: g_x beside user_a_x. The two are added up later.
    """
    acc = roles.columns["acc"]
    if {"acc", "gravity"} & {*hints.map, *roles.columns} != {"acc"} or "acc" in hints.map:
        return roles, columns
    user = user_acceleration(table.names, table.context, None)
    if not user or not keeps_length_of_gravity(stack(columns, acc)):
        return roles, columns
    positions = user[0].positions
    columns = columns | table.read(list(positions))
    return replace(roles, columns={**roles.columns, "acc": positions, "gravity": acc}), columns


def _useless(table: Table, roles: Roles, columns: dict[int, Column]) -> frozenset[int]:
    """The columns of time, gyroscope and accelerometer that show nothing, but those that a hint names.

    Every value is missing, or a T goes back as often as a temperature does.
    """
    return frozenset(
        i for role in ("t", "gyr", "acc") if role not in roles.mapped
        for i in roles.columns.get(role, ())
        if np.isnan(columns[i]).all() or (table.names[i].strip() == "T" and _goes_back(columns[i]))
    )  # fmt: skip


def _goes_back(column: Column) -> bool:
    steps = np.diff(column)
    steps = steps[np.isfinite(steps)]
    return len(steps) > 0 and float((steps < 0).mean()) > _MAX_BACK


def _refuse_gravity(table: Table, roles: Roles, columns: dict[int, Column]) -> None:
    some = {i: column[:: excerpt_step(len(column))] for i, column in columns.items()}
    if is_gravity(stack(some, roles.columns["gyr"]), stack(some, roles.columns["acc"])):
        names = ", ".join(table.names[i] for i in roles.columns["gyr"])
        raise LevelheadError(
            f"{table.source}: {names} keep one length while they turn and stay along the accelerometer: they are the "
            "direction of gravity, not rates; expected a gyroscope, such as gyr_x, gyr_y, gyr_z, or the hint map gyr=…"
        )
