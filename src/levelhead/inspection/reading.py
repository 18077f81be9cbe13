"""What the reader found out about a log, as findings."""

import re
from collections.abc import Iterator
from typing import Any

from levelhead.inspection.findings import Finding
from levelhead.inspection.timing import SLOW
from levelhead.open_types import Fields
from levelhead.recording import Recording

OWN_FIELD = 0.3  # correlation from which a field that turns too little lies under an offset, on the right axes

# name: (severity, what, cure); {} takes what the reader measured
_KNOWN = {
    "gyro_inverted": (
        "broken",
        "gravity turns against the gyroscope: one of them is inverted",
        "Turn its signs round.",
    ),
    "unit_header_wrong": (
        "warning",
        "the header's unit contradicts the numbers; the other one was taken",
        "Mend the header.",
    ),
    "unit_doubtful": (
        "warning",
        "the header's unit may be wrong",
        "Give the unit: --units gyr=rad/s or --units gyr=deg/s.",
    ),
    "raw_counts": ("warning", "the numbers are raw counts; their scale is a guess", "Give it: --counts gyr=131/deg/s."),
    "axes_order": ("warning", "the gyroscope's axes were put in order by the turn of gravity, a guess", "Name them."),
    "clock_restart": ("warning", "the clock begins again; one session was read", "--session N takes another."),
    "stamps_back": ("warning", "stamps step back", "Write a clock that only goes forward."),
    "equal_stamps": ("warning", "stamps repeat", "Write each sample once, with a stamp of its own."),
    "arrival": (
        "note",
        "stamps are those of arrival, the sensor samples regularly; its clock was put back",
        "Stamp samples where they are measured.",
    ),
    "mag_zero": ("note", "the magnetometer is 0 on every row", "It is switched off, or not there."),
    "mag_normalised": ("warning", "the magnetometer was normalised: a direction without strength", "Record it raw."),
    "mag_unusable": (
        "warning",
        "the magnetometer does not turn with the body; it was left out",
        "Check its axes; calibrate it.",
    ),
    "gravity_removed": ("note", "the acceleration has gravity removed; the gravity beside it was added", ""),
    "acc_inverted": ("note", "the accelerometer pointed down at rest (Core Motion's sign); it was turned round", ""),
    "no_time": ("note", "there are no stamps; rows stand for time", "Write a stamp with each sample."),
    "decoy_columns": ("note", "there are several columns for one sensor; the plainest was taken", ""),
    "several_clocks": ("note", "sensors have clocks of their own; they were merged", ""),
    "empty_columns": ("note", "columns or files with nothing in them were passed over", ""),
    "glued_recordings": (
        "warning",
        "rows of windows were joined, a guess",
        "Read the recordings from which they were cut.",
    ),
}


def from_reader(recording: Recording) -> Iterator[Finding]:
    """Findings that were made while the log was read; the numbers stand in ``meta["findings"]``."""
    found: Fields = dict(recording.meta.get("findings", {}))
    notes = [str(note) for note in recording.meta.get("notes", ())]
    yield from _slow(notes)
    for name, (severity, what, cure) in _KNOWN.items():
        if name in found:
            yield Finding(name, severity, what, _evidence(name, found[name], notes), cure)
            if name == "mag_unusable" and found[name]["free"] > 0.5 and found[name]["correlation"] < OWN_FIELD:
                yield Finding(
                    "mag_axes",
                    "warning",
                    "with free axes the field turns better with the body",
                    f"r = {found[name]['free']:.2f}",
                    "Check order and signs of its axes.",
                )


def _slow(notes: list[str]) -> Iterator[Finding]:
    """An accelerometer that is slow beside its gyroscope."""
    for note in notes:
        if (found := re.search(r"slower than the gyroscope \(([\d.]+) Hz", note)) and float(found[1]) < SLOW:
            yield Finding(
                "too_slow", "note", f"the accelerometer comes at {found[1]} Hz", note, "Record it at 50 Hz or more."
            )


def _evidence(name: str, value: Any, notes: list[str]) -> str:
    if isinstance(value, dict):
        return ", ".join(
            f"{key} {number:.3g}" if isinstance(number, float) else f"{key} {number}" for key, number in value.items()
        )
    if isinstance(value, list):
        return f"in rows {', '.join(str(row) for row in value[:6])}"
    words = {
        "raw_counts": "counts",
        "axes_order": "no names",
        "no_time": "no stamps",
        "decoy_columns": "taken, not",
        "several_clocks": "time",
        "gyro_inverted": "against the gyroscope",
        "glued_recordings": "window",
    }
    note = next((one for one in notes if name in words and words[name] in one), "")
    return note or (str(value) if value is not True else "every row")
