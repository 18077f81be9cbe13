"""Text whose rows belong to different sensors: a word or a number in each row says which.

"IMU, 1200, 0.1, …" beside "MAG, 1201, …" (ArduPilot, with FMT rows that name the columns), "ACC;12;0.1;…", and tables
with a column "sensor" in which accelerometer and gyroscope alternate.
"""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from levelhead.sources.formats.text.cells import cells, is_comment, is_number, lines_of
from levelhead.sources.formats.text.dates import is_stamp, nanoseconds
from levelhead.sources.formats.text.encoding import Encoding
from levelhead.sources.names.column_name import understand
from levelhead.sources.table import ArrayTable, Column
from levelhead.units import GRAVITY

_LOOK = 400
_HEAD = 1 << 16  # characters in which comments may name columns
_ANDROID = {  # android.hardware.Sensor.TYPE_…
    "1": "accelerometer", "2": "magnetometer", "4": "gyroscope", "9": "gravity", "10": "linear acceleration",
    "14": "magnetometer uncalibrated", "16": "gyroscope uncalibrated", "35": "accelerometer uncalibrated",
}  # fmt: skip
_TYPE = {"sensor", "type", "sensortype", "sensor_type", "sensorid", "sensor_id", "sensor type", "stream type"}
_KINDS = {"3": "accelerometer", "4": "gyroscope", "5": "magnetometer", "82": "linear acceleration", "83": "gravity"}
_NUMBERED = re.compile(r"([A-Za-z][A-Za-z_. ]*)[\[(]?(\d)[\])]?")
_MOST_TYPES = 80
_FEW = 5  # rows that show what stands where
_NEAR = 0.3  # share by which a force in motion may differ from gravity


def typed_tables(path: Path, shown: str, content: Sequence[str], encoding: Encoding) -> list[ArrayTable]:
    """One table for each type of row; [] if the rows are not typed by sensor. ``content``: the first lines."""
    sample = content[:_LOOK]
    for delimiter in "\t;,":
        rows = [[cell.strip() for cell in cells(line, delimiter)] for line in sample]
        if sum(len(row) > 3 for row in rows) < 0.5 * len(rows):
            continue
        if (key := _key_column(rows)) is not None:
            return _split(path, shown, encoding, delimiter, key)
        if (key := _android_column(rows)) is not None or (key := _nameless_android_column(rows)) is not None:
            return _split(path, shown, encoding, delimiter, key, _ANDROID)
        if _is_numbered(rows):
            return _by_numbers(path, shown, encoding, delimiter)
    return []


def _key_column(rows: Sequence[Sequence[str]]) -> int | None:
    """The column whose words name a gyroscope and an accelerometer, or types with FMT rows; None: there is none."""
    for k in range(min(6, max(map(len, rows), default=0))):
        words = Counter(row[k] for row in rows if len(row) > k + 1 and _is_word(row[k]))
        several = {word for word, count in words.items() if count > 2}
        if sum(words[word] for word in several) < 0.5 * len(rows) or len(several) > _MOST_TYPES:
            continue
        roles = {understand(f"{word} x").role for word in several}
        if (k == 0 and "FMT" in words) or {"gyr", "acc"} <= roles:
            return k
    return None


def _android_column(rows: Sequence[Sequence[str]]) -> int | None:
    """The column called "sensor" or "type" that holds Android's numbers of sensors; None: there is none."""
    for k, name in enumerate(rows[0] if rows else []):
        kinds = {row[k] for row in rows[1:] if len(row) > k}
        if name.strip("\"' ").lower() in _TYPE and {"1", "4"} <= kinds and len(kinds) <= _MOST_TYPES:
            return k
    return None


def _nameless_android_column(rows: Sequence[Sequence[str]]) -> int | None:
    """The first column, if Android's numbers of sensors take turns in it and rows of 1 measure gravity; else None."""
    kinds = [row[0] for row in rows if row]
    known = [kind for kind in kinds if kind in _ANDROID]
    if not {"1", "4"} <= set(known) or len(known) < 0.7 * len(kinds) or known == sorted(known):
        return None
    ones = [row[1:] for row in rows if row and row[0] == "1"]
    width = Counter(map(len, ones)).most_common(1)[0][0]
    whole = [row for row in ones if len(row) == width]
    titles = _titles(whole) if len(whole) >= _FEW else []
    if "x" not in titles:
        return None
    at = titles.index("x")
    forces = [math.hypot(*(float(cell) if is_number(cell, False) else math.nan for cell in row[at : at + 3]))
              for row in whole]  # fmt: skip
    return 0 if sum(abs(force / GRAVITY - 1.0) < _NEAR for force in forces) > 0.5 * len(forces) else None


def _comment_names(text: str, delimiter: str) -> dict[str, list[str]]:
    """Names of columns that comments give: "% Gyroscope data: GYRO;SensorTimestamp(s);Gyr_X(rad/s)", "# Accel,t,x"."""
    names = {}
    for line in lines_of(text[:_HEAD]):
        if is_comment(line) and line.count(delimiter) > 3:
            row = [cell.strip() for cell in line.lstrip("#%/ ").split(delimiter)]
            names[row[0].split()[-1] if row[0] else ""] = row[1:]
    return names


def _is_word(cell: str) -> bool:
    return bool(cell) and cell[0].isalpha() and not is_stamp(cell) and cell.lower() != "nan"


def _split(
    path: Path, shown: str, encoding: Encoding, delimiter: str, key: int, kinds: Mapping[str, str] | None = None
) -> list[ArrayTable]:
    """``kinds``: what the numbers in the key column mean, if they are numbers."""
    groups: dict[str, list[list[str]]] = {}
    header: list[str] | None = None
    text = path.read_bytes()[encoding.skip :].decode(encoding.name, "replace")
    names = _comment_names(text, delimiter)
    for line in lines_of(text):
        row = [cell.strip() for cell in cells(line, delimiter)]
        if len(row) <= key + 1 or is_comment(line):
            continue
        if kinds is not None:
            row[key] = kinds.get(row[key], row[key] if _is_word(row[key]) else "")
        if not _is_word(row[key]):
            continue
        if row[0] == "FMT" and len(row) > 5:
            names[row[3]] = row[5:]
            continue
        rest = row[:key] + row[key + 1 :]
        titled = kinds is None or row[key].strip("\"' ").lower() in _TYPE
        if header is None and titled and not any(is_number(cell, False) or is_stamp(cell) for cell in rest if cell):
            header = rest
            continue
        groups.setdefault(row[key], []).append(rest)
    found = []
    for kind, rows in groups.items():
        width = Counter(map(len, rows)).most_common(1)[0][0]
        whole = [row for row in rows if len(row) == width]
        titles = names.get(kind) or header
        if titles is not None and len(titles) == width - 3:
            titles = [*titles, "x", "y", "z"]
        titles = titles if titles is not None and len(titles) == width else None
        if len(whole) < 3:
            continue
        titles = [title or f"column {i + 1}" for i, title in enumerate(_with_axes(titles or _titles(whole)))]
        wide, samples = _side_by_side(titles[:width], whole)
        arrays, units = _arrays(wide, samples)
        if arrays:
            instances = _instances(arrays)
            for number, keep in instances.items():
                part = {name: column[keep] for name, column in arrays.items()}
                context = kind if number is None else f"{kind} {number}"
                found.append(ArrayTable(shown, part, context=context, column_units=units))
    return found


def _side_by_side(
    titles: Sequence[str], rows: Sequence[Sequence[str]]
) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
    """A long table, in which x, y and z of a sample stand below each other, as a wide one; any other as it is."""
    for k, column in enumerate(zip(*rows, strict=True)):
        if {cell.lower() for cell in column} == {"x", "y", "z"} and k < len(titles) - 1:
            break
    else:
        return titles, rows
    samples = [rows[i : i + 3] for i in range(0, len(rows) - 2, 3)]
    whole = [sample for sample in samples if {row[k].lower() for row in sample} == {"x", "y", "z"}]
    made = []
    for sample in whole:
        axes = {row[k].lower(): row[k + 1] for row in sample}
        made.append([*sample[0][:k], axes["x"], axes["y"], axes["z"], *sample[0][k + 2 :]])
    return [*titles[:k], "x", "y", "z", *titles[k + 2 :]], made


def _instances(arrays: dict[str, Column]) -> dict[int | None, Any]:
    """Rows of several equal sensors, by ArduPilot's column "I"."""
    if "I" not in arrays or len(np.unique(arrays["I"])) < 2:
        return {None: slice(None)}
    return {int(number): arrays["I"] == number for number in np.unique(arrays["I"])}


def _titles(rows: Sequence[Sequence[str]]) -> list[str]:
    """Names for rows without: a stamp first if there are four numbers or more; x, y, z last, or before their length."""
    width = len(rows[0])
    axes = ["x", "y", "z"]
    if width <= 3:
        return axes[:width]
    first = next((i for i in range(1, width - 3) if _is_followed_by_length(rows, i)), width - 3)
    titles = ["time", *(f"extra {i}" for i in range(1, width))]
    titles[first : first + 3] = axes
    return titles


def _with_axes(titles: Sequence[str]) -> list[str]:
    """v0, v1, v2 (or 1, 2, 3) as x, y, z: where rows are typed, their columns have no sensor's name."""
    found = [(i, match[1], int(match[2])) for i, title in enumerate(titles) if (match := _NUMBERED.fullmatch(title))]
    for (i, stem, first), (j, other, second), (k, last, third) in zip(found, found[1:], found[2:], strict=False):
        if stem == other == last and (first, second, third) in ((0, 1, 2), (1, 2, 3)) and (j, k) == (i + 1, i + 2):
            return [*titles[:i], "x", "y", "z", *titles[k + 1 :]]
    return list(titles)


def _is_followed_by_length(rows: Sequence[Sequence[str]], first: int) -> bool:
    """Whether the column behind three others is their length."""
    table = np.array([[float(cell) if is_number(cell, False) else np.nan for cell in row[first : first + 4]]
                      for row in rows[:_LOOK]])  # fmt: skip
    length = np.sqrt((table[:, :3] ** 2).sum(axis=1))
    return bool((np.abs(table[:, 3] - length) < 0.02 * length + 1e-9).mean() > 0.9)


def _arrays(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> tuple[dict[str, Column], dict[int, str]]:
    """Columns of numbers by name; words become NaN. And the positions of columns that were dates."""
    arrays: dict[str, Column] = {}
    units: dict[int, str] = {}
    for i, title in enumerate(titles):
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
            values = [float(cell) if is_number(cell, False) else np.nan for cell in column]
            if not np.isnan(values).all():
                arrays[title] = np.array(values)
    return arrays, units


def _is_numbered(rows: Sequence[Sequence[str]]) -> bool:
    """Whether rows are a stamp and then 3, x, y, z, 4, x, y, z …: Android's "HyperIMU" and "IMU+GPS" apps."""
    both = sum(row[1] == "3" and len(row) > 8 and "4" in row[5:9] for row in rows if len(row) > 8)
    return both > 0.5 * len(rows)


def _by_numbers(path: Path, shown: str, encoding: Encoding, delimiter: str) -> list[ArrayTable]:
    groups: dict[str, list[list[str]]] = {}
    for line in lines_of(path.read_bytes()[encoding.skip :].decode(encoding.name, "replace")):
        row = [cell.strip() for cell in cells(line, delimiter)]
        i = 1
        while i + 3 < len(row):
            if row[i] in _KINDS:
                groups.setdefault(_KINDS[row[i]], []).append([row[0], *row[i + 1 : i + 4]])
            i += 4
    found = []
    for kind, rows in groups.items():
        arrays, units = _arrays(["time", "x", "y", "z"], rows)
        if len(arrays) == 4:
            found.append(ArrayTable(shown, arrays, context=kind, column_units=units))
    return found
