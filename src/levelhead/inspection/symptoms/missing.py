"""Readings that are missing, and turns that the gyroscope did not measure."""

from collections.abc import Iterator

from levelhead.filters import health
from levelhead.inspection.evidence import RunEvidence
from levelhead.inspection.symptom import Symptom, SymptomKind

MAX_MISSING = 0.5  # % of the samples
MAX_TURN_MISSED = 0.5  # s of turns that were not measured
SENSORS = {
    health.GYR_MISSING: "gyroscope",
    health.ACC_MISSING: "accelerometer",
}


def find_missing(evidence: RunEvidence) -> Iterator[Symptom]:
    """Readings that are NaN or blank: the track goes on without them."""
    for bit, name in SENSORS.items():
        stretches = evidence.runs(bit)
        count = sum(last - first for first, last in stretches)
        share = 100.0 * count / len(evidence.t)
        if share <= MAX_MISSING:
            continue
        first, last = max(stretches, key=lambda one: one[1] - one[0])
        longest = float(evidence.t[min(last, len(evidence.t) - 1)] - evidence.t[first])
        yield Symptom(
            "missing", longest, "s", f"the {name} is NaN or blank on {share:.2g} % of the samples", "missing_readings",
            f"{count} samples, the longest stretch {longest:.2g} s at {evidence.t[first]:.1f} s",
            "The track never is NaN: the last rate is held for 0.5 s, and σ grows. Find the cause of the loss.",
            float(evidence.t[first]), "missing_values",
        )  # fmt: skip


def find_turns_missed(evidence: RunEvidence) -> Iterator[Symptom]:
    """Turns that the gyroscope did not measure, by the filter's own health bit."""
    stretches = evidence.runs(health.TURN_MISSED)
    seconds = sum(float(evidence.t[last - 1] - evidence.t[first]) for first, last in stretches)
    if seconds < MAX_TURN_MISSED:
        return
    first, _ = max(stretches, key=lambda one: one[1] - one[0])
    yield Symptom(
        "missing", seconds, "s", f"for {seconds:.1f} s the sensor turned by more than its gyroscope measured",
        "turn_missed",
        f"{evidence.track.name} sets its bit turn_missed, the longest time at {evidence.t[first]:.1f} s: tilt and "
        "velocity do not fit the rates",
        "Check wiring, rate and full scale of the gyroscope; σ is wide there, and the attitude comes back by itself.",
        float(evidence.t[first]), "",
    )  # fmt: skip


MISSING = SymptomKind(
    name="missing",
    unit="s",
    measure="NaN or blank readings of gyroscope or accelerometer; the track itself never is NaN",
    bound=f"{MAX_MISSING:g} % of the samples",
    absent="misses no readings",
    colour="#8C8C8C",
    find=find_missing,
    find_if_alone=find_turns_missed,
)
