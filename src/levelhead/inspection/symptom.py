"""A symptom of a fused track with its cause, and the kinds of symptoms."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

from levelhead.inspection.evidence import RunEvidence
from levelhead.open_types import JsonObject


@dataclass(frozen=True)
class Symptom:
    """A visible fault of a track, its cause and its cure.

    Attributes:
        name: of its ``SymptomKind``.
        size: how large it is, in ``unit``.
        unit: of ``size``.
        what: a clause with the size, such as "heading drifts 12° a minute".
        cause: a word for programs, such as "no_rest".
        why: a clause with the numbers that show the cause.
        cure: what to do, a sentence.
        at: s after the first sample at which the largest of them is; None: all the time.
        finding: name of the doctor's finding that shows the same cause; "": it has none.
    """

    name: str
    size: float
    unit: str
    what: str
    cause: str
    why: str
    cure: str
    at: float | None = None
    finding: str = ""

    def __str__(self) -> str:
        return f"{self.what}: {self.why}. {self.cure}"

    def to_dict(self) -> JsonObject:
        """Ready for JSON."""
        return {
            "symptom": self.name,
            "size": self.size,
            "unit": self.unit,
            "at_s": self.at,
            "what": self.what,
            "cause": self.cause,
            "why": self.why,
            "cure": self.cure,
            "finding": self.finding or None,
        }


class SymptomKind(NamedTuple):
    """A symptom that ``explain`` looks for.

    Attributes:
        name: a word for programs.
        unit: of its size.
        measure: how its size is measured, for the docs.
        bound: the size from which it is reported, with its unit, for the docs.
        absent: a clause about a track without it.
        colour: of its mark in the picture, #RRGGBB.
        find: yields the symptoms in a run.
        find_if_alone: likewise; asked only if no symptom was found.
        spectrum: "gyr" or "acc": the sensor whose spectrum is part of the picture.
    """

    name: str
    unit: str
    measure: str
    bound: str
    absent: str
    colour: str
    find: Callable[[RunEvidence], Iterable[Symptom]]
    find_if_alone: Callable[[RunEvidence], Iterable[Symptom]] | None = None
    spectrum: str = ""
