"""Filters under faults: each fault put on one recording, every filter run over it, ours and other people's."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from levelhead.bench import contenders
from levelhead.bench.methods import DEFAULT, SMOOTHER, Method
from levelhead.engine import fuse, smooth
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.errors import LevelheadError
from levelhead.evaluate.fault_response import BEYOND, GROWN, MAX_EXCESS, FaultResponse, measure_response
from levelhead.evaluate.text_table import Cell, Column, plain_table
from levelhead.filters import default
from levelhead.guard import Guard
from levelhead.inspection import list_findings
from levelhead.open_types import JsonObject
from levelhead.recording import Array, Recording
from levelhead.simulate.fault import Fault, Faulted, apply_fault, complete
from levelhead.track import Track

PEERS = ("vqf.VQF", "imufusion.Ahrs", "ahrs.Madgwick")  # one of each package, those for most people

COLUMNS = (
    Column("fault", "fault"),
    Column("filter", "filter"),
    Column("tilt", "tilt", "°", 1),
    Column("heading", "heading", "°", 1),
    Column("tilt_recovery", "tilt right after", "s"),
    Column("heading_recovery", "heading right after", "s"),
    Column("beyond", "beyond 4σ", "%", 1),
    Column("said", "said"),
)


@dataclass(frozen=True, eq=False)
class Stress:
    """Responses of filters to faults; printed, it is a table with notes.

    Attributes:
        recording: the one without faults.
        responses: fault by fault, filter by filter.
        findings: for each fault, as it is printed, the doctor's findings in that recording that the sound one lacks.
        left_out: sentences on faults and filters that could not be run.
        guard: in front of levelhead's own filters.
    """

    recording: Recording
    responses: Sequence[FaultResponse]
    findings: dict[str, list[str]]
    left_out: Sequence[str] = ()
    guard: Guard | None = DEFAULT_GUARD

    @property
    def table(self) -> list[dict[str, Cell]]:
        """A mapping per response from column key (see ``COLUMNS``) to cell."""
        return [_cells(one) for one in self.responses]

    @property
    def finding(self) -> str:
        """The result in a sentence, about the first filter."""
        name = self.responses[0].method
        own = [one for one in self.responses if one.method == name]
        right = sum(one.is_recovered for one in own)
        told = [one for one in own if not one.harmless]
        said = sum(one.is_said or bool(self.findings[str(one.fault)]) for one in told)
        words = f"{name} is right again after {right} of {len(own)} faults"
        return (
            words
            if not told
            else f"{words}; {said} of the {len(told)} that harm it are reported, by itself or by the doctor"
        )

    @property
    def notes(self) -> list[str]:
        """Sentences that explain the table."""
        reference = (
            "Errors are against the true orientation"
            if self.recording.truth is not None
            else "There is no truth: errors are differences from the same filter's run without the fault"
        )
        sentences = [
            f"{reference}, the largest while the fault lasts; in brackets those without the fault.",
            f"Right: within {MAX_EXCESS:g}° of that, for good, counted from the fault's end, of one that stays from "
            "its start; never: not within the recording.",
            f"Beyond {BEYOND:g}σ: samples from the fault's start on. Said: health bits that the fault sets, "
            f"σ ×: by how much σ grows where it is {GROWN:g} times and more; harmless faults are not listed.",
        ]
        found = [f"{fault}: {', '.join(names)}" for fault, names in self.findings.items() if names]
        if found:
            sentences.append(f"`levelhead doctor` finds in the faulted logs: {'; '.join(found)}.")
        if any(one.method in contenders.BY_NAME for one in self.responses):
            sentences.append("Other people's filters get the last reading where one is missing, and the median rate.")
        if self.guard is None:
            sentences.append("Guard off: every filter saw all readings as they are.")
        elif self.guard != DEFAULT_GUARD:
            sentences.append(f"In front of levelhead's filters: {self.guard}.")
        return [*sentences, *self.left_out]

    def to_dict(self) -> JsonObject:
        """Everything but the curves, ready for JSON."""
        return {
            "reference": "truth" if self.recording.truth is not None else "the same filter without the fault",
            "samples": len(self.recording),
            "duration_s": self.recording.duration,
            "finding": self.finding,
            "notes": self.notes,
            "responses": [
                one.to_dict() | {"doctor": self.findings[str(one.fault)]} for one in self.responses
            ],
        }  # fmt: skip

    def __str__(self) -> str:
        rows = self.table
        again = [row["fault"] == before["fault"] for row, before in zip(rows[1:], rows, strict=False)]
        shown = [row | {"fault": ""} if same else row for row, same in zip(rows, [False, *again], strict=True)]
        return "\n".join([plain_table(COLUMNS, shown), "", f"{self.finding}.", *self.notes])


def _cells(one: FaultResponse) -> dict[str, Cell]:
    grown = f"σ ×{one.growth:.2g}" if one.growth is not None and one.growth >= GROWN else ""
    words = ", ".join([*one.said, *([grown] if grown else [])])
    return {
        "fault": str(one.fault),
        "filter": one.method,
        "tilt": f"{one.tilt:.1f} ({one.usual_tilt:.1f})",
        "heading": f"{one.heading:.1f} ({one.usual_heading:.1f})",
        "tilt_recovery": _seconds(one.tilt_recovery),
        "heading_recovery": _seconds(one.heading_recovery),
        "beyond": None if one.beyond is None else 100.0 * one.beyond,
        "said": words or ("harmless" if one.harmless else "nothing"),
    }


def _seconds(value: float | None) -> str:
    return "never" if value is None else f"{value:.1f}"


def usual_methods() -> tuple[list[Method], list[str]]:
    """The default filter and a filter of each other package, and a sentence for each package that is not installed."""
    peers = [contenders.BY_NAME[name] for name in PEERS]
    absent = [f"{one.package} is not installed: {contenders.INSTALL}" for one in peers if not one.installed]
    return [Method(DEFAULT), *(Method(one.name) for one in peers if one.installed)], absent


def run_method(method: Method, recording: Recording, guard: Guard | None = DEFAULT_GUARD) -> Track:
    """The track of a method; of a contender, which has no guard, one without σ and health."""
    if method.name in contenders.BY_NAME:
        with np.errstate(all="ignore"):
            quat = contenders.BY_NAME[method.name].run(_complete(recording))
        lost = ~(np.abs(np.linalg.norm(quat, axis=1) - 1.0) < 0.1)
        return Track(recording.t, np.where(lost[:, None], np.nan, quat))
    return (smooth if method.name == SMOOTHER else fuse)(recording, method.params, guard=guard)


def _complete(recording: Recording) -> Recording:
    """Missing readings replaced by the last one, because contenders cannot miss any."""
    mag = None if recording.mag is None else _hold(recording.mag)
    return replace(recording, gyr=_hold(recording.gyr), acc=_hold(recording.acc), mag=mag)


def _hold(values: Array) -> Array:
    there = np.isfinite(values).all(axis=1)
    last = np.maximum.accumulate(np.where(there, np.arange(len(values)), -1))
    first = int(there.argmax())  # before the first reading there is only that one
    return values[np.where(last < 0, first, last)]


def stress(
    recording: Recording,
    faults: Sequence[Fault],
    methods: Sequence[Method],
    *,
    guard: Guard | None = DEFAULT_GUARD,
    seed: int = 0,
    left_out: Sequence[str] = (),
    progress: Callable[[float], None] | None = None,
) -> Stress:
    """Runs every filter over every fault on the recording.

    Args:
        recording: simulated or real; with truth errors are against it.
        faults: those to put on it, one at a time.
        methods: the filters; the first is the one that the result's sentence is about.
        guard: in front of levelhead's own filters; None: there is none.
        seed: of the faults' random numbers.
        left_out: sentences on the filters that could not run.
        progress: called with the fraction done, 0 to 1.

    Raises:
        LevelheadError: no fault or filter, or a fault that this recording cannot have.
    """
    if not faults or not methods:
        raise LevelheadError("stress needs a fault and a filter at least")
    whole = [complete(fault, recording) for fault in faults]  # all are checked before the first run
    done, count = 0, len(methods) * (1 + len(whole))

    def report() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done / count)

    sound: dict[str, Track] = {}
    for method in methods:
        sound[method.name] = run_method(method, recording, guard)
        report()
    responses: list[FaultResponse] = []
    findings: dict[str, list[str]] = {}
    for fault in whole:
        faulted = apply_fault(recording, fault, seed)
        findings[str(fault)] = _new_findings(faulted, recording)
        for one in _responses(faulted, recording, methods, sound, guard):
            responses.append(one)
            report()
    return Stress(recording, responses, findings, left_out, guard)


def _new_findings(faulted: Faulted, recording: Recording) -> list[str]:
    """The doctor's findings in the time of a fault, as long again before and after it, and not without the fault."""
    length = faulted.last - faulted.first
    first, last = max(0, faulted.first - length), min(len(faulted.rows), faulted.last + length)
    if last - first < 2:
        return []
    sound = recording[int(faulted.rows[first]) : int(faulted.rows[last - 1]) + 1]
    usual = {one.name for one in list_findings(sound)}
    return [one.name for one in list_findings(faulted.recording[first:last]) if one.name not in usual]


def _responses(
    faulted: Faulted, recording: Recording, methods: Sequence[Method], sound: dict[str, Track], guard: Guard | None
) -> Iterator[FaultResponse]:
    for method in methods:
        track = run_method(method, faulted.recording, guard)
        name = type(default()).__name__ if method.name == DEFAULT else method.name
        yield measure_response(faulted, track, recording, sound[method.name], name)
