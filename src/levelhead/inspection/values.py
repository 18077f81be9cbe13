"""Findings on a recording's numbers: clipping, held and missing samples, resolution."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.inspection.findings import Finding
from levelhead.inspection.mend import Mend
from levelhead.recording import Array, Recording, median
from levelhead.units import GRAVITY

NAMES = {"gyr": "gyroscope", "acc": "accelerometer", "mag": "magnetometer"}
CLIPPED = 8  # samples at the largest value of an axis that make it a limit
RUN = 3  # of them in a row, at least
ALONE = 3.0  # how many times the 90th percentile a limit must be away from, at rest there is none
COARSE = {"gyr": np.radians(0.4), "acc": 0.009}  # rad/s, m/s²
FULL_SCALES = (125.0, 250.0, 500.0, 1000.0, 2000.0)  # deg/s
MISSING = 0.005
HELD = 0.2  # share of rows that repeat the row before
HELD_MOVING = 0.1  # and where the sensor moves most, where rounding hardly repeats all three axes
TOGETHER = 0.6  # share of rows with one axis repeated in which all are: rounding repeats axes one by one
BLOCK = 25  # rows, over which its motion is measured
MIN_ROWS = 20  # that are worth a comparison of sensors
STUCK, MOVES = 4.0, 0.5  # s in which one axis is constant, and the share of rows in which another changes meanwhile
DEADBAND = 0.05  # share of rows that are exactly 0, 0, 0


def examine_values(recording: Recording) -> Iterator[Finding]:
    """Findings about gyroscope, accelerometer and magnetometer, one by one."""
    for role in ("gyr", "acc"):
        values = np.asarray(getattr(recording, role))
        yield from _stuck(recording, role, values)
        yield from _clipping(role, values)
        yield from _held(role, values)
        missing = float((~np.isfinite(values).all(axis=1)).mean())
        if missing > MISSING:
            yield Finding(
                "missing_values",
                "warning",
                f"{100 * missing:.2g} % of the {NAMES[role]}'s rows are missing",
                f"{int(missing * len(values))} of {len(values)} rows",
                "The filter holds the last rate for a while.",
            )
    zero = float((recording.gyr == 0.0).all(axis=1).mean())
    if zero > DEADBAND:
        yield Finding(
            "gyro_deadband",
            "warning",
            f"the gyroscope is exactly 0 on {100 * zero:.0f} % of the rows",
            "three zeros",
            "A device that sets small rates to 0 hides slow turns and its bias; switch that off.",
        )
    if recording.mag is not None:
        yield from _slow_field(recording.mag)


class Clipping(NamedTuple):
    """An axis that stays at its largest value: its index, that value in SI units, and (n,) the rows."""

    axis: str
    top: float
    rows: NDArray[np.bool_]


def find_clipping(role: str, values: Array) -> Clipping | None:
    """The axis of a gyroscope ("gyr") or accelerometer ("acc") that clips on most rows; None: none does."""
    factor = 180.0 / np.pi if role == "gyr" else 1.0 / GRAVITY
    worst: Clipping | None = None
    for axis, signed in zip("xyz", values.T, strict=True):
        column = np.abs(signed)
        finite = column[np.isfinite(column)]
        if len(finite) < 100:
            continue
        top = float(finite.max())
        at = column >= top * (1.0 - 2e-4)
        count = int(at.sum())
        if count < CLIPPED:
            continue
        runs = np.diff(np.concatenate([[0], np.flatnonzero(~at) + 1, [len(at) + 1]])) - 1
        high = top > ALONE * median(finite) and (role == "gyr" or top > 1.8 * GRAVITY)
        scale = top * factor
        high |= role == "gyr" and min(abs(scale / one - 1.0) for one in FULL_SCALES) < 0.002
        if runs.max() >= RUN and high and (worst is None or count > worst.rows.sum()):
            worst = Clipping(axis, top, at)
    return worst


def _clipping(role: str, values: Array) -> Iterator[Finding]:
    worst = find_clipping(role, values)
    if worst is None:
        return
    unit, factor = ("deg/s", 180.0 / np.pi) if role == "gyr" else ("g", 1.0 / GRAVITY)
    count, first = int(worst.rows.sum()), int(worst.rows.argmax())
    yield Finding(
        f"clipping_{role}",
        "warning",
        f"the {NAMES[role]} clips at ±{worst.top * factor:.4g} {unit} ({worst.axis}, {count} rows)",
        f"{100 * count / len(values):.2g} % of the rows have the largest value",
        "Set a larger full scale.",
        (first, first),
    )


def find_stuck(t: Array, values: Array) -> tuple[int, int, int] | None:
    """(axis, first row, row after the last) of the longest time in which one axis is constant and the others move."""
    best: tuple[int, int, int] | None = None
    for axis in range(3):
        column = values[:, axis]
        edges = np.concatenate([[0], np.flatnonzero(column[1:] != column[:-1]) + 1, [len(column)]])
        longest = int(np.argmax(t[np.minimum(edges[1:], len(t) - 1)] - t[edges[:-1]]))
        first, last = int(edges[longest]), int(edges[longest + 1])
        others = np.diff(np.delete(values[first:last], axis, axis=1), axis=0)
        moves = last - first > 20 and float((others != 0.0).any(axis=1).mean()) > MOVES
        if moves and t[last - 1] - t[first] > STUCK and (best is None or last - first > best[2] - best[1]):
            best = axis, first, last
    return best


def without_stuck(recording: Recording) -> Recording | None:
    """The longest part in which no axis of gyroscope or accelerometer is stuck; None: there is hardly one."""
    first, last = 0, len(recording)
    for values in (recording.gyr, recording.acc):
        found = find_stuck(recording.t[first:last], np.asarray(values)[first:last])
        if found is not None:
            begin, end = first + found[1], first + found[2]
            first, last = (first, begin) if begin - first > last - end else (end, last)
        if last - first < MIN_ROWS:
            return None
    return recording[first:last]


def _stuck(recording: Recording, role: str, values: Array) -> Iterator[Finding]:
    found = find_stuck(recording.t, values)
    if found is None:
        return
    axis, first, last = found
    when = "all the time" if last - first >= len(values) - 1 else f"from {recording.t[first] - recording.t[0]:.0f} s on"
    offset = np.zeros_like(values)
    offset[first:last, axis] = values[first, axis] - _likely(recording, role, axis)[first:last]
    yield Finding(
        f"stuck_{role}",
        "broken",
        f"the {NAMES[role]}'s {'xyz'[axis]} has one value {when}",
        f"{last - first} rows in a row, while the others move",
        "Look at the wire and the driver of that axis.",
        (first, last - 1),
        mend=Mend(role, np.eye(3), offset),
    )


def _likely(recording: Recording, role: str, axis: int) -> Array:
    """(n,) the expected reading of an axis: the rest of 1 g, or the rate that the force's turn shows."""
    acc = np.asarray(recording.acc)
    if role == "acc":
        rest = GRAVITY**2 - (np.delete(acc, axis, axis=1) ** 2).sum(axis=1)
        made: Array = np.copysign(np.sqrt(rest.clip(0.0)), acc[:, axis])
        return made
    box = max(1, round(0.2 * recording.rate))
    smooth = np.stack([np.convolve(one, np.ones(box) / box, "same") for one in acc.T], axis=1)
    square = (smooth * smooth).sum(axis=1).clip(1e-9)
    rate: Array = np.cross(np.gradient(smooth, recording.t, axis=0), smooth)[:, axis] / square
    return rate


def _held(role: str, values: Array) -> Iterator[Finding]:
    same = values[1:] == values[:-1]
    joint = float(same.all(axis=1).mean())
    single = float(same.any(axis=1).mean())
    quantum = _quantum(values)
    unit = f"{np.degrees(quantum):.3g} deg/s" if role == "gyr" else f"{quantum:.2g} m/s²"
    if quantum > COARSE[role]:
        yield Finding(
            "coarse_resolution",
            "note",
            f"the {NAMES[role]} resolves {unit} only",
            f"{100 * joint:.0f} % of its rows repeat the row before, by rounding",
            "Write more digits, or a smaller full scale.",
        )
    elif (
        joint > HELD
        and joint > TOGETHER * single
        and _repeats_moving(values) > HELD_MOVING
        and not (values == 0.0).all(axis=1).mean() > DEADBAND
    ):
        yield Finding(
            "held_samples",
            "warning",
            f"{100 * joint:.0f} % of the {NAMES[role]}'s rows repeat the row before",
            "all three axes at once: it is measured less often than it is written",
            "Write each sample once.",
        )


def _repeats_moving(values: Array) -> float:
    """Share of rows that repeat the row before in the quarter of blocks in which the steps between others are largest.

    A sensor that is read too often repeats as often in motion as at rest; rounding repeats at rest only, on all axes
    at once where a calibration has mixed them.
    """
    steps = np.diff(values, axis=0)
    count = len(steps) // BLOCK
    if count < 8:
        return 1.0
    steps = steps[: count * BLOCK].reshape(count, BLOCK, 3)
    same = (steps == 0.0).all(axis=2)
    size = np.nansum(steps * steps, axis=(1, 2)) / np.maximum(1, (~same).sum(axis=1))
    return float(same[size >= np.quantile(size, 0.75)].mean())


def _quantum(values: Array) -> float:
    """The usual smallest step between the values that an axis takes."""
    steps = []
    for column in values[:20_000].T:
        levels = np.unique(column[np.isfinite(column)])
        gaps = np.diff(levels)
        gaps = gaps[gaps > 1e-9 * max(1e-9, float(np.abs(levels).max(initial=0.0)))]
        if len(gaps):
            steps.append(float(np.quantile(gaps, 0.05)))
    return max(steps, default=0.0)


def _slow_field(mag: Array) -> Iterator[Finding]:
    new = np.isfinite(mag).all(axis=1)
    share = float(new.mean())
    changed = float((mag[new][1:] != mag[new][:-1]).any(axis=1).mean()) if new.sum() > 2 else 0.0
    gaps = np.diff(np.flatnonzero(new))
    if share < 0.999 and len(gaps) and np.quantile(gaps, 0.9) <= 1.5 and share > 0.8:
        yield Finding(
            "missing_values",
            "note",
            f"{100 * (1 - share):.2g} % of the magnetometer's rows are missing",
            "blank or NaN",
        )
    elif share < 0.8 or changed < 0.7:
        yield Finding(
            "mag_slow",
            "note",
            f"the magnetometer is new on {100 * share * changed:.0f} % of the rows only",
            f"{100 * (1 - share):.0f} % missing, {100 * (1 - changed):.0f} % repeated",
        )
        if share < 0.8:
            yield Finding(
                "missing_values", "note", f"{100 * (1 - share):.0f} % of the magnetometer's rows are blank", "NaN"
            )
