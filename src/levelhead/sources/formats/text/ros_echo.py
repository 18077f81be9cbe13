"""Messages as ROS and Gazebo print them: YAML with a line of dashes between them, or names with braces."""

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.text.cells import is_comment, is_number
from levelhead.sources.formats.text.file import TextFile
from levelhead.sources.table import ArrayTable

_LINE = re.compile(r"(\s*)([A-Za-z_]\w*):\s*(.*?)\s*$")
_OPENED = re.compile(r"(\s*)([A-Za-z_]\w*)\s*\{\s*")
_SAMPLE_LINES = 200
_MIN_SHARE = 0.5  # of the messages that hold a name, below which it is not a column


def matches(file: TextFile) -> bool:
    """Whether lines are indented names with numbers, and dashes stand between messages."""
    lines = _without_braces([line for line in file.head if not is_comment(line)][:_SAMPLE_LINES])
    lines = [line for line in lines if line.strip()]
    named = sum(_LINE.match(line) is not None or line.lstrip().startswith(("-", "[")) for line in lines)
    return any(line.strip() == "---" for line in lines) and named > 0.9 * len(lines)


def _without_braces(lines: Sequence[str]) -> list[str]:
    """Protobuf's text, "imu {", "  x: 0.1", "}" and a blank line behind each message, as YAML; other lines as they are.

    Gazebo prints it (gz topic -e).
    """
    if not any(_OPENED.fullmatch(line) for line in lines[:_SAMPLE_LINES]):
        return list(lines)
    renamed = (_OPENED.sub(r"\1\2:", line) if line.strip() else "---" for line in lines)
    return [line for line in renamed if line.strip() != "}"]


def messages(lines: Sequence[str]) -> Iterator[dict[str, str]]:
    """The numbers of each message by their path, "angular_velocity.x"; lists are left out."""
    path: list[tuple[int, str]] = []
    found: dict[str, str] = {}
    for line in [*lines, "---"]:
        if line.strip() == "---":
            if found:
                yield found
            path, found = [], {}
            continue
        parts = _LINE.match(line)
        if parts is None:
            continue
        depth = len(parts[1])
        path = [*[parent for parent in path if parent[0] < depth], (depth, parts[2])]
        if is_number(parts[3], False):
            found[".".join(name for _, name in path)] = parts[3]


def tables(file: TextFile) -> Sequence[ArrayTable]:
    """The messages of a text as rows, NaN where one lacks a number; the last one may be torn.

    Raises:
        LevelheadError: no message with numbers.
    """
    rows = list(messages(_without_braces(file.lines())))
    if len(rows) > 1 and len(rows[-1]) < len(rows[0]):
        rows.pop()
    counts: dict[str, int] = {}
    for row in rows:
        for name in row:
            counts[name] = counts.get(name, 0) + 1
    names = [name for name, count in counts.items() if count > _MIN_SHARE * len(rows)]
    if not names:
        raise LevelheadError(
            f"{file.display_path} holds no messages with numbers; expected such as rostopic echo prints"
        )
    arrays: JsonObject = {name: _column([row.get(name, "") for row in rows]) for name in names}
    kind = Conclusion("file.kind", "ros_echo", "ROS echo", Basis.HEADER, {"names": ", ".join(names[:12])})
    return [ArrayTable(file.display_path, arrays, conclusions=[kind])]


def _column(cells: Sequence[str]) -> Any:
    """(n,) int64 if all are whole numbers, else float64 with NaN for missing values."""
    if all(cell.lstrip("+-").isdigit() and len(cell) < 19 for cell in cells):
        return np.array([int(cell) for cell in cells], dtype=np.int64)
    return np.array([float(cell) if is_number(cell, False) else np.nan for cell in cells])
