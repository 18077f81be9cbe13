"""Numbers in ROS messages of any type, by their definitions, which are walked and never compiled.

ROS 1 packs numbers without gaps, little-endian (wiki.ros.org, Bags/Format/2.0). CDR of ROS 2 (DDS-RTPS 2.5, 10.2) puts
numbers at multiples of their size behind four bytes that name the order of bytes.
"""

import struct
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from levelhead.open_types import Untyped

_FORMATS = {
    "bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i",
    "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
_MAX_ARRAY = 16  # numbers of an array that become columns: more are covariances, images, clouds
_DEEPEST = 12
_AXES = {3: "xyz", 4: "xyzw"}
Definitions = Mapping[str, tuple[Any, Any]]  # type to (constants, fields), as rosbags parses them


class Encoding(NamedTuple):
    """How numbers are packed: ``order`` for ``struct``, and whether they stand at multiples of their size."""

    order: str
    aligned: bool


def read_numbers(definitions: Definitions, kind: str, data: bytes, first: bool) -> dict[str, float]:
    """The numbers of a message by their paths, "imu.angular_velocity.x"; ``first``: of ROS 1, else CDR.

    Raises:
        ValueError: the message is shorter than its definition, or has a type that is not defined.
    """
    if first:
        reader = _Reader(definitions, data, 0, Encoding("<", False))
    else:
        reader = _Reader(definitions, data, 4, Encoding("<" if data[1] & 1 else ">", True))
    try:
        return dict(reader.fields(kind, "", True, 0))
    except (struct.error, KeyError, IndexError) as error:
        raise ValueError(f"{kind} is not as its definition") from error


class _Reader:
    """Walks through one message."""

    def __init__(self, definitions: Definitions, data: bytes, begin: int, encoding: Encoding) -> None:
        self._definitions, self._data, self._encoding = definitions, data, encoding
        self._begin = self._at = begin

    def fields(self, kind: str, path: str, kept: bool, depth: int) -> Iterator[tuple[str, float]]:
        """(path, number) of the fields of a type; ``kept``: whether they are wanted, or passed over."""
        if depth > _DEEPEST:
            raise ValueError("types within types")
        members = self._definitions[kind][1]
        if not members and self._encoding.aligned:
            self._at += 1  # ROS 2 gives an empty type one byte
        for name, (node, what) in members:
            inner = f"{path}.{name}" if path else name
            yield from self._member(node.name, what, inner, kept, depth)

    def _member(self, node: str, what: Untyped, path: str, kept: bool, depth: int) -> Iterator[tuple[str, float]]:
        if node == "BASE":
            value = self._base(what[0])
            if value is not None and kept:
                yield path, value
        elif node == "NAME":
            yield from self.fields(what, path, kept, depth + 1)
        else:
            (inner, kind), count = what
            if node == "SEQUENCE":
                count = int(self._number("uint32"))
            yield from self._items(inner.name, kind, count, path, kept, depth)

    def _items(
        self, node: str, kind: Untyped, count: int, path: str, kept: bool, depth: int
    ) -> Iterator[tuple[str, float]]:
        if node == "BASE" and kind[0] in _FORMATS and count > _MAX_ARRAY:
            size = struct.calcsize(_FORMATS[kind[0]])
            self._align(size)
            self._at += size * count
            return
        if count > len(self._data):
            raise ValueError("more items than bytes")
        letters = _AXES.get(count) if node == "BASE" else None
        for k in range(count):
            inner = f"{path}.{letters[k]}" if letters else f"{path}[{k}]"
            yield from self._member(node, kind, inner, kept and k < _MAX_ARRAY, depth + 1)

    def _base(self, kind: str) -> float | None:
        """A number; None for text, which is passed over."""
        if kind in _FORMATS:
            return self._number(kind)
        if kind != "string":
            raise ValueError(kind)
        length = int(self._number("uint32"))
        self._at += length
        return None

    def _number(self, kind: str) -> float:
        sign = _FORMATS[kind]
        size = struct.calcsize(sign)
        self._align(size)
        (value,) = struct.unpack_from(self._encoding.order + sign, self._data, self._at)
        self._at += size
        return value  # type: ignore[no-any-return]  # whole numbers stay exact

    def _align(self, size: int) -> None:
        if self._encoding.aligned:
            self._at += -(self._at - self._begin) % size
