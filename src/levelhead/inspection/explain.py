"""Explains a log: what its track shows, from which cause, and what to do.

Drift, jitter and lag are measured beside the smoother, which knows the whole recording; missing readings and jumps are
traced to rows of the log. Causes are shared with the doctor: a symptom names the finding that shows the same.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from levelhead.engine import fuse, smooth
from levelhead.errors import LevelheadError
from levelhead.evaluate.lag import lag
from levelhead.filters import health
from levelhead.filters.parameters import FilterChoice
from levelhead.guard import Guard
from levelhead.inspection import list_findings
from levelhead.inspection.behaviour import find_delay
from levelhead.inspection.evidence import RunEvidence
from levelhead.inspection.jumps import CURES, FINDINGS, JUMP, START, Disturbance, find_disturbances, find_jumps
from levelhead.inspection.spectrum import SLOWEST, SpectralLine, lines, spectrum
from levelhead.inspection.symptom import Explanation, Symptom
from levelhead.recording import Array, Recording

SHORTEST = 10.0  # s of a recording in which something can be seen
DRIFT = 4.0  # deg a minute; a bias read off at rest leaves 2.5 at most (docs/explain.md)
REST = Guard().rest_time  # s after which a bias is read off
OWN = 0.5  # of the jitter: with less the filter does not make it
JITTER = 0.3  # deg rms above SLOWEST; a fast hand has 0.13
PIECE = 256  # samples that are looked at together
LASTING = 0.2  # share of pieces that must tremble: a jump shakes one or two
SAME_LINE = 1.5  # Hz between a line of the track and one of a sensor
LAG, LAG_SAMPLES = 0.010, 1.5  # s, and samples
MISSING = 0.5  # % of the samples
MISSED = 0.5  # s of turns that were not measured
NAMES = {
    health.GYR_MISSING: "gyroscope",
    health.ACC_MISSING: "accelerometer",
}


def explain(
    recording: Recording, params: FilterChoice | None = None, *, guard: Guard | None = None, source: str = ""
) -> Explanation:
    """Runs a filter and the smoother over a recording and explains what the filter's track shows.

    Args:
        recording: 10 s or more.
        params: the filter; None: the default.
        guard: in front of it; None: the default one.
        source: the log's name.

    Raises:
        LevelheadError: the recording is too short.
    """
    if recording.duration < SHORTEST:
        raise LevelheadError(
            f"the recording is {recording.duration:.3g} s long; expected {SHORTEST:g} s or more to explain"
        )
    before = Guard() if guard is None else guard
    findings = list_findings(recording)
    evidence = RunEvidence(
        recording, fuse(recording, params, guard=before), smooth(recording), {one.name: one for one in findings}
    )
    with np.errstate(all="ignore"):
        symptoms = [
            *_missing(evidence), *find_jumps(evidence), *_drift(evidence), *_jitter(evidence), *_lag(evidence),
        ]  # fmt: skip
        if not symptoms:  # else what made the turn go unmeasured is told already
            symptoms = list(_turns_missed(evidence))
    symptoms = [one if one.finding in evidence.findings else replace(one, finding="") for one in symptoms]
    told = {one.finding for one in symptoms}
    others = [one for one in findings if one.severity != "note" and one.name not in told]
    return Explanation(source or str(recording.meta.get("source", "")), evidence, symptoms, others)


def _missing(evidence: RunEvidence) -> Iterator[Symptom]:
    """Readings that are NaN or blank: the track goes on without them."""
    for bit, name in NAMES.items():
        stretches = evidence.runs(bit)
        count = sum(last - first for first, last in stretches)
        share = 100.0 * count / len(evidence.t)
        if share <= MISSING:
            continue
        first, last = max(stretches, key=lambda one: one[1] - one[0])
        longest = float(evidence.t[min(last, len(evidence.t) - 1)] - evidence.t[first])
        yield Symptom(
            "missing", longest, "s", f"the {name} is NaN or blank on {share:.2g} % of the samples", "missing_readings",
            f"{count} samples, the longest stretch {longest:.2g} s at {evidence.t[first]:.1f} s",
            "The track never is NaN: the last rate is held for 0.5 s, σ says what that costs; find what loses them.",
            float(evidence.t[first]), "missing_values",
        )  # fmt: skip


def _turns_missed(evidence: RunEvidence) -> Iterator[Symptom]:
    """Turns that the gyroscope did not measure, as the filter's own health bit says."""
    stretches = evidence.runs(health.TURN_MISSED)
    seconds = sum(float(evidence.t[last - 1] - evidence.t[first]) for first, last in stretches)
    if seconds < MISSED:
        return
    first, _ = max(stretches, key=lambda one: one[1] - one[0])
    yield Symptom(
        "missing", seconds, "s", f"for {seconds:.1f} s the sensor turned by more than its gyroscope said",
        "turn_missed",
        f"{evidence.track.name} sets its bit turn_missed, the longest time at {evidence.t[first]:.1f} s: tilt and "
        "velocity do not fit the rates",
        "Check wiring, rate and full scale of the gyroscope; σ is wide there, and the attitude comes back by itself.",
        float(evidence.t[first]), "",
    )  # fmt: skip


def _drift(evidence: RunEvidence) -> Iterator[Symptom]:
    """Heading that nothing holds: no magnetometer, or one that is refused or silent for long."""
    t = evidence.t
    if "gyr" not in evidence.uses:
        return
    steady = _steady(evidence)
    if evidence.recording.mag is None or "mag" not in evidence.uses:
        rate = _growth(evidence, steady, int(np.searchsorted(t, START)), len(t))
        if rate > DRIFT:
            yield _unheld(evidence, rate)
        yield from _heading_lost(evidence)
        return
    rates = [(_growth(evidence, steady, first, last), first, last) for first, last in evidence.unseen]
    rate, first, last = max(rates, default=(0.0, 0, 1))
    if rate <= DRIFT:
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
            f"the magnetometer gives nothing for {length:.0f} s", "Find what loses its readings.",
            float(t[first]), "missing_values",
        )  # fmt: skip


def _steady(evidence: RunEvidence) -> NDArray[np.bool_]:
    """(n − 1,) intervals in which the rate itself was right: what is lost in others is lost at once, not by and by."""
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
    """Times at which the rate was wrong, and σ of heading grew at once by what may have been turned meanwhile."""
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
        if size <= JUMP:
            continue
        _, event = max(events, key=lambda one: one[0])
        at = float(evidence.t[event.first])
        when = f"at {at:.1f} s" if len(events) == 1 else f"at {len(events)} times, most at {at:.1f} s"
        yield Symptom(
            "drift", size, "deg", f"σ of heading grows by {size:.0f}° {when}", cause,
            f"{event.why}; without a magnetometer nothing tells how far it turned meanwhile", CURES[cause], at,
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


def _jitter(evidence: RunEvidence) -> Iterator[Symptom]:
    """Attitude that trembles faster than people move, and the line of a sensor that makes it."""
    rate = evidence.recording.rate
    pieces = None if rate < 4.0 * SLOWEST else _angle_density(evidence)
    if pieces is None:
        return
    frequency, power = pieces
    sizes = np.degrees(np.sqrt(power.sum(axis=1) * frequency[1]))
    size = float(np.quantile(sizes, 1.0 - LASTING))
    if size <= JITTER:
        return
    peak = float(frequency[int(np.median(power[sizes >= size], axis=0).argmax())])
    for role, name in (("gyr", "gyroscope"), ("acc", "accelerometer")):
        line = _line_near(np.asarray(getattr(evidence.recording, role)), rate, peak)
        if line is not None:
            unit, factor = ("°/s", 180.0 / np.pi) if role == "gyr" else ("m/s²", 1.0)
            yield Symptom(
                "jitter", size, "deg", f"attitude jitters by {size:.1g}° at {peak:.0f} Hz", "vibration",
                f"the {name} vibrates at {line.frequency:.0f} Hz ({factor * line.rms:.2g} {unit} rms)",
                "Mount it softer, or switch on the sensor's low-pass filter.", None, f"vibration_{role}",
            )  # fmt: skip
            return
    name = evidence.track.name
    beside = float(np.degrees(np.sqrt(np.mean(np.sum(np.diff(evidence.corrections, axis=0) ** 2, axis=1)))))
    what = f"attitude jitters by {size:.1g}° above {SLOWEST:g} Hz"
    # Turns of independent samples add up to an angle whose density falls as 1/f²; this is its rms above SLOWEST.
    if beside * np.sqrt(rate / (2.0 * np.pi**2 * SLOWEST)) < OWN * size:
        yield Symptom(
            "jitter", size, "deg", what, "shaking",
            f"the gyroscope itself measures it, at no single frequency: {name} turns by {beside:.1g}° rms beside it",
            "A body that shakes, such as a phone on somebody who runs, moves so; else mount the sensor tighter.",
        )  # fmt: skip
        return
    yield Symptom(
        "jitter", size, "deg", what, "noise",
        f"no sensor has a line there; {name} is turned by {beside:.1g}° rms at every sample beside the gyroscope",
        "Let it trust the gyroscope more, or take a filter that does, such as ESKF.",
    )  # fmt: skip


def _angle_density(evidence: RunEvidence) -> tuple[Array, Array] | None:
    """Frequencies in Hz (k,) and density of the angle in rad²/Hz (m, k) above SLOWEST, for pieces of the track.

    The angle's density is that of the rate over (2πf)². None: it is too short for a piece.
    """
    turns, rate = evidence.turns, evidence.recording.rate
    vector = 2.0 * turns[:, 1:] * np.where(turns[:, :1] < 0.0, -1.0, 1.0) * rate
    count = len(vector) // PIECE
    if count == 0:
        return None
    window = np.hanning(PIECE)
    sound = np.ones(len(vector), dtype=np.bool_)
    for event in find_disturbances(evidence):  # what they do is a jump
        sound[max(0, event.first - 1) : event.last + PIECE] = False
    whole = sound[: count * PIECE].reshape(count, PIECE).all(axis=1)
    if not whole.any():
        return None
    parts = vector[: count * PIECE].reshape(count, PIECE, 3)[whole]
    parts = (parts - parts.mean(axis=1, keepdims=True)) * window[:, None]
    frequency: Array = np.asarray(np.fft.rfftfreq(PIECE, 1.0 / rate), dtype=np.float64)
    density = 2.0 * (np.abs(np.fft.rfft(parts, axis=1)) ** 2).sum(axis=2) / (rate * float((window**2).sum()))
    power: Array = np.where(frequency > SLOWEST, density / np.maximum((2.0 * np.pi * frequency) ** 2, 1.0), 0.0)
    return frequency, power


def _line_near(values: Array, rate: float, frequency: float) -> SpectralLine | None:
    found = spectrum(values, rate)
    near = [] if found is None else [one for one in lines(found, 0.0) if abs(one.frequency - frequency) < SAME_LINE]
    return near[0] if near else None


def _lag(evidence: RunEvidence) -> Iterator[Symptom]:
    """A track that trails: because the gyroscope does, or because the filter is slow beside the smoother."""
    recording, name = evidence.recording, evidence.track.name
    if "sensor_delay" in evidence.findings and (found := find_delay(recording)) is not None and found.delay < 0.0:
        size = -1e3 * found.delay
        yield Symptom(
            "lag", size, "ms", f"attitude comes {size:.0f} ms late", "sensor_delay",
            f"so much later than the accelerometer comes the gyroscope, ±{1e3 * found.sigma:.0f} ms",
            "Give both sensors one filter and one clock.", None, "sensor_delay",
        )  # fmt: skip
        return
    late = lag(recording.t, evidence.track.quat, evidence.smoothed.quat, evidence.t > START, with_heading=False)
    if late is not None and late >= max(LAG, LAG_SAMPLES / recording.rate):
        yield Symptom(
            "lag", 1e3 * late, "ms", f"tilt comes {1e3 * late:.0f} ms late", "slow_filter",
            f"{name} follows its sensors slowly; the smoother on the same readings does not trail",
            "Let it trust the gyroscope more and smooth the accelerometer less, or take ESKF.",
        )  # fmt: skip
