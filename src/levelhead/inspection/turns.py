"""Findings about turns: gyroscope, accelerometer and magnetometer contradict each other about how far, or which way."""

from collections.abc import Iterator, Sequence
from math import degrees, log

import numpy as np

from levelhead.inspection.agreement import CONTRAST, Agreement, Hypothesis, Seen, agree, angle_of, fit_scale, settle
from levelhead.inspection.bias_jump import BiasJump, examine_bias_jump, find_jump, leaves_less
from levelhead.inspection.findings import Finding, Measurement
from levelhead.inspection.mend import turn
from levelhead.inspection.physics import scale_to_gravity
from levelhead.inspection.residuals import (
    examine_bias,
    examine_delay,
    examine_field_delay,
    examine_iron,
    examine_shape,
    find_delay,
)
from levelhead.inspection.values import NAMES, without_stuck
from levelhead.open_types import JsonObject
from levelhead.recording import Array, Recording
from levelhead.signals.turn_matrix import MAX_SEGMENTS, MIN_SEGMENTS, SHORTEST
from levelhead.sources.interpret.counts import GYR
from levelhead.units import DEGREE

GROSS = log(1.3)  # of a scale, and
GROSS_ANGLE = 10.0  # deg of a mounting, from which the orientation is wrong rather than worse
SIGMAS = 1.96  # of an interval of 95 %
DECIDES = "Turn it slowly by 90° about each axis and back: that decides"
USUAL = (131.0, 65.5, 32.8, 16.4)  # counts per deg/s


def examine_turns(recording: Recording, most: int = MAX_SEGMENTS) -> Iterator[Finding | Measurement]:
    """The one fault of scale, wiring or mounting that explains how the sensors disagree; delay, iron, bias."""
    sound = without_stuck(recording)
    if sound is None:
        return
    recording = scale_to_gravity(sound)
    agreement, jump = _explain(recording, most)
    force = next((one for one in agreement.seen if one.role == "acc"), None)
    fault = agreement.fault
    if fault is not None:
        evidence, sure = _evidence(agreement), agreement.is_sure
        if fault.kind in ("scale", "axis_scale"):
            yield _scale(recording, fault, evidence, agreement)
        elif fault.kind == "mounting":
            yield _mounting(fault, evidence, agreement)
        else:
            yield _wiring(fault, agreement.rivals(fault), evidence, sure)
    yield from _examine_contrast(agreement, force)
    yield from _measure(agreement)
    settled = {one.role: settle(one, fault) for one in agreement.seen}
    late = 0.0  # s, of the gyroscope
    if "acc" in settled:
        delay = find_delay(settled["acc"], settled.get("mag"))
        late = max(0.0, -delay.seconds) if delay.is_clear else 0.0
        yield from examine_delay(settled["acc"], delay, agreement.excess)
    if "mag" in settled:
        yield from examine_field_delay(settled["mag"], late)
        yield from examine_iron(settled["mag"], fault)
        yield from examine_shape(settled["mag"], fault)
    right = recording if fault is None else turn(fault.role, fault.matrix).apply(recording)
    yield from examine_bias_jump(jump or find_jump(right, list(settled.values())))
    yield from examine_bias(list(settled.values()))


def _measure(agreement: Agreement) -> Iterator[Measurement]:
    """Scale and mounting of the gyroscope beside gravity; nothing beside axes in a wrong order."""
    if not agreement.seen or agreement.is_contradictory:
        return
    kind = agreement.fault.kind if agreement.fault else "none"
    if kind in ("none", "scale"):
        factor, sigma, _ = fit_scale(agreement.seen)
        spread = SIGMAS * sigma * agreement.excess**0.5
        if factor > spread:
            interval = (1.0 / (factor + spread), 1.0 / (factor - spread))
            yield Measurement("gyro_scale", "scale of the gyroscope", 1.0 / factor, interval, 1.0)
    if kind in ("none", "mounting"):
        askew = next((one for one in agreement.faults if (one.kind, one.role) == ("mounting", "acc")), None)
        if askew is not None:
            angle, sigmas = degrees(angle_of(askew.matrix)), SIGMAS * agreement.excess**0.5
            widest = float(np.linalg.eigvalsh(askew.covariance)[-1] ** 0.5)
            low, high = angle - degrees(sigmas * askew.sigma), angle + degrees(sigmas * widest)
            interval = (max(0.0, low), min(180.0, high))
            yield Measurement("mounting", "accelerometer askew by", angle, interval, 0.0, "deg")


def _examine_contrast(agreement: Agreement, force: Seen | None) -> Iterator[Finding]:
    """Whether the turn of gravity was seen at all, and some fault or none explains it."""
    if force is None:
        yield Finding(
            "acc_gyr_test_invalid",
            "note",
            "accelerometer and gyroscope cannot be compared on so short a recording",
            f"fewer than {MIN_SEGMENTS} stretches of {SHORTEST:g} s have no gap and no missing reading",
            f"Record {10 * SHORTEST:g} s of motion or more.",
        )
    elif agreement.is_contradictory:
        yield Finding(
            "acc_gyr_test_invalid",
            "note",
            "accelerometer and gyroscope cannot be compared: no fault explains how they disagree",
            f"χ² {agreement.faults[0].chi:.0f} of {9 * len(agreement.seen)} numbers for the likeliest",
            f"{DECIDES}.",
        )
    elif agreement.fault is None and force.contrast < CONTRAST:
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


def _wiring(fault: Hypothesis, rivals: Sequence[Hypothesis], evidence: str, sure: bool) -> Finding:
    inverted = fault.role == "gyr" and np.allclose(fault.matrix, -np.eye(3))
    name = "mag_axes" if fault.role == "mag" else "gyro_inverted" if inverted else "axes_order"
    ways = [f"{NAMES[one.role]} {change_of(one.matrix)}" for one in (fault, *rivals[:2])]
    contrary = f"gravity {'turns' if sure else 'may turn'} against the gyroscope: one of them is inverted"
    apart = f"the axes {'do' if sure else 'may'} not belong together: {' or '.join(ways)}"
    sole = not rivals
    return Finding(
        name,
        "warning" if fault.role == "mag" else "broken",
        contrary if inverted else apart,
        evidence,
        f"Take the {NAMES[fault.role]} as ({words_of(fault.matrix)}); --fix does." if sole and sure else
        f"{DECIDES} between them." if rivals else f"{DECIDES}.",
        mend=turn(fault.role, fault.matrix, sole),
        sure=sure,
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


def _mounting(fault: Hypothesis, evidence: str, agreement: Agreement) -> Finding:
    sure = agreement.is_sure
    angle = degrees(angle_of(fault.matrix))
    spread = SIGMAS * degrees(fault.sigma) * agreement.excess**0.5
    severe = angle > GROSS_ANGLE and fault.role != "mag"
    return Finding(
        "mag_axes" if fault.role == "mag" else "mounting",
        "broken" if severe else "warning",
        f"the {NAMES[fault.role]} {'is' if sure else 'may be'} mounted {angle:.1f}° askew",
        evidence,
        "Mount it straight, or turn its readings: --fix does." if sure else f"{DECIDES}.",
        value=angle,
        interval=(max(0.0, angle - spread), angle + spread),
        unit="deg",
        mend=turn(fault.role, fault.matrix),
        sure=sure,
    )  # fmt: skip


def _scale(recording: Recording, fault: Hypothesis, evidence: str, agreement: Agreement) -> Finding:
    sure = agreement.is_sure
    axis = None if fault.kind == "scale" else int(np.abs(np.diag(fault.matrix) - 1.0).argmax())
    factor = float(fault.matrix[axis or 0, axis or 0])
    spread = SIGMAS * fault.sigma * agreement.excess**0.5
    low, high = factor - spread, factor + spread
    value = 1.0 / factor
    interval = (1.0 / high, 1.0 / low if low > 0.0 else np.inf)
    part, verb = "" if axis is None else f"'s {'xyz'[axis]}", "reads" if sure else "may read"
    cause = "" if axis is not None else _cause(recording, interval, sure)
    cure = f"{_option(recording, factor)}; --fix does." if axis is None else "Calibrate it; --fix does."
    return Finding(
        "gyro_scale",
        "broken" if not abs(log(max(abs(value), 1e-3))) < GROSS else "warning",
        f"the gyroscope{part} {verb} {value:.3g} times the true turn ({interval[0]:.3g} to {interval[1]:.3g}){cause}",
        evidence,
        cure if sure else f"{DECIDES}.",
        value=value, interval=interval, mend=turn("gyr", fault.matrix), sure=sure,
    )  # fmt: skip


def _cause(recording: Recording, interval: tuple[float, float], sure: bool) -> str:
    """The known mistake with such a factor; of a vague one the clock only."""
    low, high = interval
    if low < 1.0 / DEGREE < high or low < DEGREE < high:
        return ": its unit is wrong"
    causes = []
    pairs = [(wrong, right) for wrong in GYR for right in GYR if wrong != right and low < right / wrong < high]
    if pairs and sure:
        middle = (low * high) ** 0.5
        wrong, right = min(pairs, key=lambda pair: (pair[0] not in USUAL) + abs(log(pair[1] / pair[0] / middle)))
        causes.append(f"{right:g} counts per deg/s were taken for {wrong:g}")
    rate = recording.rate * (low * high) ** 0.5
    causes.append(f"the clock {'is' if sure else 'may be'} wrong, {recording.rate:.3g} Hz for {rate:.3g} Hz")
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
