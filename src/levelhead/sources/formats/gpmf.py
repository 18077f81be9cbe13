"""GoPro's GPMF: accelerometer, gyroscope and magnetometer in the metadata track of an MP4.

The box structure is that of ISO/IEC 14496-12; key, type, size, repeat and the keys are those of gopro/gpmf-parser's
README: DEVC holds STRM, which hold SCAL (divisors), SIUN or UNIT, ORIN (axes), STMP (µs of the first sample) and data.
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.recording import Array
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable

_PARENTS = frozenset((b"moov", b"trak", b"mdia", b"minf", b"stbl"))
_SENSORS = {b"ACCL": "acc", b"GYRO": "gyr", b"MAGN": "mag"}
_UNITS = {"acc": "m/s²", "gyr": "rad/s", "mag": "µT"}
_TYPES = {
    b"b": ">i1", b"B": ">u1", b"s": ">i2", b"S": ">u2", b"l": ">i4", b"L": ">u4", b"f": ">f4", b"d": ">f8",
    b"j": ">i8", b"J": ">u8",
}  # fmt: skip
_NESTED = b"\0"
_DEEPEST = 6
_MAX_BOX = 1 << 26  # bytes of the table of a track


class Payload(NamedTuple):
    """One sample of the metadata track: its bytes, its time and its duration in s."""

    data: bytes
    start: float
    duration: float


class Piece(NamedTuple):
    """The readings of a sensor in one payload: (n, 3), and the stamp of the first one in µs, or None."""

    values: Array
    stamp: float | None
    payload: int


def is_mp4(head: bytes) -> bool:
    """Whether a file begins like an MP4."""
    return head[4:8] == b"ftyp"


def tables(path: Path, display_path: str, hints: Hints) -> Sequence[ArrayTable]:
    """A table for each sensor in the metadata track of a GoPro.

    Raises:
        LevelheadError: no MP4, or one without such a track.
    """
    with open(path, "rb") as file:
        size = path.stat().st_size
        try:
            payloads = [payload for track in _tracks(file, size) for payload in _payloads(file, track)]
        except (struct.error, IndexError, KeyError) as error:
            raise LevelheadError(f"{display_path} is not an MP4, or it is damaged") from error
    pieces: dict[str, list[Piece]] = {}
    for k, payload in enumerate(payloads):
        for role, values, stamp in _sensors(payload.data):
            pieces.setdefault(role, []).append(Piece(values, stamp, k))
    if not {"acc", "gyr"} <= pieces.keys():
        raise LevelheadError(
            f"{display_path} is a video without a GoPro's track of accelerometer and gyroscope (GPMF); of an Insta360, "
            "DJI or Sony, Gyroflow's export of motion data gives CSV"
        )
    return [_table(display_path, role, found, payloads) for role, found in pieces.items()]


def _table(source: str, role: str, pieces: Sequence[Piece], payloads: Sequence[Payload]) -> ArrayTable:
    """The readings of a sensor on one clock: those of a payload stand evenly between its stamp and the next one."""
    stamped = all(piece.stamp is not None for piece in pieces)
    starts = [
        1e-6 * piece.stamp if stamped and piece.stamp is not None else payloads[piece.payload].start
        for piece in pieces
    ]  # fmt: skip
    last = pieces[-1]
    durations = [*np.diff(starts), payloads[last.payload].duration]
    if stamped and len(pieces) > 1:
        durations[-1] = durations[-2] * len(last.values) / max(1, len(pieces[-2].values))
    t = np.concatenate([
        start + duration * np.arange(len(piece.values)) / max(1, len(piece.values))
        for piece, start, duration in zip(pieces, starts, durations, strict=True)
    ])  # fmt: skip
    values = np.concatenate([piece.values for piece in pieces])
    columns = {f"{role}_{axis} [{_UNITS[role]}]": values[:, i] for i, axis in enumerate("xyz")}
    return ArrayTable(source, {"t [s]": t} | columns, context=role)


# MP4: which bytes are the payloads.


def _boxes(file: BinaryIO, begin: int, end: int) -> Iterator[tuple[bytes, int, int]]:
    """(type, begin, end of the content) of the boxes between two places of a file."""
    at = begin
    while at + 8 <= end:
        file.seek(at)
        head = file.read(16)
        size, kind = struct.unpack_from(">I4s", head)
        inner = at + 8
        if size == 1:
            (size,), inner = struct.unpack_from(">Q", head, 8), at + 16
        elif size == 0:
            size = end - at
        if size < inner - at or at + size > end:
            return
        yield kind, inner, at + size
        at += size


def _tracks(file: BinaryIO, end: int) -> Iterator[Mapping[bytes, bytes]]:
    """The tables of each track of GoPro's metadata: the content of its boxes by their types."""
    for kind, begin, stop in _boxes(file, 0, end):
        if kind != b"moov":
            continue
        for inner, inner_begin, inner_stop in _boxes(file, begin, stop):
            if inner == b"trak":
                leaves = dict(_leaves(file, inner_begin, inner_stop, 0))
                if b"gpmd" in leaves.get(b"stsd", b"")[:64]:
                    yield leaves


def _leaves(file: BinaryIO, begin: int, end: int, depth: int) -> Iterator[tuple[bytes, bytes]]:
    for kind, inner, stop in _boxes(file, begin, end):
        if kind in _PARENTS and depth < _DEEPEST:
            yield from _leaves(file, inner, stop, depth + 1)
        elif stop - inner < _MAX_BOX:
            file.seek(inner)
            yield kind, file.read(stop - inner)


def _payloads(file: BinaryIO, track: Mapping[bytes, bytes]) -> Iterator[Payload]:
    """The samples of a track, by stsz (sizes), stsc and stco (places), stts and mdhd (times)."""
    header = track[b"mdhd"]
    (scale,) = struct.unpack_from(">I", header, 20 if header[0] == 1 else 12)
    fixed, count = struct.unpack_from(">II", track[b"stsz"], 4)
    sizes = [fixed] * count if fixed else list(struct.unpack_from(f">{count}I", track[b"stsz"], 12))
    start = 0
    durations = _durations(track[b"stts"], count)
    for k, place in enumerate(_places(track, sizes)):
        file.seek(place)
        yield Payload(file.read(sizes[k]), start / scale, durations[k] / scale)
        start += durations[k]


def _durations(table: bytes, count: int) -> list[int]:
    """Ticks of each sample."""
    (entries,) = struct.unpack_from(">I", table, 4)
    found: list[int] = []
    for i in range(entries):
        repeat, ticks = struct.unpack_from(">II", table, 8 + 8 * i)
        found += [ticks] * min(repeat, count - len(found))
    return found + [found[-1] if found else 0] * (count - len(found))


def _places(track: Mapping[bytes, bytes], sizes: Sequence[int]) -> Iterator[int]:
    """Where each sample begins."""
    wide = b"co64" in track
    table = track[b"co64"] if wide else track[b"stco"]
    (count,) = struct.unpack_from(">I", table, 4)
    chunks = struct.unpack_from(f">{count}{'Q' if wide else 'I'}", table, 8)
    (entries,) = struct.unpack_from(">I", track[b"stsc"], 4)
    runs = [struct.unpack_from(">III", track[b"stsc"], 8 + 12 * i) for i in range(entries)]
    sample = 0
    for k, place in enumerate(chunks, 1):
        each = next(number for first, number, _ in reversed(runs) if first <= k)
        ahead = 0  # samples of the chunk before this one
        for _ in range(each):
            if sample == len(sizes):
                return
            yield place + sum(sizes[sample - ahead : sample])
            ahead, sample = ahead + 1, sample + 1


# GPMF: the contents of a payload.


def _items(data: bytes) -> Iterator[tuple[bytes, bytes, int, bytes]]:
    """(key, type, size of one, content) of the items in a payload; each ends at a multiple of four bytes."""
    at = 0
    while at + 8 <= len(data):
        key, kind, size, repeat = struct.unpack_from(">4scBH", data, at)
        length = size * repeat
        if at + 8 + length > len(data):
            return
        yield key, kind, size, data[at + 8 : at + 8 + length]
        at += 8 + (length + 3) // 4 * 4


def _sensors(payload: bytes, depth: int = 0) -> Iterator[tuple[str, Array, float | None]]:
    """(role, (n, 3) readings in their units, stamp in µs) of each stream of a sensor."""
    for key, kind, _, content in _items(payload):
        if kind != _NESTED or depth > _DEEPEST:
            continue
        if key == b"STRM":
            stream = {name: (form, size, data) for name, form, size, data in _items(content)}
            for name, role in _SENSORS.items():
                if name in stream and (values := _readings(*stream[name])) is not None:
                    stamp = _numbers(*stream[b"STMP"]) if b"STMP" in stream else None
                    yield role, _turned(values / _divisors(stream), stream), None if stamp is None else float(stamp[0])
        else:
            yield from _sensors(content, depth + 1)


def _numbers(kind: bytes, size: int, content: bytes) -> NDArray[np.float64]:
    return np.frombuffer(content[: len(content) // np.dtype(_TYPES[kind]).itemsize * np.dtype(_TYPES[kind]).itemsize],
                         _TYPES[kind]).astype(np.float64)  # fmt: skip


def _readings(kind: bytes, size: int, content: bytes) -> Array | None:
    if kind not in _TYPES or size != 3 * np.dtype(_TYPES[kind]).itemsize:
        return None
    return _numbers(kind, size, content).reshape(-1, 3)


def _divisors(stream: Mapping[bytes, tuple[bytes, int, bytes]]) -> NDArray[np.float64]:
    divisors = _numbers(*stream[b"SCAL"]) if b"SCAL" in stream else np.ones(1)
    return divisors if (divisors != 0.0).all() and len(divisors) in (1, 3) else np.ones(1)


def _turned(values: Array, stream: Mapping[bytes, tuple[bytes, int, bytes]]) -> Array:
    """(n, 3) readings as x, y, z: ORIN names the axis of each number, with a small letter where it is negative."""
    orientation = stream.get(b"ORIN", (b"c", 1, b""))[2].rstrip(b"\0").decode("ascii", "replace")
    if sorted(orientation.upper()) != ["X", "Y", "Z"]:
        return values
    turned = np.empty_like(values)
    for i, letter in enumerate(orientation):
        turned[:, "XYZ".index(letter.upper())] = values[:, i] if letter.isupper() else -values[:, i]
    return turned
