"""A track that trails."""

from collections.abc import Iterator

from levelhead.evaluate.lag import lag
from levelhead.inspection.evidence import RunEvidence
from levelhead.inspection.symptom import Symptom, SymptomKind
from levelhead.inspection.symptoms.jump import START

MAX_LAG, MAX_LAG_SAMPLES = 0.010, 1.5  # s, and samples


def find_lag(evidence: RunEvidence) -> Iterator[Symptom]:
    """A track that trails: because the gyroscope does, or because the filter is slow beside the smoother."""
    recording, name = evidence.recording, evidence.track.name
    found = evidence.findings.get("sensor_delay")
    if found is not None and found.value is not None and found.value < 0.0:
        size = -found.value
        yield Symptom(
            "lag", size, "ms", f"attitude comes {size:.0f} ms late", "sensor_delay",
            f"{found.what}, {found.evidence}",
            "Give both sensors one filter and one clock.", None, "sensor_delay",
        )  # fmt: skip
        return
    late = lag(recording.t, evidence.track.quat, evidence.smoothed.quat, evidence.t > START, with_heading=False)
    if late is not None and late >= max(MAX_LAG, MAX_LAG_SAMPLES / recording.rate):
        yield Symptom(
            "lag", 1e3 * late, "ms", f"tilt comes {1e3 * late:.0f} ms late", "slow_filter",
            f"{name} follows its sensors slowly; the smoother on the same readings does not trail",
            "Let it trust the gyroscope more and smooth the accelerometer less, or take ESKF.",
        )  # fmt: skip


LAG = SymptomKind(
    name="lag",
    unit="ms",
    measure="the time by which the track trails the smoother, or the gyroscope the accelerometer",
    bound=f"{1e3 * MAX_LAG:g} ms and {MAX_LAG_SAMPLES:g} samples",
    absent="does not lag",
    colour="#E69F00",
    find=find_lag,
)
