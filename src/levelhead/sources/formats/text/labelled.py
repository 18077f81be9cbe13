"""Text with a word before each number, as serial monitors and plotters show it.

``AcX = 1200 | AcY = -36``, ``ax=0.01 ay=0.02``, ``roll:1.2,pitch:3.4``, ``X: 0.1 Y: 0.2 Z: 9.8 m/s^2``,
``accel={x=0.1 m/s², y=0.2 m/s², z=9.8 m/s²}``, and lines that begin with their content, ``a/g:\t1\t2\t3\t4\t5\t6``.
Files and serial lines are read by the same rules.
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.text.file import TextFile
from levelhead.sources.formats.text.header import rate_in
from levelhead.sources.names.column_name import understand
from levelhead.sources.table import ArrayTable

# A number is separate: "acc1", "m/s^2", "a/g" and "0x50" hold none.
_NUMBER = re.compile(
    r"(?<![\w.^/])(?<!\d[-:])[-+]?(?:\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?|nan|NaN|NAN)(?![\w.]*[\w])"
    r"|(?<![\w.^/])(?<!\d[-:])[-+]?(?:\d+\.?\d*|\.\d+)(?=(?:deg|rad|dps|mg|g|uT|µT|m/s|°|ms|us|C)\b)"
)
_MIN_LABELLED = (
    0.6  # share of the lines with numbers that must be labelled; beside them stand temperatures and greetings
)
_MIN_SHARE = 0.05  # of the samples that hold a name, below which it is not a column
_MIN_NAMED = 6  # numbers behind a first one that has no name
_SAMPLE_LINES = 40
_UNIT_BEFORE_AXIS = re.compile(r"\s*[(\[]([^()\[\]]*)[)\]]\s*:\s*(?=[xyzXYZ]$)")  # "Gyroscope (rad/s): X"
_UNIT_OF_NAME = re.compile(r"(?<=\w)\s*[(\[]([^()\[\]]+)[)\]]\s*[:=]$")  # "Ax(g):"
_UNIT_BEHIND_NAME = re.compile(r"([A-Za-z]\w*)\s*[(\[]([^()\[\]\s]+)[)\]]\s*$")  # "acc[g] 0.1 0.2 0.3"
_OPENED = re.compile(r"([A-Za-z]\w*)\s*[=:]\s*[({\[]\s*([xyzwXYZW])$")  # "accel={x"
_SEPARATORS = ",;|\t[](){}"
_AXES = frozenset("xyzw")
_PLAIN_WORDS = frozenset(("data", "raw", "reading", "readings", "sensor", "value", "values"))  # of a heading
_COLUMNS = {1: ("",), 3: ("x", "y", "z"), 4: ("w", "x", "y", "z")}
_SENSORS = {"a": "acc", "g": "gyr", "m": "mag"}  # of the lines "a/g:" and "a/g/m:" that Arduino libraries print


def matches(file: TextFile) -> bool:
    """Whether most of the lines have a word before each number."""
    return looks_labelled(file.content[:_SAMPLE_LINES])


def tables(file: TextFile) -> Sequence[ArrayTable]:
    """The numbers of a text by their names, NaN where a sample lacks one.

    Raises:
        LevelheadError: no sample at all.
    """
    lines = file.lines()
    samples = [record for _, record in records(lines)]
    if not samples:
        raise LevelheadError(
            f"{file.display_path} has no line with a word before each number; expected such as ax=0.01 ay=…"
        )
    counts = Counter(name for record in samples for name in record)
    names = [name for name, count in counts.items() if count > _MIN_SHARE * len(samples)]
    arrays = {name: np.array([record.get(name, np.nan) for record in samples]) for name in names}
    kind = Conclusion("file.kind", "labelled", "labelled text", Basis.HEADER, {"names": ", ".join(names[:12])})
    return [ArrayTable(file.display_path, arrays, rate=rate_in(lines[:30]), conclusions=[kind])]


def parse(line: str) -> dict[str, float]:
    """The numbers of one line by their names; {} if it is not a line of words and numbers.

    A name is the text before ``=`` or ``:``; the axes that follow "Accel X" without a word of their own are named
    after it ("Accel Y"). A known unit after a number is added to the names of its group in brackets.

    >>> parse("Accel X: 0.1  Y: 0.2  Z: 9.8 m/s^2")
    {'Accel X [m/s^2]': 0.1, 'Accel Y [m/s^2]': 0.2, 'Accel Z [m/s^2]': 9.8}
    """
    numbers = list(_NUMBER.finditer(line))
    if not numbers:
        return {}
    labels: list[tuple[str, list[float], str]] = []  # name, numbers, unit
    end, named = 0, 0
    for found in numbers:
        unit, label = _split(line[end : found.start()])
        if unit and labels:
            labels[-1] = (*labels[-1][:2], unit)
        if label or not labels:
            labels.append((label, [], ""))
            named += bool(label)
        labels[-1][1].append(float(found.group()))
        end = found.end()
    unit, _ = _split(line[end:])
    if unit:
        labels[-1] = (*labels[-1][:2], unit)
    counts = [len(numbers) for _, numbers, _ in labels]
    known = all(count in _COLUMNS for count in counts) and sum(counts[1:]) >= _MIN_NAMED
    if labels[0][0] == "" and counts[0] == 1 and known and named == len(labels) - 1:
        labels[0] = ("time", *labels[0][1:])  # the number of a row or its stamp comes first, without a name
        named += 1
    if named == 0 or named < len(labels):
        return {}
    return _name_labels(labels)


def records(lines: Iterable[str]) -> Iterator[tuple[int, dict[str, float]]]:
    """Samples whose numbers may stand on several lines: (number of the first line, from 0; numbers by name).

    A new sample begins where a name comes again. Lines without a labelled number are skipped; those that name a sensor
    are the headings of the axes below: "Accelerometer data", "x: 0.1".
    """
    first, record, heading = 0, dict[str, float](), ""
    for i, line in enumerate(lines):
        found = parse(line)
        if not found:
            heading = _heading(line) or heading
            continue
        if heading:
            found = {
                f"{heading} {name}" if name[0].lower() in _AXES and not name[1:2].isalpha() else name: number
                for name, number in found.items()
            }
        if record and not record.keys().isdisjoint(found):
            yield first, record
            record = {}
        if not record:
            first = i
        record |= found
    if record:
        yield first, record


def _heading(line: str) -> str:
    """The text of a line that names a sensor, and nothing else."""
    text = line.strip(" \t:=-#*")
    words = [word for word in text.partition("(")[0].lower().split() if word not in _PLAIN_WORDS]
    return text if len(words) == 1 and understand(f"{words[0]} x").role in _SENSORS.values() else ""


def looks_labelled(lines: Sequence[str]) -> bool:
    """Whether most of the lines with numbers have a word before each of them."""
    with_numbers = [line for line in lines if any(sign.isdigit() for sign in line)]
    return bool(with_numbers) and sum(bool(parse(line)) for line in with_numbers) > _MIN_LABELLED * len(with_numbers)


def _split(gap: str) -> tuple[str, str]:
    """(unit of the number before, name of the number behind) in the text between two numbers."""
    text = gap.rstrip(" \t([{\"',")
    marked = text[-1:] in ("=", ":")
    bracket = _UNIT_OF_NAME.search(text) if marked else _UNIT_BEHIND_NAME.search(gap)
    if bracket is not None and _leading_unit(bracket[bracket.lastindex or 1]) is not None:
        return _split_with_bracket(text if marked else gap, bracket, marked)
    body = _UNIT_BEFORE_AXIS.sub(" ", text.rstrip("=: ")) if marked else gap
    words = [word for part in re.split(f"[{re.escape(_SEPARATORS)}]|\\s{{2,}}", body) if (word := part.strip(" \"'"))]
    unit, words = _take_unit(words, not marked or '"' in gap)
    if not words or (not marked and not _is_prefix(gap)):
        return unit, ""
    opened = _OPENED.search(body) if marked else None
    name = words[-1] if opened is None else f"{opened[1]} {opened[2]}"
    return unit, name if any(sign.isalpha() for sign in name) else ""


def _split_with_bracket(text: str, bracket: re.Match[str], marked: bool) -> tuple[str, str]:
    """The same, where the name behind has its own unit in brackets: "Ax(g):" and, without a mark, "acc[g]"."""
    if marked:
        unit, name = _split(f"{text[: bracket.start()]}:")
        return unit, f"{name} [{bracket[1]}]" if name else ""
    unit, _ = _split(f"{text[: bracket.start()]} x:")
    return unit, f"{bracket[1]} [{bracket[2]}]"


def _take_unit(words: list[str], alone: bool) -> tuple[str, list[str]]:
    """(unit, other words) of words that may begin with the unit of the number before; ``alone``: it may be all of them.

    In "t = 0 ms, …" a unit alone before its mark is a name.
    """
    leading = _leading_unit(words[0]) if words else None
    if leading is None:
        return "", words
    unit, rest = leading
    if rest:
        return unit, [rest, *words[1:]]
    return (unit, words[1:]) if len(words) > 1 or alone else ("", words)


def _is_prefix(gap: str) -> bool:
    """Whether a gap without ``=`` or ``:`` is a name all the same: a word and a tab ("ypr\\t1\\t2")."""
    return gap.endswith("\t") and gap.strip().isidentifier()


def _leading_unit(text: str) -> tuple[str, str] | None:
    """(unit, the rest) if the text begins with a unit."""
    words = text.split()
    for count in (2, 1):
        unit = " ".join(words[:count])
        if len(words) >= count and any(units.find_factor(quantity, unit) is not None for quantity in units.FACTORS):
            rest = " ".join(words[count:])
            if rest or len(unit) > 1 or len(words) == count:
                return unit, rest
    return None


def _name_labels(labels: Sequence[tuple[str, list[float], str]]) -> dict[str, float]:
    groups: list[tuple[str | None, list[tuple[str, float]], str]] = []  # words before the axis, (name, number), unit
    for label, numbers, unit in labels:
        words = label.split()
        axis = words[-1].lower() in _AXES and len(numbers) == 1
        bare = axis and len(words) == 1
        if bare and groups and groups[-1][0] is not None:
            stem, members, known = groups.pop()
            groups.append((stem, [*members, (f"{stem} {label}".strip(), numbers[0])], unit or known))
        elif groups and not groups[-1][2] and _is_next_axis(groups[-1][1][-1][0], label) and len(numbers) == 1:
            groups[-1] = (None, [*groups[-1][1], (label, numbers[0])], unit)
        else:
            groups.append((" ".join(words[:-1]) if axis else None, list(_columns(label, numbers).items()), unit))
    return {f"{name} [{unit}]" if unit else name: number for _, members, unit in groups for name, number in members}


def _is_next_axis(name: str, label: str) -> bool:
    """Whether ay follows ax: one unit behind az is that of the three."""
    return name[:-1] == label[:-1] != "" and (name[-1] + label[-1]).lower() in ("xy", "yz")


def _columns(label: str, numbers: Sequence[float]) -> Mapping[str, float]:
    """Numbers behind one word: three are x, y, z; six behind "a/g" are two sensors' axes."""
    kinds = [_SENSORS.get(part.strip().lower(), "") for part in label.split("/")]
    if all(kinds) and len(numbers) == 3 * len(kinds):
        return dict(zip((f"{kind}_{axis}" for kind in kinds for axis in "xyz"), numbers, strict=True))
    axes = _COLUMNS.get(len(numbers), tuple(str(i + 1) for i in range(len(numbers))))
    return {f"{label}_{axis}" if axis else label: number for axis, number in zip(axes, numbers, strict=True)}
