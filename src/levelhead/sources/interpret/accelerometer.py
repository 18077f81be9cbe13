"""The unit of the accelerometer: it mostly measures gravity, so its median length distinguishes g from m/s²."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.recording import Array, median
from levelhead.signals.gravity_turn import excerpt, median_norm
from levelhead.signals.mean_force import is_gravity_left, usual_force
from levelhead.sources.conclusions import Basis
from levelhead.sources.hints import NeedsHints, Scale
from levelhead.sources.interpret.converter_counts import offset_of
from levelhead.sources.interpret.counts import GYR, acc_sensitivity
from levelhead.sources.interpret.evidence import Evidence, are_whole
from levelhead.sources.interpret.gyroscope_unit import gyr_unit
from levelhead.sources.interpret.raw_counts import THOUSANDTHS, are_thousandths
from levelhead.sources.names.vendors import find_vendor
from levelhead.sources.table import Table
from levelhead.units import GRAVITY

MIN_UNIT = 0.6  # of the units in use g is the largest, and gravity is 1 of it
_FULL_SCALES = (1 / 2, 1 / 4, 1 / 8, 1 / 16)  # gravity in shares of ±2, 4, 8, 16 g
_MIN_COUNTS = 50.0  # per g
_MAX_DEVIATION = 0.05  # by which a length may differ from one of them
MIN_GRAVITY = 0.35  # of the median length: a shorter mean, and no usual length, is an accelerometer without gravity
LEFT_OF_LINEAR = 0.55  # g, of the mean force; linear acceleration leaves up to 0.49, gravity 0.80 and more
_HURRIED = (1.4, 3.0)  # usual lengths, in g, of the specific force on a runner
_UNEVEN = 0.7  # shares of the usual length between its deciles: 0.9 and more on runners, 0.5 on drones and swung arms
_REST_WINDOW, _REST_WINDOWS = 0.5, 4  # s; windows in which a sensor that is moved for most of a log rests, at least
_REST_SHAKEN, _REST_TURNED = 0.02, 0.05  # in them: share of the length, share of the largest rate


class GravityRemoved(LevelheadError):
    """The accelerometer's numbers hold no gravity."""


class GyroscopeRows(NamedTuple):
    """Rows of a gyroscope beside an accelerometer's: ``rows`` of all, (m,) ``t`` s, (m, 3) ``gyr``, and its scale."""

    rows: slice | NDArray[np.intp]
    t: Array
    gyr: Array
    scale: Scale | None


def acc_scale(
    values: Array, scale: Scale | None, hinted: bool, turning: GyroscopeRows, table: Table, evidence: Evidence
) -> Scale:
    """The scale of (n, 3) ``values`` of an accelerometer; ``scale`` is the declared one.

    Raises:
        LevelheadError: gravity is not in the numbers, or the declared unit contradicts them.
    """
    norm = median_norm(values)
    if _cancels(values, norm, scale, turning):
        raise _no_gravity(table, values, norm)
    if scale is not None:
        _plausible_acc(values, norm, scale, hinted, table, evidence)
        if are_whole(values):
            per_g = round(GRAVITY * scale.divisor / abs(scale.factor), 6)
            evidence.acc_per_g, evidence.acc_norm = per_g if per_g > _MIN_COUNTS else None, norm
        return scale
    unit = acc_unit(norm)
    if unit is None and are_thousandths(values):
        evidence.acc_per_g, evidence.acc_norm = THOUSANDTHS, norm
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
        if are_whole(values):
            evidence.acc_norm = norm
            evidence.acc_per_g = 1000.0 if unit == "mg" else None
        return scale
    if (running := _while_running(values, norm, turning, evidence)) is not None:
        return running
    if (resting := _while_at_rest(values, norm, turning, evidence)) is not None:
        return resting
    counts = acc_sensitivity(norm)
    if counts is not None and norm > _MIN_COUNTS:
        evidence.acc_per_g, evidence.acc_norm = counts, norm
        scale = Scale(units.factor("acc", "g"), f"counts, {counts:g} per g", counts)
        facts, confirm = {"per_g": counts, "norm": norm}, {"counts": {"acc": f"{counts:g}/g"}}
        evidence.conclude("acc.unit", "counts", scale, Basis.GUESS, facts, confirm)
        return scale
    if without_gravity(values):
        raise _no_gravity(table, values, norm)
    if norm < MIN_UNIT and min(abs(norm / share - 1.0) for share in _FULL_SCALES) > _MAX_DEVIATION:
        raise _no_gravity(table, values, norm)
    raise _of_no_unit(values, norm, table)


def _cancels(values: Array, norm: float, scale: Scale | None, turning: GyroscopeRows) -> bool:
    """Whether (n, 3) ``values`` hold no gravity, whatever their unit: the force turned back over seconds cancels.

    Linear acceleration may be as long as gravity. Its mean is then short beside its usual length, and gravity's is not,
    in any unit of the gyroscope; on a turntable the declared unit separates gravity from centripetal acceleration.
    """
    if not norm > 0.0:
        return False
    declared = (
        [] if turning.scale is None else [turning.scale.factor / turning.scale.divisor]
    )  # first: it mostly decides
    rates = [*declared, 1.0, units.DEGREE, *(units.DEGREE / counts for counts in GYR)]
    one_g = norm if scale is None else GRAVITY * scale.divisor / abs(scale.factor)
    acc = values[turning.rows] * (GRAVITY / one_g)
    forces = (usual_force(turning.t, turning.gyr * rate, acc) for rate in rates)
    return all(force is not None and force < LEFT_OF_LINEAR for force in forces)


def _while_running(values: Array, norm: float, turning: GyroscopeRows, evidence: Evidence) -> Scale | None:
    """The scale of (n, 3) ``values`` that are longer than gravity because the body runs; None if gravity is not left.

    However it runs, the mean force over some seconds, turned back by the gyroscope, is gravity. Whole numbers are left
    to the sensitivities of chips: beside counts of the gyroscope its turn is less certain.
    """
    unit = None if are_whole(values) else unit_while_running(values)
    force = None if unit is None else _force_left(values, units.factor("acc", unit), turning)
    if unit is None or force is None or not is_gravity_left(force):
        return None
    scale = Scale(units.factor("acc", unit), unit)
    facts, confirm = {"norm": norm, "force": force}, {"units": {"acc": unit}}
    evidence.conclude("acc.unit", "mean_force", scale, Basis.GUESS, facts, confirm)
    return scale


def _while_at_rest(values: Array, norm: float, turning: GyroscopeRows, evidence: Evidence) -> Scale | None:
    """The scale of (n, 3) ``values`` whose usual length is thrust or a spin, and gravity only where nothing moves.

    A rocket rests on its pad, then spins. Whole numbers are left to the sensitivities of chips. None: nothing rests.
    """
    if are_whole(values):
        return None
    acc = values[turning.rows]
    step = median(np.diff(turning.t)) if len(turning.t) > 1 else 0.0
    size = max(4, round(_REST_WINDOW / step)) if step > 0.0 else 0
    count = len(acc) // size if size else 0
    if count < _REST_WINDOWS:
        return None
    windows, rates = (one[: count * size].reshape(count, size, 3) for one in (acc, turning.gyr))
    length = np.sqrt((windows.mean(axis=1) ** 2).sum(axis=1))
    shaken = np.sqrt(windows.var(axis=1).sum(axis=1)) / length
    turned = np.sqrt((rates**2).sum(axis=2)).max(axis=1)
    large = np.nanmax(turned, initial=0.0)
    still = (shaken < _REST_SHAKEN) & (turned < _REST_TURNED * large)
    unit = acc_unit(median(length[still]), 0.95, 1.05) if still.sum() >= _REST_WINDOWS else None
    if unit is None:
        return None
    scale = Scale(units.factor("acc", unit), unit)
    facts, confirm = {"norm": norm, "rest": median(length[still])}, {"units": {"acc": unit}}
    evidence.conclude("acc.unit", "rest", scale, Basis.GUESS, facts, confirm)
    return scale


def _of_no_unit(values: Array, norm: float, table: Table) -> NeedsHints:
    unit = None if are_whole(values) else unit_while_running(values)
    if unit is not None:
        return NeedsHints(
            f"{table.source}: the accelerometer has median length {norm:.4g}, which is {unit} only on a body that runs "
            f"or is shaken, and the gyroscope does not confirm it; expected the hint units acc={unit}, or another one",
            units={"acc": unit},
        )
    return NeedsHints(
        f"{table.source}: the accelerometer has median length {norm:.4g}, which is gravity in neither m/s², "
        f"g nor mg; expected the hint units acc=…, or for raw counts --counts acc={norm:.4g}/g",
        counts={"acc": f"{norm:.4g}/g"},
    )


def _force_left(values: Array, factor: float, turning: GyroscopeRows) -> float | None:
    """``usual_force`` of (n, 3) ``values`` that are m/s² times ``factor``, beside a gyroscope; None: no evidence."""
    t, gyr, acc = turning.t, turning.gyr, values[turning.rows] * factor
    if turning.scale is not None:
        return usual_force(t, gyr * (turning.scale.factor / turning.scale.divisor), acc)
    found = gyr_unit(t, gyr, acc)
    return None if found.unit is None else usual_force(t, gyr * units.factor("gyr", found.unit), acc)


def _plausible_acc(values: Array, norm: float, scale: Scale, hinted: bool, table: Table, evidence: Evidence) -> None:
    length = norm / scale.divisor * abs(scale.factor) / units.GRAVITY
    if 0.3 < length < 3.0 and not (length < 0.6 and without_gravity(values)):
        return
    if length < 1.0 and without_gravity(values):
        raise _no_gravity(table, values, norm)
    unit = acc_unit(norm / scale.divisor)
    if unit is None and (0.1 < length < 10.0 or not np.isfinite(length)):
        return
    if hinted:
        counts = acc_sensitivity(norm) if unit is None else None
        other = unit or ("raw counts" if counts is not None else "another unit")
        facts = {"other": other, "why": f"their median length would be {length:.3g} g"}
        evidence.conclude("acc.unit", "hint_against_numbers", scale, Basis.HINT, facts, {})
        return
    said = f"{table.source}: the accelerometer is declared in {scale.name}, but its median length of {norm:.4g} says "
    if unit is None:
        counts = acc_sensitivity(norm)
        if counts is None:
            raise LevelheadError(
                f"{said}{length:.3g} g; expected another unit, units acc=…, or raw counts, --counts acc=…"
            )
        raise NeedsHints(
            f"{said}raw counts; expected the hint --counts acc={counts:g}/g",
            counts={"acc": f"{counts:g}/g"},
        )
    raise NeedsHints(f"{said}{unit}; expected the hint units acc={unit}", units={"acc": unit})


def without_gravity(values: Array) -> bool:
    """Whether the mean of (n, 3) ``values`` is much shorter than their usual length: of all, and of most tenths."""
    values = values[excerpt(len(values))]
    finite = values[np.isfinite(values).all(axis=1)]
    norm = median_norm(finite)
    if len(finite) < 10 or not norm > 0.0:
        return False
    parts = np.array_split(finite, 10)
    short = sum(float(np.linalg.norm(part.mean(axis=0))) < MIN_GRAVITY * norm for part in parts)
    return short > 5 and float(np.linalg.norm(finite.mean(axis=0))) < MIN_GRAVITY * norm


def lacks_gravity(values: Array) -> bool:
    """Whether (n, 3) ``values`` are without gravity, or shorter than it in any unit: linear acceleration at rest."""
    return without_gravity(values) or median_norm(values) < MIN_UNIT


def _no_gravity(table: Table, values: Array, norm: float) -> GravityRemoved:
    mean = np.linalg.norm(np.nanmean(values, axis=0))
    return GravityRemoved(
        f"{table.source}: the accelerometer has gravity removed: its median length is {norm:.3g} and that of its mean "
        f"{mean:.2g}; expected the specific force, which at rest is as long as gravity (not linear or "
        f"user acceleration){_other_file([*table.names, *table.origin])}"
    )


def _other_file(names: Sequence[str]) -> str:
    """The export that has gravity, of the app that wrote the columns."""
    vendor = find_vendor(names)
    if vendor is not None and vendor.name == "Sensor Logger":
        return "; Sensor Logger writes it as TotalAcceleration.csv, or its rest as Gravity.csv: put one of them beside"
    return "; a phone's app calls it 'accelerometer' or 'acceleration with g', or writes gravity beside it"


def acc_unit(norm: float, low: float = 0.7, high: float = 1.4) -> str | None:
    """The unit in which a median norm is gravity, or ``low`` to ``high`` times gravity; None if there is none."""
    for unit, one_g in (("m/s²", GRAVITY), ("g", 1.0), ("mg", 1000.0)):
        if low < norm / one_g < high:
            return unit
    return None


def unit_while_running(values: Array) -> str | None:
    """The unit in which (n, 3) ``values`` may be the forces of a body that runs: more than gravity, and in flight less.

    None if their lengths are not those of a runner in any unit: numbers of another size keep their usual length.
    """
    low, usual, high = _deciles(values)
    return acc_unit(usual, *_HURRIED) if high - low > _UNEVEN * usual else None


def _deciles(values: Array) -> tuple[float, float, float]:
    """The first, fifth and ninth decile of the lengths of (n, 3) ``values``; NaN without any."""
    length = np.sqrt(np.einsum("ij,ij->i", values, values))
    length = length[np.isfinite(length)]
    low, usual, high = np.quantile(length, (0.1, 0.5, 0.9)) if len(length) else (math.nan,) * 3
    return float(low), float(usual), float(high)
