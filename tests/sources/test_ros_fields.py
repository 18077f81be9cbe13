"""Bags without a plain Imu topic: types of one's own, vectors in topics of their own, a camera's halves."""

import struct
from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead.recording import Recording

pytest.importorskip("rosbags", reason="rosbags is not installed (extra levelhead[ros])")
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from levelhead.sources.formats.ros_fields import read_numbers

NANO = 1_000_000_000
RULE = "=" * 80
HEADER = f"{RULE}\nMSG: std_msgs/Header\n"
IMU = (
    "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"
)
WRAPPED = "std_msgs/Header header\nstring name\nuint8 id\nsensor_msgs/Imu imu\nfloat32[] temperatures\n"
OWN = "std_msgs/Header header\nfloat32[3] gyro\nbool still\nfloat32[3] accel\nuint32 count\n"


def store_of(first: bool):
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(WRAPPED, "robot_msgs/msg/NamedImu"))
    store.register(get_types_from_msg(OWN, "robot_msgs/msg/Inertial"))
    return store


def write(path: Path, first: bool, messages) -> Path:
    """A bag of (topic, type, ns, message), its types in it."""
    store = store_of(first)
    serialize = store.serialize_ros1 if first else store.serialize_cdr
    with Writer1(path) if first else Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        known = {}
        for topic, kind, stamp, message in messages(store.types):
            if topic not in known:
                known[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(known[topic], stamp, serialize(message, kind))
    return path


def stamps(made: Recording) -> list[int]:
    return [NANO * 1_700_000_000 + round(t * NANO) for t in made.t.tolist()]


def header(types, first: bool, at: int):
    stamp = types["builtin_interfaces/msg/Time"](at // NANO, at % NANO)
    return types["std_msgs/msg/Header"](*([0] if first else []), stamp, "imu")


def imu(types, first: bool, at: int, gyr, acc):
    vector, zero = types["geometry_msgs/msg/Vector3"], np.zeros(9)
    still = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    return types["sensor_msgs/msg/Imu"](header(types, first, at), still, zero, vector(*gyr), zero, vector(*acc), zero)


@pytest.mark.parametrize("first", [True, False], ids=["ROS 1", "ROS 2"])
def test_an_imu_within_another_type(tmp_path: Path, hand: Recording, first: bool) -> None:
    def messages(types):
        for at, gyr, acc in zip(stamps(hand), hand.gyr.tolist(), hand.acc.tolist(), strict=True):
            inner = imu(types, first, at, gyr, acc)
            yield (
                "/leg",
                "robot_msgs/msg/NamedImu",
                at,
                types["robot_msgs/msg/NamedImu"](
                    header(types, first, at), "left leg", 3, inner, np.array([20.0, 21.0, 22.0], np.float32)
                ),
            )

    read = lh.read(write(tmp_path / ("log.bag" if first else "log"), first, messages))
    np.testing.assert_array_equal(read.gyr, hand.gyr)
    np.testing.assert_array_equal(read.acc, hand.acc)
    assert read.t == pytest.approx(hand.t, abs=1e-8)
    assert any("a guess" in note and "NamedImu" in note for note in read.meta["notes"])


@pytest.mark.parametrize("first", [True, False], ids=["ROS 1", "ROS 2"])
def test_arrays_in_a_type_of_ones_own(tmp_path: Path, hand: Recording, first: bool) -> None:
    def messages(types):
        rows = zip(stamps(hand), hand.gyr.astype(np.float32), hand.acc.astype(np.float32), strict=True)
        for k, (at, gyr, acc) in enumerate(rows):
            own = types["robot_msgs/msg/Inertial"](header(types, first, at), gyr, k % 2 == 0, acc, k)
            yield "/inertial", "robot_msgs/msg/Inertial", at, own

    read = lh.read(write(tmp_path / ("log.bag" if first else "log"), first, messages))
    np.testing.assert_allclose(read.gyr, hand.gyr, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(read.acc, hand.acc, rtol=1e-6, atol=1e-6)


def test_vectors_in_topics_of_their_own(tmp_path: Path, hand: Recording) -> None:
    def messages(types):
        stamped, vector = types["geometry_msgs/msg/Vector3Stamped"], types["geometry_msgs/msg/Vector3"]
        for at, gyr, acc in zip(stamps(hand), hand.gyr.tolist(), hand.acc.tolist(), strict=True):
            for topic, values in (("/imu/gyro", gyr), ("/imu/accel", acc)):
                yield topic, "geometry_msgs/msg/Vector3Stamped", at, stamped(header(types, True, at), vector(*values))

    read = lh.read(write(tmp_path / "log.bag", True, messages))
    np.testing.assert_array_equal(read.gyr, hand.gyr)
    np.testing.assert_array_equal(read.acc, hand.acc)


def test_a_camera_s_gyroscope_and_accelerometer_apart(tmp_path: Path, hand: Recording) -> None:
    def messages(types):
        for at, gyr, acc in zip(stamps(hand), hand.gyr.tolist(), hand.acc.tolist(), strict=True):
            yield "/camera/gyro/sample", "sensor_msgs/msg/Imu", at, imu(types, True, at, gyr, [0.0] * 3)
            yield "/camera/accel/sample", "sensor_msgs/msg/Imu", at, imu(types, True, at, [0.0] * 3, acc)

    read = lh.read(write(tmp_path / "log.bag", True, messages))
    np.testing.assert_array_equal(read.gyr, hand.gyr)
    np.testing.assert_array_equal(read.acc, hand.acc)


def test_a_bag_without_sensors_lists_its_topics(tmp_path: Path) -> None:
    def messages(types):
        for k in range(5):
            yield "/speed", "std_msgs/msg/Float64", k + 1, types["std_msgs/msg/Float64"](float(k))

    with pytest.raises(lh.LevelheadError, match=r"there are: /speed \(std_msgs/Float64\)"):
        lh.read(write(tmp_path / "log.bag", True, messages))


def test_numbers_by_hand() -> None:
    definitions = get_types_from_msg("uint8 a\nfloat64 b\nstring s\nint16[] c\nfloat32 d\n", "x/msg/X")
    packed = struct.pack("<Bd", 7, 1.5) + struct.pack("<I3s", 3, b"abc") + struct.pack("<I2h", 2, -1, 5)
    packed += struct.pack("<f", 0.25)
    expected = {"a": 7, "b": 1.5, "c[0]": -1, "c[1]": 5, "d": 0.25}
    assert read_numbers(definitions, "x/msg/X", packed, True) == expected
    aligned = b"\0\1\0\0" + struct.pack("<B7xd", 7, 1.5) + struct.pack("<I4s", 4, b"abc\0")
    aligned += struct.pack("<I2h", 2, -1, 5) + struct.pack("<f", 0.25)
    assert read_numbers(definitions, "x/msg/X", aligned, False) == expected
    with pytest.raises(ValueError, match="not as its definition"):
        read_numbers(definitions, "x/msg/X", packed[:-2], True)
