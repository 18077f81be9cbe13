"""Lines that a terminal, a logger or a protocol has dressed up: a clock, $SENTENCES, letters, brackets."""

import re
from collections import Counter
from collections.abc import Sequence

from levelhead.sources.formats.text.cells import is_number, lines_of
from levelhead.sources.formats.text.labelled import looks_labelled
from levelhead.sources.formats.text.unit_cells import MEASURED, without_units
from levelhead.sources.formats.text.vector_cells import OBJECT, VECTOR, without_objects, without_vectors
from levelhead.sources.names.column_name import understand

_SIX = 6  # numbers of a gyroscope and an accelerometer
MOST = 0.6  # share of the lines that must be dressed alike
_ARROW = re.compile(r"^\s*\[?(?:\d{4}-\d\d-\d\d[ T])?(\d\d?:\d\d:\d\d[.,]\d+)\]?\s*(?:->|>)\s?(.*)$")
_CLOCK = r"(?:\d{4}-\d\d-\d\d[ T])?(\d\d?:\d\d:\d\d[.,]\d+)"
_LOGGER = re.compile(rf"^\s*{_CLOCK}(?:\s*[-|]\s*[A-Za-z_][\w.: ]*?)+\s*[-|:]\s*(.*)$")  # Python's logging, loguru
_BRACKETED = re.compile(rf"^\s*\[{_CLOCK}\]\s*(.*)$")
_ESP = re.compile(r"^\s*[VDIWE] \((\d+)\) [^:]*: (.*)$")  # ESP-IDF: the level, ms since the start, a tag
_COUNTED = re.compile(r"^\s*(?:\[[A-Z]+\]\s*)?\[\s*(\d+\.\d+)\]:?\s*(.*)$")  # "[12.345] …", "[INFO] [1683203415.25]: …"
_TAGGED = re.compile(
    r"^\s*[#%]([A-Za-z]\w*)[=,:]\s*([-+\d.][-+\d.eE,\s]*?)(?:\*[0-9A-Fa-f]{2,8})?\s*$"
)  # "#YPRAMG=1,2"
_MESSAGE = re.compile(
    r"^(?=[^{]*\{)[^{}]*?\b([A-Z][A-Z0-9_]{1,30}) \{(\w+ : [^{}]*)\}\s*$"
)  # mavlogdump: "…: IMU {TimeUS : 1, …}"
_LETTER = re.compile(r"^\s*#([AGM])(?:-[A-Z])?=([-+\d.,eE\s]+)$")  # Razor AHRS: #A-C=1.2,3.4,5.6
_AROUND = re.compile(r"[(\[]\s*(?=[-+.]*\d)|(?<=\d)\s*[)\]]")  # brackets around numbers
_YPR = re.compile(r"YPR(?=.*A)(?=.*G)[AMG]{2,3}")
_UM7 = re.compile(r"^\s*\$PCHRS,([012]),([-+\d.eE, ]+?),?\*[0-9A-Fa-f]{2}\s*$")  # which sensor, s, x, y, z
_CHECKED = re.compile(r"^\s*[$!][A-Za-z]\w*,[^*]*(?:\*[0-9A-Fa-f]{2,8})?\s*$")  # NMEA: $IMU,…*3F
_POINT = re.compile(r"^[A-Za-z]\S* ((?:\w+=[^\s,=]+,){2,}\w+=[^\s,=]+) (\d{16,19})\s*$")  # InfluxDB's lines, ns
_NESTED = re.compile(
    r"^\s*[(\[]\s*(?:[-+\d.eE]+\s*,\s*)?[(\[][-+\d.eE,\s()\[\]]+[)\]],?\s*$"
)  # Python: (t, (x, y, z), …)
_SENTENCE = re.compile(r"^\s*\$(VN[A-Z]{3}),(.*?)(?:\*[0-9A-Fa-f]{2,4})?\s*$")
_BRACKETS = re.compile(r"([A-Za-z]+)\s*\(([^)]*)\)\s*\[([^\]]*)\]")
_TWO_SIGNS = re.compile(  # 1,2,3;4,5,6: no letters. A line without ; and | is no candidate.
    r"^(?=[^;|]*[;|]).*?(?=[^;|]*,[^;|]*,)[-+\d.eE,; |]*\d\s*[;|]\s*[-+.\d][-+\d.eE,; |]*$"
)
_FIELD = [f"mag_{axis} [G]" for axis in "xyz"]
_ACC, _GYR = [f"acc_{axis} [m/s²]" for axis in "xyz"], [f"gyr_{axis} [rad/s]" for axis in "xyz"]
_VECTORNAV = {  # VN-100 user manual, asynchronous ASCII messages
    "VNIMU": [*_FIELD, *_ACC, *_GYR, "temperature", "pressure"],
    "VNYMR": ["yaw", "pitch", "roll", *_FIELD, *_ACC, *_GYR],
    "VNQMR": ["quat_x", "quat_y", "quat_z", "quat_w", *_FIELD, *_ACC, *_GYR],
}


def undress_text(text: str) -> str | None:
    """The text as a table, or None if its lines are dressed in no way that is known here."""
    lines = [line for line in lines_of(text) if line.strip()]
    sample = lines[:200]
    for pattern, plain in (
        (_ARROW, _without_arrows), (_BRACKETED, _without_arrows), (_LOGGER, _without_arrows), (_ESP, _without_arrows),
        (_COUNTED, _without_arrows), (_TAGGED, _without_tags), (_MESSAGE, _without_braces), (_POINT, _without_points),
        (_UM7, _with_words), (_SENTENCE, _without_sentences), (_CHECKED, _without_checksums),
        (_LETTER, _without_letters), (_BRACKETS, _without_brackets), (_TWO_SIGNS, _with_commas),
        (OBJECT, without_objects), (_NESTED, _without_nesting), (VECTOR, without_vectors), (MEASURED, without_units),
    ):  # fmt: skip
        if sum(pattern.search(line) is not None for line in sample) > MOST * len(sample):
            return plain(lines)
    return None


def _with_commas(lines: Sequence[str]) -> str | None:
    """Sensors parted by semicolons or bars, their axes by commas: commas everywhere."""
    return "\n".join(re.sub(r"\s*[;|]\s*", ",", line.strip().rstrip(";|,")) for line in lines)


def _without_arrows(lines: Sequence[str]) -> str | None:
    """The serial monitor of the Arduino IDE with time stamps, "12:30:15.250 -> 0.1,0.2", and what loggers write."""
    pattern = next(
        one for one in (_ARROW, _BRACKETED, _LOGGER, _ESP, _COUNTED) if sum(map(bool, map(one.match, lines[:200]))) > 9
    )
    found = [match.groups() for line in lines if (match := pattern.match(line))]
    labelled = looks_labelled([rest for _, rest in found[1:40]])
    made = []
    for clock, rest in found:
        if labelled:
            made.append(f"time_{'ms' if pattern is _ESP else 's'}: {_count(clock)} {_AROUND.sub(' ', rest)}")
        else:
            delimiter = next((sign for sign in "\t;," if sign in rest), " ")
            numbers = sum(sign.isdigit() for sign in rest) > 0.3 * len(rest)
            name = "time_ms" if pattern is _ESP else "time"
            made.append(f"{clock if numbers else name}{delimiter}{rest}")
    return "\n".join(made)


def _count(clock: str) -> str:
    """Seconds since midnight of a clock time; a plain count as it is."""
    if ":" not in clock:
        return clock
    hour, minute, second = clock.replace(",", ".").split(":")
    return f"{3600 * int(hour) + 60 * int(minute) + float(second):.6f}"


def _without_tags(lines: Sequence[str]) -> str | None:
    """Lines of a protocol that begin as comments do: "#YPRAMG=1.2,3.4,…". Of several kinds the rows stay typed."""
    found = [match.groups() for line in lines if (match := _TAGGED.match(line))]
    if len(kinds := {tag for tag, _ in found}) > 1:
        return "\n".join(f"{tag},{rest}" for tag, rest in found)
    parts = {"A": "acc", "M": "mag", "G": "gyr"}  # Razor AHRS: yaw, pitch, roll and these, as its letters say
    tag = kinds.pop()
    names = [f"{parts[letter]}_{axis}" for letter in tag[3:] for axis in "xyz"] if _YPR.fullmatch(tag) else []
    return "\n".join([",".join(["yaw", "pitch", "roll", *names])] * bool(names) + [rest for _, rest in found])


def _without_braces(lines: Sequence[str]) -> str | None:
    """Messages as pymavlink prints them: rows typed by their name, as ArduPilot's own text logs are."""
    made: list[str] = []
    formats: dict[str, list[str]] = {}
    for line in lines:
        if (match := _MESSAGE.match(line)) is None:
            continue
        kind, cells = match[1], [cell.partition(" : ")[::2] for cell in match[2].split(", ")]
        if kind not in formats:
            formats[kind] = [name for name, _ in cells]
            made.append(",".join(["FMT", "0", "0", kind, "text", *formats[kind]]))
        if [name for name, _ in cells] == formats[kind]:
            made.append(",".join([kind, *(value for _, value in cells)]))
    return "\n".join(made)


def _without_checksums(lines: Sequence[str]) -> str | None:
    """Sentences: rows typed by their names; where no name is a sensor's, those of the commonest with six numbers."""
    found = [line.strip().lstrip("$!").partition("*")[0].split(",") for line in lines]
    if not {"gyr", "acc"} & {understand(f"{row[0]} x").role for row in found[:200]}:
        counts = Counter(row[0] for row in found if sum(is_number(cell, False) for cell in row) >= _SIX)
        found = [row for row in found if row[0] == max(counts, key=lambda tag: counts[tag], default=row[0])]
    return "\n".join(map(",".join, found))


def _without_points(lines: Sequence[str]) -> str | None:
    """Names and numbers, their stamp first."""
    found = [match.groups() for line in lines if (match := _POINT.match(line))]
    return "\n".join(f"time_ns: {stamp} {fields.replace(',', ' ')}" for fields, stamp in found)


def _without_nesting(lines: Sequence[str]) -> str | None:
    """The numbers of tuples in tuples."""
    return "\n".join(re.sub(r"[()\[\]\s]", "", line).rstrip(",") for line in lines)


def _without_letters(lines: Sequence[str]) -> str | None:
    """Razor AHRS: a line for each sensor, which a letter names; a sample ends where a letter comes again."""
    names = {"A": "acc", "G": "gyr", "M": "mag"}
    samples: list[dict[str, str]] = []
    for line in lines:
        found = _LETTER.match(line)
        if found is None or found[2].count(",") != 2:
            continue
        if not samples or found[1] in samples[-1]:
            samples.append({})
        samples[-1][found[1]] = found[2].strip()
    kinds = [kind for kind in names if sum(kind in sample for sample in samples) > MOST * len(samples)]
    if not {"A", "G"} <= set(kinds):
        return None
    head = ",".join(f"{names[kind]}_{axis}" for kind in kinds for axis in "xyz")
    return "\n".join(
        [head, *(",".join(sample[kind] for kind in kinds) for sample in samples if set(kinds) <= set(sample))]
    )


def _without_sentences(lines: Sequence[str]) -> str | None:
    """VectorNav's ASCII messages; of several kinds the first that has a gyroscope."""
    found = [match.groups() for line in lines if (match := _SENTENCE.match(line))]
    kind = next((word for word, _ in found if word in _VECTORNAV), None)
    if kind is None:
        return None
    return "\n".join([",".join(_VECTORNAV[kind]), *(rest for word, rest in found if word == kind)])


def _with_words(lines: Sequence[str]) -> str | None:
    """CH Robotics' UM6 and UM7 in NMEA sentences: rows typed by the sensor (UM7 data sheet, $PCHRS)."""
    words = {"0": "Gyroscope", "1": "Accelerometer", "2": "Magnetometer"}
    found = [match.groups() for line in lines if (match := _UM7.match(line))]
    return "\n".join(f"{words[kind]},{rest}" for kind, rest in found)


def _without_brackets(lines: Sequence[str]) -> str | None:
    """SparkFun's examples: "Acc (mg) [ -16.11, 33.69, 994.14 ], Gyr (DPS) [ … ]"."""
    rows = [_BRACKETS.findall(line) for line in lines]
    names = next((parts for parts in rows if len(parts) > 1), [])
    if not names:
        return None
    titles = [
        f"{name}_{axis} [{unit}]" if len(numbers.split(",")) == 3 else name
        for name, unit, numbers in names
        for axis in ("xyz" if len(numbers.split(",")) == 3 else "x")
    ]
    body = [", ".join(numbers.strip() for _, _, numbers in parts) for parts in rows if len(parts) == len(names)]
    return "\n".join([",".join(titles), *body])
