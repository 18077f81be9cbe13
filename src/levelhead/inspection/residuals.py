"""Findings of the comparison of turns beside the matrix: delays, iron, a filter, a bias."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from levelhead.inspection.agreement import CONTRAST, LIKELY_ODDS, SURE_ODDS, Hypothesis, Seen
from levelhead.inspection.findings import Finding, Measurement
from levelhead.inspection.mend import Mend
from levelhead.inspection.values import NAMES
from levelhead.recording import Array
from levelhead.signals.turn_matrix import SHAPES

SIGMAS = 1.96  # of an interval of 95 %
LIKELY, SURE = 3.0, 4.0  # σ
IRON_LIKELY, IRON_SURE = 3.8, 5.0  # the same of three numbers, by χ²
LAG = 0.08  # s: a filter in front of the accelerometer that is worse than a delay
SLOW = 0.05  # s of delay, from which it may be a filter
LAG_HIDDEN = 0.1  # s: 1σ without contrast; a walker's forces lag less than gravity
APART, TOO_FAR = 0.012, 0.03  # s between gyroscope and accelerometer: worth a note; worse than that
LATE, FLOOR = 0.008, 0.001  # s of a magnetometer: worth a note; 1σ that no model has
MUCH = 0.08  # s from which it is worse than a note
USUAL, EARLY = 0.012, 0.01  # s of a usual magnetometer, and 1σ below: real ones have −13 to 46 ms
SHARE, ROUGH, HIDDEN = 0.08, 0.02, 0.3  # of the field: iron worth a word; 1σ that no model has, and without contrast
OVAL, OVAL_ROUGH, OVAL_HIDDEN = 0.08, 0.015, 0.1  # of the field, as SHARE, ROUGH and HIDDEN
MIN_AXIS = 0.2  # of an axis of the field's shape: less is not a fit
BIAS, WANDER, VAGUE = np.radians((1.0, 0.2, 2.0))  # rad/s: worth a note; 1σ that no model has, and without contrast


def _lag_sigma(force: Seen) -> float:
    """1σ of the delay of a force, s; of a filter that of its likelihood."""
    return float(np.hypot(force.fit.sigma[3], 0.0 if force.low_pass else LAG_HIDDEN / force.contrast**2))


def _field_sigma(field: Seen) -> float:
    """1σ of the delay of a field, s."""
    return float(np.hypot(field.fit.sigma[3], FLOOR + 0.03 / field.contrast**2))


class Delay(NamedTuple):
    """s by which the accelerometer comes later than the gyroscope, 1σ, and whether the field shows it too."""

    seconds: float
    sigma: float
    by_field: bool

    @property
    def is_clear(self) -> bool:
        """Whether it is worth a note, and unlikely to be chance."""
        return abs(self.seconds) > max(APART + SIGMAS * self.sigma, LIKELY * self.sigma)


def find_delay(force: Seen, field: Seen | None) -> Delay:
    """The delay between accelerometer and gyroscope.

    A gyroscope that is late by τ makes both others early:

        d_acc = −τ,   d_mag = ``USUAL`` − τ                                                                     (1)

    as no magnetometer comes before the field that it measures. The weighted mean of both counts if they agree, and
    better than the field does with a gyroscope in time. A magnetometer that is late shows nothing of the gyroscope.
    """
    seconds, variance = force.fit.delay, _lag_sigma(force) ** 2
    found = Delay(seconds, np.sqrt(variance), False)
    early = 0.0 if field is None else USUAL - field.fit.delay
    if field is not None and early > 0.0:
        spread = EARLY**2 + _field_sigma(field) ** 2
        if (early + seconds) ** 2 / (variance + spread) < min(early**2 / spread, SURE**2):
            both = 1.0 / (1.0 / variance + 1.0 / spread)
            found = Delay(both * (seconds / variance - early / spread), np.sqrt(both), True)
    return found


def measure_delay(name: str, what: str, seconds: float, sigma: float) -> Measurement:
    """A delay in ms."""
    value, spread = 1e3 * seconds, 1e3 * SIGMAS * sigma
    return Measurement(name, what, value, (value - spread, value + spread), 0.0, "ms")


def examine_delay(force: Seen, delay: Delay, excess: float) -> Iterator[Finding | Measurement]:
    """Of accelerometer and gyroscope the one that comes later, or the filter behind which gravity lags.

    The odds for a filter are over the ``excess`` of χ², as those for the other faults.
    """
    measured = measure_delay("sensor_delay", "accelerometer later by", *delay[:2])
    yield measured
    odds = force.low_pass / excess
    if odds > LIKELY_ODDS and force.fit.delay > LAG:
        yield _low_pass(force, odds)
    elif delay.is_clear:
        yield _delay(delay, measured)


def _delay(delay: Delay, measured: Measurement) -> Finding:
    spread = SIGMAS * delay.sigma
    late, other = ("acc", "gyroscope") if delay.seconds > 0.0 else ("gyr", "accelerometer")
    others = f"{other} and the magnetometer" if delay.by_field else other
    fits = "the turns of gravity and of the field fit" if delay.by_field else "gravity's turn fits"
    slow = delay.seconds > SLOW  # a filter delays as much, and no delay of its own mends that
    sure = abs(delay.seconds) > SURE * delay.sigma
    return Finding(
        "sensor_delay",
        "warning" if abs(delay.seconds) - spread > TOO_FAR and not slow else "note",
        f"the {NAMES[late]} {'comes' if sure else 'may come'} {1e3 * abs(delay.seconds):.0f} ms later than the {others}"
        f"{', or is filtered' if slow else ''}",
        f"where {fits} best, ±{1e3 * spread:.0f} ms",
        f"Give both sensors one filter and one clock{'' if slow else '; --fix shifts it'}.",
        value=measured.value,
        interval=measured.interval,
        unit=measured.unit,
        mend=None if slow else Mend(late, np.eye(3), np.zeros(3), delay=abs(delay.seconds)),
        sure=sure,
    )


def _low_pass(force: Seen, odds: float) -> Finding:
    lag, sigma = force.fit.delay, _lag_sigma(force)
    sure = odds > SURE_ODDS and force.contrast > CONTRAST
    low, corner, high = (
        1.0 / (2.0 * np.pi * max(one, 1e-3)) for one in (lag + SIGMAS * sigma, lag, lag - SIGMAS * sigma)
    )
    return Finding(
        "acc_low_passed",
        "broken",
        f"the accelerometer {'is' if sure else 'may be'} low-passed at about {corner:.2g} Hz: "
        f"gravity lags by {1e3 * lag:.0f} ms",
        f"its turn fits the gyroscope's behind a filter of first order, ±{1e3 * SIGMAS * sigma:.0f} ms; "
        f"2 ln of the odds {odds:.0f}",
        "Switch the filter off, or set it to 5 Hz or more; the gyroscope and the accelerometer need the same one.",
        value=corner,
        interval=(low, high),
        unit="Hz",
        mend=Mend("acc", np.eye(3), np.zeros(3), lag=lag),
        sure=sure,
    )


def examine_field_delay(field: Seen, gyroscope: float) -> Iterator[Finding | Measurement]:
    """Whether the magnetometer comes later or earlier than the gyroscope, which is late itself by ``gyroscope`` s."""
    delay = field.fit.delay + gyroscope
    sigma = _field_sigma(field)
    late = measure_delay("mag_delay", "magnetometer later by", delay, sigma)
    yield late
    if abs(delay) < max(LATE + SIGMAS * sigma, LIKELY * sigma):
        return
    sure = abs(delay) > SURE * sigma
    yield Finding(
        "mag_delay",
        "warning" if abs(delay) - SIGMAS * sigma > MUCH else "note",
        f"the magnetometer {'comes' if sure else 'may come'} {1e3 * abs(delay):.0f} ms "
        f"{'later' if delay > 0 else 'earlier'} than the gyroscope",
        f"where the field turned back by the gyroscope is stillest, ±{1e3 * SIGMAS * sigma:.1f} ms",
        "Stamp it when it is measured.",
        value=late.value,
        interval=late.interval,
        unit=late.unit,
        mend=Mend("mag", np.eye(3), np.zeros(3), delay=delay),
        sure=sure,
    )


class TurningIron(NamedTuple):
    """Iron that turns with a magnetometer.

    Attributes:
        iron: in the unit of the readings, (3,).
        sigma: 1σ of its numbers.
        strength: rms of the field without it.
    """

    iron: Array
    sigma: Array
    strength: float

    @property
    def size(self) -> float:
        """Its length."""
        return float(np.linalg.norm(self.iron))

    @property
    def size_sigma(self) -> float:
        """1σ of its length."""
        return float(np.linalg.norm(self.iron * self.sigma) / max(self.size, 1e-12))

    @property
    def measurement(self) -> Measurement:
        """Its share of the field, %."""
        share, spread = (100.0 * one / self.strength for one in (self.size, SIGMAS * self.size_sigma))
        return Measurement(
            "mag_offset", "iron with the magnetometer", share, (max(0.0, share - spread), share + spread), 0.0, "%"
        )


def find_iron(field: Seen) -> TurningIron:
    """The part of the field that does not turn back with the gyroscope."""
    soft = np.eye(3) + field.fit.shape  # mended later, so the iron is that in readings
    iron: Array = np.asarray(np.linalg.solve(soft, field.fit.iron), dtype=np.float64)
    strength = float(np.sqrt(((field.segments.vector - iron) ** 2).sum(axis=-1).mean()))
    sigma = np.hypot(field.fit.sigma[:3], strength * (ROUGH + HIDDEN / field.contrast**2))
    return TurningIron(iron, sigma, strength)


def examine_iron(field: Seen, fault: Hypothesis | None) -> Iterator[Finding | Measurement]:
    """Whether iron turns with the magnetometer."""
    found = find_iron(field)
    share = found.measurement
    yield share
    sigmas = float(np.linalg.norm(found.iron / found.sigma))
    if share.value < 100.0 * SHARE or sigmas < IRON_LIKELY:
        return
    sure = sigmas > IRON_SURE
    raw, corrected = (
        np.linalg.norm(one, axis=-1).std() for one in (field.segments.vector, field.segments.vector - found.iron)
    )
    if corrected > raw + found.size_sigma:  # without its iron a length is constant: here the field changes by place
        return
    yield Finding(
        "mag_offset",
        "warning",
        f"the magnetometer {'is not' if sure else 'may not be'} calibrated: iron turns with it, "
        f"{share.value:.0f} % of the field",
        f"({', '.join(f'{value:.3g}' for value in found.iron)}) does not turn back with the gyroscope, "
        f"±{share.interval[1] - share.value:.0f} %; the field is {found.strength:.3g}",
        "Learn it: --save-calibration FILE.",
        value=share.value,
        interval=share.interval,
        unit=share.unit,
        mend=Mend("mag", np.eye(3), found.iron) if fault is None else None,
        sure=sure,
    )


def examine_shape(field: Seen, fault: Hypothesis | None) -> Iterator[Finding | Measurement]:
    """Whether soft iron, or axes of unlike scale, make the field longer along one direction than along another."""
    values, vectors = np.linalg.eigh(np.eye(3) + field.fit.shape)
    if values[0] < MIN_AXIS:
        return
    ratio = float(values[-1] / values[0])
    along = np.einsum("id,sij,jd->sd", vectors, SHAPES, vectors)  # change of each eigenvalue with each number of S
    gradient = along[:, -1] / values[0] - along[:, 0] * ratio / values[0]
    covariance = field.fit.more_covariance[-len(SHAPES) :, -len(SHAPES) :]
    floor = OVAL_ROUGH + OVAL_HIDDEN / field.contrast**2
    sigma = float(np.sqrt(gradient @ covariance @ gradient + floor**2))
    size, spread = ratio - 1.0, SIGMAS * sigma
    interval = (100.0 * max(0.0, size - spread), 100.0 * (size + spread))
    yield Measurement("mag_shape", "the field longer one way by", 100.0 * size, interval, 0.0, "%")
    if size < max(OVAL + spread, LIKELY * sigma):
        return
    sure = size > SURE * sigma
    axis = "xyz"[int(np.abs(vectors[:, 0]).argmax())]
    yield Finding(
        "mag_shape",
        "warning",
        f"the magnetometer {'reads' if sure else 'may read'} {100 * size:.0f} % more along one direction, near {axis}, "
        "than along another",
        f"soft iron, or axes of unlike scale: the field turned back by the gyroscope is oval, ±{100 * spread:.0f} %",
        "Calibrate it: levelhead calibrate LOG.",
        value=100.0 * size,
        interval=interval,
        unit="%",
        mend=Mend("mag", np.eye(3) + field.fit.shape, np.zeros(3)) if fault is None else None,
        sure=sure,
    )


def examine_bias(seen: Sequence[Seen]) -> Iterator[Finding | Measurement]:
    """The gyroscope's bias in motion: the rate that gravity and the field do not show."""
    if not seen:
        return
    made = []
    for one in seen:
        spread = one.fit.own_bias.std(axis=0) / np.sqrt(len(one.fit.own_bias))
        made.append((-one.fit.bias, np.hypot(spread, WANDER + VAGUE / one.contrast**2)))
    weights = [1.0 / sigma**2 for _, sigma in made]
    total = np.sum(weights, axis=0)
    bias = sum(weight * one for weight, (one, _) in zip(weights, made, strict=True)) / total
    sigma = total**-0.5
    axis = int(np.abs(bias).argmax())
    size, spread_deg = float(np.degrees(np.abs(bias[axis]))), float(np.degrees(SIGMAS * sigma[axis]))
    largest = float(np.degrees((np.abs(bias) + SIGMAS * sigma).max()))
    interval = (max(0.0, size - spread_deg), largest)
    yield Measurement("gyro_bias", "largest bias of the gyroscope in motion", size, interval, 0.0, "deg/s")
    if abs(bias[axis]) < BIAS + LIKELY * sigma[axis]:
        return
    yield Finding(
        "gyro_bias",
        "note",
        f"the gyroscope reads {', '.join(f'{value:.2f}' for value in np.degrees(bias))} deg/s too much in motion",
        f"rates that gravity or the field does not show, ±{spread_deg:.2f} deg/s",
        "The filters learn it; a second of rest at the start is quicker.",
        value=size,
        interval=(size - spread_deg, size + spread_deg),
        unit="deg/s",
    )
