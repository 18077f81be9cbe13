"""A symptom of a fused track with its cause, and the explanation of a whole log."""

from collections.abc import Sequence
from dataclasses import dataclass

from levelhead.inspection.evidence import RunEvidence
from levelhead.inspection.findings import Finding
from levelhead.open_types import Fields
from levelhead.track import Track


@dataclass(frozen=True)
class Symptom:
    """Something that a user sees in a track, where it comes from, and what to do.

    Attributes:
        name: "missing", "jump", "drift", "jitter" or "lag".
        size: how large it is, in ``unit``.
        unit: "s", "deg", "deg/min", or "ms".
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

    def to_dict(self) -> Fields:
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


@dataclass(frozen=True, eq=False)
class Explanation:
    """What a track shows, and the doctor's findings that explain none of it.

    Attributes:
        source: the log.
        evidence: recording, the filter's track, the smoother's, and what was computed from them.
        symptoms: those found, in the order missing, jump, drift, jitter, lag.
        others: findings of the doctor, notes left out, to which no symptom belongs.
    """

    source: str
    evidence: RunEvidence
    symptoms: Sequence[Symptom]
    others: Sequence[Finding]

    @property
    def track(self) -> Track:
        """The filter's result."""
        return self.evidence.track

    @property
    def exit_code(self) -> int:
        """0: no symptom; 1: there are some."""
        return int(bool(self.symptoms))

    def to_dict(self) -> Fields:
        """Ready for JSON."""
        return {
            "source": self.source,
            "filter": self.track.name,
            "exit_code": self.exit_code,
            "symptoms": [one.to_dict() for one in self.symptoms],
            "other_findings": [one.name for one in self.others],
        }

    def __str__(self) -> str:
        lines = [str(one) for one in self.symptoms] or [
            "no symptom: nothing is missing, jumps, drifts, jitters or lags by more than levelhead looks for"
        ]
        broken = [one for one in self.others if one.severity == "broken"]
        lines = [f"first of all, {one.what}. {one.cure}".strip() for one in broken] + lines
        if self.others:
            names = ", ".join(one.name for one in self.others)
            lines.append(f"the doctor also finds {names}; levelhead doctor LOG shows them")
        return "\n".join([f"{self.source}: {self.track.name}", *lines])
