"""The reference orientation in the same file."""

from collections.abc import Mapping, Sequence

import numpy as np

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.recording import Array, Truth
from levelhead.rotations import rotate
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.interpret.roles import Roles
from levelhead.sources.interpretation import Interpretation
from levelhead.sources.names.column_name import unit_in
from levelhead.sources.table import Column, Table, stack
from levelhead.units import GRAVITY

_UP = 0.9  # cosine, 26°: a reference that is tilted further has another axis up
_MIN_ROWS = 100  # rows of a mean force
_LEAVE_OUT = {"map": {"q": list[str]()}}
_NORTH = ("opt_quat", "truth_q")  # BROAD's, and levelhead's own; their earth frame has y to magnetic north


def judge_reference(
    table: Table, roles: Roles, columns: Mapping[int, Column], acc: Array, found: list[Conclusion]
) -> bool:
    """Whether the reference in the columns of ``roles`` is of use; appends the conclusions to ``found``.

    ``acc`` (n, 3) m/s² is the specific force, whose mean must point up in the reference's world.

    Raises:
        LevelheadError: a row that is not a unit quaternion; the line is named.
    """
    names = [table.names[i] for i in roles.columns["q"]]
    listed = ", ".join(names)
    quat, zeros = _quaternions(roles.columns, columns)
    if zeros:
        found.append(Conclusion("truth.rows", "zero", zeros, Basis.NUMBERS, {"columns": listed}))
    if np.isnan(quat).any(axis=1).all():
        found.append(Conclusion("truth.used", "empty", False, Basis.NUMBERS, {}, _LEAVE_OUT))
        return False
    _check_norm(quat, table, names)
    force = _mean_force(quat, acc)
    if "q" not in roles.mapped and force is not None and force[2] < _UP:
        facts = {"columns": listed, "force": ", ".join(f"{value:.2f}" for value in force)}
        found.append(Conclusion("truth.used", "not_up", False, Basis.NUMBERS, facts, _LEAVE_OUT))
        return False
    if not _points_north(names[0]):
        found.append(Conclusion("truth.north", "unknown", False, Basis.HEADER, {"columns": listed}))
    return True


def points_up(quat: Array, acc: Array) -> bool:
    """Whether the mean specific force (n, 3) points up in a reference's world; quat (n, 4) may be NaN."""
    force = _mean_force(quat, acc)
    return force is None or bool(force[2] >= _UP)


def make_reference(
    found: Interpretation, table: Table, positions: Mapping[str, tuple[int, ...]], columns: Mapping[int, Column]
) -> Truth | None:
    """The reference of an interpretation; None without one.

    Raises:
        LevelheadError: a row that is not a unit quaternion; the line is named.
    """
    if "q" not in positions or "q" in found.unused:
        return None
    quat, _ = _quaternions(positions, columns)
    _check_norm(quat, table, found.columns["q"])
    moving = columns[positions["moving"][0]] != 0 if "moving" in positions else None
    return Truth(quat, _bias(table, positions, columns), moving, _points_north(found.columns["q"][0]))


def _points_north(name: str) -> bool:
    return name.startswith(_NORTH)


def _quaternions(positions: Mapping[str, tuple[int, ...]], columns: Mapping[int, Column]) -> tuple[Array, int]:
    """((n, 4) with NaN where the reference is blind, rows that are all zero)."""
    quat = stack(columns, positions["q"])
    if "seen" in positions:
        quat[columns[positions["seen"][0]] == 0] = np.nan
    zero = (quat == 0.0).all(axis=1)
    quat[zero] = np.nan
    return quat, int(zero.sum())


def _mean_force(quat: Array, acc: Array) -> Array | None:
    """The direction of the mean specific force in the reference's world, (3,); None where too little is known."""
    rows = np.isfinite(quat).all(axis=1) & np.isfinite(acc).all(axis=1)
    if rows.sum() < _MIN_ROWS:
        return None
    mean: Array = rotate(quat[rows], acc[rows]).mean(axis=0)
    length = float(np.linalg.norm(mean))
    return mean / length if length > 0.5 * GRAVITY else None


def _check_norm(quat: Array, table: Table, names: Sequence[str]) -> None:
    norm = np.sqrt((quat * quat).sum(axis=1))
    bad = ~(np.abs(norm - 1.0) <= 0.01) & ~np.isnan(norm)
    if bad.any():
        row = int(bad.argmax())
        raise LevelheadError(
            f"{table.source}, {table.where(row)}: the quaternion {', '.join(names)} has length {norm[row]:.4g}; "
            "expected 1, order w, x, y, z (blank cells where the reference is blind, map q= to leave it out)"
        )


def _bias(table: Table, positions: Mapping[str, tuple[int, ...]], columns: Mapping[int, Column]) -> Array | None:
    if "bias" not in positions:
        return None
    unit = unit_in(table.names[positions["bias"][0]], "gyr", table.source)
    return stack(columns, positions["bias"]) * units.factor("gyr", unit or "rad/s")
