"""The whole state of a stream as bytes, and back: going on from there equals never having stopped, to the bit.

A header in JSON describes it; behind it are the leaves of the driver's Carry, eight bytes each (floats, or whole
numbers), little-endian; a checksum ends it. The same bytes serve plain Python and compiled code.
"""

import hashlib
import json
import struct
import zlib
from io import BytesIO
from typing import NamedTuple

import numpy as np

from levelhead import filters
from levelhead.compiler.tree import Tree, leaves
from levelhead.engine.binding import bind
from levelhead.engine.driver import Carry, Settings
from levelhead.engine.heading_offset import HeadingOffset
from levelhead.errors import LevelheadError
from levelhead.guard import Guard
from levelhead.version import VERSION

MAGIC = b"levelhead stream 1\n"


class StreamState(NamedTuple):
    """The parts of a stream."""

    settings: Settings
    guarded: bool
    carry: Carry
    time: float | None  # stamp of the last sample, s
    heading: HeadingOffset | None = None  # that the user has set


def layout(example: Tree) -> str:
    """The meaning of the leaves: names and kinds, so that bytes of another layout are refused."""
    if isinstance(example, tuple):
        names = getattr(type(example), "_fields", None) or range(len(example))
        return "(" + ",".join(f"{name}:{layout(part)}" for name, part in zip(names, example, strict=True)) + ")"
    if isinstance(example, list):
        return f"f{len(example)}"
    return "i" if isinstance(example, int) else "f"


def leaf_bytes(value: Tree) -> bytes:
    """The leaves of a value, eight bytes each."""
    if isinstance(value, tuple):
        return b"".join(map(leaf_bytes, value))
    if isinstance(value, list | np.ndarray):
        return np.asarray(value, "<f8").tobytes()
    return struct.pack("<q" if isinstance(value, int) else "<d", value)


def value_of(example: Tree, data: bytes) -> Tree:
    """The value like ``example`` that ``leaf_bytes`` was given."""
    return _fill(example, BytesIO(data))


def to_bytes(saved: StreamState) -> bytes:
    """The state as bytes."""
    params, guard = saved.settings
    header = {
        "levelhead": VERSION,
        "filter": filters.of(params).name,
        "params": params._asdict(),
        "guard": guard._asdict() if saved.guarded else None,
        "time": None if saved.time is None else saved.time.hex(),
        "heading": None if saved.heading is None else [number.hex() for number in saved.heading],
        "layout": _digest(saved.carry),
    }
    body = MAGIC + json.dumps(header).encode() + b"\n" + leaf_bytes(saved.carry)
    return body + struct.pack("<I", zlib.crc32(body))


def _digest(carry: Carry) -> str:
    return hashlib.sha256(layout(carry).encode()).hexdigest()[:16]


def _fill(example: Tree, data: BytesIO) -> Tree:
    """A value like ``example`` with the leaves read from eight bytes each."""
    if isinstance(example, tuple):
        return type(example)(*(_fill(part, data) for part in example))
    if isinstance(example, list):
        return np.frombuffer(data.read(8 * len(example)), "<f8").tolist()
    if isinstance(example, int):
        return type(example)(struct.unpack("<q", data.read(8))[0])
    return struct.unpack("<d", data.read(8))[0]


def from_bytes(data: bytes) -> StreamState:
    """The state from bytes.

    Raises:
        LevelheadError: not such bytes, cut off, damaged, or saved by a version whose filter keeps another state.
    """
    if not isinstance(data, bytes) or not data.startswith(MAGIC):
        raise LevelheadError("these bytes are not a saved stream; expected the bytes of Stream.save()")
    if len(data) < len(MAGIC) + 4 or struct.unpack("<I", data[-4:])[0] != zlib.crc32(data[:-4]):
        raise LevelheadError("the saved stream is cut off or damaged: its checksum does not fit")
    text, _, body = data[len(MAGIC) : -4].partition(b"\n")
    try:
        header = json.loads(text)
        name, values, guard = header["filter"], dict(header["params"]), header["guard"]
        time = None if header["time"] is None else float.fromhex(header["time"])
        turned = header.get("heading")
        heading = None if turned is None else HeadingOffset(*map(float.fromhex, turned))
    except (ValueError, KeyError, TypeError):
        raise LevelheadError("the saved stream's header is not one that levelhead writes") from None
    flt = filters.find(name)
    settings = Settings(flt.params(**values), Guard(**(guard or {})))
    guarded = guard is not None
    example = bind(flt, guarded).begin(settings)
    if header.get("layout") != _digest(example) or len(body) != 8 * len(list(leaves(example))):
        raise LevelheadError(
            f"the stream was saved by levelhead {header.get('levelhead')}, whose {flt.name} keeps another state than "
            f"{VERSION}; start a new one"
        )
    return StreamState(settings=settings, guarded=guarded, carry=value_of(example, body), time=time, heading=heading)
