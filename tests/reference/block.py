"""A block as the page reads it."""

import json

import numpy as np
from numpy.typing import NDArray

from levelhead.open_types import JsonObject, Untyped
from levelhead.publish.dashboard.block import ALIGNMENT, TYPES


def unpack_block(data: bytes) -> tuple[JsonObject, dict[str, NDArray[Untyped]]]:
    """The header and the columns of a block."""
    length = int.from_bytes(data[4:8], "little")
    header: JsonObject = json.loads(data[8 : 8 + length])
    columns, at = {}, _after(8 + length)
    for name, kind, rows, width in header.pop("columns"):
        values = np.frombuffer(data, TYPES[kind], rows * width, at)
        columns[name] = values if width == 1 else values.reshape(rows, width)
        at = _after(at + values.nbytes)
    return header, columns


def _after(place: int) -> int:
    """The next place at which a column may begin."""
    return place + -place % ALIGNMENT
