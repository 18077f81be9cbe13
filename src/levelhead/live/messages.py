"""The messages on the bus: three kinds, as tuples in a process, as compact versioned bytes between processes.

Bytes begin with "LH", the version of the layout and the kind; all numbers are little-endian. A reader refuses another
version by name instead of guessing.
"""

import json
import math
import struct
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.filters.health import NAMES as BITS
from levelhead.kernels.quat import Euler, Quat, to_euler
from levelhead.motion import acceleration_in_body, acceleration_in_earth
from levelhead.open_types import JsonObject

ORIENTATION, RAW, HEALTH, CONFIG = "imu/orientation", "imu/raw", "imu/health", "imu/config"
TOPICS = (ORIENTATION, RAW, HEALTH, CONFIG)
SET = "imu/set"  # the other way, a query with {"beta": 0.1}: asks the node for other parameters
CLOCK = "imu/clock"  # a query: the node's id and its clock; with it a reader reports the messages that it missed
ALIVE = "imu/alive"  # imu/alive/ID: the liveliness token of a node
VERSION = 2
HEADER = struct.Struct("<2sBBIQdq")  # "LH", version, kind, node, seq, t, stamp
BODY_ORIENTATION = struct.Struct("<4d3d3dIB12d")
BODY_RAW = struct.Struct("<3d3d3dd")
NOTHING = (math.nan, math.nan, math.nan)
Triple = tuple[float, float, float]


class OtherVersion(LevelheadError):
    """A message of a node with another layout of messages."""


class Accelerations(NamedTuple):
    """Acceleration without gravity in m/s² and its 1σ, along the axes of the body and those of the earth."""

    body: Triple
    sigma_body: Triple
    earth: Triple
    sigma_earth: Triple


class Orientation(NamedTuple):
    """The node's orientation at a sample.

    Attributes:
        node: the sender: a random number per run.
        seq: number of the sample, from 0, in all three topics.
        t: s on the source's clock.
        stamp: ns since 1970, when the node took the sample.
        quat: wxyz, sensor (or body) frame to earth frame (x east, y north, z up).
        sigma: 1σ of the attitude error about east, north and up, rad.
        bias: gyroscope bias, rad/s, that of the calibration at the start included.
        health: bits of ``levelhead.filters.health``.
        valid: False: the last orientation before the node fell silent; do not steer by it.
        rate: rad/s of the body, without bias and the scale errors that the filter has found.
        sigma_rate: its 1σ; NaN until the sensor has rested.
        force: specific force of the body, m/s², without the errors that the filter has found; NaN where none was read.
        sigma_force: its 1σ, likewise.
    """

    node: int
    seq: int
    t: float
    stamp: int
    quat: tuple[float, float, float, float]
    sigma: Triple
    bias: Triple
    health: int
    valid: bool = True
    rate: Triple = NOTHING
    sigma_rate: Triple = NOTHING
    force: Triple = NOTHING
    sigma_force: Triple = NOTHING

    @property
    def accelerations(self) -> Accelerations:
        """Accelerations without gravity, as ``Track.linear_acceleration`` and ``Track.earth_acceleration``."""
        given = (np.array([self.quat]), np.array([self.force]), np.array([self.sigma]), np.array(self.sigma_force))
        found = []
        for series in (acceleration_in_body(*given), acceleration_in_earth(*given)):
            assert series.sigma is not None
            found += [series.value[0].tolist(), series.sigma[0].tolist()]
        body, sigma_body, earth, sigma_earth = (tuple(values) for values in found)
        return Accelerations(body, sigma_body, earth, sigma_earth)

    @property
    def euler(self) -> Euler:
        """Roll, pitch and yaw in rad."""
        return to_euler(Quat(*self.quat))

    @property
    def words(self) -> list[str]:
        """The health bits in words."""
        return [words for bit, words in BITS.items() if self.health & bit]


class Raw(NamedTuple):
    """A sample as it was read, in SI units, turned to the body's axes; see ``Orientation`` for the rest.

    Attributes:
        gyr: rad/s, before the bias of the calibration is taken off.
        acc: m/s².
        mag: µT, or None where there is nothing new.
        pressure: Pa, or None where there is nothing new.
    """

    node: int
    seq: int
    t: float
    stamp: int
    gyr: Triple
    acc: Triple
    mag: Triple | None
    pressure: float | None


class Health(NamedTuple):
    """Something happened; see ``levelhead.live.events`` for the names.

    Attributes:
        name: of the event.
        on: it began, or happened; False: it is over.
        text: a sentence for people.
        data: numbers for programs.
    """

    node: int
    seq: int
    t: float
    stamp: int
    name: str
    on: bool
    text: str
    data: JsonObject = {}  # noqa: RUF012 - never changed


Message = Orientation | Raw | Health


def pack_message(message: Message) -> bytes:
    """A message as bytes."""
    kind = (Orientation, Raw, Health).index(type(message))
    head = HEADER.pack(b"LH", VERSION, kind, message.node, message.seq, message.t, message.stamp)
    if isinstance(message, Orientation):
        return head + BODY_ORIENTATION.pack(
            *message.quat, *message.sigma, *message.bias, message.health, message.valid,
            *message.rate, *message.sigma_rate, *message.force, *message.sigma_force,
        )  # fmt: skip
    if isinstance(message, Raw):
        pressure = math.nan if message.pressure is None else message.pressure
        return head + BODY_RAW.pack(*message.gyr, *message.acc, *(message.mag or NOTHING), pressure)
    words = {"name": message.name, "on": message.on, "text": message.text, "data": message.data}
    return head + json.dumps(words).encode()


def unpack(data: bytes) -> Message:
    """A message from bytes.

    Raises:
        OtherVersion: a message of another version.
        LevelheadError: no such message.
    """
    if len(data) < HEADER.size or data[:2] != b"LH":
        raise LevelheadError("these bytes are not a message of a levelhead node")
    _, version, kind, node, seq, t, stamp = HEADER.unpack_from(data)
    if version != VERSION:
        raise OtherVersion(f"the message has version {version}, this levelhead reads {VERSION}; update the older side")
    try:
        return _body(kind, data[HEADER.size :], node, seq, t, stamp)
    except (struct.error, ValueError, KeyError, TypeError, RecursionError):
        raise LevelheadError("the message is cut off or damaged") from None


def _body(kind: int, body: bytes, node: int, seq: int, t: float, stamp: int) -> Message:
    if kind == 0:
        n = BODY_ORIENTATION.unpack(body)
        motion = (n[12:15], n[15:18], n[18:21], n[21:24])
        return Orientation(node, seq, t, stamp, n[0:4], n[4:7], n[7:10], n[10], bool(n[11]), *motion)
    if kind == 1:
        n = BODY_RAW.unpack(body)
        mag = None if n[6] != n[6] else n[6:9]
        return Raw(node, seq, t, stamp, n[0:3], n[3:6], mag, None if n[9] != n[9] else n[9])
    if kind != 2:
        raise ValueError(kind)
    words = json.loads(body)
    name, text, data = words["name"], words["text"], words["data"]
    if not (isinstance(name, str) and isinstance(text, str) and isinstance(data, dict)):
        raise TypeError(name)
    return Health(node, seq, t, stamp, name, bool(words["on"]), text, data)
