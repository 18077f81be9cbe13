"""The doctor's report: findings, each with evidence, size and cure, and a verdict."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from levelhead.inspection.mend import Mend
from levelhead.open_types import JsonObject, ReadOnlyJson
from levelhead.recording import Recording

SEVERITIES = ("broken", "warning", "note")  # worst first; notes change nothing in the exit code


@dataclass(frozen=True)
class Finding:
    """One thing about a log.

    Attributes:
        name: a word for programs, such as "gyro_inverted".
        severity: "broken" (the orientation would be wrong), "warning" (it would be worse), "note".
        what: the fact, with its size, in a sentence.
        evidence: the numbers that show it.
        cure: what to do, a sentence; "" if there is nothing to do.
        rows: first and last row that it concerns, or None for all.
        value: the size as a number in ``unit``; None: it has none.
        interval: where the value lies with 95 %.
        unit: of the value; "" for a ratio.
        mend: a repair of the readings; None: no known one.
        sure: False: it is only likely, and so a note.
    """

    name: str
    severity: str
    what: str
    evidence: str
    cure: str = ""
    rows: tuple[int, int] | None = None
    value: float | None = None
    interval: tuple[float, float] | None = None
    unit: str = ""
    mend: Mend | None = None
    sure: bool = True

    def __post_init__(self) -> None:
        if not self.sure:
            object.__setattr__(self, "severity", "note")

    def __str__(self) -> str:
        where = "" if self.rows is None else f" (rows {self.rows[0]} to {self.rows[1]})"
        cure = f" {self.cure}" if self.cure else ""
        return f"{self.severity}: {self.what}{where} [{self.evidence}]{cure}"


class Measurement(NamedTuple):
    """A number that the motion shows of a sensor, whether or not it is a fault.

    Attributes:
        name: that of the finding which a fault would make.
        what: the quantity, in words.
        value: in ``unit``.
        interval: where it lies with 95 %.
        usual: the value of a good sensor.
        unit: "" for a ratio.
    """

    name: str
    what: str
    value: float
    interval: tuple[float, float]
    usual: float
    unit: str = ""

    def __str__(self) -> str:
        unit = "°" if self.unit == "deg" else f" {self.unit}" if self.unit else ""
        digits = {"": 3, "deg/s": 1}.get(self.unit, 0)
        value, low, high = (f"{one:.{digits}f}" for one in (self.value, *self.interval))
        return f"{self.what} {value}{unit} (95 %: {low} to {high})"


@dataclass(frozen=True)
class Report:
    """The examination of one log.

    Attributes:
        source: the path.
        recording: the readings; None if nothing could be read.
        findings: the worst first.
        verdict: one line.
        sigma_tilt, sigma_heading: expected errors of a fused track, deg; None where unknown.
        heading_drift: deg a minute without a magnetometer; None with one.
        unknown: questions that this motion does not answer, sentences.
        measured: numbers that this motion shows, with their intervals.
    """

    source: str
    recording: Recording | None
    findings: Sequence[Finding]
    verdict: str
    sigma_tilt: float | None = None
    sigma_heading: float | None = None
    heading_drift: float | None = None
    unknown: Sequence[str] = field(default_factory=tuple)
    measured: Sequence[Measurement] = field(default_factory=tuple)

    @property
    def exit_code(self) -> int:
        """0: fine; 1: findings; 2: unreadable."""
        if self.recording is None:
            return 2
        return int(any(one.severity != "note" for one in self.findings))

    def names(self) -> set[str]:
        """The names of the findings."""
        return {one.name for one in self.findings}

    def to_dict(self) -> JsonObject:
        """Ready for JSON."""
        rec = self.recording
        read: ReadOnlyJson = {} if rec is None else rec.meta
        return {
            "source": self.source,
            "exit_code": self.exit_code,
            "verdict": self.verdict,
            "samples": None if rec is None else len(rec),
            "duration_s": None if rec is None else rec.duration,
            "rate_hz": None if rec is None else rec.rate,
            "units": dict(read.get("units", {})),
            "notes": list(read.get("notes", ())),
            "sigma_tilt_deg": self.sigma_tilt,
            "sigma_heading_deg": self.sigma_heading,
            "heading_drift_deg_per_min": self.heading_drift,
            "findings": [
                {
                    "name": one.name,
                    "severity": one.severity,
                    "what": one.what,
                    "evidence": one.evidence,
                    "cure": one.cure,
                    "rows": one.rows,
                    "value": one.value,
                    "interval": one.interval,
                    "unit": one.unit,
                    "sure": one.sure,
                }
                for one in self.findings
            ],
            "unknown": list(self.unknown),
            "measured": [one._asdict() for one in self.measured],
        }

    def __str__(self) -> str:
        if self.recording is None:  # the verdict is the reader's sentence, which names the log
            return self.verdict if self.source in self.verdict else f"{self.source}: {self.verdict}"
        lines = [f"{self.source}: {self.verdict}", repr(self.recording)]
        lines += [str(one) for one in self.findings]
        lines += [f"measured: {one}" for one in self.measured]
        lines += [f"not known: {sentence}" for sentence in self.unknown]
        lines += [f"read: {note}" for note in self.recording.meta.get("notes", ())]
        return "\n".join(lines)


def sort_findings(findings: Sequence[Finding]) -> list[Finding]:
    """The worst first; of equals, as they were found."""
    return sorted(findings, key=lambda one: SEVERITIES.index(one.severity))
