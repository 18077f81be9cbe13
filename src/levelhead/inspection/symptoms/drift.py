"""Heading that nothing holds."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from levelhead.filters import health
from levelhead.guard import Guard
from levelhead.inspection.evidence import RunEvidence
from levelhead.inspection.symptom import Symptom, SymptomKind
from levelhead.inspection.symptoms.jump import CURES, FINDINGS, MAX_JUMP, START, Disturbance, find_disturbances

MAX_DRIFT = 4.0  # deg a minute; a bias read off at rest leaves 2.5 at most (docs/reference/symptoms.md)
REST = Guard().rest_time  # s after which a bias is read off


def find_drift(evidence: RunEvidence) -> Iterator[Symptom]:
    """Heading that nothing holds: no magnetometer, or one that is refused or silent for long."""
    t = evidence.t
    if "gyr" not in evidence.uses:
        return
    steady = _steady(evidence)
    if evidence.recording.mag is None or "mag" not in evidence.uses:
        rate = _growth(evidence, steady, int(np.searchsorted(t, START)), len(t))
        if rate > MAX_DRIFT:
            yield _unheld(evidence, rate)
        yield from _heading_lost(evidence)
        return
    rates = [(_growth(evidence, steady, first, last), first, last) for first, last in evidence.unseen]
    rate, first, last = max(rates, default=(0.0, 0, 1))
    if rate <= MAX_DRIFT:
        return
    refused = evidence.track.health[first:last] & np.uint32(health.MAG_REJECTED)
    share = float(np.mean(refused != 0))
    length = float(t[last - 1] - t[first])
    where = f"from {t[first]:.0f} to {t[last - 1]:.0f} s"
    if share > 0.5:
        yield Symptom(
            "drift", rate, "deg/min", f"heading drifts about {rate:.0f}° a minute {where}", "mag_refused",
            f"the magnetometer is refused for {length:.0f} s, as strength or dip are not those of the field",
            "Keep away from iron and magnets, or calibrate the magnetometer: levelhead calibrate.",
            float(t[first]), "mag_disturbed",
        )  # fmt: skip
    else:
        yield Symptom(
            "drift", rate, "deg/min", f"heading drifts about {rate:.0f}° a minute {where}", "mag_missing",
            f"the magnetometer gives nothing for {length:.0f} s", "Find the cause of the lost readings.",
            float(t[first]), "missing_values",
        )  # fmt: skip


def _steady(evidence: RunEvidence) -> NDArray[np.bool_]:
    """(n − 1,) intervals in which the rate itself was right; in the others heading is lost at once."""
    steady = np.ones(len(evidence.t) - 1, dtype=np.bool_)
    for event in find_disturbances(evidence):
        begin, end = event.reach(evidence.t)
        steady[begin:end] = False
    return steady


def _growth(evidence: RunEvidence, steady: NDArray[np.bool_], first: int, last: int) -> float:
    """Degrees a minute by which heading may go astray between two rows: by its σ, or away from the smoother."""
    rows = np.arange(len(steady))
    steady = steady & (rows >= first) & (rows < last - 1)
    seconds = float(np.diff(evidence.t)[steady].sum())
    if seconds < START:
        return 0.0
    astray = abs(float(np.diff(evidence.difference.heading)[steady].sum()))
    sigma = evidence.track.sigma_heading
    if sigma is not None and sigma[first] > 0.0:
        astray = max(astray, float(np.sqrt(max(np.diff(sigma**2)[steady].sum(), 0.0))))
    return float(np.degrees(astray)) / (seconds / 60.0)


def _heading_lost(evidence: RunEvidence) -> Iterator[Symptom]:
    """Times at which the rate was wrong, and σ of heading grew at once by the possible turn meanwhile."""
    sigma = evidence.track.sigma_heading
    if sigma is None:
        return
    lost: dict[str, list[tuple[float, Disturbance]]] = {}
    for event in find_disturbances(evidence):
        begin, end = event.reach(evidence.t)
        grown = float(np.degrees(np.sqrt(max(sigma[end] ** 2 - sigma[begin] ** 2, 0.0))))
        lost.setdefault(event.cause, []).append((grown, event))
    for cause, events in lost.items():
        size = float(np.linalg.norm([grown for grown, _ in events]))
        if size <= MAX_JUMP:
            continue
        _, event = max(events, key=lambda one: one[0])
        at = float(evidence.t[event.first])
        when = f"at {at:.1f} s" if len(events) == 1 else f"at {len(events)} times, most at {at:.1f} s"
        yield Symptom(
            "drift", size, "deg", f"σ of heading grows by {size:.0f}° {when}", cause,
            f"{event.why}; without a magnetometer nothing measured how far it turned meanwhile", CURES[cause], at,
            FINDINGS.get(cause, ""),
        )  # fmt: skip


def _unheld(evidence: RunEvidence, rate: float) -> Symptom:
    """A drift without a magnetometer: whether the bias could be read off, and whether it stayed."""
    recording, longest = evidence.recording, evidence.longest_rest
    what = f"heading drifts about {rate:.0f}° a minute"
    none = "no magnetometer" if recording.mag is None else f"{evidence.track.name} uses no magnetometer"
    if "bias_runs" in evidence.findings:
        return Symptom(
            "drift", rate, "deg/min", what, "bias_runs", f"{none}, and {evidence.findings['bias_runs'].what}",
            evidence.findings["bias_runs"].cure, None, "bias_runs",
        )  # fmt: skip
    if longest < REST:
        rests = f"the longest rest is {longest:.1f} s" if longest > 0.0 else "there is no rest"
        return Symptom(
            "drift", rate, "deg/min", what, "no_rest",
            f"{none}, and the gyroscope's bias could not be read off: {rests}, {REST:g} s are needed",
            "Put the sensor down for 5 s at the start.", None,
            "never_still",
        )  # fmt: skip
    return Symptom(
        "drift", rate, "deg/min", what, "no_magnetometer",
        f"{none}; rests of {longest:.0f} s at most read the bias off, and it does not stay as it was",
        "Let the sensor rest more often, or add a magnetometer.",
    )  # fmt: skip


DRIFT = SymptomKind(
    name="drift",
    unit="deg/min",
    measure="heading that nothing holds: the growth of its σ, or its distance from the smoother, per minute. Without a "
    "magnetometer it is measured over the whole log, else over 10 s and more without a reading that was used. Times of "
    "a wrong rate count by themselves: the growth of σ from their start to 1 s after them",
    bound=f"{MAX_DRIFT:g}° a minute; {MAX_JUMP:g}° at a wrong rate",
    absent="does not drift",
    colour="#0072B2",
    find=find_drift,
)
