"""The unit of the gyroscope: deg/s, rad/s or counts, by the turn of gravity beside it, and where that shows nothing by
its noise, its size and the force that is left."""

import math
from typing import NamedTuple

import numpy as np

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.open_types import ReadOnlyJson
from levelhead.recording import Array, median
from levelhead.signals.field_turn import FieldTurn, field_turn
from levelhead.signals.gravity_turn import (
    MIN_CORRELATION,
    MIN_TURN,
    GravityTurn,
    excerpt,
    median_norm,
    quiet_turn,
    turn_of_gravity,
)
from levelhead.signals.mean_force import (
    MIN_WINDOWS,
    STRIDES,
    is_gravity_left,
    mean_forces,
    steadiness_of_gravity,
)
from levelhead.signals.rest import find_still_gyroscope
from levelhead.sources.conclusion import Basis
from levelhead.sources.hints import NeedsHints, Scale, count_word
from levelhead.sources.interpret.converter_counts import rates_about
from levelhead.sources.interpret.counts import ACC, CHIPS, Chip, WholeRates, choose_sensitivity, gyr_sensitivity
from levelhead.sources.interpret.declared import Evidence, are_whole
from levelhead.sources.interpret.digit import unit_by_digit
from levelhead.sources.interpret.magnetometer import unit_of_field
from levelhead.sources.interpret.raw_counts import PER_DEGREE, PER_G
from levelhead.sources.sentences import gyroscope_reason
from levelhead.sources.table import Table
from levelhead.units import DEGREE, GRAVITY

_MIN_GUESS_CORRELATION = 0.4  # correlation from which a comparison is worth a guess
_MIN_WINDOWS = 3  # windows that must distinguish units
_DEGREES, _RADIANS = -0.2, 0.04  # gains (see Steadiness) from which it is deg/s, or rad/s; BROAD is at −0.09 and more
_SHAKEN = 0.98  # a body that hardly turns and that nothing shakes holds gravity better than this
_PROOF = 0.9  # correlation from which the comparison outweighs a header, or noise
_MAX_BIAS = 0.5  # rad/s, 29 deg/s: no gyroscope is that far off at rest
_MAX_NOISE = 0.05  # rad/s, 2.9 deg/s rms: no gyroscope is that noisy at rest
_MIN_DOUBT_CORRELATION = 0.15  # correlation from which a comparison raises a doubt
_MIN_NOISE = 0.004  # deg/s rms; below it no MEMS gyroscope is at rest, at any rate
_MOVED = 0.5  # m/s² rms about its mean, from which the force of a window is not that of a sensor at rest
_TILTED = 0.06  # rad rms in a window, from which the gyroscope shows a tilt; by its noise alone it is 0.03
_CANCELLED = 0.45  # of the mean force is left, at most, where rates in deg/s are taken for rad/s; a bias leaves more
_DRIFTED = 2.5  # between the means of a window's halves, by what shakes it: in rad/s 0.1 to 2.4, the most by bias
_SEEN = 0.06  # of its tilt that the force shows: in rad/s 0.07 and more, the least on drones; in deg/s 1/57 and noise
_FULL, _OFTEN, _CLIPPED = 0.9999, 10, 0.01  # of the largest number; rows and share of rows that show full scale
_BEYOND = 1e6  # no gyroscope's number in either unit
_AT_REST = 100.0  # counts; a sensor that is not turned reads less
_NOISE = 0.02  # at rest, deg/s below this does not come from a MEMS gyroscope at usual rates


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
    if found.basis is Basis.GUESS and (proved := _by_field(t, values, mag)) is not None:
        unit, turn = proved
        scale = Scale(units.factor("gyr", unit), unit)
        facts = {"scale": turn.scale, "correlation": turn.correlation}
        evidence.conclude("gyr.unit", "field", scale, Basis.NUMBERS, facts, {"units": {"gyr": unit}})
        return scale
    if found.basis is Basis.GUESS and (proved := _by_length(t, values, mag)) is not None:
        unit, turn = proved
        scale = Scale(units.factor("gyr", unit), unit)
        evidence.conclude("gyr.unit", "length", scale, Basis.GUESS, {"length": turn.length}, {"units": {"gyr": unit}})
        return scale
    if not found.sure and evidence.acc_per_g == PER_G and large_rate(values) < _AT_REST:  # as after power-up
        facts = {**found.facts, "counts": PER_DEGREE, "per_g": PER_G}
        found = found._replace(unit=None, counts=PER_DEGREE, reason="power_up", facts=facts, chip=CHIPS[0])
    elif not found.sure and evidence.acc_per_g in ACC:
        word = f"{count_word(found.counts)}/deg/s" if found.counts is not None else "131/deg/s"
        raise NeedsHints(
            f"{table.source}: the gyroscope's numbers are whole, as the accelerometer's counts are, and nothing turns "
            f"far enough to tell its full scale; expected the hint --counts gyr=…, such as {word} by the noise at rest",
            counts={"gyr": word},
        )
    return _concluded(found, table, evidence)


def _concluded(found: "GyroscopeUnit", table: Table, evidence: Evidence) -> Scale:
    """The scale of what was found.

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
        "expected the hint units gyr=…, or for raw counts --counts gyr=131/deg/s or what the sensor's full scale says",
        counts={"gyr": "131/deg/s"},
    )


def _counts_scale(per_unit: float) -> Scale:
    return Scale(DEGREE, f"counts, {per_unit:g} per deg/s", per_unit)


def _by_field(t: Array, values: Array, mag: Array | None) -> tuple[str, FieldTurn] | None:
    """(unit, turn) of a gyroscope against which a magnetometer turns; None if it does not, or there is none."""
    for unit, factor in (("rad/s", 1.0), ("deg/s", DEGREE)):
        turn = None if mag is None else field_turn(t, values * factor, mag)
        if turn is not None and turn.correlation > 0.8 and 0.6 < turn.scale < 1.6 and turn.turned > 0.05:
            return unit, turn
    return None


def _by_length(t: Array, values: Array, mag: Array | None) -> tuple[str, FieldTurn] | None:
    """(unit, turn) of a gyroscope by a raw magnetometer: the one in which the field has the earth's length."""
    found = []
    for unit, factor in (("rad/s", 1.0), ("deg/s", DEGREE)):
        turn = None if mag is None else field_turn(t, values * factor, mag)
        if turn is not None and turn.shows_field and unit_of_field(turn) is not None:
            found.append((unit, turn))
    return found[0] if len(found) == 1 else None


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


class GyroscopeUnit(NamedTuple):
    """The unit of one number of a gyroscope.

    Attributes:
        unit: "rad/s", "deg/s", or None where counts are more likely or nothing is.
        counts: counts per deg/s, if it is a chip's.
        reason: the evidence; ``sources.sentences`` puts it into words.
        facts: its numbers.
        basis: a guess unless gravity's turn proves it.
        reversed: whether gravity turns against the gyroscope, while nothing else than gravity is felt.
        sure: whether no other sensitivity is nearly as likely.
        chip: whose sensitivity it is.
    """

    unit: str | None
    counts: float | None
    reason: str
    facts: ReadOnlyJson
    basis: Basis = Basis.GUESS
    reversed: bool = False
    sure: bool = True
    chip: Chip | None = None


class Whole(NamedTuple):
    """Whole numbers beside a gyroscope.

    Attributes:
        acc_per_g: numbers of the accelerometer per g; None: it has a unit with decimals.
        acc_norm: their usual length.
        mag_norm: that of the magnetometer's.
    """

    acc_per_g: float | None = None
    acc_norm: float | None = None
    mag_norm: float | None = None


NOTHING_WHOLE = Whole()


def _whole_norm(mag: Array | None) -> float | None:
    return median_norm(mag) if mag is not None and are_whole(mag) else None


def gyr_unit(t: Array, gyr: Array, acc: Array, whole: Whole = NOTHING_WHOLE) -> GyroscopeUnit:
    """The unit of (n, 3) ``gyr`` beside (n, 3) ``acc`` in m/s², whose numbers were ``whole``."""
    gyr = _without_clipped(gyr)
    turn = turn_of_gravity(t, gyr, acc)
    if _may_be_counts(gyr) and not (turn is not None and turn.clear and 0.5 < turn.scale < 2.0):
        return _unit_of_whole(t, gyr, acc, turn, whole)
    acc_per_g = whole.acc_per_g
    if turn is not None and turn.clear:
        found = _infer_from_turn(turn, acc_per_g)
        if found is not None:
            return found
    quiet = quiet_turn(t, gyr, acc)
    if (opposed := _against_gravity(quiet)) is not None:
        return opposed
    for one in (quiet, turn):
        if one is not None and abs(one.correlation) > _MIN_GUESS_CORRELATION and one.turned > 0.5 * MIN_TURN:
            counts = gyr_sensitivity(one.scale, acc_per_g)
            far = min(abs(math.log(abs(one.scale) / factor)) for factor in (1.0, math.pi / 180.0)) > math.log(3.0)
            if counts is not None and far:
                facts = {
                    "counts": counts.per_unit, "chip": counts.whose, "far": 1 / counts.off,
                    "correlation": one.correlation,
                }  # fmt: skip
                turned = one.correlation < -MIN_CORRELATION
                return GyroscopeUnit(None, counts.per_unit, "gravity_turn_nearest_counts", facts, reversed=turned)
    if (digit := unit_by_digit(gyr)) is not None:
        return GyroscopeUnit(digit[0], None, "digit", {"step": digit[1]})
    return _guess_unit(t, gyr, acc)


def _without_clipped(gyr: Array) -> Array:
    """(n, 3) rates, NaN where an axis is at the largest number again and again: full scale shows no turn."""
    size = np.abs(gyr)
    large = np.nanmax(size, initial=0.0)
    clipped = (size >= _FULL * large).any(axis=1)
    if not large > 0.0 or clipped.sum() < max(_OFTEN, _CLIPPED * len(gyr)) or clipped.mean() > 0.9:
        return gyr
    return np.where(clipped[:, None], np.nan, gyr)


def _against_gravity(quiet: GravityTurn | None) -> GyroscopeUnit | None:
    """The unit of a gyroscope against which gravity turns while nothing else is felt; None: it does not."""
    if quiet is not None and quiet.correlation < -MIN_CORRELATION and quiet.turned > 0.5 * MIN_TURN:
        for unit, factor in (("rad/s", 1.0), ("deg/s", DEGREE)):
            if 0.5 < -quiet.scale / factor < 2.0:
                return GyroscopeUnit(unit, None, "gravity_against", {"scale": quiet.scale / factor}, reversed=True)
    return None


def _may_be_counts(gyr: Array) -> bool:
    """Whether (n, 3) numbers are whole, and not zeros only: in rad/s no sensor is read so coarsely."""
    finite = gyr[np.isfinite(gyr)]
    return len(finite) > 0 and bool((finite == np.rint(finite)).all()) and bool(finite.any())


def _unit_of_whole(t: Array, gyr: Array, acc: Array, turn: GravityTurn | None, whole: Whole) -> GyroscopeUnit:
    """The unit of whole numbers: the sensitivity that fits gravity's turn, the noise and the accelerometer best."""
    if turn is not None and turn.clear and 0.5 < turn.scale / DEGREE < 2.0:
        facts: ReadOnlyJson = {"scale": turn.scale, "inverse": 1 / turn.scale}
        return GyroscopeUnit("deg/s", None, "gravity_turn_degrees", facts, Basis.NUMBERS)
    best = _most_telling(turn, quiet_turn(t, gyr, acc))
    if best is None and whole.acc_per_g not in ACC and (moved := _unit_of_moved(t, gyr, acc)) is not None:
        return moved
    scale, correlation = (None, 0.0) if best is None else (abs(best.scale), abs(best.correlation))
    rates = WholeRates(scale, correlation, rest_noise(t, gyr), large_rate(gyr))
    choice = choose_sensitivity(rates, *whole)
    if choice is None:
        measured = {"measured": DEGREE / scale if scale else math.inf}
        return GyroscopeUnit(None, None, "gravity_turn_no_unit", measured, Basis.NUMBERS)
    per, against = choice.per_degree, best is not None and best.correlation < -MIN_CORRELATION
    clear = best is not None and correlation > MIN_CORRELATION and best.turned > MIN_TURN
    facts = {"counts": per, "chip": choice.chip.name, "noise": rates.noise / per, "correlation": correlation}
    if scale is not None:
        facts = {**facts, "measured": DEGREE / scale, "far": per * scale / DEGREE}
    reason = (
        "whole_degrees" if per == 1.0
        else "whole_numbers" if scale is None
        else "gravity_turn_counts" if clear and not against
        else "gravity_turn_nearest_counts"
    )  # fmt: skip
    unit, counts = ("deg/s", None) if per == 1.0 else (None, per)
    return GyroscopeUnit(unit, counts, reason, facts, reversed=against, sure=clear or choice.sure, chip=choice.chip)


def _most_telling(turn: GravityTurn | None, quiet: GravityTurn | None) -> GravityTurn | None:
    """The comparison that correlates best; None if none does."""
    if turn is not None and turn.clear:
        return turn
    told = [one for one in (turn, quiet) if one is not None and one.turned > 0.5 * MIN_TURN]
    best = max(told, key=lambda one: abs(one.correlation), default=None)
    return best if best is not None and abs(best.correlation) > _MIN_GUESS_CORRELATION and best.scale != 0.0 else None


def _guess_unit(t: Array, gyr: Array, acc: Array) -> GyroscopeUnit:
    """The unit without gravity's turn: from the noise at rest and the size of the numbers."""
    if (moved := _unit_of_moved(t, gyr, acc)) is not None:
        return moved
    held = steadiness_of_gravity(t, gyr, acc)
    if held.windows < _MIN_WINDOWS:
        held = steadiness_of_gravity(t, gyr, acc, away=1.0)
    if held.windows >= _MIN_WINDOWS and held.best > 0.6:
        if held.gain < _DEGREES:
            return GyroscopeUnit("deg/s", None, "gravity_unsteady", {})
        if held.gain > _RADIANS or held.best < _SHAKEN:
            return GyroscopeUnit("rad/s", None, "gravity_steady", {})
    return gyr_unit_at_rest(t, gyr)


def _unit_of_moved(t: Array, gyr: Array, acc: Array) -> GyroscopeUnit | None:
    """The unit from the mean force over seconds in which the sensor moves; None: no evidence.

    Turned back by rates that are 57 times too large the force cancels, or scatters. If it keeps its mean instead,
    although they say that the sensor tilted, they are right; unless the force shows no tilt, as on a calm vehicle in
    deg/s. A bias scatters the force too, and does not cancel it.
    """
    gyr = np.where(np.abs(gyr) < _BEYOND, gyr, np.nan)  # the same windows in both units
    radians = mean_forces(t, gyr, acc, STRIDES)
    telling = (radians.shaking > _MOVED) & (radians.tilt > _TILTED)
    if telling.sum() < MIN_WINDOWS:
        return None
    length, apart, shaking, _, turned, seen = (median(one[telling]) for one in radians)
    held = median(mean_forces(t, gyr * DEGREE, acc, STRIDES).length[telling])
    if length < _CANCELLED * held and is_gravity_left(held / GRAVITY):
        return GyroscopeUnit("deg/s", None, "force_cancels", {})
    if is_gravity_left(length / GRAVITY) and apart < _DRIFTED * shaking and seen > _SEEN * turned:
        return GyroscopeUnit("rad/s", None, "force_keeps_mean", {})
    return None


def _infer_from_turn(turn: GravityTurn, acc_per_g: float | None) -> GyroscopeUnit | None:
    """The unit by a clear turn of gravity."""
    if 0.5 < turn.scale < 2.0:
        return GyroscopeUnit("rad/s", None, "gravity_turn", {"scale": turn.scale}, Basis.NUMBERS)
    if 0.5 < turn.scale * 180.0 / math.pi < 2.0:
        facts = {"scale": turn.scale, "inverse": 1 / turn.scale}
        return GyroscopeUnit("deg/s", None, "gravity_turn_degrees", facts, Basis.NUMBERS)
    if turn.scale < 0.2 * math.pi / 180.0:
        measured = DEGREE / turn.scale
        counts = gyr_sensitivity(turn.scale, acc_per_g)
        if counts is None:
            return GyroscopeUnit(None, None, "gravity_turn_no_unit", {"measured": measured}, Basis.NUMBERS)
        numbers = {"counts": counts.per_unit, "chip": counts.whose, "measured": measured}
        return GyroscopeUnit(None, counts.per_unit, "gravity_turn_counts", numbers)
    return None


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
    if why is None and regular and enough and held.gain < 2.0 * _DEGREES and held.best > 0.85:
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


def gyr_unit_at_rest(t: Array, gyr: Array) -> GyroscopeUnit:
    """The unit from size and noise alone, for (n, 3) ``gyr`` without evidence from gravity: a guess."""
    large = large_rate(gyr)
    if large > 100.0:
        finite = gyr[np.isfinite(gyr).all(axis=1)]
        if large > 5000.0 or (finite == np.rint(finite)).all():
            return GyroscopeUnit(None, None, "look_like_counts", {"large": large}, Basis.NUMBERS)
        return GyroscopeUnit("deg/s", None, "too_large", {"large": large, "turns": large / (2 * math.pi)})
    noise = rest_noise(t, gyr)
    if noise < _NOISE:
        return GyroscopeUnit("rad/s", None, "quiet", {"noise": noise})
    return GyroscopeUnit("deg/s", None, "loud", {"noise": noise})


def large_rate(gyr: Array) -> float:
    """A rate that (n, 3) ``gyr`` reaches more than once: spikes in up to 2 rows, and in one of 1000, do not count."""
    with np.errstate(over="ignore", invalid="ignore"):
        norm = np.sqrt(np.einsum("ij,ij->i", gyr, gyr))
    norm = norm[~np.isnan(norm)]
    if len(norm) == 0:
        return 0.0
    spikes = min(len(norm) - 1, max(2, len(norm) // 1000))
    return float(np.partition(norm, len(norm) - 1 - spikes)[len(norm) - 1 - spikes])


def rest_noise(t: Array, gyr: Array) -> float:
    """The rms noise per axis of (n, 3) ``gyr`` in its quietest tenth of half seconds; constant rates do not count."""
    rows = gyr[np.isfinite(gyr).all(axis=1)]
    if len(rows) < 3:
        return 0.0
    step = median(np.diff(t))
    size = min(len(rows) - 1, max(2, round(0.5 / step) if step > 0 else 2))
    jumps = np.diff(rows, axis=0)
    count = len(jumps) // size
    power = (jumps[: count * size].reshape(count, size, 3) ** 2).mean(axis=(1, 2)) / 2.0
    return math.sqrt(float(np.quantile(power, 0.1)))
