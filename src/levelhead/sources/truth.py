"""The reference orientation that stands in the same file."""

from collections.abc import Sequence

import numpy as np

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.recording import Array, Truth
from levelhead.sources.columns import Roles
from levelhead.sources.names import unit_in
from levelhead.sources.table import Column, Table, stack

_NORTH = ("opt_quat", "truth_q")  # BROAD's, and levelhead's own; their earth frame has y to magnetic north


def find_truth(table: Table, roles: Roles, columns: dict[int, Column], notes: list[str]) -> Truth | None:
    """The reference that the columns of ``roles`` give, checked; appends to ``notes`` what was concluded.

    Raises:
        LevelheadError: a row that is no unit quaternion; the line is named.
    """
    if "q" not in roles.columns:
        return None
    positions = roles.columns["q"]
    names = [table.names[i] for i in positions]
    quat = stack(columns, positions)
    zero = (quat == 0.0).all(axis=1)
    if zero.any():
        quat[zero] = np.nan
        notes.append(f"truth: {', '.join(names)} are all zero in {int(zero.sum())} rows; taken as missing there")
    if np.isnan(quat).any(axis=1).all():
        notes.append("truth: left out, because no row has one")
        return None
    _check_norm(quat, table, names)
    north = names[0].startswith(_NORTH)
    if not north:
        notes.append(
            f"truth: {', '.join(names)}; its frame is not known to point north, so only relative heading counts"
        )
    bias = _bias(table, roles, columns)
    moving = None
    if "moving" in roles.columns:
        moving = columns[roles.columns["moving"][0]] != 0
    return Truth(quat, bias, moving, north)


def _check_norm(quat: Array, table: Table, names: Sequence[str]) -> None:
    norm = np.sqrt((quat * quat).sum(axis=1))
    bad = ~(np.abs(norm - 1.0) <= 0.01) & ~np.isnan(norm)
    if bad.any():
        row = int(bad.argmax())
        raise LevelheadError(
            f"{table.source}, {table.where(row)}: the quaternion {', '.join(names)} has length {norm[row]:.4g}; "
            "expected 1, order w, x, y, z (blank cells where the reference is blind, map q= to leave it out)"
        )


def _bias(table: Table, roles: Roles, columns: dict[int, Column]) -> Array | None:
    if "bias" not in roles.columns:
        return None
    positions = roles.columns["bias"]
    unit = unit_in(table.names[positions[0]], "gyr", table.source)
    return stack(columns, positions) * units.factor("gyr", unit or "rad/s")
