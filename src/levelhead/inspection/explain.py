"""Explains a log: the symptoms of its track, from which cause, and what to do.

Drift, jitter and lag are measured beside the smoother, which uses the whole recording; missing readings and jumps are
traced to rows of the log. Causes are shared with the doctor: a symptom names the finding that shows the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from levelhead.engine import fuse, smooth
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import FilterChoice
from levelhead.guard import Guard
from levelhead.inspection import list_findings, symptoms
from levelhead.inspection.evidence import RunEvidence
from levelhead.inspection.findings import Finding
from levelhead.inspection.symptom import Symptom
from levelhead.open_types import JsonObject
from levelhead.recording import Recording
from levelhead.track import Track

MIN_DURATION = 10.0  # s of a recording in which something can be seen


@dataclass(frozen=True, eq=False)
class Explanation:
    """Symptoms in a track, and the doctor's findings that explain none of them.

    Attributes:
        source: the log.
        evidence: recording, the filter's track, the smoother's, and the numbers computed from them.
        symptoms: those found, in the order of ``symptoms.ALL``.
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

    def to_dict(self) -> JsonObject:
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
            f"no symptom: the track {', '.join(kind.absent for kind in symptoms.ALL)}"
        ]
        broken = [one for one in self.others if one.severity == "broken"]
        lines = [f"first of all, {one.what}. {one.cure}".strip() for one in broken] + lines
        if self.others:
            names = ", ".join(one.name for one in self.others)
            lines.append(f"the doctor also finds {names}; levelhead doctor LOG shows them")
        return "\n".join([f"{self.source}: {self.track.name}", *lines])


def explain(
    recording: Recording, params: FilterChoice | None = None, *, guard: Guard | None = None, source: str = ""
) -> Explanation:
    """Runs a filter and the smoother over a recording and explains the symptoms of the filter's track.

    Args:
        recording: 10 s or more.
        params: the filter; None: the default.
        guard: in front of it; None: the default one.
        source: the log's name.

    Raises:
        LevelheadError: the recording is too short.
    """
    if recording.duration < MIN_DURATION:
        raise LevelheadError(
            f"the recording is {recording.duration:.3g} s long; expected {MIN_DURATION:g} s or more to explain"
        )
    before = Guard() if guard is None else guard
    findings = list_findings(recording)
    evidence = RunEvidence(
        recording, fuse(recording, params, guard=before), smooth(recording), {one.name: one for one in findings}
    )
    with np.errstate(all="ignore"):
        found = [one for kind in symptoms.ALL for one in kind.find(evidence)]
        if not found:
            alone = [kind.find_if_alone for kind in symptoms.ALL if kind.find_if_alone is not None]
            found = [one for find in alone for one in find(evidence)]
    found = [one if one.finding in evidence.findings else replace(one, finding="") for one in found]
    explained = {one.finding for one in found}
    others = [one for one in findings if one.severity != "note" and one.name not in explained]
    return Explanation(source or str(recording.meta.get("source", "")), evidence, found, others)
