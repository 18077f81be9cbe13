"""A node's messages as JSON for viewers: the schemas of Foxglove where it has one, else plain objects.

Schemas: https://docs.foxglove.dev/docs/sdk/schemas. Angles are in °, all else is in SI units and µT.
"""

import json
import math
from collections.abc import Iterator

from levelhead.live.events import EXPECTED
from levelhead.live.messages import Health, Message, Orientation
from levelhead.open_types import JsonObject
from levelhead.sources.formats.ros_messages import FRAME, WORLD

NANO = 1_000_000_000
INFO, WARNING = 2, 3  # levels of foxglove.Log
_NUMBER, _TEXT = {"type": "number"}, {"type": "string"}


def _object(**properties: JsonObject) -> JsonObject:
    return {"type": "object", "properties": properties}


_TIME = _object(sec={"type": "integer"}, nsec={"type": "integer"})
_VECTOR = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_ANGLES = _object(roll=_NUMBER, pitch=_NUMBER, yaw=_NUMBER)
_MOTION = dict.fromkeys(("rate", "specific_force", "linear_acceleration", "earth_acceleration"), _VECTOR)
SCHEMAS: JsonObject = {  # topic: (name of its schema, JSON schema)
    "/tf": ("foxglove.FrameTransform", _object(
        timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_VECTOR, rotation=_QUATERNION)),
    "/imu/pose": ("foxglove.PoseInFrame", _object(
        timestamp=_TIME, frame_id=_TEXT, pose=_object(position=_VECTOR, orientation=_QUATERNION))),
    "/imu/angles": ("levelhead.Angles", _object(
        timestamp=_TIME, seq={"type": "integer"}, valid={"type": "boolean"}, angles=_ANGLES,
        sigma=_object(tilt=_NUMBER, heading=_NUMBER), bias=_VECTOR, health={"type": "integer"},
        words={"type": "array", "items": _TEXT})),
    "/imu/motion": ("levelhead.Motion", _object(
        timestamp=_TIME, seq={"type": "integer"}, **_MOTION, sigma=_object(**_MOTION))),
    "/imu/raw": ("levelhead.Imu", _object(
        timestamp=_TIME, seq={"type": "integer"}, gyr=_VECTOR, acc=_VECTOR, mag=_VECTOR, pressure=_NUMBER)),
    "/imu/log": ("foxglove.Log", _object(
        timestamp=_TIME, level={"type": "integer"}, message=_TEXT, name=_TEXT, file=_TEXT, line={"type": "integer"})),
}  # fmt: skip


def viewer_messages(message: Message) -> Iterator[tuple[str, bytes]]:
    """(topic, JSON) of all that a viewer gets of a message of the node."""
    time = {"sec": message.stamp // NANO, "nsec": message.stamp % NANO}
    if isinstance(message, Orientation):
        yield from ((topic, _dump(fields)) for topic, fields in _orientation(message, time))
    elif isinstance(message, Health):
        level = WARNING if message.on and message.name not in EXPECTED else INFO
        text = f"{message.name}: {message.text}"
        yield "/imu/log", _dump({
            "timestamp": time, "level": level, "message": text, "name": "levelhead", "file": "", "line": 0,
        })  # fmt: skip
    else:
        raw: JsonObject = {"timestamp": time, "seq": message.seq, "gyr": _xyz(message.gyr), "acc": _xyz(message.acc)}
        if message.mag is not None:
            raw["mag"] = _xyz(message.mag)
        if message.pressure is not None:
            raw["pressure"] = message.pressure
        yield "/imu/raw", _dump(raw)


def _orientation(message: Orientation, time: JsonObject) -> Iterator[tuple[str, JsonObject]]:
    w, x, y, z = message.quat
    rotation, none = {"x": x, "y": y, "z": z, "w": w}, {"x": 0.0, "y": 0.0, "z": 0.0}
    roll, pitch, yaw = (math.degrees(angle) for angle in message.euler)
    east, north, up = (math.degrees(sigma) for sigma in message.sigma)
    yield "/imu/angles", {
        "timestamp": time, "seq": message.seq, "valid": message.valid,
        "angles": {"roll": roll, "pitch": pitch, "yaw": yaw},
        "sigma": {"tilt": math.hypot(east, north), "heading": up},
        "bias": _xyz([math.degrees(rate) for rate in message.bias]), "health": message.health, "words": message.words,
    }  # fmt: skip
    if message.valid:  # a viewer draws all messages, and an old one must not look fresh
        yield "/tf", {
            "timestamp": time, "parent_frame_id": WORLD, "child_frame_id": FRAME, "translation": none,
            "rotation": rotation,
        }  # fmt: skip
        pose = {"position": none, "orientation": rotation}
        yield "/imu/pose", {"timestamp": time, "frame_id": WORLD, "pose": pose}
        found = message.accelerations
        values = message.rate, message.force, found.body, found.earth
        sigmas = message.sigma_rate, message.sigma_force, found.sigma_body, found.sigma_earth
        motion, sigma = (dict(zip(_MOTION, map(_xyz, three), strict=True)) for three in (values, sigmas))
        yield "/imu/motion", {"timestamp": time, "seq": message.seq, **motion, "sigma": sigma}


def _xyz(values: tuple[float, ...] | list[float]) -> JsonObject:
    """A vector; JSON has no NaN, and a missing number is null."""
    return {axis: value if math.isfinite(value) else None for axis, value in zip("xyz", values, strict=True)}


def _dump(fields: JsonObject) -> bytes:
    return json.dumps(fields).encode()
