"""The likeliest unit of a gyroscope: each piece of evidence adds a cost, −log likelihood, to each candidate.

A candidate is a number per deg/s: π/180 (rad/s), 1 (deg/s) or a chip's sensitivity. Evidence is added in order of its
strength: gravity's turn, the step between numbers, the mean force of a moving sensor, the steadiness of gravity, and
last the range, the noise at rest and the sensors beside it. Numbers with decimals need no more as soon as a candidate
leads by ``DECISIVE``.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from levelhead.open_types import JsonObject, ReadOnlyJson
from levelhead.recording import Array, median
from levelhead.signals.gravity_turn import MIN_CORRELATION, MIN_TURN, GravityTurn, quiet_turn, turn_of_gravity
from levelhead.signals.mean_force import MIN_WINDOWS, STRIDES, is_gravity_left, mean_forces, steadiness_of_gravity
from levelhead.sources.conclusions import Basis
from levelhead.sources.interpret.counts import ACC, DEGREES, RADIANS, STEPS, Chip, candidates, field_sensitivity
from levelhead.units import DEGREE, GRAVITY

DECISIVE = 25.0  # cost by which the second candidate is dearer, from which nothing else is asked
_DECIMALS = {RADIANS: 0.0, DEGREES: 2.7}  # cost of a unit for numbers with decimals: drivers prefer rad/s
_WHOLE, _AVERAGED = 8.0, 14.0  # of whole numbers in such a unit; of counts with decimals
_UNUSUAL = 0.3  # of a full scale that is not the one after power-up
_TURN_ERROR, _UNSURE = 0.08, 0.5  # σ of log scale by gravity's turn; addition for an imperfect correlation
_MAX_UNCLEAR = 20.0  # cost of a turn that is not clear: other forces may bias it
_MAX_TURN_ERROR, _MAX_UNIT_ERROR = 0.35, math.log(2.0)  # of the logarithm, beyond which a clear turn excludes
_MIN_GUESS_CORRELATION = 0.4  # correlation from which a comparison is worth a guess
_STEP = 40.0  # cost of a unit in which the numbers' step is not a chip's, if it is one in the other
_MEAN_FORCE = _STEADY = 30.0  # cost of a unit that turns gravity away
_USUAL_NOISE, _NOISE_SPREAD = 0.08, 0.9  # deg/s rms at rest, a factor of 2.5 either way
_TAIL = 2.0  # σ beyond which a cost grows no longer as a square
_ROUNDING = 0.29  # rms of a digit
_MAX_RATE = 2300.0  # deg/s; full scale of the usual chips is ±2000
_LARGEST = 1e100  # number
_BEYOND, _BEYOND_LOG = 4.0, 12.0  # cost of a rate beyond it, and for each factor e
_USUAL_DEVIATION, _MAX_LENGTH = 0.04, 1.5  # of an accelerometer's scale; cost of one of another size at most
_NO_FIELD, _OTHER_FIELD = 0.5, 1.5  # costs of a chip without a magnetometer beside it, and of one that shows no field
_MIN_GAP, _MAX_SAME_FACTOR = 2.0, 1.25  # cost by which the second must be dearer, if it differs by more than a factor
_MIN_STEADY_WINDOWS = 3  # windows that must distinguish units
_STEADY_DEGREES, _STEADY_RADIANS = -0.2, 0.04  # gains (see Steadiness) from which it is deg/s, or rad/s; BROAD −0.09
_SHAKEN = 0.98  # a body that hardly turns and that nothing shakes holds gravity better than this
_MOVED = 0.5  # m/s² rms about its mean, from which the force of a window is not that of a sensor at rest
_TILTED = 0.06  # rad rms in a window, from which the gyroscope shows a tilt; by its noise alone it is 0.03
_CANCELLED = 0.45  # of the mean force is left, at most, where rates in deg/s are taken for rad/s; a bias leaves more
_DRIFTED = 2.5  # between the means of a window's halves, by shaking: in rad/s 0.1 to 2.4, the most by bias
_SEEN = 0.06  # of its tilt that the force shows: in rad/s 0.07 and more, the least on drones; in deg/s 1/57 and noise
_IMPOSSIBLE = 1e6  # no gyroscope's number in either unit
_FULL, _OFTEN, _CLIPPED = 0.9999, 10, 0.01  # of the largest number; rows and share of rows that show full scale
_ROWS, _MIN_NUMBERS = 20_000, 12  # that show a step; different numbers of an axis by which it is found
_MAX_SHARE = 0.5  # share of the numbers that may differ: more are not multiples of a step, or too few samples
_FRACTION = 0.12  # rms by which multiples may miss whole numbers: 0.29 for numbers without a step
_MAX_STEP_ERROR = 0.004  # by which a step may differ from a chip's: decimals of a text


class GyroscopeUnit(NamedTuple):
    """The unit of one number of a gyroscope.

    Attributes:
        unit: "rad/s", "deg/s", or None where counts are more likely or nothing is.
        counts: counts per deg/s, if it is a chip's.
        reason: the evidence; ``sources.conclusions.sentences`` puts it into words.
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


class Candidate(NamedTuple):
    """Numbers per deg/s, and whose they are."""

    per_degree: float
    chip: Chip


class Evidence(NamedTuple):
    """The (k,) costs of the candidates by one piece of evidence, its name, and its numbers."""

    name: str
    costs: Array
    facts: ReadOnlyJson


def gyr_unit(t: Array, gyr: Array, acc: Array, whole: Whole = NOTHING_WHOLE) -> GyroscopeUnit:
    """The unit of (n, 3) ``gyr`` beside (n, 3) ``acc`` in m/s², whose numbers were ``whole``."""
    gyr = _without_clipped(gyr)
    counts = _may_be_counts(gyr)
    known = [Candidate(per, chip) for chip in candidates(whole.acc_per_g) for per in chip.gyr]
    per = np.array([one.per_degree for one in known])
    turn = _telling_turn(t, gyr, acc)
    total = np.array([_prior(one, counts) for one in known])
    found: list[Evidence] = []
    for one in _evidence(t, gyr, acc, turn, known, counts, whole):
        if turn is not None and np.isinf(one.costs).all():
            if counts or turn.scale < 0.2 * DEGREE:
                facts = {"measured": DEGREE / abs(turn.scale)}
                return GyroscopeUnit(None, None, "gravity_turn_no_unit", facts, Basis.NUMBERS)
            turn = None
            continue
        found.append(one)
        total += one.costs
        if not counts and total[_rival(total, per)] - total.min() > DECISIVE:
            break
    return _concluded(known[int(total.argmin())], turn, found, total, per, counts)


def _rival(total: Array, per: Array) -> int:
    """The cheapest of the candidates that differ from the best one."""
    differs = np.abs(np.log(per / per[total.argmin()])) > math.log(_MAX_SAME_FACTOR)
    return int(np.where(differs, total, math.inf).argmin())


def _prior(one: Candidate, counts: bool) -> float:
    if one.chip in _DECIMALS:
        return _WHOLE if counts else _DECIMALS[one.chip]
    unusual = _UNUSUAL if one.chip.usual not in (None, one.per_degree) else 0.0
    return one.chip.rarity + unusual + (0.0 if counts else _AVERAGED)


def _evidence(
    t: Array, gyr: Array, acc: Array, turn: GravityTurn | None, known: list[Candidate], counts: bool, whole: Whole
) -> Iterator[Evidence]:
    """The evidence in order of its strength; each is found only if those before it do not decide."""
    if turn is not None:
        yield _by_turn(turn, known, counts)
    if not counts and (digit := unit_by_digit(gyr)) is not None:
        yield Evidence("digit", _others(digit[0], known, _STEP), {"step": digit[1]})
    may_move = not counts or (turn is None and whole.acc_per_g not in ACC)
    if may_move and (unit := _by_mean_force(t, gyr, acc)) is not None:
        yield Evidence("force", _others(unit, known, _MEAN_FORCE, turn), {})
    if not counts and (unit := _by_steadiness(t, gyr, acc)) is not None:
        yield Evidence("steadiness", _others(unit, known, _STEADY, turn), {})
    per = np.array([one.per_degree for one in known])
    large, noise = large_rate(gyr), rest_noise(t, gyr)
    beyond = math.log(min(large, _LARGEST) + 1e-9) - np.log(per * _MAX_RATE)
    costs = np.where(beyond > 0.0, _BEYOND + _BEYOND_LOG * beyond, 0.0)
    yield Evidence("range", costs, {"large": large, "turns": large / (2 * math.pi)})
    rounded = max(noise, _ROUNDING) if counts else noise
    costs = _tailed(np.log(rounded / per / _USUAL_NOISE) / _NOISE_SPREAD) if noise > 0.0 else np.zeros(len(per))
    yield Evidence("noise", costs, {"noise": noise})
    yield Evidence("beside", np.array([_cost_beside(one.chip, whole) for one in known]), {})


def _tailed(sigmas: Array) -> Array:
    """−log likelihood of deviations in σ: of a normal distribution, with longer tails."""
    size = np.abs(sigmas)
    return np.where(size < _TAIL, 0.5 * size**2, _TAIL * size - 0.5 * _TAIL**2)


def _others(unit: str, known: list[Candidate], cost: float, turn: GravityTurn | None = None) -> Array:
    """A cost for all but one unit; beside a turn of gravity for the other unit, which may be counts instead."""
    return np.array(
        [cost if one.chip.name != unit and (turn is None or one.chip in _DECIMALS) else 0.0 for one in known]
    )


def _by_turn(turn: GravityTurn, known: list[Candidate], counts: bool) -> Evidence:
    correlation = abs(turn.correlation)
    off = np.array([abs(math.log(DEGREE / one.per_degree / abs(turn.scale))) for one in known])
    costs = _tailed(off / (_TURN_ERROR + _UNSURE * (1.0 - correlation)))
    if turn.clear or (counts and correlation > MIN_CORRELATION):
        limits = np.array([_MAX_UNIT_ERROR if one.chip in _DECIMALS else _MAX_TURN_ERROR for one in known])
        costs = np.where(off > limits, math.inf, costs)
    else:
        costs = np.minimum(costs, _MAX_UNCLEAR)
    return Evidence("turn", costs, {"correlation": turn.correlation, "scale": turn.scale, "inverse": 1 / turn.scale})


def _cost_beside(chip: Chip, whole: Whole) -> float:
    """The cost of a chip beside the whole numbers of an accelerometer and a magnetometer."""
    norm = whole.acc_norm if whole.acc_norm is not None and whole.acc_norm > 0.0 else whole.acc_per_g
    cost = 0.0
    if norm is not None:
        near = min((abs(math.log(norm / count)) for count in chip.acc), default=1.0)
        cost = min(0.5 * (near / _USUAL_DEVIATION) ** 2, _MAX_LENGTH)
    if whole.mag_norm is None or field_sensitivity(chip, whole.mag_norm) is not None:
        return cost
    return cost + (_OTHER_FIELD if chip.mag else _NO_FIELD)


_UNIT_REASONS = {  # (evidence, unit)
    ("turn", "rad/s"): "gravity_turn", ("turn", "deg/s"): "gravity_turn_degrees",
    ("digit", "rad/s"): "digit", ("digit", "deg/s"): "digit",
    ("force", "rad/s"): "force_keeps_mean", ("force", "deg/s"): "force_cancels",
    ("steadiness", "rad/s"): "gravity_steady", ("steadiness", "deg/s"): "gravity_unsteady",
    ("range", "deg/s"): "too_large", ("noise", "rad/s"): "quiet", ("noise", "deg/s"): "loud",
}  # fmt: skip


def _concluded(
    best: Candidate, turn: GravityTurn | None, found: list[Evidence], total: Array, per: Array, counts: bool
) -> GyroscopeUnit:
    """The best candidate, by the evidence that separates it most from its rival: of a unit the other unit."""
    place, rival = int(total.argmin()), _rival(total, per)
    other = 1 - place if best.chip in _DECIMALS else rival
    told = max(found, key=lambda one: one.costs[other] - one.costs[place])
    facts: JsonObject = {name: value for one in found for name, value in one.facts.items()}
    against = turn is not None and turn.correlation < -MIN_CORRELATION
    clear = turn is not None and turn.clear
    if turn is not None:
        facts |= {"measured": DEGREE / abs(turn.scale), "far": best.per_degree * abs(turn.scale) / DEGREE}
    if best.chip in _DECIMALS:
        proved = told.name == "turn" and clear
        unclear = (
            "gravity_against" if against else "gravity_turn_unclear" if told.name == "turn" and not clear else None
        )
        reason = unclear or _UNIT_REASONS.get((told.name, best.chip.name), "quiet")
        return GyroscopeUnit(best.chip.name, None, reason, facts, Basis.NUMBERS if proved else Basis.GUESS, against)
    return _concluded_counts(best, turn, facts, counts, clear or bool(total[rival] - total[place] > _MIN_GAP))


def _concluded_counts(
    best: Candidate, turn: GravityTurn | None, facts: JsonObject, counts: bool, sure: bool
) -> GyroscopeUnit:
    """The best candidate, which is a chip's or scaled: counts of no unit where decimals show no turn."""
    if turn is None and not counts:
        return GyroscopeUnit(None, None, "look_like_counts", facts, Basis.NUMBERS)
    facts |= {"counts": best.per_degree, "chip": best.chip.name}
    if "noise" in facts:
        facts["noise"] /= best.per_degree
    against = turn is not None and turn.correlation < -MIN_CORRELATION
    if best.per_degree == 1.0:
        return GyroscopeUnit("deg/s", None, "whole_degrees", facts, reversed=against, sure=sure, chip=best.chip)
    by_turn = "gravity_turn_counts" if turn is not None and turn.clear else "gravity_turn_nearest_counts"
    reason = "whole_numbers" if turn is None else by_turn
    return GyroscopeUnit(None, best.per_degree, reason, facts, reversed=against, sure=sure, chip=best.chip)


def _telling_turn(t: Array, gyr: Array, acc: Array) -> GravityTurn | None:
    """The comparison with gravity's turn that correlates best; None if none does.

    Gravity may seem to turn against the gyroscope on a limb, which is a pendulum, but not while nothing else is felt.
    """
    turn = turn_of_gravity(t, gyr, acc)
    if turn is not None and turn.clear:
        return turn
    told = [turn if turn is None or turn.correlation > 0.0 else None, quiet_turn(t, gyr, acc)]
    moved = [one for one in told if one is not None and one.turned > 0.5 * MIN_TURN and one.scale != 0.0]
    best = max(moved, key=lambda one: abs(one.correlation), default=None)
    return best if best is not None and abs(best.correlation) > _MIN_GUESS_CORRELATION else None


def _without_clipped(gyr: Array) -> Array:
    """(n, 3) rates, NaN where an axis is at the largest number again and again: full scale shows no turn."""
    size = np.abs(gyr)
    large = np.nanmax(size, initial=0.0)
    clipped = (size >= _FULL * large).any(axis=1)
    if not large > 0.0 or clipped.sum() < max(_OFTEN, _CLIPPED * len(gyr)) or clipped.mean() > 0.9:
        return gyr
    return np.where(clipped[:, None], np.nan, gyr)


def _may_be_counts(gyr: Array) -> bool:
    """Whether (n, 3) numbers are whole, and not zeros only: in rad/s no sensor is read so coarsely."""
    finite = gyr[np.isfinite(gyr)]
    return len(finite) > 0 and bool((finite == np.rint(finite)).all()) and bool(finite.any())


def _by_steadiness(t: Array, gyr: Array, acc: Array) -> str | None:
    """The unit in which gravity, turned back by the gyroscope, holds still; None: no evidence."""
    held = steadiness_of_gravity(t, gyr, acc)
    if held.windows < _MIN_STEADY_WINDOWS:
        held = steadiness_of_gravity(t, gyr, acc, away=1.0)
    if held.windows < _MIN_STEADY_WINDOWS or held.best <= 0.6:
        return None
    if held.gain < _STEADY_DEGREES:
        return "deg/s"
    return "rad/s" if held.gain > _STEADY_RADIANS or held.best < _SHAKEN else None


def _by_mean_force(t: Array, gyr: Array, acc: Array) -> str | None:
    """The unit from the mean force over seconds in which the sensor moves; None: no evidence.

    Turned back by rates that are 57 times too large the force cancels, or scatters. If it keeps its mean instead,
    although by the rates the sensor tilted, they are right; unless the force shows no tilt, as on a calm vehicle in
    deg/s. A bias scatters the force too, and does not cancel it.
    """
    gyr = np.where(np.abs(gyr) < _IMPOSSIBLE, gyr, np.nan)  # the same windows in both units
    radians = mean_forces(t, gyr, acc, STRIDES)
    telling = (radians.shaking > _MOVED) & (radians.tilt > _TILTED)
    if telling.sum() < MIN_WINDOWS:
        return None
    length, apart, shaking = (median(one[telling]) for one in (radians.length, radians.apart, radians.shaking))
    turned, seen = median(radians.turned[telling]), median(radians.seen[telling])
    held = median(mean_forces(t, gyr * DEGREE, acc, STRIDES).length[telling])
    if length < _CANCELLED * held and is_gravity_left(held / GRAVITY):
        return "deg/s"
    if is_gravity_left(length / GRAVITY) and apart < _DRIFTED * shaking and seen > _SEEN * turned:
        return "rad/s"
    return None


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


def step_of(values: Array) -> float | None:
    """The step of which (n,) numbers are multiples, up to an offset; None if there is none."""
    finite = values[np.isfinite(values)][:_ROWS]
    levels = np.unique(finite)
    if len(levels) < _MIN_NUMBERS or len(levels) > _MAX_SHARE * len(finite):
        return None
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-4 * median(gaps)]
    step = float(np.quantile(gaps, 0.1))
    for _ in range(3):
        multiples = np.rint(gaps / step)
        known = (multiples > 0.0) & (multiples < 20.0)
        if not known.any():
            return None
        step = float((gaps[known] * multiples[known]).sum() / (multiples[known] ** 2).sum())
    off = gaps / step
    off = off[off < 20.0]
    return step if float(np.sqrt(np.mean((off - np.rint(off)) ** 2))) < _FRACTION and (np.rint(off) > 0).all() else None


def unit_by_digit(gyr: Array) -> tuple[str, float] | None:
    """("deg/s" or "rad/s", the step in deg/s) of (n, 3) rates whose step is a chip's in one of them; else None."""
    steps = [step for axis in gyr.T if (step := step_of(axis)) is not None]
    if len(steps) < 2 or max(steps) > 1.01 * min(steps):
        return None
    step = median(np.array(steps))
    fits = {unit: _is_step_of_chip(step / factor) for unit, factor in (("deg/s", 1.0), ("rad/s", DEGREE))}
    if sum(fits.values()) != 1:
        return None
    return ("deg/s", step) if fits["deg/s"] else ("rad/s", step / DEGREE)


def _is_step_of_chip(step: float) -> bool:
    """Whether a step is a chip's, and no last decimal."""
    if abs(math.log10(step) - round(math.log10(step))) < _MAX_STEP_ERROR:
        return False
    return min(abs(math.log(step / one)) for one in STEPS) < _MAX_STEP_ERROR
