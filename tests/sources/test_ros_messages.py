"""ROS 2 messages as bytes, read back by rosbags; what a node's black box holds for other viewers."""

import numpy as np
import pytest

from levelhead.sources.formats import ros_messages as ros

typesys = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed (extra levelhead[ros])")
STORE = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
STAMP = 1_700_000_000_123_456_789
QUAT = (0.5, -0.5, 0.5, 0.5)


def head(message) -> tuple:
    return message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id


@pytest.mark.parametrize("frame", ["", "imu", "imu_link", "a/frame"])  # all four alignments of what follows
def test_imu(frame):
    read = STORE.deserialize_cdr(ros.pack_imu(STAMP, (1, 2, 3), (4, 5, 6), QUAT, (0.1, 0.2, 0.3), frame), ros.IMU)
    assert head(read) == (1_700_000_000, 123_456_789, frame)
    q, w, a = read.orientation, read.angular_velocity, read.linear_acceleration
    assert (q.w, q.x, q.y, q.z) == QUAT and (w.x, w.y, w.z, a.x, a.y, a.z) == (1, 2, 3, 4, 5, 6)
    np.testing.assert_allclose(read.orientation_covariance, np.diag([0.01, 0.04, 0.09]).ravel())
    assert not read.angular_velocity_covariance.any() and not read.linear_acceleration_covariance.any()
    without = STORE.deserialize_cdr(ros.pack_imu(STAMP, (1, 2, 3), (4, 5, 6)), ros.IMU)
    assert without.orientation_covariance[0] == -1.0 and without.orientation.w == 1.0


def test_field_in_tesla():
    read = STORE.deserialize_cdr(ros.pack_field(STAMP, (10.0, -20.0, 30.0)), ros.FIELD)
    field = read.magnetic_field
    np.testing.assert_allclose([field.x, field.y, field.z], [10e-6, -20e-6, 30e-6])


def test_diagnostics_and_transform():
    words = ros.pack_diagnostics(STAMP, ros.WARN, "node", "µ", "chip", {"a": "1", "longer": "zwei"})
    (status,) = STORE.deserialize_cdr(words, ros.DIAGNOSTICS).status
    assert (status.level, status.name, status.message, status.hardware_id) == (1, "node", "µ", "chip")
    assert [(one.key, one.value) for one in status.values] == [("a", "1"), ("longer", "zwei")]
    (one,) = STORE.deserialize_cdr(ros.pack_transform(STAMP, QUAT), ros.TRANSFORMS).transforms
    assert head(one)[2] == "odom" and one.child_frame_id == "imu_link"
    assert (one.transform.rotation.w, one.transform.rotation.x) == QUAT[:2] and one.transform.translation.x == 0.0


@pytest.mark.parametrize("kind", ros.DEFINITIONS)
def test_definitions_are_those_of_ros(kind):
    """As rosbags writes them: the same fields in the same order, so the same type hash."""
    own = typesys.get_types_from_msg(ros.DEFINITIONS[kind], kind)
    fresh = typesys.get_typestore(typesys.Stores.EMPTY)
    fresh.register(own)
    assert fresh.hash_rihs01(kind) == STORE.hash_rihs01(kind) == ros.HASHES.get(kind, STORE.hash_rihs01(kind))
