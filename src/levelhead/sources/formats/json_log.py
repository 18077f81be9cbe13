"""JSON: a line for each sample, a list of objects (Sensor Logger), or lists of numbers at any depth."""

import ast
import json
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.named_arrays import VECTOR_AXES, rate_of, with_rate
from levelhead.sources.formats.row_table import table_of_rows, to_numbers
from levelhead.sources.formats.text.cells import is_comment, lines_of
from levelhead.sources.formats.text.file import TextFile
from levelhead.sources.hints import Hints
from levelhead.sources.names.column_name import understand
from levelhead.sources.table import ArrayTable, Table

_KIND_KEYS = ("sensor", "type", "name", "sensortype", "sensor_type", "sensorname", "topic", "kind")
_MIN_SAMPLES = 5  # that make a table
_MIN_COLUMNS = 3  # of one length in an object that make a table
_MIN_SERIES = 2  # lists of one length in an object that make it a batch
_MIN_RATE, _MAX_RATE = 0.5, 1e5  # Hz
_MAX_BYTES = 1 << 30
_MAX_DEPTH = 8


class Garbage(ValueError):
    """A line that is not a line of numbers: for counting, not for people."""


@dataclass(frozen=True)
class JsonTable(ArrayTable):
    """Columns of JSON lines; ``lines`` are the numbers of those that they came from."""

    lines: Sequence[int] = ()

    def where(self, row: int) -> str:
        """See ``Table``."""
        return f"line {self.lines[row]}"


def matches(file: TextFile) -> bool:
    """Whether a text begins like JSON; the first of its lines may be cut."""
    first = file.content[0].lstrip("\ufeff \t") if file.content else ""
    bracket = first[:1] in ("{", "[") and _has_quotes("".join(file.content[:3]))
    return bracket or any(line.lstrip().startswith("{") and _has_quotes(line) for line in file.content[1:2])


def _has_quotes(text: str) -> bool:
    """Whether there are names in quotes: JSON's, or Python's."""
    return '"' in text or "':" in text


def text_tables(file: TextFile) -> Sequence[Table]:
    """The tables of a text that begins like JSON; see ``tables``."""
    return _tables(file.text(), file.display_path)


def tables(path: Path, display_path: str, hints: Hints) -> Sequence[Table]:
    """The tables of a JSON file.

    Raises:
        LevelheadError: no JSON, or no samples in it.
    """
    if path.stat().st_size > _MAX_BYTES:
        raise LevelheadError(f"{display_path} is larger than 1 GiB; expected JSON that fits into memory, or CSV")
    return _tables(path.read_bytes().decode("utf-8", "replace"), display_path)


def _tables(text: str, source: str) -> Sequence[Table]:
    text = text.removeprefix("\ufeff")
    try:
        whole = json.loads(text, parse_constant=lambda _: None)
    except (ValueError, RecursionError):
        return _line_tables(text, source)
    if (
        isinstance(whole, dict)
        and "\n" not in text.strip()
        and not any(isinstance(v, list | dict) for v in whole.values())
    ):
        return [_json_lines(text, source)]
    found = list(_walk(whole, "", source, 0))
    if not found:
        raise LevelheadError(f"{source} holds no samples; expected a list of objects with numbers, or lists of numbers")
    return found


# Lines: an object for each sample.


def _line_tables(text: str, source: str) -> Sequence[Table]:
    """The table of a file with an object on each line; numbers in quotes and dates count where others do not do."""
    table = _json_lines(text, source)
    whole = {"gyr", "acc", "t"} <= {name.role for name in map(understand, table.names)}
    objects = []
    for line in text.splitlines():
        try:
            item = _load(line)
        except ValueError:
            continue
        objects += [item] if isinstance(item, dict) else []
        if whole and objects and len(_samples(objects[0])) == 1:
            return [table]
    found = list(_object_tables(objects, "", source)) if len(objects) >= _MIN_SAMPLES else []
    return found if found and (not whole or len(next(iter(found[0].arrays.values()))) > len(table.lines)) else [table]


def _json_lines(text: str, source: str) -> JsonTable:
    """The numbers of JSON lines by name, NaN where a line does not have one, by the rules for serial lines.

    The first and the last line may be cut, because the recorder started late and was stopped; that is noted.

    Raises:
        LevelheadError: a line between them is not a JSON object of numbers, or there is none at all.
    """
    given = [(k, line) for k, line in enumerate(lines_of(text), 1) if line.strip() and not is_comment(line)]
    rows, lines, conclusions = [], [], []
    for i, (number, line) in enumerate(given):
        try:
            rows.append(flatten_line(line))
            lines.append(number)
        except Garbage:
            if 0 < i < len(given) - 1:
                raise LevelheadError(
                    f"{source}, line {number}: '{line.strip()[:30]}' is not a JSON object of numbers; expected such as "
                    '{"t": 0.01, "gyr": [0, 0, 0], "acc": [0, 0, 9.81]}'
                ) from None
            conclusions.append(Conclusion("file.lines", "cut_off", number, Basis.NUMBERS))
    if not rows:
        raise LevelheadError(f"{source} holds no JSON objects; expected one line per sample")
    names = list(dict.fromkeys(name for row in rows for name in row))
    arrays = {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}
    return JsonTable(source, arrays, conclusions=conclusions, lines=lines)


def flatten_line(text: str) -> dict[str, float]:
    """A JSON object as names and numbers: {"gyr": [1, 2, 3]} is gyr_x, gyr_y, gyr_z; {"acc": {"x": 1}} is acc_x.

    Raises:
        Garbage: no object, no JSON, or an infinite number.
    """
    try:
        given = _load(text, lambda name: math.nan if name == "NaN" else math.inf)
    except ValueError:
        raise Garbage from None
    if not isinstance(given, dict):
        raise Garbage
    try:
        return {name: _finite_or_nan(part) for name, part in _parts(given) if _is_number(part)}
    except (RecursionError, OverflowError):  # nested for hundreds of levels, or an integer of hundreds of digits
        raise Garbage from None


def _load(line: str, constant: Callable[[str], float | None] = lambda _: None) -> Any:
    """The value in a line of JSON, or in a dictionary as Python prints it.

    Raises:
        ValueError: neither.
    """
    try:
        return json.loads(line, parse_constant=constant)
    except ValueError:
        if "'" not in line:
            raise
    except RecursionError:
        raise ValueError("nested too deep") from None
    try:
        return ast.literal_eval(_NAN.sub("None", line.strip()))
    except (SyntaxError, MemoryError, RecursionError, TypeError):
        raise ValueError("no dictionary") from None


_NAN = re.compile(r"\bnan\b")


def _is_number(part: object) -> bool:
    return part is None or (isinstance(part, int | float) and not isinstance(part, bool))


def _finite_or_nan(part: Any) -> float:
    """A value of JSON; null is NaN."""
    number = math.nan if part is None else float(part)
    if math.isinf(number):
        raise Garbage
    return number


def _parts(given: JsonObject) -> Iterator[tuple[str, object]]:
    """Names and values in an object: those of lists by axis, those of objects by their path."""
    for name, value in given.items():
        if isinstance(value, list):
            axes = VECTOR_AXES.get(len(value), "xyz")
            yield from ((f"{name}_{axis}", part) for axis, part in zip(axes, value, strict=False))
        elif isinstance(value, dict):
            yield from _leaves(value, f"{name}_")
        else:
            yield name, value


def _leaves(node: Mapping[str, object], prefix: str) -> Iterator[tuple[str, object]]:
    """Names and values in objects within objects: {"gyro": {"x": 1}} in "imu" is imu_gyro_x."""
    for key, value in node.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}_")
        else:
            yield f"{prefix}{key}", value


# Documents: lists and objects at any depth.


def _walk(node: Any, name: str, source: str, depth: int) -> Iterator[ArrayTable]:
    """The tables in a list or an object called ``name``."""
    if depth > _MAX_DEPTH:
        return
    if isinstance(node, list):
        yield from _list_tables(node, name, source, depth)
    elif isinstance(node, dict):
        table = _named_rows(node, name, source) or _keyed_columns(node, name, source) or _columns(node, name, source)
        found = [table] if table is not None else _member_tables(node, name, source, depth)
        rate = _rate_beside(node, source)
        yield from (with_rate(one, rate) for one in found)


def _rate_beside(node: JsonObject, source: str) -> float | None:
    """The rate in Hz among the numbers of an object; "ts" may be a stamp, whose inverse is the rate of no sensor."""
    numbers = {key: float(value) for key, value in node.items() if _is_number(value) and value and value > 0}
    rates = (rate_of(source, key, value) for key, value in numbers.items())
    return next((rate for rate in rates if rate is not None and _MIN_RATE <= rate <= _MAX_RATE), None)


def _list_tables(node: Sequence[Any], name: str, source: str, depth: int) -> Iterator[ArrayTable]:
    """The tables in a list: samples as objects, samples as lists of numbers, or a list of something else."""
    objects = [item for item in node if isinstance(item, dict)]
    if len(objects) >= _MIN_SAMPLES and len(objects) > 0.5 * len(node) and not any(map(_holds_tables, objects)):
        yield from _object_tables(objects, name, source)
    elif len(node) >= _MIN_SAMPLES and _is_matrix(node):
        width = len(node[0])
        titles = {3: list("xyz"), 4: ["time", *"xyz"]}.get(width, [str(i + 1) for i in range(width)])
        columns = {title: to_numbers([row[i] for row in node]) for i, title in enumerate(titles)}
        yield ArrayTable(source, columns, context=name)
    else:
        for item in node[:100]:
            yield from _walk(item, name, source, depth + 1)


def _holds_tables(item: JsonObject) -> bool:
    """Whether a member of an object is a list of samples by itself, as in the streams of gopro-telemetry."""
    return any(
        isinstance(value, list)
        and len(value) >= _MIN_SAMPLES
        and all(isinstance(part, dict) for part in value)
        and any(isinstance(inner, list | dict) for part in value[:1] for inner in part.values())
        for value in item.values()
    )


def _is_matrix(node: Sequence[Any]) -> bool:
    return all(isinstance(item, list) for item in node) and len({len(item) for item in node}) == 1


def _member_tables(node: JsonObject, name: str, source: str, depth: int) -> Iterator[ArrayTable]:
    """The tables in the members of an object, whose name and unit may stand beside their samples."""
    title = next((str(node[key]) for key in ("name", "sensor", "STNM") if isinstance(node.get(key), str)), "")
    unit = node.get("units") or node.get("unit") or node.get("SIUN")
    for key, value in node.items():
        called = key if isinstance(value, list | dict) else name
        for table in _walk(value, title if title and isinstance(value, list) else called, source, depth + 1):
            yield _with_unit(table, unit) if isinstance(unit, str) and isinstance(value, list) else table


def _with_unit(table: ArrayTable, unit: str) -> ArrayTable:
    """A table whose axes have the unit beside their samples (gopro-telemetry's streams)."""
    titles = [
        f"{name} [{unit}]" if understand(name, table.context).axis and "[" not in name else name
        for name in table.arrays
    ]
    return replace(table, arrays=dict(zip(titles, table.arrays.values(), strict=True)))


def _columns(node: JsonObject, name: str, source: str) -> ArrayTable | None:
    """Lists of one length as columns: {"t": […], "acc": {"x": […]}}; None if there are too few."""
    flat = _flatten_lists(node)
    lengths = [len(values) for values in flat.values()]
    longest = max(lengths, default=0)
    if longest < _MIN_SAMPLES or lengths.count(longest) < _MIN_COLUMNS:
        return None
    columns = {key: to_numbers(values) for key, values in flat.items() if len(values) == longest}
    return ArrayTable(source, columns, context=name)


def _flatten_lists(node: JsonObject, prefix: str = "") -> dict[str, list[Any]]:
    """Lists of numbers in an object and in the objects in it: {"acc": {"x": […]}} is acc_x."""
    found: dict[str, list[Any]] = {}
    for key, value in node.items():
        if isinstance(value, dict):
            found |= _flatten_lists(value, f"{prefix}{key}_")
        elif not isinstance(value, list) or not value:
            continue
        elif all(item is None or isinstance(item, int | float | str) for item in value):
            found[f"{prefix}{key}"] = value
        elif len(value) >= _MIN_SAMPLES and all(isinstance(item, list) and len(item) == 3 for item in value):
            found |= {f"{prefix}{key}_{axis}": [item[i] for item in value] for i, axis in enumerate("xyz")}
    return found


def _keyed_columns(node: JsonObject, name: str, source: str) -> ArrayTable | None:
    """Columns of pandas' to_json: {"gyro_x": {"0": 0.1, "1": …}, …}; None if it is something else."""
    columns = list(node.values())
    if len(columns) < 6 or not all(isinstance(column, dict) and len(column) >= _MIN_SAMPLES for column in columns):
        return None
    keys = list(columns[0])
    if not all(key.isdigit() for key in keys) or any(list(column) != keys for column in columns):
        return None
    arrays = {title: to_numbers(list(column.values())) for title, column in node.items()}
    return ArrayTable(source, arrays, context=name)


def _named_rows(node: JsonObject, name: str, source: str) -> ArrayTable | None:
    """Rows of numbers beside the names of their columns: Edge Impulse's payload, pandas' "split"."""
    names, values = node.get("sensors") or node.get("columns"), node.get("values") or node.get("data")
    if not isinstance(names, list) or not isinstance(values, list) or len(values) < _MIN_SAMPLES:
        return None
    titles = [_title(entry) for entry in names]
    if any(not isinstance(row, list) or len(row) != len(titles) for row in values):
        return None
    interval = node.get("interval_ms")
    rate = 1000.0 / interval if isinstance(interval, int | float) and interval > 0 else None
    arrays = {title: to_numbers([row[i] for row in values]) for i, title in enumerate(titles)}
    return ArrayTable(source, arrays, rate=rate, context=name)


def _title(entry: object) -> str:
    """The name of a column, with its unit if that is beside it."""
    if not isinstance(entry, dict):
        return str(entry)
    return f"{entry.get('name')} [{entry['units']}]" if entry.get("units") else str(entry.get("name"))


# Objects: a sample each, or several.


def _object_tables(objects: Sequence[JsonObject], name: str, source: str) -> Iterator[ArrayTable]:
    """One table for each kind of object, or one for all."""
    flat = [_flatten_object(sample, "") for item in objects for sample in _samples(item)]
    key = next((k for k, value in flat[0].items() if k.lower() in _KIND_KEYS and isinstance(value, str)), None)
    groups: dict[str, list[JsonObject]] = {}
    for item in flat:
        groups.setdefault(str(item.get(key, "")) if key else name, []).append(item)
    for kind, rows in groups.items():
        if len(rows) >= _MIN_SAMPLES:
            table = table_of_rows(rows, kind, source, {key})
            if table.arrays:
                yield table


def _samples(item: JsonObject) -> list[JsonObject]:
    """One object for each sample of a message, which share its stamp: {"Timestamp": 12, "ArrayAcc": [{…}, …], …}."""
    lengths = Counter(len(values) for values in _series(item))
    if not lengths:
        return [item]
    length, count = lengths.most_common(1)[0]
    return [_pick(item, k, length) for k in range(length)] if count >= _MIN_SERIES else [item]


def _series(item: JsonObject) -> Iterator[Sequence[Any]]:
    """The lists in an object, and in the objects in it, that hold a number or a vector for each of several samples."""
    for value in item.values():
        if isinstance(value, dict):
            yield from _series(value)
        elif isinstance(value, list) and _is_series(value):
            yield value


def _is_series(values: Sequence[Any]) -> bool:
    if not values:
        return False
    if all(isinstance(reading, dict) for reading in values):
        return all(isinstance(part, int | float) for reading in values for part in reading.values())
    if all(isinstance(reading, list) and len(reading) in VECTOR_AXES for reading in values):
        return True
    return len(values) not in (1, *VECTOR_AXES) and all(isinstance(reading, int | float) for reading in values)


def _pick(item: JsonObject, k: int, length: int) -> JsonObject:
    """Sample ``k`` of a message of ``length``."""
    return {
        key: _pick(value, k, length) if isinstance(value, dict)
        else value[k] if isinstance(value, list) and _is_series(value) and len(value) == length
        else value
        for key, value in item.items()
    }  # fmt: skip


def _flatten_object(item: JsonObject, prefix: str) -> JsonObject:
    found: JsonObject = {}
    for key, value in item.items():
        if isinstance(value, dict):
            found |= _flatten_object(value, f"{prefix}{key}_")
        elif isinstance(value, list) and len(value) in VECTOR_AXES:
            axes = VECTOR_AXES[len(value)]
            found |= {f"{prefix}{key}_{axis}": part for axis, part in zip(axes, value, strict=True)}
        else:
            found[f"{prefix}{key}"] = value
    return found
