"""What the numbers themselves say about their unit.

An accelerometer mostly sees gravity, so its median norm tells g from m/s². While a body turns, gravity turns the other
way in its frame, du/dt = −ω × u: how far u really turned, compared with the gyroscope, tells deg/s from rad/s.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.open_types import ReadOnlyFields
from levelhead.recording import Array, median
from levelhead.signals.mean_force import mean_forces, steadiness_of_gravity
from levelhead.signals.rest import find_still_gyroscope
from levelhead.sources.conclusion import Basis
from levelhead.sources.interpret.counts import gyr_sensitivity
from levelhead.units import DEGREE, GRAVITY

SMOOTH = 0.2  # s; takes vibration out of the direction of gravity
_NEAR, _QUIET = 0.2, 0.06  # shares of its usual length by which the specific force may differ: usually, in quiet spans
_QUIET_SAMPLE, _QUIET_SPAN = 0.12, 0.3  # share of the usual length, at every sample; s
_QUIET_SHARE = 0.05  # of the rows, at least, must be quiet
_FAINT = 0.4  # correlation from which a comparison is worth a guess
SPAN = 0.5  # s; over which the turn of gravity is compared
_TELLING = 3  # windows that must tell units apart
_DEGREES, _RADIANS = -0.2, 0.04  # gains (see Steadiness) from which it is deg/s, or rad/s; BROAD is at −0.09 and more
_SHAKEN = 0.98  # a body that hardly turns and that nothing shakes holds gravity better than this
_CLEAR = 0.7  # correlation from which the comparison counts
_ENOUGH = 0.05  # rms turn of gravity per span, as a fraction of its length (3 degrees), that counts as motion
_SAMPLES = 100_000  # rows that are looked at
_BIAS = 0.5  # rad/s, 29 deg/s: no gyroscope is that far off at rest
_LOUD = 0.05  # rad/s, 2.9 deg/s rms: no gyroscope is that noisy at rest
_SLIGHT = 0.15  # correlation from which a comparison raises a doubt
_QUIETEST = 0.004  # deg/s rms; below it no MEMS gyroscope is at rest, at any rate
_HURRIED = (1.4, 3.0)  # usual lengths, in g, of the specific force on a runner
_UNEVEN = 0.7  # shares of the usual length between its deciles: 0.9 and more on runners, 0.5 on drones and swung arms
_STRIDES = 4.0  # s; over which the accelerations of a runner cancel
_LEFT = (0.55, 1.2)  # what then is left, in g: 0.6 to 1.0 on runners, the least where full scale cuts steps off
_FEWEST = 3  # windows of _STRIDES
_MOVED = 0.5  # m/s² rms about its mean, from which the force of a window is not that of a sensor at rest
_TILTED = 0.06  # rad rms in a window, from which the gyroscope says that it tilts; by its noise alone it is 0.03
_CANCELLED = 0.45  # of the mean force is left, at most, where rates in deg/s are taken for rad/s; a bias leaves more
_DRIFTED = 2.5  # between the means of a window's halves, by what shakes it: in rad/s 0.1 to 2.4, the most by bias
_SEEN = 0.06  # of its tilt that the force shows: in rad/s 0.07 and more, the least on drones; in deg/s 1/57 and noise
_NOISE = 0.02  # at rest, deg/s below this does not come from a MEMS gyroscope at usual rates


class GravityTurn(NamedTuple):
    """The comparison of the gyroscope with the turn of gravity.

    Attributes:
        scale: k in Δu = k · Σ −(ω × u) Δt: what one unit of the gyroscope is in rad/s.
        correlation: of the two sides, 0 to 1.
        turned: rms of Δu over the spans.
    """

    scale: float
    correlation: float
    turned: float

    @property
    def clear(self) -> bool:
        """Whether there was enough motion, and it fits."""
        return self.correlation > _CLEAR and self.turned > _ENOUGH and self.scale > 0.0


def median_norm(values: Array) -> float:
    """The median length of (n, 3) vectors in their unit, rows with NaN left out; NaN if there are none."""
    with np.errstate(over="ignore", invalid="ignore"):
        norm = np.sqrt(np.einsum("ij,ij->i", values, values))
    norm = norm[~np.isnan(norm)]
    return median(norm) if len(norm) else math.nan


def excerpt(n: int) -> slice | NDArray[np.intp]:
    """Rows that stand for a long recording: twenty stretches spread over it; all rows of a short one."""
    if n <= _SAMPLES:
        return slice(None)
    length = _SAMPLES // 20
    starts = np.linspace(0, n - length, 20).astype(np.intp)
    return (starts[:, None] + np.arange(length)).ravel()


def turn_of_gravity(t: Array, gyr: Array, acc: Array, near: float = _NEAR, span: float = SPAN) -> GravityTurn | None:
    """Compares (n, 3) ``gyr`` in an unknown unit with the turn of (n, 3) ``acc``; None without a comparable span.

    ``t`` (n,) s. Spans across gaps and missing values are left out, and those at whose ends the specific force is
    further than ``near`` (a share) from its usual length; ``span`` and ``SMOOTH`` are times in s: any rate will do.
    """
    length = np.sqrt((acc * acc).sum(axis=1))
    x, y, z = (np.abs(gyr) < 1e100).T  # not where it is NaN
    usable = x & y & z & (length > 0.0) & (length < 1e100)
    if usable.sum() < 8:
        return None
    if not usable.all():
        t, gyr, acc, length = t[usable], gyr[usable], acc[usable], length[usable]
    up = acc / length[:, None]
    step = median(np.diff(t))
    if not step > 0.0:
        return None
    box, size = max(1, round(SMOOTH / step)), max(1, round(span / step))
    if len(t) <= box + size:
        return None
    rate = np.cross(up, gyr)  # −(ω × u)
    turned = np.zeros_like(rate)
    np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t)[:, None], axis=0, out=turned[1:])
    real = _spans(up, box, size)
    said = _spans(turned, box, size)
    whole = (t[box + size - 1 :] - t[: 1 - box - size or None]) < 1.5 * (box + size) * step
    steady = _steady(length, box, size, near)
    comparable = whole & steady
    return _regress(np.compress(comparable, real, axis=0), np.compress(comparable, said, axis=0))


def quiet_turn(t: Array, gyr: Array, acc: Array) -> GravityTurn | None:
    """``turn_of_gravity`` over short spans in which the specific force keeps its usual length at every sample.

    On a swinging leg or arm gravity seems to turn against the gyroscope, because the limb is a pendulum; there the
    force is never quiet, and nothing is compared.
    """
    length = np.sqrt((acc * acc).sum(axis=1))
    finite = length[np.isfinite(length)]
    if len(finite) < 8:
        return None
    still = np.abs(length / median(finite) - 1.0) < _QUIET_SAMPLE
    step = median(np.diff(t)) if len(t) > 1 else 1.0
    size = max(1, min(round(_QUIET_SPAN / step), (len(t) - 1) // 2)) if step > 0 else 1
    around = np.convolve(~still, np.ones(2 * size + 1), "same") < 0.05 * size
    if still.sum() < 8 or around.sum() < max(30, _QUIET_SHARE * len(t)):
        return None
    return turn_of_gravity(t, np.where(around[:, None], gyr, np.nan), acc, near=_QUIET, span=_QUIET_SPAN)


def _spans(values: Array, box: int, span: int) -> Array:
    """How (n, 3) values, averaged over ``box`` rows, change over ``span`` rows: (n − box − span + 1, 3)."""
    total = np.zeros((len(values) + 1, values.shape[1]))
    np.cumsum(values, axis=0, out=total[1:])
    mean: Array = (total[box:] - total[:-box]) / box
    return mean[span:] - mean[:-span]


def _steady(length: Array, box: int, span: int, share: float) -> NDArray[np.bool_]:
    """Spans at whose ends the accelerometer sees gravity and not much else: (n − box − span + 1,)."""
    total = np.concatenate([[0.0], np.cumsum(length)])
    mean = (total[box:] - total[:-box]) / box
    typical = median(length)
    near: NDArray[np.bool_] = np.abs(mean - typical) < share * typical
    steady: NDArray[np.bool_] = near[span:] & near[:-span]
    return steady


def _regress(real: Array, said: Array) -> GravityTurn | None:
    if len(real) == 0:
        return None
    both, own, other = float((real * said).sum()), float((said * said).sum()), float((real * real).sum())
    if not (own > 0.0 and other > 0.0 and math.isfinite(own)):
        return GravityTurn(0.0, 0.0, math.sqrt(other / len(real)))
    return GravityTurn(both / own, both / math.sqrt(own * other), math.sqrt(other / len(real)))


def acc_unit(norm: float, low: float = 0.7, high: float = 1.4) -> str | None:
    """The unit in which a median norm is gravity, or ``low`` to ``high`` times gravity; None if there is none."""
    for unit, one_g in (("m/s²", GRAVITY), ("g", 1.0), ("mg", 1000.0)):
        if low < norm / one_g < high:
            return unit
    return None


def hurried_unit(values: Array) -> str | None:
    """The unit in which (n, 3) ``values`` may be what a body that runs feels: more than gravity, and in flight less.

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


def mean_force(t: Array, rate: Array, acc: Array) -> float | None:
    """The usual length in g of the mean of (n, 3) ``acc`` in m/s² over strides, turned back by ``rate`` in rad/s.

    However a body runs, what it accelerates to and fro cancels and gravity is left. None: too little tells it.
    """
    lengths = mean_forces(t, rate, acc, _STRIDES).length
    return None if len(lengths) < _FEWEST else median(lengths) / GRAVITY


def is_gravity_left(force: float) -> bool:
    """Whether ``mean_force`` is gravity: neither linear acceleration nor counts of another size."""
    return _LEFT[0] < force < _LEFT[1]


def mag_unit(norm: float) -> str | None:
    """The unit in which a median norm is the earth's field; None if there is none."""
    for unit, low, high in (("µT", 20.0, 70.0), ("G", 0.2, 0.7), ("mG", 200.0, 700.0), ("nT", 20e3, 70e3)):
        if low <= norm <= high:
            return unit
    return None


class GyroscopeUnit(NamedTuple):
    """What one number of a gyroscope is.

    Attributes:
        unit: "rad/s", "deg/s", or None where counts are more likely or nothing is.
        counts: counts per deg/s, if it is a chip's.
        reason: the evidence; ``sources.sentences`` puts it into words.
        facts: its numbers.
        basis: a guess unless gravity's turn proves it.
        reversed: whether gravity turns against the gyroscope, while nothing else than gravity is felt.
    """

    unit: str | None
    counts: float | None
    reason: str
    facts: ReadOnlyFields
    basis: Basis = Basis.GUESS
    reversed: bool = False


def gyr_unit(t: Array, gyr: Array, acc: Array, acc_per_g: float | None = None) -> GyroscopeUnit:
    """The unit of (n, 3) ``gyr`` beside (n, 3) ``acc`` in m/s², which had ``acc_per_g`` counts, if counts."""
    turn = turn_of_gravity(t, gyr, acc)
    if turn is not None and turn.clear:
        found = _infer_from_turn(turn, acc_per_g)
        if found is not None:
            return found
    quiet = quiet_turn(t, gyr, acc)
    against = quiet is not None and quiet.correlation < -_CLEAR and quiet.turned > 0.5 * _ENOUGH
    if against and quiet is not None:
        for unit, factor in (("rad/s", 1.0), ("deg/s", math.pi / 180.0)):
            if 0.5 < -quiet.scale / factor < 2.0:
                facts: ReadOnlyFields = {"scale": quiet.scale / factor}
                return GyroscopeUnit(unit, None, "gravity_against", facts, reversed=True)
    for one in (quiet, turn):
        if one is not None and abs(one.correlation) > _FAINT and one.turned > 0.5 * _ENOUGH:
            counts = gyr_sensitivity(one.scale, acc_per_g)
            far = min(abs(math.log(abs(one.scale) / factor)) for factor in (1.0, math.pi / 180.0)) > math.log(3.0)
            if counts is not None and far:
                facts = {
                    "counts": counts.per_unit, "chip": counts.whose, "far": 1 / counts.off,
                    "correlation": one.correlation,
                }  # fmt: skip
                turned = one.correlation < -_CLEAR
                return GyroscopeUnit(None, counts.per_unit, "gravity_turn_nearest_counts", facts, reversed=turned)
    return _guess_unit(t, gyr, acc)


def _guess_unit(t: Array, gyr: Array, acc: Array) -> GyroscopeUnit:
    """The unit where gravity's turn tells nothing: from how still it holds, from the size of the numbers."""
    if (moved := _unit_of_moved(t, gyr, acc)) is not None:
        return moved
    held = steadiness_of_gravity(t, gyr, acc)
    if held.windows < _TELLING:
        held = steadiness_of_gravity(t, gyr, acc, away=1.0)
    if held.windows >= _TELLING and held.best > 0.6:
        if held.gain < _DEGREES:
            return GyroscopeUnit("deg/s", None, "gravity_unsteady", {})
        if held.gain > _RADIANS or held.best < _SHAKEN:
            return GyroscopeUnit("rad/s", None, "gravity_steady", {})
    return gyr_unit_at_rest(t, gyr)


def _unit_of_moved(t: Array, gyr: Array, acc: Array) -> GyroscopeUnit | None:
    """The unit from what is left of the force over seconds in which the sensor is moved; None: nothing tells it.

    Turned back by rates that are 57 times too large the force cancels, or scatters. If it keeps its mean instead,
    although they say that the sensor tilted, they are right; unless the force shows no tilt, as on a calm vehicle in
    deg/s. A bias scatters the force too, and does not cancel it.
    """
    radians = mean_forces(t, gyr, acc, _STRIDES)
    telling = (radians.shaking > _MOVED) & (radians.tilt > _TILTED)
    if telling.sum() < _FEWEST:
        return None
    length, apart, shaking, _, turned, seen = (median(one[telling]) for one in radians)
    held = median(mean_forces(t, gyr * DEGREE, acc, _STRIDES).length[telling])
    if length < _CANCELLED * held and is_gravity_left(held / GRAVITY):
        return GyroscopeUnit("deg/s", None, "force_cancels", {})
    if is_gravity_left(length / GRAVITY) and apart < _DRIFTED * shaking and seen > _SEEN * turned:
        return GyroscopeUnit("rad/s", None, "force_keeps_mean", {})
    return None


def _infer_from_turn(turn: GravityTurn, acc_per_g: float | None) -> GyroscopeUnit | None:
    """What a clear turn of gravity says."""
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


def says_degrees(t: Array, gyr: Array, acc: Array) -> str | None:
    """Why (n, 3) ``gyr``, declared as rad/s, must be deg/s; None if nothing says so clearly. ``acc`` in m/s²."""
    large = large_rate(gyr)
    if large > 100.0:
        return f"it reaches {large:.0f}, {large / (2 * math.pi):.0f} turns a second"
    turn, held = turn_of_gravity(t, gyr, acc), steadiness_of_gravity(t, gyr, acc)
    if turn is not None and turn.clear and 0.5 < turn.scale * 180.0 / math.pi < 2.0:
        return f"gravity turns {1 / turn.scale:.1f} times slower than it says"
    rest = find_still_gyroscope(t, gyr, acc)
    if rest.windows >= _TELLING and rest.rate > _BIAS:
        return f"at rest, while gravity holds still, it says {rest.rate:.2g}, {math.degrees(rest.rate):.0f} deg/s"
    if rest.windows >= _TELLING and rest.noise > _LOUD:
        return f"its noise at rest would be {math.degrees(rest.noise):.1f} deg/s"
    regular = turn is None or not (turn.clear and turn.scale > 0.3)
    enough = held.windows >= 4 * _TELLING if rest.windows == 0 else held.windows > _TELLING + 1
    if regular and enough and held.gain < 2.0 * _DEGREES and held.best > 0.85:
        return "gravity turns much slower than it says"
    return None


def says_radians(t: Array, gyr: Array, acc: Array) -> str | None:
    """Why (n, 3) ``gyr``, declared as deg/s, must be rad/s; None if nothing says so clearly. ``acc`` in m/s²."""
    turn = turn_of_gravity(t, gyr, acc)
    if turn is not None and turn.clear and turn.correlation > 0.9 and 0.5 < turn.scale < 2.0:
        return f"gravity turns {turn.scale * 180.0 / math.pi:.1f} times faster than it says"
    return None


def question_unit(t: Array, rate: Array, acc: Array, factor: float) -> str | None:
    """Why the declared unit, in rad/s ``factor``, may be the other of deg/s and rad/s; None if nothing says so.

    ``rate`` (n, 3) rad/s by the declared unit, ``acc`` (n, 3) m/s². Weaker than ``says_degrees``: gravity's turn, noisy
    as it may be, is nearer to the other unit, or no gyroscope is as quiet as this one would be.
    """
    between = math.sqrt(180.0 / math.pi)
    told = [one for one in (turn_of_gravity(t, rate, acc), quiet_turn(t, rate, acc)) if one is not None]
    told = [one for one in told if one.turned > 0.4 * _ENOUGH and one.correlation > _SLIGHT]
    if told:
        best = max(told, key=lambda one: one.correlation)
        if best.scale > between if factor < 1.0 else best.scale < 1.0 / between:
            return f"gravity turns {best.scale:.2g} times as far as it says (correlation {best.correlation:.2f})"
        return None
    noise = math.degrees(rest_noise(t, rate))
    if factor < 1.0 and 0.0 < noise < _QUIETEST:
        return f"its noise at rest would be {noise:.2g} deg/s"
    return None


def gyr_unit_at_rest(t: Array, gyr: Array) -> GyroscopeUnit:
    """The unit from size and noise alone, for (n, 3) ``gyr`` that gravity says nothing about: a guess."""
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
