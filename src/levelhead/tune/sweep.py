"""A sweep: one parameter over its range, the error for each value, the minimum, and how flat it is around it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from levelhead import filters
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.errors import LevelheadError, nearest
from levelhead.evaluate.text_table import Cell, Column, plain_table
from levelhead.filters.parameters import FilterChoice, Param, Params, derived_table, settable
from levelhead.guard import Guard
from levelhead.recording import Array, Recording
from levelhead.tune.score_sets import score_sets

Metric = Literal["total", "tilt", "heading"]
FLAT = 0.05  # the flat region: errors within this share above the minimum
PER_DECADE = 10  # values of a default grid by factors
STEPS = 20  # values of a default grid by steps


@dataclass(frozen=True, eq=False)
class Sweep:
    """The error of one filter over one of its parameters.

    Attributes:
        params: the filter with its other parameters.
        name: the parameter swept.
        param: its unit, meaning and range.
        values: (k,) its values, ascending.
        total: (k,) RMS angle between estimate and truth, °.
        tilt: (k,) RMS inclination error, °.
        heading: (k,) RMS heading error, °.
        metric: which of the three is minimised.
    """

    params: Params
    name: str
    param: Param
    values: Array
    total: Array
    tilt: Array
    heading: Array
    metric: Metric

    @property
    def scores(self) -> Array:
        """(k,) the error that is minimised, °."""
        scores: Array = getattr(self, self.metric)
        return scores

    @property
    def index(self) -> int:
        """Index of the smallest error."""
        return int(np.argmin(self.scores))

    @property
    def minimum(self) -> float:
        """The value with the smallest error."""
        return float(self.values[self.index])

    @property
    def best(self) -> Params:
        """The filter's parameters with that value."""
        return set_value(self.params, self.name, self.minimum)

    @property
    def flat(self) -> tuple[int, int]:
        """First and last index of the flat region: the unbroken run of values around the minimum whose error is at
        most 5 % above it.
        """
        good = self.scores <= (1.0 + FLAT) * self.scores[self.index]
        first = last = self.index
        while first > 0 and good[first - 1]:
            first -= 1
        while last < len(good) - 1 and good[last + 1]:
            last += 1
        return first, last

    @property
    def edge(self) -> Literal["lowest", "highest", ""]:
        """Whether the minimum is the lowest or highest value tried, so that a better one may lie outside.

        Beyond False and True there is none.
        """
        if len(self.values) < 2 or isinstance(getattr(self.params, self.name, None), bool):
            return ""
        return "lowest" if self.index == 0 else "highest" if self.index == len(self.values) - 1 else ""

    @property
    def finding(self) -> str:
        """The result in a sentence or three."""
        unit = f" {self.param.unit}" if self.param.unit else ""
        low, high = (float(self.values[i]) for i in self.flat)
        error = self.scores[self.index]
        words = f"smallest {self.metric} error {error:.4f}° RMS at {self.name} = {self.minimum:g}{unit}"
        derived = derived_table(type(self.params)).get(self.name)
        if derived is not None:
            words += f" ({derived.field} = {getattr(self.best, derived.field):.4g})"
        words += "; within 5 % of it: " + (f"{low:g} to {high:g}{unit}" if high > low else "no other value")
        if self.edge:
            words += f"; the minimum is the {self.edge} value tried, at the edge: widen the range"
        return words

    def to_dict(self) -> dict[str, object]:
        """All numbers, ready for JSON."""
        low, high = self.flat
        return {
            "filter": type(self.params).__name__,
            "params": dict(self.params._asdict()),
            "parameter": self.name,
            "unit": self.param.unit,
            "metric": self.metric,
            "values": self.values.tolist(),
            "total_deg": self.total.tolist(),
            "tilt_deg": self.tilt.tolist(),
            "heading_deg": self.heading.tolist(),
            "minimum": {"value": self.minimum, "error_deg": float(self.scores[self.index]), "edge": self.edge or None},
            "flat": {"low": float(self.values[low]), "high": float(self.values[high]), "within": FLAT},
        }

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns of the table of all values."""
        return (
            Column("value", self.name, self.param.unit, None),
            Column("total", "total", "°", 4, "low"),
            Column("tilt", "tilt", "°", 4, "low"),
            Column("heading", "heading", "°", 4, "low"),
            Column("mark", ""),
        )

    @property
    def table(self) -> list[dict[str, Cell]]:
        """One mapping per value, by the keys of ``columns``."""
        first, last = self.flat
        marks = {i: "flat" for i in range(first, last + 1)} | {self.index: "minimum"}
        return [
            {"value": value, "total": total, "tilt": tilt, "heading": heading, "mark": marks.get(i, "")}
            for i, (value, total, tilt, heading) in enumerate(
                zip(*(a.tolist() for a in (self.values, self.total, self.tilt, self.heading)), strict=True)
            )
        ]

    def __str__(self) -> str:
        return f"{self.params!r}\n{plain_table(self.columns, self.table)}\n{self.finding[0].upper()}{self.finding[1:]}."


def set_value(params: Params, name: str, value: float) -> Params:
    """The same parameters with one of them, or one of their other names (alpha for tau), set to ``value``."""
    fields = dict(params._asdict())
    derived = derived_table(type(params)).get(name)
    if derived is not None:
        del fields[derived.field]
    return type(params)(**(fields | {name: value}))


def grid(owner: str, name: str, param: Param) -> list[float]:
    """Default values of a sweep: 10 a decade where the parameter is searched by factors, else 20 even steps."""
    low, high = param.sweep or (param.low, param.high)
    if not (math.isfinite(low) and math.isfinite(high)) or (param.log and low <= 0.0):
        raise LevelheadError(f"{owner}.{name} has no usual range to sweep; give the values")
    if param.log:
        steps = math.ceil(PER_DECADE * math.log10(high / low) - 1e-9) + 1
        values = np.geomspace(low, high, steps)
    else:
        values = np.linspace(low, high, STEPS)
    return [float(f"{value:.3g}") for value in values]  # 0.126, not 0.125893: as a person would type it


def facts_of(params: Params, name: str) -> Param:
    """Unit, range and meaning of a parameter, or of another name of one.

    Raises:
        LevelheadError: the filter has none of that name; the nearest is named.
    """
    known = settable(type(params))
    if name not in known:
        raise LevelheadError(f"{type(params).__name__} has no parameter '{name}'; {nearest(name, known)}")
    return known[name]


def sweep(
    recording: Recording,
    params: FilterChoice,
    name: str,
    values: Sequence[float] | Array | None = None,
    *,
    metric: Metric = "total",
    guard: Guard | None = DEFAULT_GUARD,
    engine: str = "auto",
    progress: Callable[[float], None] | None = None,
) -> Sweep:
    """Run a filter with one parameter set to each of many values, and score every run against the truth.

    Args:
        recording: with truth.
        params: the filter: Params object (its other parameters stay as they are), class or name.
        name: parameter to sweep, also by another name such as alpha (which then means 100 Hz, as everywhere).
        values: its values; None: the usual range of the parameter.
        metric: error to minimise: "total", "tilt" or "heading" RMS.
        guard: as for ``fuse``; with another one than the default the values are tried one by one.
        engine: as for ``fuse_parameter_sets``.
        progress: called with the fraction done, 0 to 1.

    Raises:
        LevelheadError: no truth, no such parameter (the nearest is named), or a value out of its range.
    """
    if recording.truth is None:
        raise LevelheadError("a sweep needs the true orientation (Recording.truth); this recording holds none")
    if metric not in get_args(Metric):
        raise LevelheadError(f"'{metric}' is not an error to minimise; {nearest(metric, get_args(Metric))}")
    params = filters.resolve(params)
    param = facts_of(params, name)
    if values is None:
        flag = isinstance(getattr(params, name), bool)
        values = [0.0, 1.0] if flag else grid(type(params).__name__, name, param)
    chosen = sorted({float(value) for value in values})
    if not chosen:
        raise LevelheadError(f"there is no value of {name} to try; expected at least one")
    parameter_sets = [set_value(params, name, value) for value in chosen]  # all checked before the first run
    total, tilt, heading = score_sets([recording], parameter_sets, guard, engine, progress)[0].T
    return Sweep(params, name, param, np.array(chosen), total, tilt, heading, metric)
