"""Text whose rows belong to different sensors: a word or a number in each row names it.

"IMU, 1200, 0.1, …" beside "MAG, 1201, …" (ArduPilot, with FMT rows that name the columns), "ACC;12;0.1;…", and tables
with a column "sensor" in which accelerometer and gyroscope alternate.
"""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.text.cells import cells, is_comment, is_number, lines_of
from levelhead.sources.formats.text.dates import is_stamp, nanoseconds
from levelhead.sources.formats.text.file import TextFile
from levelhead.sources.names.column_name import understand
from levelhead.sources.table import ArrayTable, Column
from levelhead.units import GRAVITY

_SAMPLE_LINES = 400
_HEAD = 1 << 16  # characters in which comments may name columns
_ANDROID = {  # android.hardware.Sensor.TYPE_…
    "1": "accelerometer", "2": "magnetometer", "4": "gyroscope", "9": "gravity", "10": "linear acceleration",
    "14": "magnetometer uncalibrated", "16": "gyroscope uncalibrated", "35": "accelerometer uncalibrated",
}  # fmt: skip
_ACCURACY = {"-1", "0", "1", "2", "3"}  # android.hardware.SensorManager.SENSOR_STATUS_…
_TYPE = {"sensor", "type", "sensortype", "sensor_type", "sensorid", "sensor_id", "sensor type", "stream type"}
_NUMBERED_KINDS = {
    "3": "accelerometer", "4": "gyroscope", "5": "magnetometer", "82": "linear acceleration", "83": "gravity",
}  # fmt: skip
_NUMBERED = re.compile(r"([A-Za-z][A-Za-z_. ]*)[\[(]?(\d)[\])]?")
_FIELD, _BIAS = (
    re.compile(r"(?i)uncal.*mag|mag.*uncal"),
    re.compile(r"(?i)bias"),
)  # x of Android is the field + its bias
_MAX_TYPES = 80
_MAX_KEY = 6  # columns that may be the key
_MIN_ROWS = 3  # of a type
_MIN_FORCES = 5  # rows that show the columns of the force
_MAX_FORCE_SHARE = 0.3  # by which a force in motion may differ from gravity
Row = list[str]


class KeyColumn(NamedTuple):
    """The column with the sensor of a row: its position, and the meaning of its numbers; None if it has words."""

    position: int
    kinds: Mapping[str, str] | None = None


class RowTyping(NamedTuple):
    """The mark of a row's sensor: a key column, or, without one, a number before each sensor's three axes."""

    delimiter: str
    key: KeyColumn | None


def matches(file: TextFile) -> bool:
    """Whether the rows of a text belong to different sensors."""
    return _typing(file.content) is not None


def tables(file: TextFile) -> list[ArrayTable]:
    """One table for each type of row; [] if too few rows of any type are numbers."""
    typing = _typing(file.content)
    assert typing is not None  # the file matches
    if typing.key is None:
        return _numbered_tables(file, typing.delimiter)
    return _keyed_tables(file, typing.delimiter, typing.key)


def _typing(lines: Sequence[str]) -> RowTyping | None:
    """The mark of the rows' sensors; None if there is none."""
    for delimiter in "\t;,":
        rows = [[cell.strip() for cell in cells(line, delimiter)] for line in lines[:_SAMPLE_LINES]]
        if sum(len(row) > 3 for row in rows) < 0.5 * len(rows):
            continue
        if key := _key_column(rows) or _android_column(rows) or _nameless_android_column(rows):
            return RowTyping(delimiter, key)
        if _is_numbered(rows):
            return RowTyping(delimiter, None)
    return None


# Which column is the key.


def _key_column(rows: Sequence[Row]) -> KeyColumn | None:
    """The column whose words name a gyroscope and an accelerometer, or types with FMT rows; None: there is none."""
    for k in range(min(_MAX_KEY, max(map(len, rows), default=0))):
        words = Counter(row[k] for row in rows if len(row) > k + 1 and _is_word(row[k]))
        several = {word for word, count in words.items() if count > 2}
        if sum(words[word] for word in several) < 0.5 * len(rows) or len(several) > _MAX_TYPES:
            continue
        roles = {understand(f"{word} x").role for word in several}
        if (k == 0 and "FMT" in words) or {"gyr", "acc"} <= roles:
            return KeyColumn(k)
    return None


def _android_column(rows: Sequence[Row]) -> KeyColumn | None:
    """The column called "sensor" or "type" that holds Android's numbers of sensors; None: there is none."""
    for k, name in enumerate(rows[0] if rows else []):
        kinds = {row[k] for row in rows[1:] if len(row) > k}
        if _is_type_name(name) and {"1", "4"} <= kinds and len(kinds) <= _MAX_TYPES:
            return KeyColumn(k, _ANDROID)
    return None


def _nameless_android_column(rows: Sequence[Row]) -> KeyColumn | None:
    """The first column, if Android's numbers of sensors take turns in it and rows of 1 measure gravity; else None."""
    kinds = [row[0] for row in rows if row]
    known = [kind for kind in kinds if kind in _ANDROID]
    if not {"1", "4"} <= set(known) or len(known) < 0.7 * len(kinds) or known == sorted(known):
        return None
    forces = _force_lengths([row[1:] for row in rows if row and row[0] == "1"])
    near = sum(abs(force / GRAVITY - 1.0) < _MAX_FORCE_SHARE for force in forces)
    return KeyColumn(0, _ANDROID) if forces and near > 0.5 * len(forces) else None


def _force_lengths(rows: Sequence[Row]) -> list[float]:
    """The length of x, y, z in each of the rows of the usual width; [] if nothing shows which columns these are."""
    rows = _of_usual_width(rows)
    titles = _titles(rows) if len(rows) >= _MIN_FORCES else []
    if "x" not in titles:
        return []
    first = titles.index("x")
    return [math.hypot(*map(_number, row[first : first + 3])) for row in rows]


def _is_numbered(rows: Sequence[Row]) -> bool:
    """Whether rows are a stamp and then 3, x, y, z, 4, x, y, z …: Android's "HyperIMU" and "IMU+GPS" apps."""
    both = sum(row[1] == "3" and len(row) > 8 and "4" in row[5:9] for row in rows if len(row) > 8)
    return both > 0.5 * len(rows)


def _is_word(cell: str) -> bool:
    return bool(cell) and cell[0].isalpha() and not is_stamp(cell) and cell.lower() != "nan"


def _is_type_name(cell: str) -> bool:
    return cell.strip("\"' ").lower() in _TYPE


# Rows by their key.


def _keyed_tables(file: TextFile, delimiter: str, key: KeyColumn) -> list[ArrayTable]:
    groups, titles = _group_rows(file, delimiter, key)
    return [table for kind, rows in groups.items() for table in _kind_tables(file, kind, rows, titles.get(kind))]


def _group_rows(file: TextFile, delimiter: str, key: KeyColumn) -> tuple[dict[str, list[Row]], dict[str, Row]]:
    """The rows of each type without their key, and the names of their columns where some line gives them."""
    groups: dict[str, list[Row]] = {}
    header: Row | None = None
    text = file.text()
    names = _comment_names(text, delimiter)
    for line in lines_of(text):
        row = [cell.strip() for cell in cells(line, delimiter)]
        if len(row) <= key.position + 1 or is_comment(line):
            continue
        kind = _kind(row[key.position], key)
        if not _is_word(kind):
            continue
        if row[0] == "FMT" and len(row) > 5:
            names[row[3]] = row[5:]
            continue
        rest = row[: key.position] + row[key.position + 1 :]
        if header is None and _is_header(rest, kind, key):
            header = rest
            continue
        groups.setdefault(kind, []).append(rest)
    return groups, {kind: titles for kind in groups if (titles := names.get(kind) or header)}


def _kind(cell: str, key: KeyColumn) -> str:
    """The type of a row by the cell in its key column; "" for a number without a meaning."""
    if key.kinds is None:
        return cell
    return key.kinds.get(cell, cell if _is_word(cell) else "")


def _is_header(rest: Row, kind: str, key: KeyColumn) -> bool:
    titled = key.kinds is None or _is_type_name(kind)
    return titled and not any(is_number(cell, False) or is_stamp(cell) for cell in rest if cell)


def _comment_names(text: str, delimiter: str) -> dict[str, Row]:
    """Names of columns that comments give: "% Gyroscope data: GYRO;SensorTimestamp(s);Gyr_X(rad/s)", "# Accel,t,x"."""
    names = {}
    for line in lines_of(text[:_HEAD]):
        if is_comment(line) and line.count(delimiter) > 3:
            row = [cell.strip() for cell in line.lstrip("#%/ ").split(delimiter)]
            names[row[0].split()[-1] if row[0] else ""] = row[1:]
    return names


def _kind_tables(file: TextFile, kind: str, rows: Sequence[Row], titles: Row | None) -> list[ArrayTable]:
    """The tables of the rows of one type: one for each instance of the sensor."""
    rows = _of_usual_width(rows)
    if len(rows) < _MIN_ROWS:
        return []
    width = len(rows[0])
    if titles is not None and len(titles) == width - 3:
        titles = [*titles, "x", "y", "z"]
    if titles is None or len(titles) != width:
        titles = _titles(rows)
    titles = [title or f"column {i + 1}" for i, title in enumerate(_with_axes(titles))]
    arrays, units = _arrays(*_side_by_side(titles[:width], rows))
    conclusions = _subtract_bias(arrays) if _FIELD.search(kind) else []
    tables = []
    for number, keep in _instances(arrays).items() if arrays else ():
        part = {name: column[keep] for name, column in arrays.items()}
        context = kind if number is None else f"{kind} {number}"
        tables.append(ArrayTable(file.display_path, part, context=context, column_units=units, conclusions=conclusions))
    return tables


def _subtract_bias(arrays: dict[str, Column]) -> list[Conclusion]:
    """Takes from a field the bias that the phone itself writes in the three columns behind it."""
    names = list(arrays)
    first = next((i for i, name in enumerate(names) if _BIAS.match(name)), 0)
    if first < 3 or not all(_BIAS.match(name) for name in names[first : first + 3]) or len(names) < first + 3:
        return []
    for field, bias in zip(names[first - 3 : first], names[first : first + 3], strict=True):
        arrays[field] = arrays[field].astype(np.float64) - arrays[bias]
    return [Conclusion("mag.bias", "subtracted", tuple(names[first : first + 3]), Basis.HEADER)]


def _of_usual_width(rows: Sequence[Row]) -> list[Row]:
    """The rows of as many cells as most have."""
    if not rows:
        return []
    width = Counter(map(len, rows)).most_common(1)[0][0]
    return [row for row in rows if len(row) == width]


def _instances(arrays: dict[str, Column]) -> dict[int | None, Any]:
    """Rows of several equal sensors, by ArduPilot's column "I"."""
    if "I" not in arrays or len(np.unique(arrays["I"])) < 2:
        return {None: slice(None)}
    return {int(number): arrays["I"] == number for number in np.unique(arrays["I"])}


# Which columns are x, y, z.


def _titles(rows: Sequence[Row]) -> list[str]:
    """Names for rows without: a stamp first if there are four numbers or more; x, y, z last.

    Behind them may stand their length, or Android's accuracy.
    """
    width = len(rows[0])
    axes = ["x", "y", "z"]
    if width <= 3:
        return axes[:width]
    last = width - 4 if _ends_with_accuracy(rows) else width - 3
    first = next((i for i in range(1, width - 3) if _is_followed_by_length(rows, i)), last)
    titles = ["time", *(f"extra {i}" for i in range(1, width))]
    titles[first : first + 3] = axes
    return titles


def _ends_with_accuracy(rows: Sequence[Row]) -> bool:
    """Whether the last column is Android's accuracy behind x, y, z: the column that would be x is no stamp."""
    if len(rows[0]) < 5 or not {row[-1] for row in rows} <= _ACCURACY:
        return False
    first = [_number(row[-4]) for row in rows[:_SAMPLE_LINES]]
    return any(later <= before for before, later in pairwise(first))


def _is_followed_by_length(rows: Sequence[Row], first: int) -> bool:
    """Whether the column behind three others is their length."""
    table = np.array([list(map(_number, row[first : first + 4])) for row in rows[:_SAMPLE_LINES]])
    length = np.sqrt((table[:, :3] ** 2).sum(axis=1))
    return bool((np.abs(table[:, 3] - length) < 0.02 * length + 1e-9).mean() > 0.9)


def _with_axes(titles: Sequence[str]) -> list[str]:
    """v0, v1, v2 (or 1, 2, 3) as x, y, z: where rows are typed, their columns have no sensor's name."""
    found = [(i, match[1], int(match[2])) for i, title in enumerate(titles) if (match := _NUMBERED.fullmatch(title))]
    for (i, stem, first), (j, other, second), (k, last, third) in zip(found, found[1:], found[2:], strict=False):
        if stem == other == last and (first, second, third) in ((0, 1, 2), (1, 2, 3)) and (j, k) == (i + 1, i + 2):
            return [*titles[:i], "x", "y", "z", *titles[k + 1 :]]
    return list(titles)


def _side_by_side(titles: Sequence[str], rows: Sequence[Row]) -> tuple[Sequence[str], Sequence[Row]]:
    """A long table, in which x, y and z of a sample stand below each other, as a wide one; any other as it is."""
    for k, column in enumerate(zip(*rows, strict=True)):
        if {cell.lower() for cell in column} == {"x", "y", "z"} and k < len(titles) - 1:
            break
    else:
        return titles, rows
    samples = [rows[i : i + 3] for i in range(0, len(rows) - 2, 3)]
    whole = [sample for sample in samples if {row[k].lower() for row in sample} == {"x", "y", "z"}]
    wide = []
    for sample in whole:
        axes = {row[k].lower(): row[k + 1] for row in sample}
        wide.append([*sample[0][:k], axes["x"], axes["y"], axes["z"], *sample[0][k + 2 :]])
    return [*titles[:k], "x", "y", "z", *titles[k + 2 :]], wide


# Numbers.


def _arrays(titles: Sequence[str], rows: Sequence[Row]) -> tuple[dict[str, Column], dict[int, str]]:
    """Columns of numbers by name; words become NaN. And the positions of columns that were dates."""
    arrays: dict[str, Column] = {}
    units: dict[int, str] = {}
    for i, title in enumerate(titles if rows else ()):
        column = [row[i] for row in rows]
        if is_stamp(column[0]):
            try:
                arrays[title] = np.array([nanoseconds(cell) for cell in column], dtype=np.int64)
                units[len(arrays) - 1] = "ns"
            except ValueError:
                continue
        elif all(cell.lstrip("+-").isdigit() for cell in column) and max(map(len, column)) < 19 + 1:
            arrays[title] = np.array([int(cell) for cell in column], dtype=np.int64)
        else:
            values = np.array(list(map(_number, column)))
            if not np.isnan(values).all():
                arrays[title] = values
    return arrays, units


def _number(cell: str) -> float:
    return float(cell) if is_number(cell, False) else math.nan


def _numbered_tables(file: TextFile, delimiter: str) -> list[ArrayTable]:
    """The readings behind each sensor's number, by sensor."""
    groups: dict[str, list[Row]] = {}
    for line in file.lines():
        row = [cell.strip() for cell in cells(line, delimiter)]
        for i in range(1, len(row) - 3, 4):
            if row[i] in _NUMBERED_KINDS:
                groups.setdefault(_NUMBERED_KINDS[row[i]], []).append([row[0], *row[i + 1 : i + 4]])
    tables = []
    for kind, rows in groups.items():
        arrays, units = _arrays(["time", "x", "y", "z"], rows)
        if len(arrays) == 4:
            tables.append(ArrayTable(file.display_path, arrays, context=kind, column_units=units))
    return tables
