"""The doctor: examines a log and reports its problems, the certainty of each, and its cure."""

import os
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.inspection.findings import Finding, Measurement, Report, sort_findings
from levelhead.inspection.physics import examine_field, examine_gravity, examine_rest
from levelhead.inspection.place import examine_place
from levelhead.inspection.reading import from_reader
from levelhead.inspection.spikes import examine_spikes
from levelhead.inspection.timing import examine_clock
from levelhead.inspection.turns import examine_turns
from levelhead.inspection.unknown import unknown
from levelhead.inspection.values import examine_values
from levelhead.inspection.verdict import expectation, verdict
from levelhead.recording import Recording
from levelhead.signals.turn_matrix import MAX_SEGMENTS
from levelhead.sources import read
from levelhead.sources.hints import NeedsHints
from levelhead.sources.interpret.accelerometer import GravityRemoved

Check = Callable[[Recording], Iterator[Finding | Measurement]]
BRIEF = 10  # segments by which ``levelhead fuse`` judges turns


def examine_turns_and_field(recording: Recording, most: int = MAX_SEGMENTS) -> Iterator[Finding | Measurement]:
    """``examine_turns``, ``examine_place``, and ``examine_field`` without the iron that the turns showed.

    The iron would be found again as a wrong strength and as a field that varies.
    """
    less_iron = recording
    for one in examine_turns(recording, most):
        if isinstance(one, Finding) and one.name == "mag_offset" and one.mend is not None:
            less_iron = one.mend.apply(recording)
        yield one
    yield from examine_place(recording)
    yield from examine_field(less_iron)


FAULTS: tuple[Check, ...] = (
    examine_turns_and_field,
    examine_gravity,
    examine_rest,
    examine_clock,
    examine_values,
    examine_spikes,
)

__all__ = ["Finding", "Measurement", "Report", "examine", "inspect", "list_findings", "short_form"]


def inspect(path: str | os.PathLike[str], **hints: Any) -> Report:
    """Reads and examines a log.

    Args:
        path: a file, a folder or a zip.
        hints: as for ``levelhead.read``: map, units, counts, rate, sensor, session.

    Returns:
        A report. Where the log cannot be read its ``recording`` is None and the verdict gives the reason; where only a
        hint is missing, it is examined under the hint that the error names.
    """
    source = os.fspath(path)
    missing: list[Finding] = []
    try:
        recording = read(path, **hints)
    except NeedsHints as error:
        name = "no_time" if "rate" in error.suggested else "hint_needed"
        cure = f"Try: {error.command()}" if error.path else ""
        missing.append(Finding(name, "warning", error.sentence, "the log does not contain it", cure))
        try:
            recording = read(path, **{**hints, **error.suggested})
        except LevelheadError:
            return Report(source, None, missing, str(error))
    except LevelheadError as error:
        name = "gravity_removed" if isinstance(error, GravityRemoved) else "unreadable"
        return Report(source, None, [Finding(name, "broken", str(error), "reading it")], str(error))
    return examine(recording, source, missing)


def examine(recording: Recording, source: str = "", before: list[Finding] | None = None) -> Report:
    """Examines a recording; ``before`` are findings that were made already."""
    findings, measured = _collect(recording, (*FAULTS, *_remarks()), before or [])
    found = {one.name: one for one in findings}
    with np.errstate(all="ignore"):
        expected = expectation(recording, findings)
    return Report(
        source or str(recording.meta.get("source", "")),
        recording,
        findings,
        verdict(recording, findings, expected),
        expected.tilt,
        expected.heading,
        expected.drift,
        tuple(unknown(recording, set(found))),
        measured,
    )


def list_findings(recording: Recording, before: Sequence[Finding] = ()) -> list[Finding]:
    """Findings on a recording, the worst first; of two findings with one name the first counts."""
    return _collect(recording, (*FAULTS, *_remarks()), before)[0]


def _remarks() -> tuple[Check, ...]:
    """Checks that find nothing worse than a note; imported here, because ``levelhead fuse`` does without."""
    from levelhead.inspection.behaviour import examine_bias, examine_noise
    from levelhead.inspection.spectrum import examine_spectra

    return examine_spectra, examine_bias, examine_noise


def _collect(
    recording: Recording, checks: Sequence[Check], before: Sequence[Finding] = ()
) -> tuple[list[Finding], list[Measurement]]:
    found: dict[str, Finding] = {}
    measured = []
    with np.errstate(all="ignore"):
        for one in [*before, *_run(recording, checks)]:
            if isinstance(one, Measurement):
                measured.append(one)
            else:
                found.setdefault(one.name, one)
    return sort_findings(list(found.values())), measured


def _run(recording: Recording, checks: Sequence[Check]) -> Iterator[Finding | Measurement]:
    yield from from_reader(recording)
    if len(recording) < 20:
        yield Finding("too_short", "warning", f"{len(recording)} samples are too few to examine", "length")
        return
    for check in checks:
        yield from check(recording)


def short_form(recording: Recording) -> list[str]:
    """At most two lines for the summary of ``levelhead fuse``: the worst findings; [] for a recording that is fine."""
    brief: tuple[Check, ...] = (partial(examine_turns_and_field, most=BRIEF), *FAULTS[1:])
    bad = [one for one in _collect(recording, brief)[0] if one.severity != "note"]
    lines = [f"{one.what}. {one.cure}".strip() for one in bad[:1]]
    if len(bad) > 1:
        lines.append(f"{len(bad) - 1} more: {', '.join(one.name for one in bad[1:5])}; levelhead doctor LOG shows them")
    return lines
