"""The scale of the gyroscope: its declared unit against its numbers, or the likeliest unit (``gyroscope_unit``)."""

import math
from collections.abc import Mapping

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.recording import Array
from levelhead.signals.field_turn import FieldTurn, field_turn
from levelhead.signals.gravity_turn import (
    MIN_TURN,
    excerpt,
    median_norm,
    quiet_turn,
    turn_of_gravity,
)
from levelhead.signals.mean_force import (
    steadiness_of_gravity,
)
from levelhead.signals.rest import find_still_gyroscope
from levelhead.sources.conclusions import Basis
from levelhead.sources.conclusions.sentences import gyroscope_reason
from levelhead.sources.hints import NeedsHints, Scale, count_word
from levelhead.sources.interpret.converter_counts import rates_about
from levelhead.sources.interpret.counts import ACC, CHIPS
from levelhead.sources.interpret.evidence import Evidence, are_whole
from levelhead.sources.interpret.gyroscope_unit import GyroscopeUnit, Whole, gyr_unit, large_rate, rest_noise
from levelhead.sources.interpret.magnetometer import unit_of_field
from levelhead.sources.interpret.raw_counts import PER_DEGREE, PER_G
from levelhead.sources.table import Table
from levelhead.units import DEGREE

_DEGREES = -0.4  # gain (see Steadiness) from which it is deg/s
_MIN_WINDOWS = 3  # at rest
_PROOF = 0.9  # correlation from which the comparison outweighs a header, or noise
_MAX_BIAS = 0.5  # rad/s, 29 deg/s: no gyroscope is that far off at rest
_MAX_NOISE = 0.05  # rad/s, 2.9 deg/s rms: no gyroscope is that noisy at rest
_MIN_DOUBT_CORRELATION = 0.15  # correlation from which a comparison raises a doubt
_MIN_NOISE = 0.004  # deg/s rms; below it no MEMS gyroscope is at rest, at any rate
_AT_REST = 100.0  # counts; a sensor that is not turned reads less


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

    ``mag`` (n, 3) in any unit, or None, helps where gravity shows little.

    Raises:
        LevelheadError: a hint contradicts the numbers, or nothing shows their unit.
    """
    rows = excerpt(len(t))
    if (middle := rates_about(values)) is not None:
        raise LevelheadError(
            f"{table.source}: the gyroscope's numbers are counts about {middle:.0f}, as an analogue sensor's are, and "
            "not about 0; expected those taken off, from all columns of counts"
        )
    if scale is not None:
        return _checked_gyr(values[rows], scale, hinted, t[rows], acc[rows], table, evidence)
    whole = Whole(evidence.acc_per_g, evidence.acc_norm, _whole_norm(mag))
    found = gyr_unit(t[rows], values[rows], acc[rows], whole)
    turns = _against_field(t, values, mag) if found.basis is Basis.GUESS else {}
    if (unit := _by_field(turns)) is not None:
        scale = Scale(units.factor("gyr", unit), unit)
        facts = {"scale": turns[unit].scale, "correlation": turns[unit].correlation}
        evidence.conclude("gyr.unit", "field", scale, Basis.NUMBERS, facts, {"units": {"gyr": unit}})
        return scale
    if (unit := _by_length(turns)) is not None:
        scale = Scale(units.factor("gyr", unit), unit)
        facts = {"length": turns[unit].length}
        evidence.conclude("gyr.unit", "length", scale, Basis.GUESS, facts, {"units": {"gyr": unit}})
        return scale
    if not found.sure and evidence.acc_per_g == PER_G and large_rate(values) < _AT_REST:  # as after power-up
        facts = {**found.facts, "counts": PER_DEGREE, "per_g": PER_G}
        found = found._replace(unit=None, counts=PER_DEGREE, reason="power_up", facts=facts, chip=CHIPS[0])
    elif not found.sure and evidence.acc_per_g in ACC:
        word = f"{count_word(found.counts)}/deg/s" if found.counts is not None else "131/deg/s"
        raise NeedsHints(
            f"{table.source}: the gyroscope's numbers are whole, as the accelerometer's counts are, and nothing turns "
            f"far enough to show its full scale; expected the hint --counts gyr=…, such as {word} by the noise at rest",
            counts={"gyr": word},
        )
    return _concluded(found, table, evidence)


def _concluded(found: GyroscopeUnit, table: Table, evidence: Evidence) -> Scale:
    """The scale of the unit found.

    Raises:
        NeedsHints: nothing was.
    """
    facts = {**found.facts, "reversed": found.reversed}
    evidence.chip = found.chip
    if found.unit is not None:
        scale = Scale(units.factor("gyr", found.unit), found.unit)
        evidence.conclude("gyr.unit", found.reason, scale, found.basis, facts, {"units": {"gyr": found.unit}})
        return scale
    if found.counts is not None:
        scale = _counts_scale(found.counts)
        confirm = {"counts": {"gyr": f"{count_word(found.counts)}/deg/s"}}
        evidence.conclude("gyr.unit", found.reason, scale, found.basis, facts, confirm)
        return scale
    why = gyroscope_reason(found.reason, found.facts)
    raise NeedsHints(
        f"{table.source}: the gyroscope is neither in rad/s nor in deg/s: {why}; "
        "expected the hint units gyr=…, or for raw counts --counts gyr=131/deg/s, by the full scale",
        counts={"gyr": "131/deg/s"},
    )


def _counts_scale(per_unit: float) -> Scale:
    return Scale(DEGREE, f"counts, {per_unit:g} per deg/s", per_unit)


def _against_field(t: Array, values: Array, mag: Array | None) -> dict[str, FieldTurn]:
    """How a magnetometer turns against the gyroscope in each unit in which that can be seen."""
    if mag is None:
        return {}
    turns = {unit: field_turn(t, values * factor, mag) for unit, factor in (("rad/s", 1.0), ("deg/s", DEGREE))}
    return {unit: turn for unit, turn in turns.items() if turn is not None}


def _by_field(turns: Mapping[str, FieldTurn]) -> str | None:
    """The unit of a gyroscope against which a magnetometer turns; None if it does not."""
    fits = (
        unit for unit, turn in turns.items()
        if turn.correlation > 0.8 and 0.6 < turn.scale < 1.6 and turn.turned > 0.05
    )  # fmt: skip
    return next(fits, None)


def _by_length(turns: Mapping[str, FieldTurn]) -> str | None:
    """The unit of a gyroscope by a raw magnetometer: the one in which the field has the earth's length."""
    fits = [unit for unit, turn in turns.items() if turn.shows_field and unit_of_field(turn) is not None]
    return fits[0] if len(fits) == 1 else None


def _checked_gyr(
    values: Array, scale: Scale, hinted: bool, t: Array, acc: Array, table: Table, evidence: Evidence
) -> Scale:
    why, unit = None, "deg/s"
    scaled = values / scale.divisor
    if scale.factor == 1.0:
        why = contradicts_rad_s(t, scaled, acc)
    elif scale.factor == DEGREE:
        why, unit = contradicts_deg_s(t, scaled, acc), "rad/s"
    if why is None:
        if not hinted and scale.divisor == 1.0 and scale.factor in (1.0, DEGREE):
            question = alternative_unit(t, scaled * scale.factor, acc, DEGREE if scale.factor == DEGREE else 1.0)
            if question is not None:
                other = "rad/s" if scale.factor == DEGREE else "deg/s"
                facts = {"declared": scale.name, "other": other, "why": question}
                confirm = {"units": {"gyr": scale.name}}
                evidence.conclude("gyr.unit", "doubtful", scale, Basis.GUESS, facts, confirm)
        return scale
    if hinted:  # a rocket spins ten times a second, and its user knows the unit
        facts = {"other": unit, "why": why}
        evidence.conclude("gyr.unit", "hint_against_numbers", scale, Basis.HINT, facts, {})
        return scale
    if scale.divisor != 1.0:
        raise NeedsHints(
            f"{table.source}: the gyroscope is declared in {scale.name}, but it looks like {unit}: {why}; "
            f"expected the hint units gyr={unit}",
            units={"gyr": unit},
        )
    facts = {"declared": scale.name, "taken": unit, "why": why}
    taken = Scale(units.factor("gyr", unit), unit)
    evidence.conclude("gyr.unit", "against_header", taken, Basis.GUESS, facts, {"units": {"gyr": unit}})
    return taken


def _whole_norm(mag: Array | None) -> float | None:
    return median_norm(mag) if mag is not None and are_whole(mag) else None


def contradicts_rad_s(t: Array, gyr: Array, acc: Array) -> str | None:
    """Why (n, 3) ``gyr``, declared as rad/s, must be deg/s; None without clear evidence. ``acc`` in m/s²."""
    large = large_rate(gyr)
    if large > 100.0:
        return f"it reaches {large:.0f}, {large / (2 * math.pi):.0f} turns a second"
    turn, held = turn_of_gravity(t, gyr, acc), steadiness_of_gravity(t, gyr, acc)
    if turn is not None and turn.clear:
        if 0.5 < turn.scale * 180.0 / math.pi < 2.0:
            return f"gravity turns {1 / turn.scale:.1f} times slower than its rate"
        if turn.correlation > _PROOF and 0.5 < turn.scale < 2.0:
            return None  # whatever its noise
    rest = find_still_gyroscope(t, gyr, acc)
    why = None
    if rest.windows >= _MIN_WINDOWS and rest.rate > _MAX_BIAS:
        why = f"at rest, while gravity holds still, it reads {rest.rate:.2g}, {math.degrees(rest.rate):.0f} deg/s"
    elif rest.windows >= _MIN_WINDOWS and rest.noise > _MAX_NOISE:
        why = f"its noise at rest would be {math.degrees(rest.noise):.1f} deg/s"
    regular = turn is None or not (turn.clear and turn.scale > 0.3)
    enough = held.windows >= 4 * _MIN_WINDOWS if rest.windows == 0 else held.windows > _MIN_WINDOWS + 1
    if why is None and regular and enough and held.gain < _DEGREES and held.best > 0.85:
        why = "gravity turns much slower than it does"
    return why


def contradicts_deg_s(t: Array, gyr: Array, acc: Array) -> str | None:
    """Why (n, 3) ``gyr``, declared as deg/s, must be rad/s; None without clear evidence. ``acc`` in m/s²."""
    turn = turn_of_gravity(t, gyr, acc)
    if turn is not None and turn.clear and turn.correlation > _PROOF and 0.5 < turn.scale < 2.0:
        return f"gravity turns {turn.scale * 180.0 / math.pi:.1f} times faster than its rate"
    return None


def alternative_unit(t: Array, rate: Array, acc: Array, factor: float) -> str | None:
    """Why the declared unit, in rad/s ``factor``, may be the other of deg/s and rad/s; None without evidence.

    ``rate`` (n, 3) rad/s by the declared unit, ``acc`` (n, 3) m/s². Weaker than ``contradicts_rad_s``: gravity's turn,
    noisy as it may be, is nearer to the other unit, or no gyroscope is as quiet as this one would be.
    """
    between = math.sqrt(180.0 / math.pi)
    told = [one for one in (turn_of_gravity(t, rate, acc), quiet_turn(t, rate, acc)) if one is not None]
    told = [one for one in told if one.turned > 0.4 * MIN_TURN and one.correlation > _MIN_DOUBT_CORRELATION]
    if told:
        best = max(told, key=lambda one: one.correlation)
        if best.scale > between if factor < 1.0 else best.scale < 1.0 / between:
            return f"gravity turns {best.scale:.2g} times as far as it measured (correlation {best.correlation:.2f})"
        return None
    noise = math.degrees(rest_noise(t, rate))
    if factor < 1.0 and 0.0 < noise < _MIN_NOISE:
        return f"its noise at rest would be {noise:.2g} deg/s"
    return None
