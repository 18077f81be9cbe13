"""ROS 2 messages as bytes: ``sensor_msgs`` and ``diagnostic_msgs`` of a node, without ROS.

CDR as DDS-RTPS 2.5 §10.2 has it, little-endian: four bytes name the encoding, numbers stand at multiples of their size
after these, texts are a length with the closing zero. Frames are those of REP 103 (x east, y north, z up); -1 as the
first number of a covariance means that the message does not carry the quantity, zeros that it is unknown (REP 145).
"""

import struct
from collections.abc import Mapping, Sequence
from math import isfinite

import numpy as np

from levelhead.open_types import Untyped

IMU, FIELD = "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField"
DIAGNOSTICS, TRANSFORMS = "diagnostic_msgs/msg/DiagnosticArray", "tf2_msgs/msg/TFMessage"
ACCELERATION = "geometry_msgs/msg/AccelWithCovarianceStamped"
ATTITUDE = "geometry_msgs/msg/QuaternionStamped"
FRAME, WORLD = "imu_link", "odom"
OK, WARN, ERROR = range(3)  # levels of a DiagnosticStatus
NANO = 1_000_000_000
TESLA = 1e-6  # per µT
UNKNOWN = (0.0,) * 9
ABSENT = (-1.0, *(0.0,) * 8)
_RULE = "=" * 80
_PARTS = {
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
    "geometry_msgs/AccelWithCovariance": "geometry_msgs/Accel accel\nfloat64[36] covariance\n",
    "geometry_msgs/Accel": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"
    ),
    "diagnostic_msgs/KeyValue": "string key\nstring value\n",
    "diagnostic_msgs/DiagnosticStatus": (
        "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\nstring message\n"
        "string hardware_id\ndiagnostic_msgs/KeyValue[] values\n"
    ),
}
_HEADER = ("std_msgs/Header", "builtin_interfaces/Time")


def _definition(text: str, *parts: str) -> str:
    """The definition of a message and of those in it, as bags keep it."""
    return "".join([text, *(f"{_RULE}\nMSG: {part}\n{_PARTS[part]}" for part in parts)])


DEFINITIONS = {
    IMU: _definition(
        "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
        "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
        "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
        *_HEADER, "geometry_msgs/Quaternion", "geometry_msgs/Vector3",
    ),
    FIELD: _definition(
        "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance\n",
        *_HEADER, "geometry_msgs/Vector3",
    ),
    ACCELERATION: _definition(
        "std_msgs/Header header\ngeometry_msgs/AccelWithCovariance accel\n",
        *_HEADER, "geometry_msgs/AccelWithCovariance", "geometry_msgs/Accel", "geometry_msgs/Vector3",
    ),
    ATTITUDE: _definition(
        "std_msgs/Header header\ngeometry_msgs/Quaternion quaternion\n", *_HEADER, "geometry_msgs/Quaternion",
    ),
    DIAGNOSTICS: _definition(
        "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n",
        *_HEADER, "diagnostic_msgs/DiagnosticStatus", "diagnostic_msgs/KeyValue",
    ),
    TRANSFORMS: _definition(
        "geometry_msgs/TransformStamped[] transforms\n", "geometry_msgs/TransformStamped", *_HEADER,
        "geometry_msgs/Transform", "geometry_msgs/Vector3", "geometry_msgs/Quaternion",
    ),
}  # fmt: skip


HASHES = {  # of the definitions, as REP 2011 makes them
    IMU: "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b",
    ACCELERATION: "RIHS01_61c9ad8928e71dd95ce791b2f02809ee2a0bbcc42cd0e4047fd00a822a08e444",
    FIELD: "RIHS01_e80f32f56a20486c9923008fc1a1db07bbb273cbbf6a5b3bfa00835ee00e4dff",
}


class _CdrWriter:
    """Bytes of a message."""

    def __init__(self) -> None:
        self._data = bytearray(b"\x00\x01\x00\x00")

    def numbers(self, letter: str, *values: Untyped) -> None:
        """Numbers of one type, a letter of ``struct``."""
        size = struct.calcsize(letter)
        self._data += bytes(-(len(self._data) - 4) % size)
        self._data += struct.pack(f"<{len(values)}{letter}", *values)

    def text(self, text: str) -> None:
        """A string."""
        data = text.encode() + b"\x00"
        self.numbers("I", len(data))
        self._data += data

    def header(self, stamp: int, frame: str) -> None:
        """A std_msgs/Header; ``stamp``: ns since 1970."""
        self.numbers("i", stamp // NANO)
        self.numbers("I", stamp % NANO)
        self.text(frame)

    def done(self) -> bytes:
        """All of it."""
        return bytes(self._data)


def variances(sigma: Sequence[float] | None) -> tuple[float, ...]:
    """Nine numbers of a covariance from σ of three axes; None or NaN: not known."""
    if sigma is None or not isfinite(sum(sigma)):
        return UNKNOWN
    x, y, z = sigma
    return x * x, 0.0, 0.0, 0.0, y * y, 0.0, 0.0, 0.0, z * z


def pack_imu(
    stamp: int, gyr: Sequence[float], acc: Sequence[float], quat: Sequence[float] | None = None,
    sigma: Sequence[float] | None = None, frame: str = FRAME, sigma_gyr: Sequence[float] | None = None,
    sigma_acc: Sequence[float] | None = None,
) -> bytes:  # fmt: skip
    """A sensor_msgs/Imu.

    Args:
        stamp: ns since 1970.
        gyr: rad/s.
        acc: m/s².
        quat: wxyz, sensor to earth; None: the message has no orientation.
        sigma: 1σ of the attitude about east, north and up, rad; None: not known.
        frame: of the sensor.
        sigma_gyr: 1σ of the rate, rad/s; None: not known.
        sigma_acc: 1σ of the specific force, m/s², likewise.
    """
    out = _CdrWriter()
    out.header(stamp, frame)
    w, x, y, z = (1.0, 0.0, 0.0, 0.0) if quat is None else quat
    out.numbers("d", x, y, z, w, *(ABSENT if quat is None else variances(sigma)))
    out.numbers("d", *gyr, *variances(sigma_gyr), *acc, *variances(sigma_acc))
    return out.done()


def pack_field(stamp: int, mag: Sequence[float], frame: str = FRAME) -> bytes:
    """A sensor_msgs/MagneticField; ``mag`` in µT, in the message in T."""
    out = _CdrWriter()
    out.header(stamp, frame)
    out.numbers("d", *(TESLA * one for one in mag), *UNKNOWN)
    return out.done()


def acceleration_covariance(sigma: Sequence[float] | None) -> tuple[float, ...]:
    """The 36 numbers of a covariance of acceleration; that of the angular part marks it as absent."""
    x, y, z = variances(sigma)[::4]
    rows = np.diag([x, y, z, ABSENT[0], 0.0, 0.0])
    return tuple(rows.ravel().tolist())


def pack_acceleration(stamp: int, value: Sequence[float], sigma: Sequence[float] | None, frame: str = FRAME) -> bytes:
    """A geometry_msgs/AccelWithCovarianceStamped without an angular part; value and its 1σ in m/s²."""
    out = _CdrWriter()
    out.header(stamp, frame)
    out.numbers("d", *value, 0.0, 0.0, 0.0, *acceleration_covariance(sigma))
    return out.done()


def pack_attitude(stamp: int, quat: Sequence[float], frame: str = FRAME) -> bytes:
    """A geometry_msgs/QuaternionStamped; ``quat`` is wxyz."""
    out = _CdrWriter()
    out.header(stamp, frame)
    w, x, y, z = quat
    out.numbers("d", x, y, z, w)
    return out.done()


def unpack_attitude(data: bytes) -> tuple[int, tuple[float, float, float, float]]:
    """The stamp in ns and the quaternion wxyz of ``pack_attitude``.

    Raises:
        struct.error: the bytes are too few.
    """
    seconds, rest = struct.unpack_from("<iI", data, 4)
    x, y, z, w = struct.unpack("<4d", data[-32:])
    return seconds * NANO + rest, (w, x, y, z)


def pack_diagnostics(
    stamp: int, level: int, name: str, message: str, hardware: str, values: Mapping[str, str]
) -> bytes:
    """A diagnostic_msgs/DiagnosticArray with one status."""
    out = _CdrWriter()
    out.header(stamp, "")
    out.numbers("I", 1)
    out.numbers("B", level)
    for text in (name, message, hardware):
        out.text(text)
    out.numbers("I", len(values))
    for key, value in values.items():
        out.text(key)
        out.text(value)
    return out.done()


def pack_transform(stamp: int, quat: Sequence[float], parent: str = WORLD, child: str = FRAME) -> bytes:
    """A tf2_msgs/TFMessage with one transform: a rotation (wxyz, child to parent) at the parent's origin."""
    out = _CdrWriter()
    out.numbers("I", 1)
    out.header(stamp, parent)
    out.text(child)
    w, x, y, z = quat
    out.numbers("d", 0.0, 0.0, 0.0, x, y, z, w)
    return out.done()
