"""The unit of each sensor: from a hint, the header, or the evidence in the numbers, and whether they agree."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.open_types import ReadOnlyFields
from levelhead.recording import Array
from levelhead.signals.field_turn import FieldTurn, field_turn
from levelhead.sources.conclusion import Basis, Conclusion
from levelhead.sources.hints import QUANTITY, Hints, NeedsHints, Scale, count_word
from levelhead.sources.interpret import unit_inference
from levelhead.sources.interpret.converter_counts import offset_of, rates_about
from levelhead.sources.interpret.counts import acc_sensitivity
from levelhead.sources.interpret.raw_counts import PER_DEGREE, PER_G, THOUSANDTHS, are_thousandths
from levelhead.sources.interpret.roles import Roles
from levelhead.sources.names.column_name import RELATIVE
from levelhead.sources.names.vendors import find_vendor, gyroflow_scale
from levelhead.sources.sentences import gyroscope_reason
from levelhead.sources.table import Table
from levelhead.units import DEGREE

SHORTEST = 0.6  # of the units in use g is the largest, and gravity is 1 of it
_FULL_SCALES = (1 / 2, 1 / 4, 1 / 8, 1 / 16)  # what gravity is in shares of ±2, 4, 8, 16 g
_NEAR = 0.05  # by which a length may differ from one of them
LEAST_GRAVITY = 0.35  # of the median length: a shorter mean, and no usual length, is an accelerometer without gravity


@dataclass
class Evidence:
    """What was concluded while a table became a recording.

    Attributes:
        conclusions: in the order in which they were made.
        acc_per_g: counts per g, if the accelerometer gives counts.
        thousandths: whether it gives whole mg, or m/s² times 1000: no chip's counts stand beside those.
        adds_gravity: whether gravity, which stands in columns of its own, is added to the acceleration.
    """

    conclusions: list[Conclusion]
    acc_per_g: float | None = None
    thousandths: bool = False
    adds_gravity: bool = False

    def conclude(
        self, about: str, reason: str, scale: Scale, basis: Basis, facts: ReadOnlyFields, confirm: ReadOnlyFields
    ) -> None:
        """Adds a conclusion about a unit."""
        self.conclusions.append(Conclusion(about, reason, scale.name, basis, facts, confirm))


class GravityRemoved(LevelheadError):
    """The accelerometer's numbers hold no gravity."""


def find_scale(role: str, table: Table, roles: Roles, hints: Hints, found: list[Conclusion]) -> Scale | None:
    """The scale that a hint gives, the file, or the custom of the program that wrote it; a hint wins."""
    said = roles.units.get(role) or table.units.get(role)
    if said is None and role not in hints.scale and (scale := gyroflow_scale(role, table.origin)) is not None:
        found.append(Conclusion(f"{role}.unit", "preamble", scale.name, Basis.HEADER))
        return scale
    if said is None and role not in hints.scale and role not in hints.map:
        vendor = find_vendor([*table.names, *table.origin])
        if vendor is not None and role in vendor.units:
            said = vendor.units[role]
            facts, confirm = {"vendor": vendor.name}, {"units": {role: said}}
            found.append(Conclusion(f"{role}.unit", "vendor", said, Basis.VENDOR, facts, confirm))
    if role in hints.scale:
        if said is not None and units.find_factor(QUANTITY[role], said) != hints.scale[role].factor:
            facts = {"file": said}
            found.append(Conclusion(f"{role}.unit", "hint_against_file", hints.scale[role].name, Basis.HINT, facts))
        return hints.scale[role]
    if said is None or said == RELATIVE:
        return None
    return Scale(units.factor(QUANTITY[role], said), said)


class Turning(NamedTuple):
    """Rows of a gyroscope beside an accelerometer's: ``rows`` of all, (m,) ``t`` s, (m, 3) ``gyr``, and its scale."""

    rows: slice | NDArray[np.intp]
    t: Array
    gyr: Array
    scale: Scale | None


def acc_scale(
    values: Array, scale: Scale | None, hinted: bool, turning: Turning, table: Table, evidence: Evidence
) -> Scale:
    """The scale of (n, 3) ``values`` of an accelerometer; ``scale`` is the declared one.

    Raises:
        LevelheadError: gravity is not in the numbers, or the declared unit contradicts them.
    """
    norm = unit_inference.median_norm(values)
    if scale is not None:
        _plausible_acc(values, norm, scale, hinted, table)
        return scale
    unit = unit_inference.acc_unit(norm)
    if unit is None and are_thousandths(values):
        evidence.thousandths = True
        scale = Scale(1.0, "counts, 1000 per m/s²", 1000.0)
        confirm = {"counts": {"acc": "1000/m/s²"}}
        evidence.conclude("acc.unit", "thousandths", scale, Basis.GUESS, {"norm": norm}, confirm)
        return scale
    middle = offset_of(values)
    if middle is not None:
        listed = ", ".join(f"{one:.0f}" for one in middle)
        raise LevelheadError(
            f"{table.source}: the accelerometer's numbers are counts about {listed}, as an analogue sensor's are, and "
            "not about 0; expected those taken off, from all columns of counts"
        )
    if unit is not None:
        scale = Scale(units.factor("acc", unit), unit)
        evidence.conclude("acc.unit", "length", scale, Basis.NUMBERS, {"norm": norm}, {"units": {"acc": unit}})
        evidence.thousandths = unit == "mg" and _whole(values)
        return scale
    if (running := _runner(values, norm, turning, evidence)) is not None:
        return running
    counts = acc_sensitivity(norm)
    if counts is not None and norm > 50.0:
        evidence.acc_per_g = counts.per_unit
        scale = Scale(units.factor("acc", "g"), f"counts, {counts.per_unit:g} per g", counts.per_unit)
        facts, confirm = {"per_g": counts.per_unit, "norm": norm}, {"counts": {"acc": f"{counts.per_unit:g}/g"}}
        evidence.conclude("acc.unit", "counts", scale, Basis.GUESS, facts, confirm)
        return scale
    if without_gravity(values):
        raise _no_gravity(table, values, norm)
    if norm < SHORTEST and min(abs(norm / share - 1.0) for share in _FULL_SCALES) > _NEAR:
        raise _no_gravity(table, values, norm)
    raise _of_no_unit(values, norm, table)


def _runner(values: Array, norm: float, turning: Turning, evidence: Evidence) -> Scale | None:
    """The scale of (n, 3) ``values`` that are longer than gravity because the body runs; None if gravity is not left.

    However it runs, the mean force over some seconds, turned back by the gyroscope, is gravity. Whole numbers are left
    to the sensitivities of chips: beside counts of the gyroscope its turn is less certain.
    """
    unit = None if _whole(values) else unit_inference.hurried_unit(values)
    force = None if unit is None else _mean_force(values, units.factor("acc", unit), turning)
    if unit is None or force is None or not unit_inference.is_gravity_left(force):
        return None
    scale = Scale(units.factor("acc", unit), unit)
    facts, confirm = {"norm": norm, "force": force}, {"units": {"acc": unit}}
    evidence.conclude("acc.unit", "mean_force", scale, Basis.GUESS, facts, confirm)
    return scale


def _of_no_unit(values: Array, norm: float, table: Table) -> NeedsHints:
    unit = None if _whole(values) else unit_inference.hurried_unit(values)
    if unit is not None:
        return NeedsHints(
            f"{table.source}: the accelerometer has median length {norm:.4g}, which is {unit} only on a body that runs "
            f"or is shaken, and the gyroscope does not confirm it; expected the hint units acc={unit}, or what it is",
            units={"acc": unit},
        )
    return NeedsHints(
        f"{table.source}: the accelerometer has median length {norm:.4g}, which is gravity in neither m/s², "
        f"g nor mg; expected the hint units acc=…, or for raw counts --counts acc={norm:.4g}/g",
        counts={"acc": f"{norm:.4g}/g"},
    )


def _mean_force(values: Array, factor: float, turning: Turning) -> float | None:
    """``mean_force`` of (n, 3) ``values`` that are m/s² times ``factor``, beside a gyroscope; None: nothing tells."""
    t, gyr, acc = turning.t, turning.gyr, values[turning.rows] * factor
    if turning.scale is not None:
        return unit_inference.mean_force(t, gyr * (turning.scale.factor / turning.scale.divisor), acc)
    found = unit_inference.gyr_unit(t, gyr, acc)
    return None if found.unit is None else unit_inference.mean_force(t, gyr * units.factor("gyr", found.unit), acc)


def gyr_scale(
    values: Array,
    scale: Scale | None,
    hinted: bool,
    t: Array,
    acc: Array,
    mag: Array | None,
    table: Table,
    evidence: Evidence,
) -> Scale:
    """The scale of (n, 3) ``values`` of a gyroscope beside (n, 3) ``acc`` in m/s²; ``scale`` is the declared one.

    ``mag`` (n, 3) in any unit, or None, helps where gravity tells little.

    Raises:
        LevelheadError: a hint contradicts the numbers, or nothing tells their unit.
    """
    rows = unit_inference.excerpt(len(t))
    if (middle := rates_about(values)) is not None:
        raise LevelheadError(
            f"{table.source}: the gyroscope's numbers are counts about {middle:.0f}, as an analogue sensor's are, and "
            "not about 0; expected those taken off, from all columns of counts"
        )
    if scale is not None:
        return _checked_gyr(values[rows], scale, hinted, t[rows], acc[rows], table, evidence)
    per_g = THOUSANDTHS if evidence.thousandths else evidence.acc_per_g
    found = unit_inference.gyr_unit(t[rows], values[rows], acc[rows], per_g)
    if found.basis is Basis.GUESS and (proved := _by_field(t, values, mag)) is not None:
        unit, turn = proved
        scale = Scale(units.factor("gyr", unit), unit)
        facts = {"scale": turn.scale, "correlation": turn.correlation}
        evidence.conclude("gyr.unit", "field", scale, Basis.NUMBERS, facts, {"units": {"gyr": unit}})
        return scale
    counted = found.unit is not None and found.basis is Basis.GUESS and _whole(values)  # beside counts stand counts
    if counted and evidence.acc_per_g == PER_G:
        scale = _counts_scale(PER_DEGREE)
        facts = {"counts": PER_DEGREE, "per_g": PER_G}
        evidence.conclude(
            "gyr.unit", "mpu6050", scale, Basis.GUESS, facts, {"counts": {"gyr": f"{PER_DEGREE:g}/deg/s"}}
        )
        return scale
    if counted and evidence.thousandths:
        scale = Scale(1.0, "counts, 1000 per rad/s", 1000.0)
        evidence.conclude("gyr.unit", "thousandths", scale, Basis.GUESS, {}, {"counts": {"gyr": "1000/rad/s"}})
        return scale
    if counted and evidence.acc_per_g is not None:
        usual = "14.375" if evidence.acc_per_g == 256.0 else "131"  # an ADXL345's neighbour is an ITG-3200
        raise NeedsHints(
            f"{table.source}: the gyroscope's numbers are whole, as the accelerometer's counts are, and nothing turns "
            "far enough to tell its full scale; expected the hint --counts gyr=…, such as 131/deg/s for ±250 deg/s",
            counts={"gyr": f"{usual}/deg/s"},
        )
    if found.unit is not None:
        scale = Scale(units.factor("gyr", found.unit), found.unit)
        facts = {**found.facts, "reversed": found.reversed}
        evidence.conclude("gyr.unit", found.reason, scale, found.basis, facts, {"units": {"gyr": found.unit}})
        return scale
    if found.counts is not None:
        scale = _counts_scale(found.counts)
        facts = {**found.facts, "reversed": found.reversed}
        confirm = {"counts": {"gyr": f"{count_word(found.counts)}/deg/s"}}
        evidence.conclude("gyr.unit", found.reason, scale, found.basis, facts, confirm)
        return scale
    why = gyroscope_reason(found.reason, found.facts)
    raise NeedsHints(
        f"{table.source}: the gyroscope is neither in rad/s nor in deg/s: {why}; "
        "expected the hint units gyr=…, or for raw counts --counts gyr=131/deg/s or what the sensor's full scale says",
        counts={"gyr": "131/deg/s"},
    )


def _counts_scale(per_unit: float) -> Scale:
    return Scale(DEGREE, f"counts, {per_unit:g} per deg/s", per_unit)


def _whole(values: Array) -> bool:
    """Whether all numbers are whole, and reach more than a few: counts."""
    finite = values[np.isfinite(values)]
    return len(finite) > 0 and bool(np.array_equal(finite, np.rint(finite))) and float(np.abs(finite).max()) > 3.0


def _by_field(t: Array, values: Array, mag: Array | None) -> tuple[str, FieldTurn] | None:
    """(unit, turn) of a gyroscope against which a magnetometer turns; None if it does not, or there is none."""
    for unit, factor in (("rad/s", 1.0), ("deg/s", DEGREE)):
        turn = None if mag is None else field_turn(t, values * factor, mag)
        if turn is not None and turn.correlation > 0.8 and 0.6 < turn.scale < 1.6 and turn.turned > 0.05:
            return unit, turn
    return None


def mag_scale(values: Array, scale: Scale | None, relative: bool, evidence: Evidence) -> Scale | None:
    """The scale of (n, 3) ``values`` of a magnetometer; None: without unit."""
    if scale is not None:
        return scale
    norm = unit_inference.median_norm(values)
    unit = None if relative else unit_inference.mag_unit(norm)
    if unit is None:
        evidence.conclusions.append(Conclusion("mag.unit", "unknown", None, Basis.NUMBERS, {"norm": norm}))
        return None
    scale = Scale(units.factor("mag", unit), unit)
    evidence.conclude("mag.unit", "length", scale, Basis.NUMBERS, {"norm": norm}, {"units": {"mag": unit}})
    return scale


def _plausible_acc(values: Array, norm: float, scale: Scale, hinted: bool, table: Table) -> None:
    length = norm / scale.divisor * abs(scale.factor) / units.GRAVITY
    if 0.3 < length < 3.0 and not (length < 0.6 and without_gravity(values)):
        return
    if length < 1.0 and without_gravity(values):
        raise _no_gravity(table, values, norm)
    unit = unit_inference.acc_unit(norm / scale.divisor)
    if unit is None and (0.1 < length < 10.0 or not np.isfinite(length)):
        return
    said = f"{table.source}: the accelerometer is declared in {scale.name}, but its median length of {norm:.4g} says "
    if unit is None:
        counts = acc_sensitivity(norm)
        if counts is None:
            raise LevelheadError(
                f"{said}{length:.3g} g; expected another unit, units acc=…, or raw counts, --counts acc=…"
            )
        raise NeedsHints(
            f"{said}raw counts; expected the hint --counts acc={counts.per_unit:g}/g",
            counts={"acc": f"{counts.per_unit:g}/g"},
        )
    raise NeedsHints(f"{said}{unit}; expected the hint units acc={unit}", units={"acc": unit})


def without_gravity(values: Array) -> bool:
    """Whether the mean of (n, 3) ``values`` is much shorter than their usual length: of all, and of most tenths."""
    finite = values[np.isfinite(values).all(axis=1)]
    norm = unit_inference.median_norm(finite)
    if len(finite) < 10 or not norm > 0.0:
        return False
    parts = np.array_split(finite, 10)
    short = sum(float(np.linalg.norm(part.mean(axis=0))) < LEAST_GRAVITY * norm for part in parts)
    return short > 5 and float(np.linalg.norm(finite.mean(axis=0))) < LEAST_GRAVITY * norm


def lacks_gravity(values: Array) -> bool:
    """Whether (n, 3) ``values`` are without gravity, or shorter than it in any unit: linear acceleration at rest."""
    return without_gravity(values) or unit_inference.median_norm(values) < SHORTEST


def _no_gravity(table: Table, values: Array, norm: float) -> GravityRemoved:
    mean = np.linalg.norm(np.nanmean(values, axis=0))
    return GravityRemoved(
        f"{table.source}: the accelerometer has gravity removed: its median length is {norm:.3g} and that of its mean "
        f"{mean:.2g}; expected the specific force, which at rest is as long as gravity (not linear or "
        f"user acceleration)"
    )


def _checked_gyr(
    values: Array, scale: Scale, hinted: bool, t: Array, acc: Array, table: Table, evidence: Evidence
) -> Scale:
    why, unit = None, "deg/s"
    scaled = values / scale.divisor
    if scale.factor == 1.0:
        why = unit_inference.says_degrees(t, scaled, acc)
    elif scale.factor == DEGREE:
        why, unit = unit_inference.says_radians(t, scaled, acc), "rad/s"
    if why is None:
        if not hinted and scale.divisor == 1.0 and scale.factor in (1.0, DEGREE):
            question = unit_inference.question_unit(
                t, scaled * scale.factor, acc, DEGREE if scale.factor == DEGREE else 1.0
            )
            if question is not None:
                other = "rad/s" if scale.factor == DEGREE else "deg/s"
                facts = {"declared": scale.name, "other": other, "why": question}
                confirm = {"units": {"gyr": scale.name}}
                evidence.conclude("gyr.unit", "doubtful", scale, Basis.GUESS, facts, confirm)
        return scale
    if hinted or scale.divisor != 1.0:
        raise NeedsHints(
            f"{table.source}: the gyroscope is declared in {scale.name}, but it looks like {unit}: {why}; "
            f"expected the hint units gyr={unit}",
            units={"gyr": unit},
        )
    facts = {"declared": scale.name, "taken": unit, "why": why}
    taken = Scale(units.factor("gyr", unit), unit)
    evidence.conclude("gyr.unit", "against_header", taken, Basis.GUESS, facts, {"units": {"gyr": unit}})
    return taken
