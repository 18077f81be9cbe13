"""The few messages of MAVLink that carry an IMU's readings and an attitude, as bytes of version 1 and 2.

Layouts, scales and CRC_EXTRA are those of ``common.xml`` (https://mavlink.io/en/messages/common.html); framing and
checksum (X.25) those of https://mavlink.io/en/guide/serialization.html. Fields stand in the order of their sizes.
"""

import struct
from collections.abc import Iterator
from typing import NamedTuple

V1, V2 = 0xFE, 0xFD
SIGNED, SIGNATURE = 0x01, 13  # flag of a message with a signature, and the bytes of that


class Layout(NamedTuple):
    """A message: its format for ``struct``, its fields in that order, and the byte that the checksum ends with."""

    format: struct.Struct
    fields: tuple[str, ...]
    crc_extra: int


def _layout(format: str, fields: str, crc_extra: int) -> Layout:
    return Layout(struct.Struct(f"<{format}"), tuple(fields.split()), crc_extra)


_NINE = "xacc yacc zacc xgyro ygyro zgyro xmag ymag zmag"
HEARTBEAT, SCALED_IMU, RAW_IMU, SCALED_PRESSURE, ATTITUDE, ATTITUDE_QUATERNION, HIGHRES_IMU = 0, 26, 27, 29, 30, 31, 105
LAYOUTS = {
    HEARTBEAT: _layout("IBBBBB", "custom_mode type autopilot base_mode system_status mavlink_version", 50),
    SCALED_IMU: _layout("I9h", f"time_boot_ms {_NINE}", 170),
    RAW_IMU: _layout("Q9h", f"time_usec {_NINE}", 144),
    SCALED_PRESSURE: _layout("Iffh", "time_boot_ms press_abs press_diff temperature", 115),
    ATTITUDE: _layout("I6f", "time_boot_ms roll pitch yaw rollspeed pitchspeed yawspeed", 39),
    ATTITUDE_QUATERNION: _layout("I7f", "time_boot_ms q1 q2 q3 q4 rollspeed pitchspeed yawspeed", 246),
    HIGHRES_IMU: _layout(
        "Q13fH", f"time_usec {_NINE} abs_pressure diff_pressure pressure_alt temperature fields_updated", 93
    ),
}


class MavlinkMessage(NamedTuple):
    """A message.

    Attributes:
        number: which, such as ``ATTITUDE``.
        system: id of the vehicle.
        component: id of its part.
        fields: name to value, as on the wire.
    """

    number: int
    system: int
    component: int
    fields: dict[str, float]


def checksum(data: bytes) -> int:
    """The CRC-16 of MAVLink (X.25, initial value 0xFFFF)."""
    crc = 0xFFFF
    for byte in data:
        low = (byte ^ crc) & 0xFF
        low ^= (low << 4) & 0xFF
        crc = (crc >> 8) ^ (low << 8) ^ (low << 3) ^ (low >> 4)
    return crc


def pack_mavlink(number: int, seq: int, *values: float, system: int = 1, component: int = 191) -> bytes:
    """A message of version 2; ``values`` in the order of ``LAYOUTS``. Component 191 is a companion computer."""
    layout = LAYOUTS[number]
    payload = layout.format.pack(*values).rstrip(b"\x00") or b"\x00"
    head = struct.pack("<BBBBBB", len(payload), 0, 0, seq % 256, system, component) + number.to_bytes(3, "little")
    crc = checksum(head + payload + bytes([layout.crc_extra]))
    return bytes([V2]) + head + payload + struct.pack("<H", crc)


def unpack_mavlink(data: bytes) -> Iterator[MavlinkMessage]:
    """The messages in a datagram that are known and whole; bytes between them are left."""
    at = 0
    while at + 8 <= len(data):
        end, message = frame_at(data, at)
        if message is None and (end == 0 or not _is_whole(data, at, end)):
            at += 1
            continue
        if message is not None:
            yield message
        at = end


def frame_at(data: bytes, at: int) -> tuple[int, MavlinkMessage | None]:
    """The end of the frame that begins at ``at``, 0 where none does, and its message; None: not known, or not whole."""
    if at + 8 > len(data) or data[at] not in (V1, V2):
        return 0, None
    version, length = data[at], data[at + 1]
    head = 6 if version == V1 else 10
    end = at + head + length + 2
    signed = SIGNATURE if version == V2 and data[at + 2] & SIGNED else 0
    return end + signed, _message(data[at:end], version, head) if end + signed <= len(data) else None


def _is_whole(data: bytes, at: int, end: int) -> bool:
    """Whether a frame that was not read ends where another one begins, or the data do: a message that is not known."""
    return end == len(data) or (end < len(data) and data[end] in (V1, V2))


def _message(frame: bytes, version: int, head: int) -> MavlinkMessage | None:
    if len(frame) < head + 2:
        return None
    number = frame[5] if version == V1 else int.from_bytes(frame[7:10], "little")
    system, component = (frame[3], frame[4]) if version == V1 else (frame[5], frame[6])
    layout = LAYOUTS.get(number)
    if layout is None:
        return None
    if checksum(frame[1:-2] + bytes([layout.crc_extra])) != int.from_bytes(frame[-2:], "little"):
        return None
    size = layout.format.size
    payload = frame[head:-2][:size].ljust(size, b"\x00")  # zeros at the end are left out; the rest is an extension
    return MavlinkMessage(
        number, system, component, dict(zip(layout.fields, layout.format.unpack(payload), strict=True))
    )
