"""The input of a self-test, and the filter's output in Python: rest, a turn, and everything that goes wrong.

The readings are made by whole-number arithmetic and rounded to a few decimals, so that they are the same on every
machine; in double the answers must be the same to the bit.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from levelhead.engine.binding import bind, bind_axis
from levelhead.engine.stepper import MOST_DT
from levelhead.export.config import ExportConfig
from levelhead.export.frame import turned_output
from levelhead.filters.contract import FilterState, Output
from levelhead.kernels.vec3 import Vec3

SAMPLES = 96
STEP = 0.0517  # s; no threshold in seconds is a multiple of it
RESTING = 44  # samples: longer than a guard's rest_time
NAN = math.nan


class VectorSample(NamedTuple):
    """One sample of an IMU."""

    dt: float
    gyr: Vec3
    acc: Vec3
    mag: Vec3


class VectorRow(NamedTuple):
    """A sample, whether it is taken, and the filter's output after it."""

    sample: VectorSample
    taken: bool
    output: Output


class AxisRow(NamedTuple):
    """A pair, whether it is taken, and the filter's report after it."""

    level: float
    rate: float
    dt: float
    taken: bool
    report: tuple[float, ...]


def _noise() -> Iterator[float]:
    """Even noise within ±1, by a linear congruence (Numerical Recipes, 2nd ed., section 7.1)."""
    state = 42
    while True:
        state = (1664525 * state + 1013904223) % 2**32
        yield round(state / 2**31 - 1.0, 4)


def _roll_vector(angle: float, v: tuple[float, float, float]) -> tuple[float, float, float]:
    """A vector of the earth as a sensor sees it that has rolled by an angle."""
    x, y, z = v
    return x, y * math.cos(angle) + z * math.sin(angle), z * math.cos(angle) - y * math.sin(angle)


def vector_samples() -> list[VectorSample]:
    """Three seconds of rest, then a roll to and fro."""
    noise, found, angle = _noise(), [], 0.3
    for i in range(SAMPLES):
        rate = 0.0 if i < RESTING else 1.5 * math.sin(0.4 * (i - RESTING))
        angle += rate * STEP
        gyr = [0.01 + rate, -0.02, 0.005]
        acc, mag = _roll_vector(angle, (0.2, 0.0, 9.8)), _roll_vector(angle, (3.0, 19.0, -45.0))
        found.append(
            VectorSample(
                STEP,
                Vec3(*(round(x + 0.002 * next(noise), 4) for x in gyr)),
                Vec3(*(round(x + 0.05 * next(noise), 3) for x in acc)),
                Vec3(*(round(x + 0.3 * next(noise), 2) for x in mag)),
            )
        )
    return [_disturb(i, sample) for i, sample in enumerate(found)]


def _disturb(i: int, sample: VectorSample) -> VectorSample:
    """The faults: readings missing, infinite and silent, time that does not advance, a gap, a shock, a magnet."""
    dt, gyr, acc, mag = sample
    nowhere, silent = Vec3(NAN, NAN, NAN), Vec3(0.0, 0.0, 0.0)
    if i == 0:
        acc = nowhere
    if i in (55, 56):
        gyr = Vec3(NAN, 0.1, 0.1)
    if i in (58, 60):
        dt = 0.0 if i == 58 else NAN
    if i == 62:
        dt = 1.75
    if i in (65, 66):
        acc = silent if i == 65 else Vec3(0.0, math.inf, 9.8)
    if i in (68, 69, 70):
        mag = (silent, nowhere, Vec3(60.0, 19.0, -45.0))[i - 68]
    if i == 74:
        acc = Vec3(150.0, -40.0, 90.0)
    if i in (78, 79):
        gyr = Vec3(9.0, -7.0, 5.0)  # so fast that sines leave their series
    return VectorSample(dt, gyr, acc, mag)


def vector_rows(config: ExportConfig) -> list[VectorRow]:
    """The samples through the filter in plain Python."""
    bound = bind(config.flt, config.guard is not None)
    settings, carry, found = config.settings, config.begin(), []
    for sample in vector_samples():
        taken = 0.0 < sample.dt < MOST_DT
        if taken:
            carry = bound.advance(settings, carry, *config.readings(sample.gyr, sample.acc, sample.mag), sample.dt)
        found.append(VectorRow(sample, taken, turned_output(config.frame, bound.result(settings, carry.run))))
    return found


def axis_rows(config: ExportConfig, first: float, period: float) -> list[AxisRow]:
    """Pairs that cross the edge of the circle, through the filter in plain Python."""
    axis = bind_axis(config.flt).axis
    state: FilterState = axis.init(config.params, first)
    noise, found = _noise(), []
    for i in range(40):
        level = round(170.0 + 20.0 * math.sin(0.2 * i) + 3.0 * next(noise), 2)
        level = round(level - 360.0, 2) if level >= 180.0 else level
        rate, dt = round(80.0 * math.cos(0.2 * i) + 1.5 + 0.5 * next(noise), 2), STEP
        if i in (20, 22, 24):
            level, rate, dt = {20: (NAN, rate, dt), 22: (level, math.inf, dt), 24: (level, rate, -STEP)}[i]
        taken = math.isfinite(level) and math.isfinite(rate) and dt > 0.0
        if taken:
            state = axis.step(config.params, state, level, rate, dt, period)
        found.append(AxisRow(level, rate, dt, taken, tuple(axis.read(state))))
    return found
