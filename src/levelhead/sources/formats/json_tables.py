"""JSON: lines of objects, a list of objects (Sensor Logger), or objects that hold lists of numbers, at any depth."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import Fields
from levelhead.sources.formats.json_batches import unpack_batches
from levelhead.sources.formats.json_lines import json_lines
from levelhead.sources.formats.text.cells import is_number
from levelhead.sources.formats.text.dates import is_stamp, nanoseconds
from levelhead.sources.hints import Hints
from levelhead.sources.names.column_name import understand
from levelhead.sources.table import ArrayTable, Table

_KIND = ("sensor", "type", "name", "sensortype", "sensor_type", "sensorname", "topic", "kind")
_LEAST = 5  # samples that make a table
_MOST_BYTES = 1 << 30


def tables(path: Path, shown: str, hints: Hints) -> Sequence[Table]:
    """The tables of a JSON file.

    Raises:
        LevelheadError: no JSON, or no samples in it.
    """
    if path.stat().st_size > _MOST_BYTES:
        raise LevelheadError(f"{shown} is larger than 1 GiB; expected JSON that fits into memory, or CSV")
    text = path.read_bytes().removeprefix(b"\xef\xbb\xbf").decode("utf-8", "replace")
    try:
        whole = json.loads(text, parse_constant=lambda _: None)
    except (ValueError, RecursionError):
        return _lines(path, text, shown)
    if (
        isinstance(whole, dict)
        and "\n" not in text.strip()
        and not any(isinstance(v, list | dict) for v in whole.values())
    ):
        return [json_lines(path)]
    found = list(_walk(whole, "", shown, 0))
    if not found:
        raise LevelheadError(f"{shown} holds no samples; expected a list of objects with numbers, or lists of numbers")
    return found


def _lines(path: Path, text: str, shown: str) -> Sequence[Table]:
    """The table of a file with an object on each line; numbers in quotes and dates count where others do not do."""
    table = json_lines(path)
    if {"gyr", "acc"} <= {name.role for name in map(understand, table.names)}:
        return [table]
    objects = []
    for line in text.splitlines():
        try:
            item = json.loads(line, parse_constant=lambda _: None)
        except (ValueError, RecursionError):
            continue
        objects += [item] if isinstance(item, dict) else []
    return list(_objects(objects, "", shown)) if len(objects) >= _LEAST else [table]


def _walk(node: Any, name: str, shown: str, depth: int) -> Iterator[ArrayTable]:
    if depth > 8:
        return
    if isinstance(node, list):
        objects = [item for item in node if isinstance(item, dict)]
        if len(objects) >= _LEAST and len(objects) > 0.5 * len(node):
            yield from _objects(objects, name, shown)
        elif len(node) >= _LEAST and all(isinstance(item, list) for item in node) and len({len(i) for i in node}) == 1:
            width = len(node[0])
            titles = {3: list("xyz"), 4: ["time", *"xyz"]}.get(width, [str(i + 1) for i in range(width)])
            yield ArrayTable(
                shown, {title: _numbers([row[i] for row in node]) for i, title in enumerate(titles)}, context=name
            )
        else:
            for item in node[:100]:
                yield from _walk(item, name, shown, depth + 1)
    elif isinstance(node, dict) and (table := _named_rows(node, name, shown)) is not None:
        yield table
    elif isinstance(node, dict) and (columns := _columns_by_row(node)):
        yield ArrayTable(shown, columns, context=name)
    elif isinstance(node, dict):
        flat = _flat_lists(node)
        lengths = [len(values) for values in flat.values()]
        if lengths and max(lengths) >= _LEAST and lengths.count(max(lengths)) >= 3:
            longest = max(lengths)
            same = {key: _numbers(values) for key, values in flat.items() if len(values) == longest}
            yield ArrayTable(shown, same, context=name)
            return
        title = next((str(node[key]) for key in ("name", "sensor") if isinstance(node.get(key), str)), "")
        unit = node.get("units") or node.get("unit")
        for key, value in node.items():
            called = key if isinstance(value, list | dict) else name
            for table in _walk(value, title if title and isinstance(value, list) else called, shown, depth + 1):
                yield _with_unit(table, unit) if isinstance(unit, str) and isinstance(value, list) else table


def _with_unit(table: ArrayTable, unit: str) -> ArrayTable:
    """A table whose axes have the unit that stands beside their samples (gopro-telemetry's streams)."""
    titles = [
        f"{name} [{unit}]" if understand(name, table.context).axis and "[" not in name else name
        for name in table.arrays
    ]
    return replace(table, arrays=dict(zip(titles, table.arrays.values(), strict=True)))


def _columns_by_row(node: Fields) -> Fields:
    """Columns of pandas' to_json: {"gyro_x": {"0": 0.1, "1": …}, …}; {} if it is something else."""
    parts = list(node.values())
    if len(parts) < 6 or not all(isinstance(part, dict) and len(part) >= _LEAST for part in parts):
        return {}
    keys = list(parts[0])
    if not all(key.isdigit() for key in keys) or any(list(part) != keys for part in parts):
        return {}
    return {name: _numbers(list(part.values())) for name, part in node.items()}


def _named_rows(node: Fields, name: str, shown: str) -> ArrayTable | None:
    """Rows of numbers beside the names of their columns: Edge Impulse's payload, pandas' "split"."""
    names, values = node.get("sensors") or node.get("columns"), node.get("values") or node.get("data")
    if not isinstance(names, list) or not isinstance(values, list) or len(values) < _LEAST:
        return None
    titles = [
        f"{one.get('name')} [{one['units']}]" if isinstance(one, dict) and one.get("units") else
        str(one.get("name") if isinstance(one, dict) else one) for one in names
    ]  # fmt: skip
    if any(not isinstance(row, list) or len(row) != len(titles) for row in values):
        return None
    interval = node.get("interval_ms")
    rate = 1000.0 / interval if isinstance(interval, int | float) and interval > 0 else None
    arrays = {title: _numbers([row[i] for row in values]) for i, title in enumerate(titles)}
    return ArrayTable(shown, arrays, rate=rate, context=name)


def _flat_lists(node: Fields, prefix: str = "") -> dict[str, list[Any]]:
    """Lists of numbers in an object and in the objects in it: {"acc": {"x": […]}} is acc_x."""
    found: dict[str, list[Any]] = {}
    for key, value in node.items():
        if isinstance(value, dict):
            found |= _flat_lists(value, f"{prefix}{key}_")
        elif (
            isinstance(value, list)
            and value
            and all(item is None or isinstance(item, int | float | str) for item in value)
        ):
            found[f"{prefix}{key}"] = value
        elif (
            isinstance(value, list) and len(value) >= _LEAST and all(isinstance(i, list) and len(i) == 3 for i in value)
        ):
            found |= {f"{prefix}{key}_{axis}": [item[i] for item in value] for i, axis in enumerate("xyz")}
    return found


def _objects(objects: Sequence[Fields], name: str, shown: str) -> Iterator[ArrayTable]:
    """One table for each kind of object, or one for all."""
    objects = unpack_batches(objects)
    key = next((k for k in objects[0] if k.lower() in _KIND and isinstance(objects[0][k], str)), None)
    groups: dict[str, list[Fields]] = {}
    for item in objects:
        kind = str(item.get(key, "")) if key else name
        groups.setdefault(kind, []).append(_flatten_object(item, ""))
    for kind, rows in groups.items():
        if len(rows) < _LEAST:
            continue
        titles = dict.fromkeys(title for row in rows for title in row if title != key)
        arrays: Fields = {}
        units: dict[int, str] = {}
        labels: Fields = {}
        for title in titles:
            column = [row.get(title) for row in rows]
            if isinstance(column[0], str) and is_stamp(column[0]):
                try:
                    units[len(arrays)] = "ns"
                    arrays[title] = np.array([nanoseconds(str(cell)) for cell in column], dtype=np.int64)
                except ValueError:
                    units.pop(len(arrays), None)
                continue
            if all(isinstance(cell, str) and not is_number(cell, False) for cell in column):
                labels[title] = np.array(column)
                continue
            values = _numbers(column)
            if values.dtype.kind == "i" or not np.isnan(values).all():
                arrays[title] = values
        if arrays:
            yield ArrayTable(shown, arrays, context=kind, column_units=units, labels=labels)


def _flatten_object(item: Fields, prefix: str) -> Fields:
    found: Fields = {}
    for key, value in item.items():
        if isinstance(value, dict):
            found |= _flatten_object(value, f"{prefix}{key}_")
        elif isinstance(value, list) and len(value) in (3, 4):
            axes = "xyz" if len(value) == 3 else "wxyz"
            found |= {f"{prefix}{key}_{axis}": part for axis, part in zip(axes, value, strict=True)}
        else:
            found[f"{prefix}{key}"] = value
    return found


def _numbers(column: Sequence[Any]) -> Any:
    """(n,) int64 if all are whole numbers, else float64 with NaN for what is none; numbers in quotes count."""
    texts = [item if not isinstance(item, str) else item.strip() for item in column]
    try:
        if all(
            (isinstance(i, int) and not isinstance(i, bool)) or (isinstance(i, str) and i.lstrip("+-").isdigit())
            for i in texts
        ):
            return np.array([int(item) for item in texts], dtype=np.int64)
    except OverflowError:
        pass
    return np.array([_number(item) for item in texts])


def _number(item: Any) -> float:
    if isinstance(item, bool) or item is None:
        return np.nan
    if isinstance(item, int | float):
        return float(item)
    return float(item) if isinstance(item, str) and is_number(item, False) else np.nan
