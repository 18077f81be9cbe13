"""Which parameters of a filter are searched, and over which range."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.filters.parameters import Param, Params, derived_table, param_table
from levelhead.recording import Array
from levelhead.tune.sweep import facts_of, set_value


class Range(NamedTuple):
    """One parameter that is searched, from low to high; by factors where ``param.log``."""

    name: str
    param: Param
    low: float
    high: float

    def at(self, share: float) -> float:
        """The value at a share of the range, to four digits, as a person would type it."""
        share = min(max(share, 0.0), 1.0)
        if self.param.log:
            value = self.low * (self.high / self.low) ** share
        else:
            value = self.low + (self.high - self.low) * share
        return min(max(float(f"{value:.4g}"), self.low), self.high)

    def share(self, value: float) -> float:
        """Where in the range a value lies, 0 to 1; a value outside counts as the nearer end."""
        value = min(max(value, self.low), self.high)
        if self.param.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


class Space(NamedTuple):
    """The parameters of a filter that are searched; the others stay as they are in ``params``."""

    params: Params
    ranges: tuple[Range, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters."""
        return tuple(one.name for one in self.ranges)

    @property
    def start(self) -> Array:
        """(n,) where in the ranges ``params`` lies."""
        return self.point(self.params)

    def point(self, params: Params) -> Array:
        """(n,) where in the ranges these lie."""
        return np.array([one.share(getattr(params, one.name)) for one in self.ranges])

    def at(self, point: Array) -> Params:
        """The parameters at a point; where it is that of ``params`` exactly these, also if outside of the ranges."""
        chosen = self.params
        for one, share, own in zip(self.ranges, point.tolist(), self.start.tolist(), strict=True):
            if share != own:
                chosen = set_value(chosen, one.name, one.at(share))
        return chosen


def parse_range(word: str) -> tuple[str, tuple[float, float] | None]:
    """A parameter's name and range from ``kp`` or ``kp=0.01:10``.

    Raises:
        LevelheadError: not so.
    """
    name, equals, text = word.partition("=")
    if not equals:
        return name, None
    low, _, high = text.partition(":")
    try:
        return name, (float(low), float(high))
    except ValueError:
        raise LevelheadError(
            f"'{word}' is not a range; write lowest and highest value, such as {name}=0.01:10"
        ) from None


def space_of(params: Params, words: Sequence[str] = ()) -> Space:
    """The parameters to search: those named, each perhaps with a range, or all that are tuned unasked.

    Raises:
        LevelheadError: no such parameter, none to tune, one named twice, or a range that is none.
    """
    owner, others = type(params).__name__, derived_table(type(params))
    if words:
        wishes = [parse_range(word) for word in words]
    else:
        flags = {name for name, value in params._asdict().items() if isinstance(value, bool)}
        wishes = [
            (name, None)
            for name, param in param_table(type(params)).items()
            if param.sweep and param.tune and name not in flags
        ]
        if not wishes:
            raise LevelheadError(f"{owner} has no parameter to tune; choose a filter that has, such as Mahony")
    ranges, fields = [], set[str]()
    for name, wish in wishes:
        param = facts_of(params, name)
        field = others[name].field if name in others else name
        if field in fields:
            raise LevelheadError(f"{owner}.{name} is named twice; name it once")
        fields.add(field)
        ranges.append(_range(owner, name, param, wish, isinstance(getattr(params, name), bool)))
    return Space(params, tuple(ranges))


def _range(owner: str, name: str, param: Param, wish: tuple[float, float] | None, flag: bool) -> Range:
    if flag:
        raise LevelheadError(f"{owner}.{name} is a switch and has no range; compare both with --set {name}=true")
    low, high = wish or param.sweep or (param.low, param.high)
    if not (math.isfinite(low) and math.isfinite(high)):
        raise LevelheadError(f"{owner}.{name} has no usual range; give one: -p {name}=LOW:HIGH")
    if not (low < high and param.allows(low) and param.allows(high)) or (param.log and low <= 0.0):
        more = " and, as it is searched by factors, greater than 0" if param.log else ""
        raise LevelheadError(
            f"{owner}.{name}: {low:g} to {high:g} is not a range to search; both must be {param.range}{more}, in order"
        )
    return Range(name, param, low, high)
