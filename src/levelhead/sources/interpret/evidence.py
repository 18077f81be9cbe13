"""The evidence of the units, as the interpretation gathers it."""

from dataclasses import dataclass

import numpy as np

from levelhead.open_types import ReadOnlyJson
from levelhead.recording import Array
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import Scale
from levelhead.sources.interpret.counts import Chip


@dataclass
class Evidence:
    """The conclusions on the way from a table to a recording.

    Attributes:
        conclusions: in the order in which they were made.
        acc_per_g: numbers per g, if the accelerometer gives whole ones: a chip's counts, mg, thousandths of 1 m/s².
        acc_norm: their usual length.
        chip: whose sensitivity the gyroscope seems to have, if its numbers are whole.
        adds_gravity: whether gravity, which has columns of its own, is added to the acceleration.
    """

    conclusions: list[Conclusion]
    acc_per_g: float | None = None
    acc_norm: float | None = None
    chip: Chip | None = None
    adds_gravity: bool = False

    def conclude(
        self, about: str, reason: str, scale: Scale, basis: Basis, facts: ReadOnlyJson, confirm: ReadOnlyJson
    ) -> None:
        """Adds a conclusion about a unit."""
        self.conclusions.append(Conclusion(about, reason, scale.name, basis, facts, confirm))


def are_whole(values: Array) -> bool:
    """Whether all numbers are whole, and reach more than a few: counts."""
    finite = values[np.isfinite(values)]
    return len(finite) > 0 and bool(np.array_equal(finite, np.rint(finite))) and float(np.abs(finite).max()) > 3.0
