"""What is exported: a filter with its numbers, with or without the guard, or on one axis, in single or double."""

from dataclasses import dataclass
from typing import Any, Literal

from levelhead import filters
from levelhead.engine.binding import guards
from levelhead.errors import LevelheadError
from levelhead.export.program import snake
from levelhead.filters.contract import Filter, param_table

DEFAULT_GUARD = filters.Guard()


@dataclass(frozen=True)
class Choice:
    """One export.

    Attributes:
        params: of the filter; they say which one.
        guard: what stands in front of it; None: the filter sees every reading as it is.
        real: the type of all numbers.
        axis: the filter of one level and its rate instead of that of an IMU.
        command: the words that do it again.
    """

    params: Any
    guard: filters.Guard | None = DEFAULT_GUARD
    real: Literal["float", "double"] = "double"
    axis: bool = False
    command: str = "levelhead export"

    def __post_init__(self) -> None:
        if self.axis and self.flt.axis is None:
            having = ", ".join(flt.name for flt in filters.ALL if flt.axis)
            raise LevelheadError(f"{self.flt.name} needs an IMU; on one level and its rate work {having}")

    @property
    def flt(self) -> Filter:
        """The filter."""
        return filters.of(self.params)

    @property
    def guarded(self) -> bool:
        """Whether the guard is part of it."""
        return self.guard is not None and guards(self.flt) and not self.axis

    @property
    def name(self) -> str:
        """Of the files and in front of all names: lh_ekf, lh_kalman_axis."""
        return f"lh_{snake(self.flt.name)}" + ("_axis" if self.axis else "")


def remarks(params: type) -> dict[str, str]:
    """Field -> unit, meaning and range of a parameter."""
    said = {}
    for name, param in param_table(params).items():
        inside = "" if param.range == "any number" else f" ({param.range})"
        said[name] = f"{param.unit}: {param.doc}{inside}" if param.unit else f"{param.doc}{inside}"
    return said
