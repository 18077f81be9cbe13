"""Lines wrapped by a terminal, a logger or a protocol: a clock, $SENTENCES, letters, brackets, units in each cell."""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.sources.formats.text.cells import is_number, lines_of
from levelhead.sources.formats.text.file import TextFile
from levelhead.sources.formats.text.labelled import looks_labelled, parse
from levelhead.sources.names.column_name import understand

_SAMPLE_LINES = 200
_MIN_CONTENT = 6  # lines that are not comments; a protocol whose lines begin as comments may send some greetings too
_MIN_SHARE = 0.6  # of the lines, wrapped in the same way
_MIN_OPEN = 0.3  # of the lines, that open or close a quoted cell and not both
_MIN_NUMBERS = 6  # of a gyroscope and an accelerometer
_MIN_UNITS = 6  # cells of a line that hold a unit
_COLOUR = re.compile(r"\x1b\[[\d;]*m")  # of a terminal
_PLAIN = r"[^\s,;={}\"]"
_TAG = (  # "-> ", or words of which the last is no number: "host app[1]: ", "<inf> main: ", "D/Tag( 12): ", "INFO | "
    rf"(?:-?>|(?:{_PLAIN}+\s+){{0,6}}?{_PLAIN}*[A-Za-z_)\]]{_PLAIN}*\s*[-:>|\]]+)\s"
)
_TAGS = re.compile(rf"\s*{_TAG}\s*")
_STAMPED = re.compile(
    rf"""^\s* (?:\[[A-Za-z][\w.-]*\]\s*)*                               # a node, a level
    (?: [VDIWE][ ]\((?P<ms>\d+)\)                                       # ESP-IDF
      | (?P<bracket>\[\s*)?
        (?: (?:(?:\d{{4}}-)?\d\d-\d\d[ T] | [A-Z][a-z]{{2}}[ ][ \d]\d[ ])?
            (?P<clock>\d\d?:\d\d:\d\d[.,]\d+) (?:,\d{{3}})?             # Zephyr writes .123,456
            (?:Z|[+-]\d\d:?\d\d)?
          | (?(bracket)(?P<s>\d+\.\d+)|(?!)) )
    ) (?(bracket)\]:?|(?=\s*{_TAG}))
    (?P<rest>.*)$""",
    re.VERBOSE,
)
_TOPIC = re.compile(r"^[^\s{\"\[]+[ \t]+(\{\s*\".*\})\s*$")  # mosquitto_sub -v
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
_NESTED = re.compile(  # Python's (t, (x, y, z), …) and [t, x, y, z, …]
    r"^\s*[(\[]\s*(?:(?:[-+\d.eE]+\s*,\s*)?[(\[]|[-+\d.eE]+(?:\s*,\s*[-+\d.eE]+){5})[-+\d.eE,\s()\[\]]+[)\]],?\s*$"
)
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
_VECTOR_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_BETWEEN = r"(?:\s*[,;]\s*|\s+)"
_VECTOR = re.compile(rf"\"?[\[(]\s*({_VECTOR_NUMBER}(?:{_BETWEEN}{_VECTOR_NUMBER}){{2,3}})\s*[\])]\"?")
_QUOTE = r"[\"']{0,2}"
_OBJECT = re.compile(
    rf"\"?\{{\s*{_QUOTE}x{_QUOTE}\s*:\s*({_VECTOR_NUMBER})\s*,\s*{_QUOTE}y{_QUOTE}\s*:\s*({_VECTOR_NUMBER})\s*,"
    rf"\s*{_QUOTE}z{_QUOTE}\s*:\s*({_VECTOR_NUMBER})\s*\}}\"?"
)
_LABEL = re.compile(r"[A-Za-z]\w*\s*[:=]")
_MARK = "\1"
_KEY = re.compile(r"[\"']\w+[\"']\s*:")
_ROW_TIME = {"time": "time_s", "time_ms": "time_ms"}  # a clock time is counted in s where each number has a name
_AXES = {1: ("",), 3: ("_x", "_y", "_z")}
_CELL = r"\s*\"?[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?\s*[a-zA-Zµ°][\w/^²°.]*\"?\s*"
_MEASURED = re.compile(rf"(?:[,;\t]|^){_CELL}[,;\t]{_CELL}[,;\t]{_CELL}(?:[,;\t]|$)")
_WORD = re.compile(r"(?<![\w/])([A-Za-z]\w*)[ \t]+(?=[-+]?\.?\d)")  # accel 0.1 0.2 9.8
_PARTS = re.compile(r"\s*\"?([-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)\s*([a-zA-Zµ°][\w/^²°.]*)\"?\s*$")


def matches(file: TextFile) -> bool:
    """Whether the first lines are wrapped in one way."""
    lines = file.content if len(file.content) >= _MIN_CONTENT else file.head
    return unwrap("\n".join(lines[:_SAMPLE_LINES])) is not None


def unwrap_file(file: TextFile) -> TextFile:
    """The file with the text that its lines wrap.

    Raises:
        LevelheadError: the lines below are not wrapped as the first ones are.
    """
    text = unwrap(file.text())
    if text is None:
        raise LevelheadError(
            f"{file.display_path} begins with sentences or stamps of a terminal, but does not go on with them"
        )
    return file.with_text(text)


def unwrap(text: str) -> str | None:
    """The text as lines of another dialect; None if its lines are not wrapped in the same way, by any pattern here."""
    lines = [line for line in lines_of(text) if line.strip()]
    sample = lines[:_SAMPLE_LINES]
    if not sample:
        return None
    if sum(line.count('"') % 2 for line in sample) > _MIN_OPEN * len(sample):
        return _without_breaks(lines)
    if sample[0].lstrip() == sample[0] and sum(line[0] in " \t" for line in sample) > _MIN_OPEN * len(sample):
        lines, sample = _with_continuations(lines), _with_continuations(sample)
    for wrapping in _WRAPPINGS:
        if sum(wrapping.pattern.search(line) is not None for line in sample) > _MIN_SHARE * len(sample):
            return wrapping.unwrap(lines)
    return None


def _with_continuations(lines: Sequence[str]) -> list[str]:
    """A line for each that is not indented, those below it joined to it: Zephyr's sensors."""
    made: list[str] = []
    for line in lines:
        if made and line[0] in " \t":
            made[-1] += f" {line.strip()}"
        else:
            made.append(line.rstrip())
    return made


def _without_breaks(lines: Sequence[str]) -> str | None:
    """A table whose quoted cells go over lines, as NumPy's arrays do in pandas' files: a line for each row."""
    made: list[str] = []
    is_open = False
    for line in lines:
        if is_open:
            made[-1] += f" {line.strip()}"
        else:
            made.append(line)
        is_open ^= line.count('"') % 2 == 1
    return "\n".join(made) if len(made) < len(lines) else None


def _with_commas(lines: Sequence[str]) -> str | None:
    """Sensors parted by semicolons or bars, their axes by commas: commas everywhere."""
    return "\n".join(re.sub(r"\s*[;|]\s*", ",", line.strip().rstrip(";|,")) for line in lines)


def _without_colours(lines: Sequence[str]) -> str | None:
    """Colour codes of a terminal."""
    return "\n".join(_COLOUR.sub("", line) for line in lines)


def _without_stamps(lines: Sequence[str]) -> str | None:
    """The lines of loggers and of serial monitors with time stamps: "12:30:15.250 -> 0.1,0.2"."""
    matches = [match for line in lines if (match := _STAMPED.match(line))]
    found = [(match["clock"] or match["s"] or match["ms"], _without_tag(match)) for match in matches]
    name = "time_ms" if matches[-1]["ms"] else "time"
    if not _are_labelled(found):
        marked = [(clock, _WORD.sub(r"\1: ", rest)) for clock, rest in found]
        found = marked if _are_labelled(marked) else found
    if found[-1][1].startswith("{"):
        objects = [(clock, rest.strip()[1:]) for clock, rest in found if rest.startswith("{")]
        return "\n".join(f'{{"{_ROW_TIME[name]}": {_count(clock)}, {rest}' for clock, rest in objects)
    if _are_labelled(found):
        return "\n".join(
            f"{_ROW_TIME[name]}: {_count(clock)} {_AROUND.sub(' ', rest)}" for clock, rest in found if parse(rest)
        )
    return "\n".join(_clock_cell(clock, rest, name) + rest for clock, rest in found)


def _are_labelled(found: Sequence[tuple[str, str]]) -> bool:
    """Whether texts behind stamps have a word before each number."""
    return looks_labelled([rest for _, rest in found[1:40]])


def _without_tag(stamped: re.Match[str]) -> str:
    """The content of a line of ``_STAMPED``: the text behind names of programs, nodes and levels."""
    rest = stamped["rest"].strip()
    while (tag := _TAGS.match(rest)) and not _is_label(tag[0].strip(), rest[tag.end() :]):
        rest = rest[tag.end() :]
    return rest


def _is_label(tag: str, rest: str) -> bool:
    """Whether a word with a colon is the name of the numbers behind it: of a sensor, or one of several names."""
    return _names_sensor(tag) or (tag[-1] == ":" and rest[:1] in "+-.0123456789" and _LABEL.search(rest) is not None)


@lru_cache(maxsize=1000)
def _names_sensor(tag: str) -> bool:
    words = re.split(r"[\s/:]+", tag)
    return any(understand(name).role for word in words if word for name in (word, f"{word} x"))


def _clock_cell(clock: str, rest: str, name: str) -> str:
    """The first cell of a row, with its delimiter: the clock, or its name before names."""
    delimiter = next((sign for sign in "\t;," if sign in rest), " ")
    numbers = sum(sign.isdigit() for sign in rest) > 0.3 * len(rest)
    return f"{clock if numbers else name}{delimiter}"


def _count(clock: str) -> str:
    """Seconds since midnight of a clock time; a plain count as it is."""
    if ":" not in clock:
        return clock
    hour, minute, second = clock.replace(",", ".").split(":")
    return f"{3600 * int(hour) + 60 * int(minute) + float(second):.6f}"


def _without_topics(lines: Sequence[str]) -> str | None:
    """Objects of JSON behind the topic that they came by."""
    return "\n".join(match[1] for line in lines if (match := _TOPIC.match(line)))


def _without_tags(lines: Sequence[str]) -> str | None:
    """Lines of a protocol that begin as comments do: "#YPRAMG=1.2,3.4,…". Of several kinds the rows stay typed."""
    found = [match.groups() for line in lines if (match := _TAGGED.match(line))]
    if len(kinds := {tag for tag, _ in found}) > 1:
        return "\n".join(f"{tag},{rest}" for tag, rest in found)
    parts = {"A": "acc", "M": "mag", "G": "gyr"}  # Razor AHRS: yaw, pitch, roll and these, by its letters
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
        counts = Counter(row[0] for row in found if sum(is_number(cell, False) for cell in row) >= _MIN_NUMBERS)
        usual = max(counts, key=lambda tag: counts[tag], default=None)
        found = [row for row in found if usual in (None, row[0])]
    return "\n".join(map(",".join, found))


def _without_points(lines: Sequence[str]) -> str | None:
    """Names and numbers, their stamp first."""
    found = [match.groups() for line in lines if (match := _POINT.match(line))]
    return "\n".join(f"time_ns: {stamp} {fields.replace(',', ' ')}" for fields, stamp in found)


def _without_nesting(lines: Sequence[str]) -> str | None:
    """The numbers of tuples in tuples, or of a list."""
    return "\n".join(re.sub(r"[()\[\]\s]", "", line).rstrip(",") for line in lines)


def _without_letters(lines: Sequence[str]) -> str | None:
    """Razor AHRS: a line for each sensor, which a letter names; a sample ends where a letter comes again."""
    names = {"A": "acc", "G": "gyr", "M": "mag"}
    samples = _letter_samples(lines)
    kinds = [kind for kind in names if sum(kind in sample for sample in samples) > _MIN_SHARE * len(samples)]
    if not {"A", "G"} <= set(kinds):
        return None
    head = ",".join(f"{names[kind]}_{axis}" for kind in kinds for axis in "xyz")
    whole = [sample for sample in samples if set(kinds) <= set(sample)]
    return "\n".join([head, *(",".join(sample[kind] for kind in kinds) for sample in whole)])


def _letter_samples(lines: Sequence[str]) -> list[dict[str, str]]:
    """The axes of each sensor by its letter, for each sample."""
    samples: list[dict[str, str]] = []
    for line in lines:
        match = _LETTER.match(line)
        if match is None or match[2].count(",") != 2:
            continue
        if not samples or match[1] in samples[-1]:
            samples.append({})
        samples[-1][match[1]] = match[2].strip()
    return samples


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


def _without_objects(lines: Sequence[str]) -> str | None:
    """Cells such as "{'x': 0.1, 'y': 0.2, 'z': 9.8}" as columns; None: each line is one object."""
    return _without_vectors([_OBJECT.sub(r"(\1, \2, \3)", line) for line in lines])


def _without_vectors(lines: Sequence[str]) -> str | None:
    """The lines as a table with commas, three columns for a vector of three; None: they are words with vectors."""
    first = next(i for i, line in enumerate(lines) if _VECTOR.search(line))
    if _KEY.search(lines[first]) or any(_MARK in cell != _MARK for cell in _plain_cells(lines[first])):
        return None
    sizes = [len(cell) for cell in _cells(lines[first])]
    rows = [_cells(line) for line in lines[first:] if _VECTOR.search(line)]
    body = [",".join(part for cell in row for part in cell) for row in rows if [len(cell) for cell in row] == sizes]
    return "\n".join([*_header(lines[first - 1], sizes), *body] if first > 0 else body)


def _cells(line: str) -> list[list[str]]:
    """The cells of a line, each as its numbers: one, or those of a vector."""
    following = iter([re.split(r"[\s,;]+", found.strip()) for found in _VECTOR.findall(line)])
    return [next(following) if cell == _MARK else [cell.replace(",", ".")] for cell in _plain_cells(line)]


def _plain_cells(line: str) -> list[str]:
    """The cells of a line, a mark in place of each vector."""
    plain = _VECTOR.sub(_MARK, line).strip()
    delimiter = next((sign for sign in "\t;,|" if sign in plain), None)
    return [cell.strip() for cell in plain.split(delimiter)]


def _header(line: str, sizes: Sequence[int]) -> list[str]:
    """The header line with a name for each number; [] if it has not one name for each cell."""
    sign = max("\t;,|", key=line.count)
    titles = [title.strip().strip("\"'") for title in line.split(sign)]
    if len(titles) != len(sizes):
        return []
    every = [_AXES.get(size, tuple(f"_{i + 1}" for i in range(size))) for size in sizes]
    return [",".join(f"{title}{axis}" for title, axes in zip(titles, every, strict=True) for axis in axes)]


def _without_units(lines: Sequence[str]) -> str | None:
    """Cells that hold a number and its unit, "0.02 g", as numbers and a unit in the name of each column.

    None: the words behind the numbers are not units.
    """
    first = next(i for i, line in enumerate(lines) if _MEASURED.search(line))
    delimiter = max("\t;,", key=lines[first].count)
    cell_units = [parts[2] if (parts := _PARTS.match(cell)) else "" for cell in lines[first].split(delimiter)]
    if first == 0 or sum(map(_is_unit, cell_units)) < _MIN_UNITS or looks_labelled(lines[:40]):
        return None
    titles = [title.strip() for title in lines[first - 1].split(delimiter)]
    if len(titles) != len(cell_units):
        return None
    head = delimiter.join(
        f"{title} [{unit}]" if unit else title for title, unit in zip(titles, cell_units, strict=True)
    )
    body = [delimiter.join(_PARTS.sub(r"\1", cell) for cell in line.split(delimiter)) for line in lines[first:]]
    return "\n".join([head, *body])


def _is_unit(text: str) -> bool:
    return any(units.find_factor(quantity, text) is not None for quantity in units.FACTORS)


class Wrapping(NamedTuple):
    """A pattern of lines, and the function that gives the lines without it; None if they are something else."""

    pattern: re.Pattern[str]
    unwrap: Callable[[Sequence[str]], str | None]


# In this order because later patterns match lines of earlier ones too: a logger's clock comes before any sentence, and
# a sentence of a known maker is a sentence with a checksum.
_WRAPPINGS = (
    Wrapping(_COLOUR, _without_colours),
    Wrapping(_STAMPED, _without_stamps),
    Wrapping(_TOPIC, _without_topics),
    Wrapping(_TAGGED, _without_tags),
    Wrapping(_MESSAGE, _without_braces),
    Wrapping(_POINT, _without_points),
    Wrapping(_UM7, _with_words),
    Wrapping(_SENTENCE, _without_sentences),
    Wrapping(_CHECKED, _without_checksums),
    Wrapping(_LETTER, _without_letters),
    Wrapping(_BRACKETS, _without_brackets),
    Wrapping(_TWO_SIGNS, _with_commas),
    Wrapping(_OBJECT, _without_objects),
    Wrapping(_NESTED, _without_nesting),
    Wrapping(_VECTOR, _without_vectors),
    Wrapping(_MEASURED, _without_units),
)
