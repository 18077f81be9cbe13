"""Signs and sums that only some systems have: gravity and user acceleration apart, Core Motion's sign."""

import re
from collections.abc import Sequence

import numpy as np

from levelhead.recording import Array
from levelhead.sources.hints import Scale
from levelhead.sources.scales import Evidence
from levelhead.units import GRAVITY

_CONSTANT = 2e-3  # by which the length of a gravity vector that software worked out may vary
_APPLE = re.compile(
    r"rotationRate[XYZ.]|motionUserAcceleration|accelerometerAcceleration[XYZ]|userAcceleration\.?[xyzXYZ]|motionGravity"
)
_SENSOR_LOGGER = "seconds_elapsed"  # a column of its exports; on Android its accelerometer is in m/s²


def whole_acceleration(
    acc: Array, scale: Scale | None, gravity: Array | None, names: Sequence[str], evidence: Evidence
) -> tuple[Array, Scale | None]:
    """(n, 3) acceleration with gravity in it, and its scale.

    Where a log has a gravity vector of constant length, and the accelerometer has none of it (regression on that vector
    near 0), the two are added.
    """
    if gravity is None:
        return acc, scale
    length = np.sqrt((gravity * gravity).sum(axis=1))
    known = np.isfinite(length) & np.isfinite(acc).all(axis=1)
    if known.sum() < 10:
        return acc, scale
    typical = float(np.median(length[known]))
    if not typical > 0.0 or float(np.quantile(np.abs(length[known] / typical - 1.0), 0.9)) > _CONSTANT:
        return acc, scale
    part = float((acc[known] * gravity[known]).sum() / (gravity[known] ** 2).sum())
    if abs(part) > 0.5:
        return acc, scale
    evidence.findings["gravity_removed"] = {"part": part}
    evidence.notes.append(
        f"accelerometer: {', '.join(names[:1])} … hold {100 * part:.0f} % of the gravity that stands "
        f"beside them; the two were added"
    )
    unit = "g" if abs(typical - 1.0) < 0.05 else "m/s²" if abs(typical / GRAVITY - 1.0) < 0.05 else None
    if unit is None:
        return acc + gravity, scale
    return acc + gravity, Scale(GRAVITY if unit == "g" else 1.0, unit)


def points_down(names: Sequence[str], scale: Scale, gravity: Array | None, evidence: Evidence) -> bool:
    """Whether the acceleration has Core Motion's sign: a phone on its back reads z = −1 g.

    ``names`` are those of all columns. Only Apple's systems give acceleration in g together with these names; Android's
    are in m/s² and point up.
    """
    in_g = abs(scale.factor / scale.divisor / GRAVITY - 1.0) < 1e-9
    why = ""
    if in_g and gravity is not None and _of_length_one(gravity):
        why = "a gravity vector of length 1 is Core Motion's"
    elif in_g and any(_APPLE.search(name) for name in names):
        why = "these names are Core Motion's"
    elif in_g and _SENSOR_LOGGER in names:
        why = "Sensor Logger writes g on Apple's devices only, a guess"
    if not why:
        return False
    evidence.findings["acc_inverted"] = {"why": why}
    evidence.notes.append(f"accelerometer: turned round, since Core Motion's points down at rest ({why})")
    return True


def _of_length_one(gravity: Array) -> bool:
    length = np.sqrt((gravity * gravity).sum(axis=1))
    length = length[np.isfinite(length)]
    return len(length) > 0 and float(np.median(np.abs(length - 1.0))) < _CONSTANT
