"""From a table to a Recording: roles, time, units from header, hint or evidence, reference."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.recording import Array, Recording
from levelhead.sources import unit_inference
from levelhead.sources.clock import Clock, seconds
from levelhead.sources.columns import Roles, assign
from levelhead.sources.hints import MEANING, QUANTITY, Hints, Scale
from levelhead.sources.names import RELATIVE
from levelhead.sources.table import Column, Table, stack
from levelhead.sources.truth import find_truth


def assemble(table: Table, hints: Hints) -> Recording:
    """The Recording in ``table``, in SI units; what was concluded stands in its ``meta``.

    ``meta`` has "source", "notes" (sentences), "ignored" (columns that nothing uses), "units" (what the file is in),
    and where they apply "t0" (s, subtracted from the stamps) and "mag_unit" ("relative").

    Raises:
        LevelheadError: one sentence with file, line and column.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return _assemble(table, hints)


def _assemble(table: Table, hints: Hints) -> Recording:
    roles = assign(table.names, hints.map, table.source, frozenset(hints.scale))
    time = roles.columns.get("t", (None,))[0]
    wanted = sorted(i for positions in roles.columns.values() for i in positions)
    columns = table.read(wanted, time)
    if len(columns[wanted[0]]) == 0:
        raise LevelheadError(f"{table.source} has no line of numbers; expected one line per sample")
    notes = [*table.notes, *roles.notes]
    clock = clock_of(table, roles, hints, columns, notes)
    found: dict[str, str] = {"t": clock.unit}
    acc = _sensor("acc", table, roles, hints, columns, clock.t, None, found, notes)
    gyr = _sensor("gyr", table, roles, hints, columns, clock.t, acc, found, notes)
    mag = _mag(table, roles, hints, columns, clock.t, found, notes)
    truth = find_truth(table, roles, columns, notes)
    meta: dict[str, Any] = {"source": table.source, "notes": notes, "ignored": list(roles.ignored), "units": found}
    if clock.t0 is not None:
        meta["t0"] = clock.t0
    if found.get("mag") == RELATIVE:
        meta["mag_unit"] = RELATIVE
    assert acc is not None and gyr is not None  # assign has seen to it
    return Recording(clock.t, gyr, acc, mag, truth, meta)


def clock_of(table: Table, roles: Roles, hints: Hints, columns: dict[int, Column], notes: list[str]) -> Clock:
    """The time stamps of the columns that were read: those of the file, or rows over the rate.

    Raises:
        LevelheadError: no stamps and no rate, both of them, or stamps that are none.
    """
    n = len(next(iter(columns.values())))
    if "t" in roles.columns:
        position = roles.columns["t"][0]
        name = table.names[position]
        if hints.rate is not None:
            raise LevelheadError(
                f"{table.source} has time stamps in column '{name}', and rate={hints.rate:g} is given too; "
                "leave out the rate, or leave out the stamps with the hint map t="
            )
        declared = hints.scale.get("t") or table.units.get("t") or roles.units.get("t")
        clock = seconds(columns[position], declared, table, name)
        notes += clock.notes
        return clock
    if hints.rate is not None and table.rate is not None and "t" not in hints.map:
        raise LevelheadError(
            f"{table.source} says itself that its rate is {table.rate:g} Hz; leave out rate={hints.rate:g}, "
            "or insist on it with the hint map t="
        )
    rate = hints.rate or table.rate
    if rate is None:
        raise LevelheadError(
            f"{table.source} has no column with time stamps; expected such as 't' or 'time_ms', or the hint map t=…, "
            "or the hint rate=… in Hz"
        )
    return Clock(np.arange(n) / rate, "s", None, [])


def _sensor(
    role: str,
    table: Table,
    roles: Roles,
    hints: Hints,
    columns: dict[int, Column],
    t: Array,
    acc: Array | None,
    found: dict[str, str],
    notes: list[str],
) -> Array | None:
    """The (n, 3) values of one sensor in SI; ``acc`` in m/s² helps to judge the gyroscope."""
    values = _values(role, table, roles.columns[role], columns)
    rows = unit_inference.excerpt(len(t))
    scale = _declared(role, table, roles, hints, notes)
    if scale is None:
        unit, why = _concluded(role, values, t, rows, acc, table)
        scale = Scale(units.factor(QUANTITY[role], unit), unit)
        notes.append(f"{MEANING[role]}: taken as {unit}; {why}")
    elif role == "acc":
        _plausible_acc(values, scale, table, found)
    elif acc is not None:
        _plausible_gyr(values[rows] / scale.divisor, scale, t[rows], acc[rows], table)
    found[role] = scale.name
    return _scaled(role, values, scale, table, roles.columns[role])


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


def _declared(role: str, table: Table, roles: Roles, hints: Hints, notes: list[str]) -> Scale | None:
    """The scale that a hint gives, or the file; a hint wins."""
    said = roles.units.get(role) or table.units.get(role)
    if role in hints.scale:
        if said is not None and units.find(QUANTITY[role], said) != hints.scale[role].factor:
            notes.append(f"{MEANING[role]}: the hint says {hints.scale[role].name} where the file says {said}")
        return hints.scale[role]
    if said is None or said == RELATIVE:
        return None
    return Scale(units.factor(QUANTITY[role], said), said)


def _concluded(role: str, values: Array, t: Array, rows: Any, acc: Array | None, table: Table) -> tuple[str, str]:
    if role == "acc":
        norm = unit_inference.median_norm(values)
        unit = unit_inference.acc_unit(norm)
        if unit is None:
            raise LevelheadError(
                f"{table.source}: the accelerometer has median length {norm:.4g}, which is gravity in neither m/s², "
                f"g nor mg; expected the hint units acc=…, or for raw counts lsb acc={unit_inference.acc_counts(norm)}"
            )
        return unit, f"its median length is {norm:.4g}"
    assert acc is not None  # the accelerometer comes first
    found, why = unit_inference.gyr_unit(t[rows], values[rows], acc[rows])
    if found is None:
        raise LevelheadError(
            f"{table.source}: the gyroscope is neither in rad/s nor in deg/s: {why}; "
            "expected the hint units gyr=…, or for raw counts lsb gyr=131/deg/s or what the sensor's full scale says"
        )
    return found, why


def _plausible_acc(values: Array, scale: Scale, table: Table, found: dict[str, str]) -> None:
    norm = unit_inference.median_norm(values)
    unit = unit_inference.acc_unit(norm / scale.divisor)
    if unit is None or 0.3 < norm / scale.divisor * scale.factor / units.STANDARD_GRAVITY < 3.0:
        return
    raise LevelheadError(
        f"{table.source}: the accelerometer is declared in {scale.name}, but its median length of {norm:.4g} says "
        f"{unit}; expected the hint units acc={unit}"
    )


def _plausible_gyr(values: Array, scale: Scale, t: Array, acc: Array, table: Table) -> None:
    degree = units.factor("gyr", "deg/s")
    why, unit = None, "deg/s"
    if scale.factor == 1.0:
        why = unit_inference.says_degrees(t, values, acc)
    elif scale.factor == degree:
        why, unit = unit_inference.says_radians(t, values, acc), "rad/s"
    if why is not None:
        raise LevelheadError(
            f"{table.source}: the gyroscope is declared in {scale.name}, but it looks like {unit}: {why}; "
            f"expected the hint units gyr={unit}"
        )


def _scaled(role: str, values: Array, scale: Scale, table: Table, positions: Sequence[int]) -> Array:
    if scale.factor == scale.divisor == 1.0:
        return values
    scaled: Array = values * (scale.factor / scale.divisor)
    beyond = np.isinf(scaled)
    if beyond.any():
        row, axis = (int(k) for k in np.argwhere(beyond)[0])
        raise LevelheadError(
            f"{table.source}, {table.where(row)}, column '{table.names[positions[axis]]}': {values[row, axis]:.4g} "
            f"{scale.name} is beyond all numbers; expected a value of the {MEANING[role]}"
        )
    return scaled


def _mag(
    table: Table,
    roles: Roles,
    hints: Hints,
    columns: dict[int, Column],
    t: Array,
    found: dict[str, str],
    notes: list[str],
) -> Array | None:
    if "mag" not in roles.columns:
        return None
    values = _values("mag", table, roles.columns["mag"], columns)
    scale = _declared("mag", table, roles, hints, notes)
    norm = unit_inference.median_norm(values)
    if np.isnan(norm):
        notes.append("magnetometer: left out, because no row is complete")
        return None
    if scale is None:
        unit = None if roles.units.get("mag") == RELATIVE else unit_inference.mag_unit(norm)
        if unit is None:
            notes.append(f"magnetometer: kept as it is, without unit; its median length is {norm:.4g}")
            found["mag"] = RELATIVE
            return values
        scale = Scale(units.factor("mag", unit), unit)
        notes.append(f"magnetometer: taken as {unit}; its median length is {norm:.4g}")
    found["mag"] = scale.name
    return _scaled("mag", values, scale, table, roles.columns["mag"])
