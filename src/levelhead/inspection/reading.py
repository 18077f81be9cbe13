"""Findings about a log in the conclusions of its reader."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from levelhead.inspection.findings import Finding
from levelhead.inspection.timing import SLOW
from levelhead.recording import Recording
from levelhead.sources.conclusions import Conclusion
from levelhead.sources.conclusions.sentences import sentence

OWN_FIELD = 0.3  # correlation from which a field that turns too little lies under an offset, on the right axes
IN_ORDER = [0, 1, 2]  # axes as the columns give them
ROWS = 6  # rows that are listed


def _always(_: Conclusion) -> bool:
    return True


class Rule(NamedTuple):
    """Conclusions that are a finding.

    Attributes:
        name, severity, what, cure: of the finding; ``what`` may hold facts in braces.
        conclusions: pairs of ``about`` and ``reason``.
        shown: facts that are the evidence; without any the sentence of the conclusion.
        when: further condition.
    """

    name: str
    severity: str
    what: str
    cure: str
    conclusions: Sequence[tuple[str, str]]
    shown: Sequence[str] = ()
    when: Callable[[Conclusion], bool] = _always


def _is_reversed(conclusion: Conclusion) -> bool:
    return bool(conclusion.facts.get("reversed"))


def _is_reordered(conclusion: Conclusion) -> bool:
    return bool(conclusion.facts["order"] != IN_ORDER or min(conclusion.facts["signs"]) < 0.0)


def _is_slow(conclusion: Conclusion) -> bool:
    return float(conclusion.facts["rate"]) < SLOW


def _has_free_axes(conclusion: Conclusion) -> bool:
    return bool(conclusion.facts["free"] > 0.5 and conclusion.facts["correlation"] < OWN_FIELD)


_COUNTS = ("whole_numbers", "power_up", "gravity_turn_counts", "gravity_turn_nearest_counts")
RULES = (
    Rule(
        "too_slow", "note", "the accelerometer comes at {rate:.5g} Hz", "Record it at 50 Hz or more.",
        [("acc.stamps", "slower")], when=_is_slow,
    ),
    Rule(
        "gyro_inverted", "broken", "gravity turns against the gyroscope: one of them is inverted",
        "Turn its signs round.",
        [("gyr.unit", "gravity_against"), ("gyr.unit", "gravity_turn_nearest_counts")], when=_is_reversed,
    ),
    Rule(
        "unit_header_wrong", "warning", "the header's unit contradicts the numbers; the other one was used",
        "Mend the header.",
        [("t.unit", "against_header"), ("gyr.unit", "against_header")], ("declared", "taken"),
    ),
    Rule(
        "unit_doubtful", "warning", "the header's unit may be wrong",
        "Give the unit: --units gyr=rad/s or --units gyr=deg/s.",
        [("gyr.unit", "doubtful")], ("declared", "other"),
    ),
    Rule(
        "raw_counts", "warning", "the numbers are raw counts; their scale is a guess",
        "Give it: --counts gyr=131/deg/s.",
        [("acc.unit", "counts"), ("columns", "by_physics"), *(("gyr.unit", reason) for reason in _COUNTS)],
    ),
    Rule(
        "axes_order", "warning", "the gyroscope's axes were put in order by the turn of gravity, a guess", "Name them.",
        [("columns", "by_physics")], when=_is_reordered,
    ),
    Rule(
        "clock_restart", "warning", "the clock begins again; one session was read", "--session N takes another.",
        [("t.session", "longest"), ("t.session", "hint")], ("rows",),
    ),
    Rule(
        "stamps_back", "warning", "stamps step back", "Write a clock that only goes forward.",
        [("t.stamps", "out_of_order"), ("t.stamps", "wandering"), ("t.stamps", "jitter")],
    ),
    Rule(
        "equal_stamps", "warning", "stamps repeat", "Write each sample once, with a stamp of its own.",
        [("t.rows", "repeated"), ("t.stamps", "equal")],
    ),
    Rule(
        "arrival", "note", "stamps are those of arrival, the sensor samples regularly; its clock was put back",
        "Stamp samples where they are measured.",
        [("t.stamps", "arrival")], ("jitter_ms", "rows", "missing"),
    ),
    Rule(
        "mag_zero", "note", "the magnetometer is 0 on every row", "It is switched off, or not there.",
        [("mag.used", "zero")],
    ),
    Rule(
        "mag_normalised", "warning", "the magnetometer was normalised: a direction without strength", "Record it raw.",
        [("mag.unit", "normalised")],
    ),
    Rule(
        "mag_unusable", "warning", "the magnetometer does not turn with the body; it was left out",
        "Check its axes; calibrate it.",
        [("mag.used", "does_not_turn")], ("correlation", "scale", "free", "length"),
    ),
    Rule(
        "mag_axes", "warning", "with free axes the field turns better with the body",
        "Check order and signs of its axes.",
        [("mag.used", "does_not_turn")], ("free",), _has_free_axes,
    ),
    Rule(
        "gravity_removed", "note", "the acceleration has gravity removed; the gravity beside it was added", "",
        [("acc.gravity", "added"), ("acc.columns", "gravity_removed")],
    ),
    Rule(
        "acc_inverted", "note", "the accelerometer pointed down at rest (Core Motion's sign); it was turned round", "",
        [("acc.sign", "gravity_vector"), ("acc.sign", "names"), ("acc.sign", "sensor_logger")],
    ),
    Rule(
        "no_time", "note", "there are no stamps; rows stand for time", "Write a stamp with each sample.",
        [("t.rate", "file"), ("t.rate", "hint")],
    ),
    Rule(
        "decoy_columns", "note", "there are several columns for one sensor; the plainest was used", "",
        [(f"{role}.columns", reason) for role in ("gyr", "acc", "mag")
         for reason in ("plainest", "gravity_removed", "other_table")],
    ),
    Rule(
        "several_clocks", "note", "sensors have clocks of their own; they were merged", "",
        [("clock", "merged"), ("rows", "outside_overlap")],
    ),
    Rule("several_clocks", "note", "of several columns with time one was taken", "", [("t.column", "most_even")]),
    Rule(
        "empty_columns", "note", "columns or files with nothing in them were passed over", "",
        [("file.parts", "empty")],
    ),
    Rule(
        "glued_recordings", "warning", "rows of windows were joined, a guess",
        "Read the recordings from which they were cut.",
        [("rows", "windows")],
    ),
)  # fmt: skip


def from_reader(recording: Recording) -> Iterator[Finding]:
    """Findings in the conclusions that were made while the log was read."""
    conclusions: Sequence[Conclusion] = recording.meta.get("conclusions", ())
    for rule in RULES:
        made = [one for one in conclusions if (one.about, one.reason) in rule.conclusions and rule.when(one)]
        if made:
            what = rule.what.format_map(made[0].facts)
            yield Finding(rule.name, rule.severity, what, _evidence(made[0], rule.shown), rule.cure)


def _evidence(conclusion: Conclusion, shown: Sequence[str]) -> str:
    return ", ".join(_fact(name, conclusion.facts[name]) for name in shown) or sentence(conclusion)


def _fact(name: str, value: object) -> str:
    if isinstance(value, list):
        return f"in {name} {', '.join(str(one) for one in value[:ROWS])}"
    return f"{name} {value:.3g}" if isinstance(value, float) else f"{name} {value}"
