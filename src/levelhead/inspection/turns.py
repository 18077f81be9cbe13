"""Findings about turns: gyroscope, accelerometer and magnetometer contradict each other about how far, or which way."""

from collections.abc import Iterator, Sequence
from math import degrees, log

import numpy as np

from levelhead.inspection.agreement import Agreement, Hypothesis, Seen, agree, settle
from levelhead.inspection.bias_jump import BiasJump, examine_bias_jump, find_jump, leaves_less
from levelhead.inspection.findings import Finding
from levelhead.inspection.mend import turn
from levelhead.inspection.residuals import (
    examine_bias,
    examine_delay,
    examine_field_delay,
    examine_iron,
    examine_shape,
    examine_slow_force,
    find_delay,
)
from levelhead.inspection.values import NAMES
from levelhead.open_types import JsonObject
from levelhead.recording import Array, Recording
from levelhead.signals.turn_matrix import MAX_SEGMENTS, MIN_SEGMENTS, SHORTEST
from levelhead.sources.interpret.counts import GYR
from levelhead.units import DEGREE

GROSS = log(1.3)  # of a scale, and
GROSS_ANGLE = 10.0  # deg of a mounting, from which the orientation is wrong rather than worse
CONTRAST = 1.5  # below which forces hide the turn of gravity
SIGMAS = 1.96  # of an interval of 95 %
USUAL = (131.0, 65.5, 32.8, 16.4)  # counts per deg/s


def examine_turns(recording: Recording, most: int = MAX_SEGMENTS) -> Iterator[Finding]:
    """The one fault of scale, wiring or mounting that explains how the sensors disagree."""
    agreement, jump = _explain(recording, most)
    force = next((one for one in agreement.seen if one.role == "acc"), None)
    fault = agreement.fault
    if fault is not None:
        evidence = _evidence(agreement)
        if fault.kind in ("scale", "axis_scale"):
            yield _scale(recording, fault, evidence)
        elif fault.kind == "mounting":
            yield _mounting(fault, evidence)
        else:
            yield _wiring(fault, agreement.rivals(fault), evidence)
    yield from _examine_contrast(force, fault)
    settled = {one.role: settle(one, fault) for one in agreement.seen}
    late = 0.0  # s, of the gyroscope
    if "acc" in settled:
        delay = find_delay(settled["acc"], settled.get("mag"))
        if delay is not None:
            late = max(0.0, -delay.seconds)
            yield examine_delay(delay)
        yield from examine_slow_force(settled["acc"])
    if "mag" in settled:
        yield from examine_field_delay(settled["mag"], late)
        yield from examine_iron(settled["mag"], fault)
        yield from examine_shape(settled["mag"], fault)
    right = recording if fault is None else turn(fault.role, fault.matrix).apply(recording)
    yield from examine_bias_jump(jump or find_jump(right, list(settled.values())))
    yield from examine_bias(list(settled.values()))


def _examine_contrast(force: Seen | None, fault: Hypothesis | None) -> Iterator[Finding]:
    """Whether the turn of gravity was seen at all."""
    if force is None:
        yield Finding(
            "acc_gyr_test_invalid",
            "note",
            "accelerometer and gyroscope cannot be compared on so short a recording",
            f"fewer than {MIN_SEGMENTS} stretches of {SHORTEST:g} s have no gap and no missing reading",
            f"Record {10 * SHORTEST:g} s of motion or more.",
        )
    elif fault is None and force.contrast < CONTRAST:
        yield Finding(
            "acc_gyr_test_invalid",
            "note",
            "accelerometer and gyroscope cannot be compared on this motion",
            f"turned back by the gyroscope, {100 / force.contrast:.0f} % of the force's change is left",
        )


def _explain(recording: Recording, most: int) -> tuple[Agreement, BiasJump | None]:
    """How the sensors agree, and a jump of the bias, if without it there is no fault: one cause in place of two."""
    agreement = agree(recording, most)
    if agreement.fault is None:
        return agreement, None
    jump = find_jump(recording, [settle(one, None) for one in agreement.seen])
    if jump is None:
        return agreement, None
    level = agree(jump.mend.apply(recording), most)
    fits, others = ([one.fit for one in made.seen] for made in (level, agreement))
    return (level, jump) if level.fault is None and leaves_less(fits, others) else (agreement, None)


def _evidence(agreement: Agreement) -> str:
    none = next(one for one in agreement.faults if one.kind == "none")
    words = []
    for one in agreement.seen:
        rows = "; ".join(" ".join(f"{value:.2f}" for value in row) for row in one.fit.matrix)
        words.append(f"turn of the {'force' if one.role == 'acc' else 'field'} over that of the gyroscope [{rows}]")
    return f"{', '.join(words)}; χ² {none.chi:.0f} as it is, {agreement.faults[0].chi:.0f} so"


def words_of(matrix: Array) -> str:
    """A signed permutation as axes: "y, x, -z" for readings that become right as (y, x, −z)."""
    axes = []
    for row in matrix:
        axis = int(np.abs(row).argmax())
        axes.append(("-" if row[axis] < 0.0 else "") + "xyz"[axis])
    return ", ".join(axes)


def _wiring(fault: Hypothesis, rivals: Sequence[Hypothesis], evidence: str) -> Finding:
    inverted = fault.role == "gyr" and np.allclose(fault.matrix, -np.eye(3))
    name = "mag_axes" if fault.role == "mag" else "gyro_inverted" if inverted else "axes_order"
    ways = [f"{NAMES[one.role]} {change_of(one.matrix)}" for one in (fault, *rivals[:2])]
    what = "gravity turns against the gyroscope: one of them is inverted" if inverted else " or ".join(ways)
    if not inverted:
        what = f"the axes do not belong together: {what}"
    sole = not rivals
    return Finding(
        name,
        "warning" if fault.role == "mag" else "broken",
        what,
        evidence,
        f"Take the {NAMES[fault.role]} as ({words_of(fault.matrix)}); --fix does." if sole else
        "Turn it slowly by 90° about each axis and back: that decides between them.",
        mend=turn(fault.role, fault.matrix, sole),
    )  # fmt: skip


def change_of(matrix: Array) -> str:
    """The fault in words."""
    magnitude = np.abs(matrix)
    if np.allclose(magnitude, np.eye(3)):
        axes = ["xyz"[i] for i in range(3) if matrix[i, i] < 0.0]
        return f"{' and '.join(axes)} reversed"
    if (matrix >= 0.0).all() and np.trace(magnitude) == 1.0:
        axes = ["xyz"[i] for i in range(3) if matrix[i, i] == 0.0]
        return f"{' and '.join(axes)} swapped"
    return f"in the order of ({words_of(matrix)})"


def _mounting(fault: Hypothesis, evidence: str) -> Finding:
    angle = degrees(float(np.arccos(np.clip((np.trace(fault.matrix) - 1.0) / 2.0, -1.0, 1.0))))
    spread = SIGMAS * degrees(fault.sigma)
    severe = angle > GROSS_ANGLE and fault.role != "mag"
    return Finding(
        "mag_axes" if fault.role == "mag" else "mounting",
        "broken" if severe else "warning",
        f"the {NAMES[fault.role]} is mounted {angle:.1f}° askew",
        evidence,
        "Mount it straight, or turn its readings: --fix does.",
        value=angle,
        interval=(max(0.0, angle - spread), angle + spread),
        unit="deg",
        mend=turn(fault.role, fault.matrix),
    )  # fmt: skip


def _scale(recording: Recording, fault: Hypothesis, evidence: str) -> Finding:
    axis = None if fault.kind == "scale" else int(np.abs(np.diag(fault.matrix) - 1.0).argmax())
    factor = float(fault.matrix[axis or 0, axis or 0])
    low, high = factor - SIGMAS * fault.sigma, factor + SIGMAS * fault.sigma
    value = 1.0 / factor
    interval = (1.0 / high, 1.0 / low if low > 0.0 else np.inf)
    what = f"the gyroscope{'' if axis is None else chr(39) + 's ' + 'xyz'[axis]} reads {value:.3g} times the true turn"
    cause = "" if axis is not None else _cause(recording, interval)
    return Finding(
        "gyro_scale",
        "broken" if not abs(log(max(abs(value), 1e-3))) < GROSS else "warning",
        f"{what} ({interval[0]:.3g} to {interval[1]:.3g}){cause}",
        evidence,
        f"{_option(recording, factor)}; --fix does." if axis is None else "Calibrate it; --fix does.",
        value=value, interval=interval, mend=turn("gyr", fault.matrix),
    )  # fmt: skip


def _cause(recording: Recording, interval: tuple[float, float]) -> str:
    """The known mistake with such a factor."""
    low, high = interval
    if low < 1.0 / DEGREE < high or low < DEGREE < high:
        return ": its unit is wrong"
    causes = []
    pairs = [(wrong, right) for wrong in GYR for right in GYR if wrong != right and low < right / wrong < high]
    if pairs:
        middle = (low * high) ** 0.5
        wrong, right = min(pairs, key=lambda pair: (pair[0] not in USUAL) + abs(log(pair[1] / pair[0] / middle)))
        causes.append(f"{right:g} counts per deg/s were taken for {wrong:g}")
    causes.append(f"the clock is wrong, {recording.rate:.3g} Hz for {recording.rate * (low * high) ** 0.5:.3g} Hz")
    return f": {' or '.join(causes)}"


def _option(recording: Recording, factor: float) -> str:
    """The option that mends a scale."""
    units: JsonObject = dict(recording.meta.get("units", {}))
    unit = str(units.get("gyr", ""))
    if unit.startswith("counts, "):
        per, _, of = unit.removeprefix("counts, ").partition(" per ")
        return f"Try --counts gyr={float(per) / factor:.4g}/{of}"
    if unit in ("rad/s", "deg/s"):
        return f"Try --counts gyr={1.0 / factor:.4g}/{unit}"
    return f"Multiply the gyroscope by {factor:.4g}"
