"""Jumps of an attitude, and the reading, gap or late discovery from which each comes."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from levelhead.filters import health
from levelhead.guard import Guard
from levelhead.inspection.evidence import RunEvidence, runs
from levelhead.inspection.symptom import Symptom, SymptomKind
from levelhead.inspection.values import find_clipping
from levelhead.recording import Array
from levelhead.units import GRAVITY

MAX_JUMP = 3.0  # deg; clean recordings step by 1.3 at most (docs/reference/symptoms.md)
WITHIN = 1.0  # s, in which an attitude steps away from the smoother's
AFTER = 10.0  # s after a fault in which the filter corrects its error
START = 5.0  # s of a run that do not count: a filter finds its attitude
JOIN = 2.0  # s between two events of one cause that are one
ISOLATED = 0.3  # of a spike: how much the readings before and after it may differ
SPIKE = np.radians(1.0)  # rad that a single reading turns the attitude
AROUND, OUTLYING = 10, 8.0  # samples on either side, and times their median, beyond which a reading is alone
MAX_BRIDGED = 0.1  # s of a missing gyroscope, which the last rate bridges
LEARNED = 0.5  # deg/s by which the bias changes where it is found late
BIAS_TIME = 3.0  # s before a step, where the bias was that with which it came
OFTEN = 20.0  # % of the samples around a step on which the magnetometer is refused
HAND_MOTION = 1.0  # m/s² rms: a hand that moves


class Disturbance(NamedTuple):
    """Rows from ``first`` to before ``last`` at which the rate was wrong; its cause and the words for it."""

    first: int
    last: int
    cause: str
    why: str

    def reach(self, t: Array) -> tuple[int, int]:
        """The row before it, and the one WITHIN seconds after it, when σ has grown by the possible turn."""
        end = int(np.searchsorted(t, t[self.last - 1] + WITHIN))
        return max(self.first - 1, 0), min(end, len(t) - 1)


CURES = {
    "gyr_clipping": "Set a larger full scale, or give it: --guard gyr_range=DEG_S.",
    "gyr_spikes": "Look for a bus or serial line that loses bits, and leave such rows blank.",
    "gap": "Find the cause of the pause; across more than 0.5 s the attitude is held.",
    "gyr_missing": "Find the cause of the lost readings; the last rate is held for 0.5 s.",
    "gyr_stuck": "Look for a bus that hangs; a reset of the sensor helps.",
    "mag_learned": "Keep away from iron and magnets that stay, or leave the magnetometer out: --map mag=.",
    "bias_late": "Put the sensor down for 5 s at the start, or keep the calibration: --save-calibration, --prior.",
    "mag_refused": "Keep away from iron and magnets, or calibrate the magnetometer: levelhead calibrate.",
    "mag_back": "Find the cause of its silence; levelhead smooth uses both sides of the time without it.",
    "no_rest": "Put the sensor down for 5 s at the start.",
    "near_vertical": "Take a filter of quaternions: ESKF, EKF, Mahony.",
    "acceleration": "Let it trust the gyroscope more, or use ESKF, which separates acceleration from gravity.",
    "unknown": "Compare with levelhead smooth, and look at this time in its picture.",
}
FINDINGS = {
    "gyr_clipping": "clipping_gyr",
    "gap": "gaps",
    "gyr_missing": "missing_values",
    "mag_learned": "mag_disturbed",
    "mag_refused": "mag_disturbed",
    "no_rest": "never_still",
}


def find_jumps(evidence: RunEvidence) -> Iterator[Symptom]:
    """A symptom for each cause of jumps, the largest of them first."""
    found: dict[str, list[tuple[float, Disturbance]]] = {}
    for event in find_disturbances(evidence):
        size = _size(evidence, event)
        if size > MAX_JUMP:
            found.setdefault(event.cause, []).append((size, event))
    for size, event in _steps(evidence, [event for events in found.values() for _, event in events]):
        found.setdefault(event.cause, []).append((size, event))
    for cause, events in sorted(found.items(), key=lambda item: -max(size for size, _ in item[1])):
        size, event = max(events, key=lambda one: one[0])
        at = float(evidence.t[event.first])
        many = "jump" if len(events) == 1 else f"{len(events)} jumps, the largest"
        yield Symptom(
            "jump", size, "deg", f"{many} of {size:.0f}° at {at:.1f} s",
            cause, event.why, CURES[cause], at, FINDINGS.get(cause, ""),
        )  # fmt: skip


def find_disturbances(evidence: RunEvidence) -> Iterator[Disturbance]:
    """Everything that made a rate wrong."""
    recording, t = evidence.recording, evidence.t
    clipping = find_clipping("gyr", recording.gyr)
    at_limit = (evidence.track.health & np.uint32(health.GYR_SATURATED)) != 0
    at_limit |= False if clipping is None else clipping.rows
    for first, last in _join(runs(at_limit), t):
        count = int(at_limit[first:last].sum())
        most = np.nanmax(np.abs(recording.gyr[first:last][at_limit[first:last]]), axis=0)
        axis, top = "xyz"[int(most.argmax())], float(np.degrees(most.max()))
        yield Disturbance(
            first, last, "gyr_clipping", f"the gyroscope's {axis} clipped at {top:.4g} °/s for {count} samples"
        )
    for first, last in _join(evidence.runs(health.GYR_STUCK), t):
        length = float(t[last - 1] - t[first])
        words = f"an axis of the gyroscope repeats one value for more than {length:.1f} s"
        yield Disturbance(first, last, "gyr_stuck", words)
    for first, last in evidence.runs(health.GYR_MISSING):
        length = float(t[min(last, len(t) - 1)] - t[first])
        if length > MAX_BRIDGED:
            yield Disturbance(first, last, "gyr_missing", f"the gyroscope is missing for {length:.2g} s")
    for first, last in evidence.runs(health.GAP):
        yield Disturbance(first, last, "gap", f"there is no sample for {t[first] - t[max(first - 1, 0)]:.2g} s")
    for first, last in _join(evidence.runs(health.MAG_LEARNED), t):
        yield Disturbance(first, last, "mag_learned", "a new magnetic field was accepted as the earth's")
    yield from _spikes(evidence)


def _spikes(evidence: RunEvidence) -> Iterator[Disturbance]:
    """Single readings of the gyroscope that no motion explains."""
    rate, t = evidence.recording.gyr, evidence.t
    if len(t) < 3:
        return
    off = np.linalg.norm(rate[1:-1] - 0.5 * (rate[:-2] + rate[2:]), axis=1)
    around = np.linalg.norm(rate[2:] - rate[:-2], axis=1)
    alone = (off * (t[1:-1] - t[:-2]) > SPIKE) & (around < ISOLATED * off)
    for row in np.flatnonzero(alone):
        near = off[max(0, row - AROUND) : row + AROUND + 1]
        if off[row] > OUTLYING * float(np.median(near)):  # of a vibration every reading is off
            words = f"one reading of the gyroscope alone is {np.degrees(off[row]):.0f} °/s off"
            yield Disturbance(int(row) + 1, int(row) + 2, "gyr_spikes", words)


def _join(stretches: list[tuple[int, int]], t: Array) -> list[tuple[int, int]]:
    """Stretches that follow each other within JOIN seconds as one."""
    made: list[tuple[int, int]] = []
    for first, last in stretches:
        if made and t[first] - t[made[-1][1] - 1] < JOIN:
            made[-1] = (made[-1][0], last)
        else:
            made.append((first, last))
    return made


def _size(evidence: RunEvidence, event: Disturbance) -> float:
    """Degrees: a spike's own turn; else the filter's later correction or, if larger, the smoother's."""
    t = evidence.t
    if event.cause == "gyr_spikes":
        rate, row = evidence.recording.gyr, event.first
        off = np.linalg.norm(rate[row] - 0.5 * (rate[row - 1] + rate[row + 1]))
        return float(np.degrees(off * (t[row] - t[row - 1])))
    end = max(event.last, int(np.searchsorted(t, t[event.last - 1] + AFTER)))
    taken_back = evidence.corrections[event.last - 1 : end] - evidence.corrections[event.last - 1]
    total = evidence.distance
    before = total[max(0, int(np.searchsorted(t, t[event.first] - WITHIN))) : event.first + 1].max()
    away = float(total[event.first : end].max() - before)
    return min(180.0, float(np.degrees(max(np.linalg.norm(taken_back, axis=1).max(), away))))


def _steps(evidence: RunEvidence, known: list[Disturbance]) -> Iterator[tuple[float, Disturbance]]:
    """Steps away from the smoother, or back to it, that none of the known events explains."""
    t, total = evidence.t, np.degrees(evidence.distance)
    reach = max(1, round(WITHIN * evidence.recording.rate))
    if len(t) <= reach:
        return
    step = np.concatenate([np.abs(total[reach:] - total[:-reach]), np.zeros(reach)])
    large = (step > MAX_JUMP) & (t > START)
    for event in known:
        large[max(0, event.first - reach) : int(np.searchsorted(t, t[event.last - 1] + AFTER))] = False
    for first, last in _join(runs(large), t):
        top = first + int(step[first:last].argmax())
        yield float(step[top]), Disturbance(top, top + 1, *next(_causes_of_step(evidence, top)))


def _causes_of_step(evidence: RunEvidence, row: int) -> Iterator[tuple[str, str]]:
    """Causes of a step without an event, and words for them; the first one counts."""
    t, bias, name = evidence.t, evidence.track.bias, evidence.track.name
    first, last = (int(one) for one in np.searchsorted(t, [t[row] - BIAS_TIME, t[row] + BIAS_TIME]))
    bits = evidence.track.health[first:last]
    if evidence.by_angles and (bits & np.uint32(health.NEAR_VERTICAL)).any():
        yield "near_vertical", f"pitch is near ±90°, where roll and yaw of {name} are not defined"
    change = 0.0 if bias is None else float(np.degrees(np.linalg.norm(bias[-1] - bias[first])))
    if change > LEARNED:
        yield "bias_late", f"the gyroscope's bias was not known yet: its estimate was {change:.1f} °/s off the last one"
    silent = [end for _, end in evidence.unseen if first < end < last]
    if silent:
        yield "mag_back", f"the magnetometer comes back at {t[silent[0]]:.1f} s and corrects heading"
    refused = 100.0 * float(((bits & np.uint32(health.MAG_REJECTED)) != 0).mean())
    if refused > OFTEN:
        words = f"is refused on {refused:.0f} % of the samples around, as strength or dip are not those of the field"
        yield "mag_refused", f"the magnetometer {words}"
    force = np.linalg.norm(evidence.recording.acc[first:last], axis=1)
    off = float(np.sqrt(np.nanmean((force - GRAVITY) ** 2)))
    if evidence.is_plain and off > HAND_MOTION:
        yield "acceleration", f"the specific force is {off:.1f} m/s² off g there (rms), and {name} treats it as gravity"
    if "gyr" in evidence.uses and evidence.recording.mag is None and evidence.longest_rest < Guard().rest_time:
        yield "no_rest", "neither a magnetometer nor a rest measured the gyroscope's bias, which is still being learned"
    yield "unknown", "no reading in the log explains it"


JUMP = SymptomKind(
    name="jump",
    unit="deg",
    measure="the turn of a single wrong reading, or the angle that the filter takes back within 10 s after a fault, or "
    "a step of 1 s away from the smoother; the first 5 s do not count",
    bound=f"{MAX_JUMP:g}°",
    absent="does not jump",
    colour="#D55E00",
    find=find_jumps,
)
