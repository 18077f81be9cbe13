"""The only place that turns a conclusion of the reader into English."""

import shlex
from collections.abc import Callable, Iterable, Mapping

from levelhead.open_types import ReadOnlyJson
from levelhead.sources.conclusions import Conclusion
from levelhead.sources.hints import MEANING

Template = str | Callable[[Conclusion], str]


def sentence(conclusion: Conclusion) -> str:
    """The sentence of a conclusion, without a full stop."""
    template = (
        SENTENCES.get((conclusion.about, conclusion.reason))
        or SENTENCES[(conclusion.about.replace(conclusion.role, "*", 1), conclusion.reason)]
    )
    if callable(template):
        return template(conclusion)
    sensor = MEANING.get(conclusion.role, conclusion.role)
    return template.format_map({"value": conclusion.value, "sensor": sensor, **conclusion.facts})


def notes(conclusions: Iterable[Conclusion]) -> list[str]:
    """The sentences of the conclusions that a reader of the summary needs, each once."""
    return list(dict.fromkeys(sentence(one) for one in conclusions if (one.about, one.reason) not in EXPECTED))


EXPECTED = {  # conclusions without news
    ("t.rate", "hint"), ("t.column", "named"), ("t.column", "hint"), ("t.unit", "declared"), ("t.unit", "hint"),
    ("mag.used", "offset"),  # the filter that learns it, or the calibration, reports the number
    *((f"{role}.{what}", reason) for role in ("gyr", "acc", "mag", "q") for what, reason in (
        ("columns", "named"), ("columns", "hint"), ("unit", "declared"), ("unit", "hint"))),
}  # fmt: skip


def gyroscope_reason(reason: str, facts: ReadOnlyJson) -> str:
    """The evidence for the unit of a gyroscope, for an error."""
    return _GYROSCOPE[reason].format_map(facts)


def _before_header(one: Conclusion) -> str:
    count = "stands 1 line" if one.value == 1 else f"stand {one.value} lines"
    return f"before the header {count} of numbers; left out"


def _torn(one: Conclusion) -> str:
    count = "1 line was" if one.value == 1 else f"{one.value} lines were"
    return f"{count} torn or no numbers and left out ({one.facts['first']})"


def _stale(one: Conclusion) -> str:
    count = "the first row" if one.value == 1 else f"the first {one.value} rows"
    return f"time: {count} were left out: '{one.facts['column']}' places them long before the others"


def _windows(one: Conclusion) -> str:
    overlap = one.facts["overlap"]
    return (
        f"each row is a window of {one.facts['width']} samples"
        + (f", {overlap} of which are those of the next row; used once" if overlap else "")
        + "; rows are joined, a guess that they follow one another"
    )


def _plainest(one: Conclusion) -> str:
    other = one.facts["other_sensor"]
    words = f"; --sensor {shlex.quote(other)} takes that one" if other else ""
    return f"{MEANING[one.role]}: {one.facts['columns']} taken, not {one.facts['rest']}{words}"


def _session(one: Conclusion) -> str:
    facts, sizes = one.facts, one.facts["sizes"]
    listed = ", ".join(f"{n} rows" for n in sizes[:6]) + (", …" if len(sizes) > 6 else "")
    longest = "" if one.reason == "hint" else ", the longest"
    return (
        f"time: '{facts['column']}' begins again {len(sizes) - 1} times (in row {facts['rows'][1]} first): "
        f"{len(sizes)} sessions of {listed}; session {one.value} is read{longest}; --session N takes another"
    )


def _columns_by_numbers(one: Conclusion) -> str:
    step = one.facts["step"]
    gained = f"; increments over {step:.4g} s" if step > 0.0 else ""
    return f"no header: columns found by their numbers, a guess: {one.facts['listed']}{gained}"


_GYROSCOPE: Mapping[str, str] = {  # reason to the evidence for a gyroscope's unit
    "gravity_turn": "gravity turns as it should (scale {scale:.3f})",
    "gravity_turn_degrees": "gravity turns as it should (scale {scale:.4f} rad/s, 1/{inverse:.1f})",
    "gravity_turn_counts": (
        "a guess: {counts:g} counts per deg/s, {chip}; gravity turns by 1 deg/s for about {measured:.4g} of its numbers"
    ),
    "gravity_turn_no_unit": "gravity turns by 1 deg/s for about {measured:.4g} of its numbers",
    "gravity_turn_nearest_counts": (
        "a guess: {counts:g} counts per deg/s, {chip}, since gravity turns {far:.2f} times as far "
        "(correlation {correlation:.2f})"
    ),
    "gravity_turn_unclear": "a guess: gravity turns {far:.2f} times as far (correlation {correlation:.2f})",
    "whole_numbers": "a guess: {counts:g} counts per deg/s, {chip}, at which its noise at rest is {noise:.2g} deg/s",
    "power_up": "a guess: {counts:g} counts per deg/s, the MPU-6050's after power-up beside {per_g:g} per g",
    "whole_degrees": "a guess: whole numbers, whose noise at rest is {noise:.2g} deg/s",
    "digit": "a guess: its numbers go in steps of {step:.5g} deg/s, as a chip's converter does",
    "gravity_against": "a guess: gravity turns against the gyroscope (scale -{far:.2f}); one is inverted",
    "force_cancels": "a guess: turned back as rad/s, the force would cancel",
    "force_keeps_mean": "a guess: turned back as rad/s, the force of a moving sensor keeps its mean",
    "gravity_unsteady": "a guess: gravity would not hold still if it were rad/s",
    "gravity_steady": "a guess: gravity would not hold as still if it were deg/s",
    "too_large": "a guess: {large:.0f} would be {turns:.0f} turns a second in rad/s",
    "look_like_counts": "its numbers reach {large:.0f} and look like raw counts",
    "quiet": "a guess, because gravity shows little here: noise of {noise:.2g} at rest is too small for deg/s",
    "loud": "a guess, because gravity shows little here: noise of {noise:.2g} at rest is too large for rad/s",
}
_CORE_MOTION = "accelerometer: turned round, since Core Motion's points down at rest ({})"
_CELLS = "the header has {names} names and the lines {cells} cells: "

# (about, reason) to the sentence; "*" stands for any sensor, a template takes value, sensor and the facts
SENTENCES: Mapping[tuple[str, str], Template] = {
    ("file.decimal", "comma"): "numbers are written with a decimal comma",
    ("file.lines", "before_header"): _before_header,
    ("file.lines", "torn"): _torn,
    ("file.lines", "zeros"): "the {value} zero bytes at the end are left out; a recorder that loses power leaves such",
    ("file.lines", "cut_off"): "line {value} is cut off and was left out",
    ("file.header", "first_unnamed"): _CELLS + "the first has no name",
    ("file.header", "time_absent"): "a guess: " + _CELLS + "no line has '{value}'",
    ("file.header", "rest_unnamed"): _CELLS + "the last {unnamed} have no name, a guess",
    ("file.header", "last_absent"): _CELLS + "no line has '{value}'",
    ("file.encoding", "zero_bytes"): "read as UTF-16, which its zero bytes show",
    ("file.encoding", "code_page"): (
        "the file is not UTF-8; its letters were read as {value}, a guess; numbers are the same in any"
    ),
    ("file.kind", "ros_echo"): "messages as ROS prints them: {names}",
    ("file.kind", "labelled"): "text with a word before each number: {names}",
    ("file.kind", "long_table"): (
        "a long table: a row for each number; the numbers of one stamp were put side by side"
    ),
    ("file.kind", "ros_fields"): "{topic}: fields of {type} with the names of a sensor, a guess",
    ("file.kind", "kitti"): "KITTI's oxts, {files} files",
    ("file.parts", "empty"): "{value}: nothing in them; passed over",
    ("box.end", "cut_off"): "the black box was cut off; everything up to there was read",
    ("box.bias", "start"): "gyroscope: without the bias that was measured at the start",
    ("box.params", "changed"): ("parameters were changed while the node ran; those of its first orientation are used"),
    ("box.params", "node"): (
        "the node ran {value} with parameters of its own: meta['live'] holds them, `levelhead fuse` takes them, "
        "lh.fuse takes those that it is given"
    ),
    ("place", "satellites"): "place {value} by {source}; --place auto turns heading to true north there",
    ("frame", "ulog"): "{topic}: body frame x forward, z down",
    ("columns", "by_numbers"): _columns_by_numbers,
    ("columns", "increments"): (
        "{columns}: angles and velocities gained in {step:.4g} s; divided by the time of each row"
    ),
    ("columns", "stacked_rows"): "no header: a sample has {count} lines, a guess: {listed}",
    ("columns", "by_physics"): (
        "no names: a guess by physics: accelerometer {accelerometer} … with {per_g:.4g} counts per g around {middle}; "
        "gyroscope {gyroscope} with {scale:.4g} rad/s a count (gravity turns so, correlation {correlation:.2f})"
    ),
    ("sensor", "word_column"): (
        "the rows of {count} units alternate, column {column} names it: {listed}; {value} is read, --sensor {value} "
        "takes it, and another word another"
    ),
    ("sensor", "number_column"): (
        "the rows of {count} units alternate, column {column} names it: {listed}; {column} {value} is read, "
        "--sensor '{column} N' takes another"
    ),
    ("sensor", "rows_in_turn"): (
        "every {count}th row goes on from the one {count} before, and not from its neighbours: a guess that {count} "
        "units take turns; the first one's rows were read"
    ),
    ("rows", "windows"): _windows,
    ("rows", "outside_overlap"): (
        "merged: {value} of {count} gyroscope samples lie outside the accelerometer's time; left out"
    ),
    ("*.columns", "named"): "{sensor}: {value}, by name",
    ("*.columns", "hint"): "{sensor}: {value}, by the hint",
    ("*.columns", "plainest"): _plainest,
    ("*.columns", "gravity_removed"): "{sensor}: {rest} has gravity removed; not used",
    ("*.columns", "other_table"): "{sensor}: from {value}, not from {rest}",
    ("clock", "merged"): "merged: {parts}",
    ("acc.stamps", "slower"): (
        "accelerometer: slower than the gyroscope ({rate:.5g} Hz); set to the gyroscope's stamps by straight lines"
    ),
    ("acc.stamps", "own_clock"): (
        "accelerometer: on a clock of its own ({rate:.5g} Hz); set to the gyroscope's stamps by straight lines"
    ),
    ("acc.stamps", "other_rows"): (
        "gyroscope and accelerometer have different rows; the accelerometer was set to the gyroscope's by straight "
        "lines"
    ),
    ("t.rate", "file"): "time: no stamps; rows at the {value:g} Hz that the file gives",
    ("t.rate", "hint"): "time: no stamps; rows at {value:g} Hz, by the hint",
    ("t.column", "most_even"): (
        "time: '{value}' is the most even of {count} columns with time in their name, not {rest}"
    ),
    ("t.column", "intervals"): "time: the sum of '{value}', the interval of each row",
    ("t.column", "even"): "time: '{value}' goes on evenly, as a clock does",
    ("t.column", "even_at_rate"): (
        "time: '{value}' goes on evenly, as a clock does, and gravity turns as the gyroscope does at its rate: a guess"
    ),
    ("t.unit", "file_rate"): (
        "time: '{column}' has no unit; it counts {step:g} a sample, which at the {rate:g} Hz that the file gives are "
        "{ticks:.6g} ticks a second"
    ),
    ("t.unit", "other_clock"): ("time: '{column}' has no unit; the clock beside it shows {ticks:.6g} ticks a second"),
    ("t.unit", "interval"): "time: '{column}' has no unit; by its median interval of {step:.6g} it is in {value}",
    (
        "t.unit",
        "short_interval",
    ): "time: '{column}' has no unit; by its median interval of {step:.6g} it is in {value}, a guess",
    ("t.unit", "against_header"): (
        "time: '{column}' taken as {taken}, a guess against the header, which has {declared}: an interval of "
        "{step:.4g} would be {rate:.3g} Hz"
    ),
    ("t.rows", "stale"): _stale,
    ("t.rows", "no_stamp"): "time: {value} rows without a stamp were left out, the first at {first}",
    ("t.rows", "repeated"): "time: '{column}' repeats {value} stamps with the row before; these rows were left out",
    ("t.rows", "marks"): "time: {value} rows without a reading share a stamp with another row; they were left out",
    ("t.start", "date"): "time: starts at 0; the first stamp is {value:.6f} s (meta['t0'])",
    ("t.session", "longest"): _session,
    ("t.session", "hint"): _session,
    ("t.stamps", "overflow"): (
        "time: '{column}' begins again at {size:g}, as a counter of fixed size does; counted on"
    ),
    ("t.stamps", "out_of_order"): (
        "time: '{column}' has {value} stamps out of order, the first in row {first}; set between their neighbours"
    ),
    ("t.stamps", "wandering"): (
        "time: '{column}' goes back {value} times and catches up; a straight line was laid through it ({away:.3g} off "
        "at most)"
    ),
    ("t.stamps", "jitter"): (
        "time: '{column}' goes back {value} times, by a jitter of {jitter:.3g} rms about an even clock, which was taken"
    ),
    ("t.stamps", "bursts"): (
        "time: '{column}' was written as samples arrived, in {value} bursts of about {size:.0f}; they were spread "
        "evenly"
    ),
    ("t.stamps", "equal"): (
        "time: '{column}' repeats {value} stamps with new numbers; these samples were spread evenly"
    ),
    ("t.stamps", "arrival"): (
        "time: '{column}' holds times of arrival, {jitter_ms:.3g} ms rms about the clock of a sensor that samples "
        "regularly, as its readings show; that clock was put back ({missing} samples are missing)"
    ),
    ("t.column", "named"): "time: '{value}', by name",
    ("t.column", "hint"): "time: '{value}', by the hint",
    ("t.unit", "declared"): "time: in {value}, by the file",
    ("t.unit", "hint"): "time: in {value}, by the hint",
    ("*.unit", "declared"): "{sensor}: in {value}, by the file",
    ("*.unit", "hint"): "{sensor}: in {value}, by the hint",
    ("*.unit", "preamble"): "{sensor}: {value}, by the preamble",
    ("*.unit", "vendor"): "{sensor}: taken as {value}, as {vendor} writes it",
    ("*.unit", "hint_against_file"): "{sensor}: the hint gives {value} where the file has {file}",
    ("*.unit", "hint_against_numbers"): (
        "{sensor}: taken as {value}, by the hint; a warning: its numbers look like {other}: {why}"
    ),
    ("*.unit", "length"): "{sensor}: taken as {value}; its median length is {norm:.4g}",
    ("acc.unit", "thousandths"): (
        "accelerometer: taken as thousandths of 1 m/s², a guess: whole numbers of median length {norm:.4g}; "
        "--counts acc=1000/m/s² confirms it"
    ),
    ("acc.unit", "mean_force"): (
        "accelerometer: taken as {value}, a guess: its median length is {norm:.4g}, as on a runner, and its mean over "
        "some seconds, turned back by the gyroscope, {force:.2f} g; --units acc={value} confirms it"
    ),
    ("acc.unit", "rest"): (
        "accelerometer: taken as {value}, a guess: its length is {rest:.4g} where nothing moves ({norm:.4g} usually); "
        "--units acc={value} confirms it"
    ),
    ("acc.unit", "counts"): (
        "accelerometer: raw counts, {per_g:g} per g, a guess: its median length is {norm:.4g}; "
        "--counts acc={per_g:g}/g confirms it"
    ),
    ("acc.gravity", "added"): (
        "accelerometer: {column} … hold {percent:.0f} % of the gravity in the columns beside them; the two were added"
    ),
    ("acc.sign", "gravity_vector"): _CORE_MOTION.format("a gravity vector of length 1 is Core Motion's"),
    ("acc.sign", "names"): _CORE_MOTION.format("these names are Core Motion's"),
    ("acc.sign", "sensor_logger"): _CORE_MOTION.format("Sensor Logger writes g on Apple's devices only, a guess"),
    ("acc.sign", "assumed"): (
        "accelerometer: its sign is a guess: it begins with {z:.2f} g along z, as a sensor does that lies upside down, "
        "or face up where −1 g is written at rest (Core Motion, Unity); for the latter --units acc=-{unit}"
    ),
    ("gyr.unit", "field"): (
        "gyroscope: taken as {value}; the magnetometer turns as it should (scale {scale:.3f}, correlation "
        "{correlation:.2f})"
    ),
    ("gyr.unit", "length"): (
        "gyroscope: taken as {value}, a guess: in it the field that turns with the body is {length:.4g} long, as the "
        "earth's; --units gyr={value} confirms it"
    ),
    ("gyr.unit", "doubtful"): (
        "gyroscope: taken as {declared}, by the header, but that is a guess: {why}; --units gyr={other} takes the other"
    ),
    ("gyr.unit", "against_header"): (
        "gyroscope: taken as {taken}, a guess against the header, which has {declared}: {why}"
    ),
    **{("gyr.unit", reason): f"gyroscope: taken as {{value}}; {why}" for reason, why in _GYROSCOPE.items()},
    **{
        (
            "gyr.unit",
            reason,
        ): f"gyroscope: raw counts, {_GYROSCOPE[reason]}; --counts gyr={{counts:g}}/deg/s confirms it"
        for reason in ("gravity_turn_counts", "gravity_turn_nearest_counts", "whole_numbers", "power_up")
    },
    ("mag.bias", "subtracted"): "magnetometer: without the bias that the phone wrote beside it",
    ("mag.used", "incomplete"): "magnetometer: left out, because no row is complete",
    ("mag.used", "zero"): "magnetometer: left out, because it is 0 on every row",
    ("mag.used", "offset"): (
        "magnetometer: not calibrated; a constant offset hides the turn of its field (length {length:.3g}), and a "
        "filter learns it"
    ),
    ("mag.used", "does_not_turn"): (
        "magnetometer: left out, because it does not turn with the body (correlation {correlation:.2f} with the "
        "gyroscope, length {length:.3g}); --map mag=… keeps it"
    ),
    ("mag.unit", "normalised"): (
        "magnetometer: its length never changes, so it was normalised: a direction without strength"
    ),
    ("mag.unit", "counts"): (
        "magnetometer: raw counts, {per:.4g} per µT, a guess: {chip}, at which its median length of {norm:.4g} is the "
        "earth's field; --counts mag={per:g}/µT confirms it"
    ),
    ("mag.unit", "whole"): (
        "magnetometer: taken as {value}, a guess: whole numbers of median length {norm:.4g}; --units mag={value} "
        "confirms it"
    ),
    ("mag.unit", "turn"): (
        "magnetometer: taken as {value}, a guess: the part that turns with the body has a length of {norm:.4g}; "
        "--units mag={value} confirms it"
    ),
    ("mag.unit", "unknown"): "magnetometer: kept as it is, without unit; its median length is {norm:.4g}",
    ("truth.rows", "zero"): "truth: {columns} are all zero in {value} rows; taken as missing there",
    ("truth.used", "empty"): "truth: left out, because no row has one",
    ("truth.used", "not_up"): (
        "truth: {columns} left out: in its world the mean specific force points to ({force}), not to (0, 0, 1); its "
        "third axis is not up, or it turns the world into the sensor; --map q=… keeps it as it is"
    ),
    ("truth.north", "unknown"): (
        "truth: {columns}; its frame is not known to point north, so only relative heading counts"
    ),
    ("sensors.unit", "mpu6050"): (
        "numbers without a unit are taken for raw counts of an MPU-6050 at its default full scales, 16384 per g and "
        "131 per °/s, a guess; another range is --counts gyr=65.5/deg/s --counts acc=8192/g"
    ),
}
