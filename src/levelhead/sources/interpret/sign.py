"""Signs and sums that only some systems have: gravity and user acceleration apart, Core Motion's sign."""

import re
from collections.abc import Sequence

import numpy as np

from levelhead.recording import Array
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import Scale
from levelhead.sources.interpret.evidence import Evidence
from levelhead.sources.names.vendors import find_vendor
from levelhead.sources.table import Table
from levelhead.units import GRAVITY

_CORE_MOTION = {"g", "gs", "mg"}  # in m/s², and in a chip's counts, +1 g up is all but certain; vehicles have z down
_METRES = {"m/s²", "m/s^2", "m/s2"}  # unless an app with Core Motion's words has multiplied
_SWIFT = re.compile(r"^rotationRate|^motion[A-Z]")
_START, _MIN_ROWS = 2.0, 10  # s, rows by which it is judged how a log begins
_ALONG, _ACROSS, _NEAR = 0.8, 0.4, 0.2  # g
_CONSTANT = 2e-3  # by which the length of a gravity vector that software worked out may vary
_APPLE = re.compile(
    r"rotationRate(?:[XYZ.]|_[xyz]\b)|motionUserAcceleration|accelerometerAcceleration[XYZ]|userAcceleration\.?[xyzXYZ]|motionGravity"
)
_HEADPHONE = re.compile(r"rotationRateX$")  # Sensor Logger names Core Motion's so, in m/s² too; Android's are x, y, z
_SENSOR_LOGGER = "seconds_elapsed"  # a column of its exports; on Android its accelerometer is in m/s²


def add_gravity(
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
    evidence.adds_gravity = True
    facts = {"column": names[0], "percent": 100.0 * part, "part": part}
    evidence.conclusions.append(Conclusion("acc.gravity", "added", True, Basis.NUMBERS, facts))
    unit = "g" if abs(typical - 1.0) < 0.05 else "m/s²" if abs(typical / GRAVITY - 1.0) < 0.05 else None
    if unit is None:
        return acc + gravity, scale
    return acc + gravity, Scale(GRAVITY if unit == "g" else 1.0, unit)


def sign_of_acceleration(names: Sequence[str], scale: Scale, gravity: Array | None, evidence: Evidence) -> float:
    """−1 where the acceleration has Core Motion's sign, a phone on its back reads z = −1 g; else 1.

    ``names`` are those of all columns. Only Apple's systems give acceleration in g together with these names; Android's
    are in m/s² and point up.
    """
    in_g = abs(scale.factor / scale.divisor / GRAVITY - 1.0) < 1e-9
    if in_g and gravity is not None and _of_length_one(gravity):
        reason, basis = "gravity_vector", Basis.NUMBERS
    elif any((_APPLE if in_g else _HEADPHONE).search(name) for name in names) and (in_g or _SENSOR_LOGGER in names):
        reason, basis = "names", Basis.VENDOR
    elif in_g and _SENSOR_LOGGER in names:
        reason, basis = "sensor_logger", Basis.GUESS
    else:
        return 1.0
    confirm = {"units": {"acc": f"-{scale.name}"}}
    evidence.conclusions.append(Conclusion("acc.sign", reason, -1, basis, confirm=confirm))
    return -1.0


def judge_start(t: Array, acc: Array, unit: str, table: Table, evidence: Evidence) -> None:
    """Notes that the sign of the accelerometer is assumed, where a log begins with −1 g along z without a reason.

    ``acc`` (n, 3) m/s², in the log in ``unit``, at ``t`` (n,) s. A sensor upside down and Core Motion's sign (−1 g,
    face up) look the same, and both turn as the gyroscope measures.
    """
    start = acc[t < t[0] + _START]
    start = start[np.isfinite(start).all(axis=1)]
    likely = unit in _CORE_MOTION or (unit in _METRES and any(_SWIFT.search(name) for name in table.names))
    turned = any(one.about == "acc.sign" for one in evidence.conclusions)
    if turned or not likely or len(start) < _MIN_ROWS or find_vendor([*table.names, *table.origin]) is not None:
        return
    x, y, z = (float(one) for one in np.median(start, axis=0) / GRAVITY)
    if z < -_ALONG and abs(z + 1.0) < _NEAR and np.hypot(x, y) < _ACROSS:
        facts = {"z": z, "unit": unit}
        evidence.conclusions.append(Conclusion("acc.sign", "assumed", 1, Basis.GUESS, facts, {"units": {"acc": unit}}))


def _of_length_one(gravity: Array) -> bool:
    length = np.sqrt((gravity * gravity).sum(axis=1))
    length = length[np.isfinite(length)]
    return len(length) > 0 and float(np.median(np.abs(length - 1.0))) < _CONSTANT
