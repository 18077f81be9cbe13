"""The tags of a .mat file of version 5 to 7: whether each names a type of data that there is.

SciPy's reader takes the type from the file for an index, and a damaged one ends the process (scipy pull request 25829).
The format: MAT-File Format, MathWorks, 2024, chapter 1. Each element is a tag of 8 bytes, type and size, and the data;
up to four bytes of data stand in the tag itself. A matrix is a sequence of elements: flags, dimensions, name, contents.
"""

import struct
import zlib

from levelhead.errors import LevelheadError

HEADER = 128  # bytes
PLAIN = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18))  # numbers and letters
FLAGS, MATRIX, COMPRESSED = 6, 14, 15
NESTING = frozenset((1, 2, 3, 16, 17))  # classes that hold matrices: cell, structure, object, function, opaque


def check_tags(raw: bytes) -> None:
    """Walks through all elements that are whole; what is cut off is left to the reader.

    Raises:
        LevelheadError: an element has a type that does not exist, or not there.
    """
    order = {b"\0\1IM": "<", b"\1\0MI": ">"}.get(raw[124:HEADER])  # version 1, and the order of bytes
    if order is not None:
        _walk(memoryview(raw)[HEADER:], order, True)


def _walk(data: memoryview, order: str, nesting: bool) -> None:
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(order + "II", data, at)
        small = kind >> 16 != 0
        if small:
            kind, size = kind & 0xFFFF, kind >> 16
        begin = at + (4 if small else 8)
        if size > len(data) - begin:
            return
        _check(data[begin : begin + size], kind, order, nesting)
        at = at + 8 if small else begin + (size if kind == COMPRESSED else (size + 7) // 8 * 8)


def _check(data: memoryview, kind: int, order: str, nesting: bool) -> None:
    if kind in PLAIN:
        return
    if not nesting or kind not in (MATRIX, COMPRESSED):
        raise LevelheadError(f"data of type {kind}")
    if kind == COMPRESSED:
        _walk(memoryview(zlib.decompress(data)), order, True)
    elif len(data) >= 12:
        first, _, flags = struct.unpack_from(order + "III", data)
        _walk(data, order, first == FLAGS and flags & 0xFF in NESTING)
