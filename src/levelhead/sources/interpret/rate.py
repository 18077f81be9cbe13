"""The rate of a log without a clock, from how far gravity turns beside the gyroscope."""

from collections.abc import Mapping, Sequence

import numpy as np

from levelhead.signals.gravity_turn import turn_of_gravity
from levelhead.sources.interpret.raw_counts import PER_DEGREE, are_thousandths, mpu6050_scales
from levelhead.sources.table import Column, stack

ROUND_RATES = (10, 20, 25, 50, 100, 125, 200, 250, 400, 500, 1000)  # Hz
USUAL_RATES = (10, 12.5, 20, 25, 50, 100, 104, 119, 125, 200, 208, 250, 400, 416, 500, 800, 1000)  # Hz
_LOOP_RATE = 30.0  # Hz of loops that print
# Counts per deg/s of an MPU-6050 as it comes, and with its motion firmware (DMP), ±2000 deg/s.
USUAL_COUNTS = (PER_DEGREE, 16.4)


def guess_rate(
    positions: Mapping[str, Sequence[int]], columns: Mapping[int, Column], factor: float | None = None
) -> tuple[float, str]:
    """(a usual rate in Hz, words) at which gravity would turn as the gyroscope measures; 100 if unknown.

    ``positions`` are those of the sensors' columns. ``factor``: rad/s for 1 of the gyroscope's numbers; None: deg/s or
    rad/s, whichever fits.
    """
    if factor is None and _are_counts(positions, columns):
        for counts in USUAL_COUNTS:
            found = rate_of_turn(positions, columns, np.pi / 180.0 / counts)
            usual = counts == PER_DEGREE and abs(np.log(found / _LOOP_RATE)) < 0.1 if found is not None else False
            if found is not None and (usual or _round_rates(found)):
                return _nearest(found), f"{_turns(found)}, if these are raw counts, {counts:g} per deg/s"
    if factor is None and "acc" in positions and are_thousandths(stack(columns, positions["acc"])):
        factor = 1e-3  # beside m/s² times 1000
    found = rate_of_turn(positions, columns, factor)
    if found is None:
        if {"gyr", "acc"} <= set(positions):
            return 100.0, "; the log contains too little motion to estimate it; 100 Hz is a placeholder"
        return 100.0, ""
    return _nearest(found), _turns(found)


def _turns(rate: float) -> str:
    return f"; gravity turns as the gyroscope does at about {rate:.0f} Hz"


def _round_rates(found: float) -> list[float]:
    return [float(one) for one in ROUND_RATES if abs(np.log(one / found)) < 0.1]  # gravity's turn is not more accurate


def _nearest(found: float) -> float:
    usual = min(_round_rates(found) or USUAL_RATES, key=lambda one: abs(np.log(one / found)))
    return float(usual) if abs(np.log(usual / found)) < 0.15 else float(round(found))


def _are_counts(positions: Mapping[str, Sequence[int]], columns: Mapping[int, Column]) -> bool:
    """Whether the numbers are raw counts of an MPU-6050 whose accelerometer is as it comes."""
    if not {"gyr", "acc"} <= set(positions):
        return False
    return mpu6050_scales(stack(columns, positions["gyr"]), stack(columns, positions["acc"])) is not None


def rate_of_turn(
    positions: Mapping[str, Sequence[int]], columns: Mapping[int, Column], factor: float | None = None
) -> float | None:
    """The rate in Hz at which gravity turns as the gyroscope measures; None if nothing turns clearly."""
    if not {"gyr", "acc"} <= set(positions):
        return None
    gyr, acc = (stack(columns, positions[role]) for role in ("gyr", "acc"))
    best: tuple[float, float] | None = None
    for one in (1.0, np.pi / 180.0) if factor is None else (factor,):
        for near in (10.0, 100.0):  # spans of half a second are as long as the rate makes them
            turn = turn_of_gravity(np.arange(len(gyr)) / near, gyr * one, acc)
            if turn is not None and turn.clear:
                rate = near * 1.0 / turn.scale if turn.scale > 0 else 0.0
                if 8.0 < rate < 1200.0 and (best is None or turn.correlation > best[1]):
                    best = rate, turn.correlation
    return None if best is None else best[0]
