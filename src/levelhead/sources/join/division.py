"""One table that is several: rows of alternating units, or a clock of its own beside each column."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import Hints
from levelhead.sources.interpret.interleaved_rows import parts_of
from levelhead.sources.names.column_groups import group_axes, order_positions
from levelhead.sources.names.column_name import split, understand
from levelhead.sources.table import ArrayTable, Column, Table, labels_of, words_of

_NUMBERS = {"i", "instance", "imuid", "sensorid", "sensor", "imu", "sensorindex", "imuindex", "nodeid", "deviceid"}
_MAX_UNITS = 16  # units in one table
_MIN_SHARE = 0.02  # of the rows that each of them must have
_MIN_CHANGES = 0.1  # share of rows in which the unit differs from the row before: less are recordings one after another


def divide(table: Table, hints: Hints) -> Sequence[Table]:
    """The tables in a table; itself if it is one, or if hints name the columns."""
    if {"t", "gyr", "acc"} & set(hints.map):
        return [table]
    return _by_unit(table) or _by_word(table) or _by_clock(table) or [table]


def _by_word(table: Table) -> list[Table]:
    """A table for each unit of sensors that a column of words names, whose rows take turns: LEFT, RIGHT, LEFT, …."""
    labels = labels_of(table)
    known = [understand(name, table.context) for name in table.names]
    accs = [order_positions("acc", axes) for axes in group_axes("acc", known, None)[0]] if labels else []
    if not accs or "gyr" not in {name.role for name in known}:
        return []
    columns = _read_numbers(table)
    acc = np.column_stack([columns[i] for i in accs[0]]).astype(np.float64)
    for name, words in labels.items():
        if len(words) == len(acc) and (parts := parts_of(words, acc)):
            facts = {"count": len(parts), "column": name, "listed": ", ".join(parts)}
            chosen = Conclusion("sensor", "word_column", next(iter(parts)), Basis.NUMBERS, facts)
            found = [*table.conclusions, chosen]
            return [_part(table, columns, kept, word, found) for word, kept in parts.items()]
    return []


def _read_numbers(table: Table) -> dict[int, Column]:
    """All columns of numbers that have a name, in one reading: which rows are left out depends on the columns."""
    wanted = [k for k, title in enumerate(table.names) if title.strip() and k not in words_of(table)]
    return table.read(wanted, frozenset(wanted))


def instances(numbers: Column) -> Mapping[int, NDArray[np.bool_]]:
    """The rows of each unit, by its number, by the (n,) ``numbers`` of the rows; {} if it is but one."""
    if len(numbers) < 8 or not np.isfinite(numbers).all() or (numbers != np.rint(numbers)).any():
        return {}
    found = np.unique(numbers)
    if not 1 < len(found) <= _MAX_UNITS or float((numbers[1:] != numbers[:-1]).mean()) < _MIN_CHANGES:
        return {}
    rows = {int(number): numbers == number for number in found}
    return rows if min(float(kept.mean()) for kept in rows.values()) > _MIN_SHARE else {}


def _by_unit(table: Table) -> list[Table]:
    """A table for each unit of sensors whose number is in a column: ArduPilot's "I", "sensor_id"."""
    known = [understand(name, table.context) for name in table.names]
    if not {"gyr", "acc"} <= {name.role for name in known}:
        return []
    for i, name in enumerate(table.names):
        if "".join(split(name)) not in _NUMBERS or i in words_of(table) or known[i].role:
            continue
        columns = _read_numbers(table)
        if rows := instances(columns[i]):
            facts = {"count": len(rows), "column": name, "listed": ", ".join(map(str, rows))}
            return [
                _part(
                    table, columns, kept, f"{name} {number}",
                    [*table.conclusions, Conclusion("sensor", "number_column", number, Basis.NUMBERS, facts)],
                )
                for number, kept in rows.items()
            ]  # fmt: skip
    return []


def _part(
    table: Table, columns: Mapping[int, Column], kept: NDArray[np.bool_], context: str,
    conclusions: Sequence[Conclusion],
) -> ArrayTable:  # fmt: skip
    """The kept rows of some columns as a table."""
    arrays: dict[str, Column] = {}
    for i, column in columns.items():
        title = table.names[i] if table.names[i] not in arrays else f"{table.names[i]} ({i + 1})"
        arrays[title] = column[kept]
    units = {k: table.column_units[i] for k, i in enumerate(columns) if i in table.column_units}
    context = f"{table.context} {context}".strip()
    return ArrayTable(table.source, arrays, dict(table.units), table.rate, conclusions, context, units, table.origin)


def _by_clock(table: Table) -> list[Table]:
    """A table for each sensor whose every axis has stamps of its own at its left, as Delsys writes them."""
    known = [understand(name, table.context) for name in table.names]
    times = {i for i, name in enumerate(known) if name.role == "t"}
    if len(times) < 2:
        return []
    parts: list[Table] = []
    roles = set()
    for role in ("gyr", "acc", "mag"):
        for positions in (order_positions(role, axes) for axes in group_axes(role, known, None)[0]):
            if not all(i - 1 in times for i in positions):
                continue
            clock = positions[0] - 1
            columns = table.read([clock, *positions], frozenset([clock]))
            kept = np.isfinite(columns[clock])
            parts.append(_part(table, columns, kept, table.names[positions[0]], table.conclusions))
            roles.add(role)
    return parts if {"gyr", "acc"} <= roles else []
