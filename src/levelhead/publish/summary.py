"""A recording and its track in at most twenty lines of plain text, as ``levelhead fuse`` prints them."""

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from levelhead import filters, rotations
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.filters import health
from levelhead.filters.parameters import Params, param_table
from levelhead.guard import Guard
from levelhead.recording import Array, Recording, median
from levelhead.signals.hard_iron import hard_iron
from levelhead.track import Track

if TYPE_CHECKING:
    from levelhead.evaluate import Score

LINES = 18  # of a summary that is not verbose; the command adds two: the picture and the files written
KINDS = 3  # of faults that it names
NOTES = 2  # of the reader that it repeats
ADVICE = {  # health bit -> advice
    health.GYR_MISSING: "check the logger",
    health.ACC_MISSING: "check the logger",
    health.GAP: "check the logger: orientation is lost where the body turned in a gap",
    health.NEAR_VERTICAL: "use quaternions there, not roll and yaw",
    health.GYR_SATURATED: "choose a larger full scale",
    health.ACC_SATURATED: "choose a larger full scale",
    health.GYR_SPIKE: "check the wiring of the bus",
    health.GYR_STUCK: "check wiring and chip",
    health.ACC_STUCK: "check wiring and chip",
    health.MAG_REJECTED: "move away from iron and currents",
    health.IRON_FOUND: "`levelhead calibrate LOG --magnetometer` keeps it from the start",
    health.MAG_LEARNED: "heading before and after may differ",
    health.AID_REJECTED: "check the σ of the receiver or barometer",
    health.TURN_MISSED: "check wiring, rate and full scale of the gyroscope",
}
FEW_READINGS = 10  # of a magnetometer, for its usual interval
SLOW = 3.0  # usual intervals after which readings of a magnetometer are missing
LONG_GAP = 3.0  # sample intervals: a longer step in time is called a gap


def summary(
    recording: Recording,
    track: Track,
    score: "Score | None" = None,
    guard: Guard | None = DEFAULT_GUARD,
    *,
    verbose: bool = False,
    notes: Sequence[str] = (),
) -> str:
    """Plain text, one fact a line: input, filter, final orientation, its σ, faults, and what to do about them.

    Without ``verbose`` it has at most ``LINES`` lines: kinds of faults and notes beyond ``KINDS`` and ``NOTES`` are
    counted, and the filter's parameters and the calibration are left out.

    Args:
        recording: the sensors.
        track: the orientation that a filter made of them.
        score: its errors, if there is truth (``levelhead.evaluate.evaluate``).
        guard: the guard in front of the filter; None: there was none.
        verbose: every parameter, every learned number, every kind of fault, every note.
        notes: sentences of the reader of the log.
    """
    lines_of_facts = [
        ("recording", _recording(recording)),
        *_filter(track.params, verbose),
        ("guard", _guard(guard)),
        ("end", _end(track)),
        ("σ at the end", _sigma(track)),
        ("north", north_sentence(track)),
        ("largest tilt", _largest_tilt(track) if verbose else ""),
        ("bias", _bias(track)),
        *_calibration(track, verbose),
        *_iron(recording, track),
        ("at rest", _rest(track)),
        *_health(track, verbose),
        *_score(score, verbose),
        *_notes(notes, verbose),
    ]
    width = max(len(name) for name, _ in lines_of_facts)
    lines, last = [], ""
    for name, text in lines_of_facts:
        if text:
            lines.append(f"{'' if name == last else name:<{width}}  {text}")
            last = name
    return re.sub(r" -(?=[\d.])", " −", "\n".join(lines))


def facts(
    recording: Recording, track: Track, score: "Score | None" = None, guard: Guard | None = DEFAULT_GUARD
) -> dict[str, object]:
    """The same facts for programs, ready for JSON: units in the names, None for a missing value."""
    from levelhead.evaluate.compare import COLUMNS  # with all of `evaluate`, which the words need only for a score

    flt, iron = filters.of(track.params), hard_iron(recording)
    angles = tilt_angles(track)
    row = int(np.nanargmax(angles))
    degrees = {"roll_deg": 0, "pitch_deg": 1, "yaw_deg": 2}
    end = track.euler()[-1]
    return {
        "samples": len(recording),
        "duration_s": recording.duration,
        "rate_hz": recording.rate,
        "incomplete_samples": int((~recording.valid).sum()),
        "magnetometer": recording.mag is not None,
        "magnetometer_offset_uT": iron.offset.tolist() if iron is not None and iron.clear else None,
        "notes": list(recording.meta.get("notes", ())),
        "filter": flt.name,
        "params": {} if track.params is None else dict(track.params._asdict()),
        "guard": None if guard is None else dict(guard._asdict()),
        "declination_deg": None if track.declination is None else math.degrees(track.declination),
        "north": north_facts(track),
        "end": {name: float(end[i]) for name, i in degrees.items()} | {"quat_wxyz": track.quat[-1].tolist()},
        "largest_tilt_deg": float(np.degrees(angles[row])),
        "bias_rad_s": None if track.bias is None else track.bias[-1].tolist(),
        "sigma_east_north_up_rad": None if track.sigma is None else track.sigma[-1].tolist(),
        "calibration": None if track.calibration is None else track.calibration.to_dict(),
        "at_rest": rest_share(track),
        "health": {health.NAMES[bit]: count for bit, count in health_counts(track).items()},
        "score": None if score is None else score.to_dict(),
        "score_units": {column.key: column.unit for column in COLUMNS if column.unit},
    }


def health_counts(track: Track) -> dict[int, int]:
    """Health bit -> number of samples that carry it, the most frequent first; bits that none carries are left out.

    Rest is not a fault and is not counted here (``rest_share``).
    """
    faults = [bit for bit in health.NAMES if bit & health.FAULTS]
    counts = {bit: int(np.count_nonzero(track.health & np.uint32(bit))) for bit in faults}
    counts[health.MAG_MISSING] = _missing_mag(track)
    return dict(sorted(((bit, n) for bit, n in counts.items() if n), key=lambda item: -item[1]))


def _missing_mag(track: Track) -> int:
    """Samples without a magnetometer reading, beyond those of a magnetometer that is slower than the other sensors."""
    present = np.flatnonzero((track.health & np.uint32(health.MAG_MISSING)) == 0)
    missing = len(track) - len(present)
    if len(present) < FEW_READINGS:
        return missing
    steps = np.diff(present)
    usual = float(np.percentile(steps, 75.0))  # samples per reading
    if usual <= 1.0:
        return missing
    return int((steps[steps > SLOW * usual] - 1).sum())


def rest_share(track: Track) -> float:
    """Share of the samples at rest, 0 to 1."""
    return float(np.mean(track.health & np.uint32(health.AT_REST) != 0))


def _recording(recording: Recording) -> str:
    parts = [_count(len(recording), "sample"), f"{recording.duration:.6g} s", f"{recording.rate:.5g} Hz"]
    sensors = ["gyroscope", "accelerometer"] + (["magnetometer"] if recording.mag is not None else [])
    parts.append(" + ".join(sensors))
    steps = np.diff(recording.t)
    if len(steps):
        long = steps > LONG_GAP * median(steps)
        if long.any():
            parts.append(f"{_count(int(long.sum()), 'gap')} (longest {steps.max():.3g} s)")
    missing = int((~recording.valid).sum())
    if missing:
        parts.append(f"{_count(missing, 'incomplete sample')} ({100 * missing / len(recording):.2g} %)")
    return ", ".join(parts)


def _filter(params: Params | None, verbose: bool) -> list[tuple[str, str]]:
    """The filter with the parameters that differ from its defaults; verbose: all of them with units."""
    if params is None:
        return []
    if not verbose:
        return [("filter", filters.title(params))]
    values = []
    for name, param in param_table(type(params)).items():
        value = getattr(params, name)
        values.append(f"{name} = {value}" if isinstance(value, bool) else f"{name} = {value:g} {param.unit}".rstrip())
    facts = [("filter", filters.of(params).name)]
    facts += [("parameters", ", ".join(values[i : i + 4])) for i in range(0, len(values), 4)]
    return facts


def _guard(guard: Guard | None) -> str:
    """The thresholds that differ from the default; "" if none does."""
    if guard is None:
        return "off: every reading reached the filter"
    return "" if guard == DEFAULT_GUARD else repr(guard)


def north_facts(track: Track) -> dict[str, object]:
    """The azimuth of magnetic north, its 1σ, and the reference of heading, for JSON."""
    reference = "start" if track.relative else "magnetic north" if track.declination is None else "true north"
    azimuth, sigma = (None, None) if track.north is None else map(math.degrees, track.north)
    return {"azimuth_deg": azimuth, "sigma_deg": sigma, "heading_relative_to": reference}


def north_sentence(track: Track) -> str:
    """Where magnetic north lies with its σ, and whether heading is relative to it."""
    north = track.north
    doubt = "" if north is None else f", σ {math.degrees(north.sigma):.2g}°"
    if track.declination is not None:
        degrees = math.degrees(track.declination)
        side = "east" if degrees >= 0.0 else "west"
        return f"true; magnetic north lies {abs(degrees):.6g}° {side} of it (declination){doubt}"
    if north is not None and not north.known:
        return f"not found{doubt}: heading is relative to the start; turn the sensor all the way round, and over"
    if not track.relative:
        return f"magnetic, where yaw is 90°{doubt}"
    if north is None:
        return "unknown: heading is relative to the start"
    yaw = (90.0 - math.degrees(north.azimuth) + 180.0) % 360.0 - 180.0
    return f"magnetic, where yaw is {yaw:.1f}°{doubt}: heading is relative to the start"


def _rest(track: Track) -> str:
    share = rest_share(track)
    return f"{100 * share:.2g} % of the time, where the bias was measured" if share else ""


def _end(track: Track) -> str:
    roll, pitch, yaw = (
        round(float(angle), 2) + 0.0 for angle in Track(track.t[-1:], track.quat[-1:]).euler()[-1]
    )  # no minus before 0.00
    return f"roll {roll:.2f}°, pitch {pitch:.2f}°, yaw {yaw:.2f}° at {track.t[-1]:.6g} s"


def tilt_angles(track: Track) -> Array:
    """(n,) angle in rad between the sensor's z axis and the vertical."""
    return rotations.tilt(track.quat)


def _largest_tilt(track: Track) -> str:
    angles = tilt_angles(track)
    if np.isnan(angles).all():
        return ""
    row = int(np.nanargmax(angles))
    return f"{math.degrees(angles[row]):.2f}° at {track.t[row]:.6g} s"


def _bias(track: Track) -> str:
    if track.bias is None:
        return "not estimated by this filter"
    courses = zip("xyz", np.degrees(track.bias).T, strict=True)  # 0 from first to last: that axis was not estimated
    values = ", ".join(f"{axis} {course[-1]:.4f}" if course.any() else f"{axis} –" for axis, course in courses)
    return f"{values} °/s at the end"


def _calibration(track: Track, verbose: bool) -> list[tuple[str, str]]:
    """The number of the sensor's errors that are known; verbose: each with its value."""
    if track.calibration is None:
        return []
    if verbose:
        return [("learned (± 1σ)", line) for line in track.calibration.words()]
    known, asked = track.calibration.counts()
    return [("calibration", f"{known} of {asked} errors of the sensor known; --save-calibration FILE keeps them")]


def _iron(recording: Recording, track: Track) -> list[tuple[str, str]]:
    """A magnetometer without calibration, and what to do."""
    found = hard_iron(recording)
    if found is None or not found.clear:
        return []
    where = ", ".join(f"{axis} {value:+.3g}" for axis, value in zip("xyz", found.offset, strict=True))
    off = f"not calibrated: offset {100 * found.share:.0f} % of the field ({where} µT)"
    learned = None if track.calibration is None else track.calibration.mag_offset
    if learned is not None and found.explained(learned.value):
        advice = "learned by the end: --save-calibration FILE keeps it, --prior FILE starts with it"
    else:
        off += f": heading may be wrong by {found.heading:.0f}°"
        advice = "learn it with ESKF: --save-calibration FILE, then --prior FILE"
    return [("magnetometer", off), ("magnetometer", advice)]


def _sigma(track: Track) -> str:
    if track.sigma is None:
        return "not estimated by this filter"
    heading = math.degrees(track.sigma[-1, 2])
    tilt_words = f"tilt {math.degrees(math.hypot(*track.sigma[-1, :2])):.3g}°"
    return tilt_words + (f", heading {heading:.3g}°" if heading > 0.0 else "")


def _health(track: Track, verbose: bool) -> list[tuple[str, str]]:
    """One line per kind of fault with what to do, the most frequent first."""
    found = health_counts(track)
    if not found:
        return [("health", "nothing missing, stuck, at full scale or rejected; no gap in time")]
    lines = []
    for bit, count in found.items():
        advice = f": {ADVICE[bit]}" if bit in ADVICE else ""
        share = f"{100 * count / len(track):.2g} %"
        lines.append(("health", f"{_count(count, 'sample')} ({share}): {health.NAMES[bit]}{advice}"))
    return _shorten(lines, KINDS, verbose)


def _score(score: "Score | None", verbose: bool) -> list[tuple[str, str]]:
    if score is None:
        return []
    lines = str(score).splitlines()
    if not verbose:
        lines = ["; ".join(lines[:2]), *filter(None, ["; ".join(lines[2:])])]
    return [("against truth", line) for line in lines]


def _notes(notes: Sequence[str], verbose: bool) -> list[tuple[str, str]]:
    return _shorten([("note", note) for note in notes], NOTES, verbose)


def _shorten(lines: list[tuple[str, str]], most: int, verbose: bool) -> list[tuple[str, str]]:
    """The first ``most`` lines, the last of them with the number of those left out."""
    if verbose or len(lines) <= most:
        return lines
    name, text = lines[most - 1]
    return [*lines[: most - 1], (name, f"{text}; {len(lines) - most} more with --verbose")]


def _count(number: int, thing: str) -> str:
    return f"{number:,} {thing}{'' if number == 1 else 's'}"
