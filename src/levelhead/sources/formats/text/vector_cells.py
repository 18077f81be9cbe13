"""Vectors in one cell, "[0.1, 0.2, 9.8]" or "(0.1, 0.2, 9.8)", as a column for each of their numbers."""

import re
from collections.abc import Sequence

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_BETWEEN = r"(?:\s*[,;]\s*|\s+)"
VECTOR = re.compile(rf"\"?[\[(]\s*({_NUMBER}(?:{_BETWEEN}{_NUMBER}){{2,3}})\s*[\])]\"?")
_QUOTE = r"[\"']{0,2}"
OBJECT = re.compile(
    rf"\"?\{{\s*{_QUOTE}x{_QUOTE}\s*:\s*({_NUMBER})\s*,\s*{_QUOTE}y{_QUOTE}\s*:\s*({_NUMBER})\s*,"
    rf"\s*{_QUOTE}z{_QUOTE}\s*:\s*({_NUMBER})\s*\}}\"?"
)
_MARK = "\1"
_KEY = re.compile(r"[\"']\w+[\"']\s*:")
_AXES = {1: ("",), 3: ("_x", "_y", "_z")}


def without_objects(lines: Sequence[str]) -> str | None:
    """Cells such as "{'x': 0.1, 'y': 0.2, 'z': 9.8}" as columns; None: each line is one object."""
    return without_vectors([OBJECT.sub(r"(\1, \2, \3)", line) for line in lines])


def without_vectors(lines: Sequence[str]) -> str | None:
    """The lines as a table with commas, three columns for a vector of three; None: they are words with vectors."""
    first = next(i for i, line in enumerate(lines) if VECTOR.search(line))
    if _KEY.search(lines[first]) or any(_MARK in cell != _MARK for cell in _plain_cells(lines[first])):
        return None
    sizes = [len(cell) for cell in _cells(lines[first])]
    rows = [_cells(line) for line in lines[first:] if VECTOR.search(line)]
    body = [",".join(part for cell in row for part in cell) for row in rows if [len(cell) for cell in row] == sizes]
    return "\n".join([*_header(lines[first - 1], sizes), *body] if first > 0 else body)


def _cells(line: str) -> list[list[str]]:
    """The cells of a line, each as its numbers: one, or those of a vector."""
    following = iter([re.split(r"[\s,;]+", found.strip()) for found in VECTOR.findall(line)])
    return [next(following) if cell == _MARK else [cell.replace(",", ".")] for cell in _plain_cells(line)]


def _plain_cells(line: str) -> list[str]:
    """The cells of a line, a mark in place of each vector."""
    plain = VECTOR.sub(_MARK, line).strip()
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
