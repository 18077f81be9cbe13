"""Time stamps: their unit, their start, and whether they go forward."""

from typing import NamedTuple

import numpy as np

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.recording import Array, median
from levelhead.sources.hints import Scale
from levelhead.sources.table import Column, Table

_EPOCH = (0.9e9, 4.2e9)  # seconds since 1970 that lie between 1998 and 2103
_LONGEST_UPTIME = 1e8  # seconds; stamps beyond it count from some date, not from the start of the sensor
_SLOWEST_MEDIAN = {"s": 0.25, "ms": 250.0, "us": 250e3, "ns": 250e6}  # 4 Hz


class Clock(NamedTuple):
    """Time stamps in seconds.

    Attributes:
        t: (n,) seconds.
        unit: what the stamps are in.
        t0: what was subtracted, in seconds; None if nothing was.
        notes: sentences about what was concluded.
    """

    t: Array
    unit: str
    t0: float | None
    notes: list[str]


def seconds(stamps: Column, declared: Scale | str | None, table: Table, name: str) -> Clock:
    """(n,) stamps of column ``name`` as seconds, checked.

    ``declared`` is the unit that the header or a hint gives; without one the unit follows from the median interval.
    Stamps that count from 1970 or another date become seconds since the first one.

    Raises:
        LevelheadError: a stamp is missing, or does not come after the one before it; the line is named.
    """
    _check(stamps, table, name)
    notes: list[str] = []
    if declared is None:
        declared = guess_unit(stamps)
        notes.append(f"time: '{name}' has no unit; its median interval of {_interval(stamps):.6g} says {declared}")
    scale = declared if isinstance(declared, Scale) else Scale(units.factor("time", declared), declared)
    t0 = None
    first = stamps[0]
    if abs(float(first)) * scale.factor / scale.divisor > _LONGEST_UPTIME:
        t0 = float(_scaled(stamps[:1].astype(np.float64), scale)[0])
        stamps = stamps - first
        notes.append(f"time: starts at 0; the first stamp is {t0:.6f} s (meta['t0'])")
    return Clock(_scaled(stamps.astype(np.float64), scale), scale.name, t0, notes)


def guess_unit(stamps: Column) -> str:
    """The unit of (n,) stamps: the one in which they lie in our century, or else give 4 Hz or more."""
    step, first = _interval(stamps), abs(float(stamps[0]))
    for unit in ("s", "ms", "us", "ns"):
        factor = units.factor("time", unit)
        if _EPOCH[0] < first * factor < _EPOCH[1] and 1e-5 < step * factor < 10.0:
            return unit
    return next((unit for unit, limit in _SLOWEST_MEDIAN.items() if step < limit), "ns")


def _interval(stamps: Column) -> float:
    if len(stamps) < 2:
        return 0.0
    return median(np.diff(stamps[:100_000]))


def _scaled(values: Array, scale: Scale) -> Array:
    """Divides where it can: 12 ms / 1000 is the nearest number to 0.012, 12 × 0.001 is not always."""
    if scale.divisor == 1.0 and scale.factor < 1.0:
        return values / round(1.0 / scale.factor)
    return values * (scale.factor / scale.divisor)


def _check(stamps: Column, table: Table, name: str) -> None:
    finite = np.isfinite(stamps)
    if not finite.all():
        row = int(np.argmin(finite))
        what = "missing" if np.isnan(stamps[row]) else "infinite"
        raise LevelheadError(
            f"{table.source}, {table.where(row)}, column '{name}': the time is {what}; expected a stamp on every line"
        )
    forward = stamps[1:] > stamps[:-1]
    if not forward.all():
        row = int(np.argmin(forward)) + 1
        now, before = stamps[row], stamps[row - 1]
        what = f"stands still at {now}" if now == before else f"goes back from {before} to {now}"
        raise LevelheadError(
            f"{table.source}, {table.where(row)}, column '{name}': time {what}; expected stamps that increase, "
            "or the hints map t= and rate=…, which leave the stamps out"
        )
    if float(stamps[-1]) - float(stamps[0]) > 1e20 or abs(float(stamps[0])) > 1e20:
        raise LevelheadError(f"{table.source}, column '{name}': {stamps[-1]:.6g} is no time; expected s, ms, us or ns")
