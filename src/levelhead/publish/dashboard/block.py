"""A block: a JSON header and columns of numbers as bytes, which the page reads as typed arrays without a copy.

Layout, little-endian: "LHB1", length of the header (uint32), the header (JSON), padding to 8 bytes, then the columns in
the order of the header's "columns", each padded to 8 bytes. An entry is [name, type, rows, width]; type f8, f4, u4 or
u1.
"""

import json
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from levelhead.open_types import JsonObject, Untyped

MAGIC = b"LHB1"
ALIGNMENT = 8  # bytes: that of float64
TYPES = {"f8": "<f8", "f4": "<f4", "u4": "<u4", "u1": "u1"}


def pack_block(header: JsonObject, columns: Mapping[str, NDArray[Untyped]] | None = None) -> bytes:
    """A block as bytes; arrays of (n,) or (n, k) with one of the four types."""
    described: list[list[str | int]] = []
    parts: list[bytes | memoryview] = []
    for name, values in (columns or {}).items():
        kind = f"{values.dtype.kind}{values.dtype.itemsize}"
        width = 1 if values.ndim == 1 else values.shape[1]
        described.append([name, kind, len(values), width])
        flat = np.ascontiguousarray(values, TYPES[kind]).reshape(-1)
        parts += (flat.view(np.uint8).data, bytes(-flat.nbytes % ALIGNMENT))
    head = json.dumps(header | {"columns": described}, allow_nan=False).encode()
    start = MAGIC + len(head).to_bytes(4, "little") + head
    return b"".join([start, bytes(-len(start) % ALIGNMENT), *parts])
