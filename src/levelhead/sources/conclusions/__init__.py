"""One decision of the reader as data: subject, result, basis, numbers, and the hints that settle it."""

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType
from typing import Any, NamedTuple

from levelhead.open_types import JsonObject, ReadOnlyJson

_NOTHING: ReadOnlyJson = MappingProxyType({})


class Basis(StrEnum):
    """The evidence behind a conclusion, the strongest first."""

    HINT = "hint"
    HEADER = "header"
    VENDOR = "vendor"
    NUMBERS = "numbers"
    GUESS = "guess"


class Conclusion(NamedTuple):
    """One decision that the reader made.

    Attributes:
        about: the subject, such as "acc.unit"; ``sources.conclusions.sentences`` lists them all.
        reason: the name of the evidence; with ``about`` it selects the sentence.
        value: the result, such as "m/s²".
        basis: the kind of evidence.
        facts: the numbers and names in the evidence.
        confirm: hints that settle the question, as arguments of ``levelhead.read``; empty if no hint does.
    """

    about: str
    reason: str
    value: object
    basis: Basis
    facts: ReadOnlyJson = _NOTHING
    confirm: ReadOnlyJson = _NOTHING

    @property
    def role(self) -> str:
        """The sensor in ``about``: "gyr" of "gyr.unit"."""
        return self.about.partition(".")[0]

    def to_dict(self) -> JsonObject:
        """Ready for JSON; ``from_dict`` restores it."""
        return {
            "about": self.about, "reason": self.reason, "value": self.value, "basis": str(self.basis),
            "facts": dict(self.facts), "confirm": dict(self.confirm),
        }  # fmt: skip

    @classmethod
    def from_dict(cls, stored: Mapping[str, Any]) -> "Conclusion":
        """The conclusion in a dictionary of ``to_dict``."""
        return cls(**{**stored, "basis": Basis(stored["basis"])})
