"""Quaternion columns of a log as a Track, on the clock of its recording."""

import os
import re
from collections.abc import Sequence

import numpy as np

from levelhead.errors import LevelheadError, nearest
from levelhead.recording import Array
from levelhead.sources.hints import Hints
from levelhead.sources.interpret.clock import find_clock
from levelhead.sources.interpret.roles import assign, quaternion
from levelhead.sources.pipeline import open_table
from levelhead.sources.table import Table
from levelhead.track import Track

ANGLES = ("roll", "pitch", "yaw")
_UNEVEN = 0.05  # of their median length, by which quaternions may differ in length


def read_orientation(path: str | os.PathLike[str], column: str, hints: Hints) -> Track:
    """The quaternions of ``column``, see ``levelhead.sources.orientation``.

    Raises:
        LevelheadError: no such columns, or they hold no quaternions.
    """

    return _track(open_table(path, hints), column, hints)


def read_angle(path: str | os.PathLike[str], column: str, hints: Hints) -> tuple[str, Array, Array]:
    """The roll, pitch or yaw of one column, see ``levelhead.sources.angle``.

    Raises:
        LevelheadError: no such column, its name has none of the three words, or it holds no numbers.
    """
    table = open_table(path, hints)
    if column not in table.names:
        raise LevelheadError(f"{table.source} has no column {column!r}; {nearest(column, table.names)}")
    words = re.findall(r"[a-z]+", column.lower())
    kind = next((one for one in ANGLES if one in words), None)
    if kind is None:
        raise LevelheadError(f"{table.source}: column {column!r} must have roll, pitch or yaw in its name")
    t, (value,) = _on_clock(table, (table.names.index(column),), hints)
    if not np.isfinite(value).any():
        raise LevelheadError(f"{table.source}: column {column!r} holds no number; expected an angle")
    return kind, t, value if "rad" in words else np.radians(value)


def _track(table: Table, column: str, hints: Hints) -> Track:
    positions = quaternion(column, table.names, table.source)
    t, columns = _on_clock(table, positions, hints)
    return Track(t, _unit(np.stack(columns, axis=1), table, [table.names[i] for i in positions]))


def _on_clock(table: Table, positions: Sequence[int], hints: Hints) -> tuple[Array, list[Array]]:
    """The recording's stamps (n,), and the columns (n,) at those positions."""
    roles = assign(table.names, hints.map, table.source, frozenset(hints.scale), needed=())
    times = roles.columns.get("t", ())
    sensors = {i for role in ("gyr", "acc", "mag") for i in roles.columns.get(role, ())}
    columns = table.read(sorted({*positions, *times, *sensors}), frozenset(times))
    clock = find_clock(table, roles, hints, columns)
    rows = slice(None) if clock.rows is None else clock.rows
    return clock.t, [np.asarray(columns[i], dtype=float)[rows] for i in positions]


def _unit(quat: Array, table: Table, names: Sequence[str]) -> Array:
    """(n, 4) with length 1: some vendors write integers; NaN where all four are zero.

    Raises:
        LevelheadError: lengths that differ, as no quaternions' do.
    """
    norm = np.sqrt(np.sum(quat * quat, axis=1))
    known = np.isfinite(norm) & (norm > 0.0)
    if not known.any():
        raise LevelheadError(
            f"{table.source}: {', '.join(names)} are blank or zero on every line; expected quaternions"
        )
    usual = float(np.median(norm[known]))
    bad = known & (np.abs(norm - usual) > _UNEVEN * usual)
    if bad.any():
        row = int(bad.argmax())
        raise LevelheadError(
            f"{table.source}, {table.where(row)}: {', '.join(names)} have length {norm[row]:.4g}, elsewhere "
            f"{usual:.4g}; expected quaternions, all of one length"
        )
    unit: Array = quat / np.where(known, norm, np.nan)[:, None]
    return unit
