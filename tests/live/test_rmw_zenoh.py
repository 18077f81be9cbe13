"""rmw_zenoh's form of a node's messages, read by a plain Zenoh session and decoded by rosbags."""

import math
import socket
import struct
import time

import pytest

from levelhead.live import LocalBus
from levelhead.live.messages import Orientation, Raw
from levelhead.live.rmw_zenoh import RmwZenohPublisher
from levelhead.live.zenoh_session import configuration, open_session

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed (extra levelhead[bus])")
typesys = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed (extra levelhead[ros])")
SAID = Orientation(7, 3, 1.5, 5, (math.cos(0.1), math.sin(0.1), 0.0, 0.0), (0.1,) * 3, (0.5, 0.0, 0.0), 0, rate=(1.0, 2.0, 3.0), sigma_rate=(0.1,) * 3, force=(0.0, 0.0, 9.81), sigma_force=(0.2,) * 3)  # fmt: skip # noqa: E501
READ = Raw(7, 3, 1.5, 5, (1.5, 2.0, 3.0), (0.0, 0.0, 9.81), (10.0, 20.0, 30.0), None)
HASH = "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"  # of sensor_msgs/msg/Imu


@pytest.mark.slow
def test_keys_attachments_and_tokens_are_those_of_rmw_zenoh():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    router = open_session(configuration(endpoint, True))
    got = []
    keep = router.declare_subscriber("3/**", got.append)
    bus = LocalBus()
    with RmwZenohPublisher(bus.subscribe, endpoint, 3, "chip"):
        until = time.monotonic() + 20.0
        while not {"imu/data", "imu/mag", "imu/earth_acceleration"} <= {
            "/".join(str(one.key_expr).split("/")[1:3]) for one in got
        }:
            assert time.monotonic() < until
            bus.publish("imu/raw", READ)
            bus.publish("imu/orientation", SAID)
            time.sleep(0.02)
        replies = [str(reply.ok.key_expr) for reply in router.liveliness().get("@ros2_lv/3/**")]
    imu = next(one for one in got if "Imu_" in str(one.key_expr))
    assert str(imu.key_expr) == f"3/imu/data/sensor_msgs::msg::dds_::Imu_/{HASH}"
    number, stamp, length, _ = struct.unpack("<qqB16s", bytes(imu.attachment))
    assert number >= 1 and abs(time.time_ns() - stamp) < 60e9 and length == 16 and len(bytes(imu.attachment)) == 33
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    read = store.deserialize_cdr(bytes(imu.payload), "sensor_msgs/msg/Imu")
    assert read.header.frame_id == "chip" and read.orientation.w == SAID.quat[0] and read.angular_velocity.x == 1.0
    found = next(one for one in got if "imu/linear_acceleration" in str(one.key_expr))
    kind = "geometry_msgs/msg/AccelWithCovarianceStamped"
    assert str(found.key_expr).endswith(f"dds_::AccelWithCovarianceStamped_/{store.hash_rihs01(kind)}")
    assert store.deserialize_cdr(bytes(found.payload), kind).accel.accel.linear.z == SAID.accelerations.body[2]
    assert sum("/NN/%/%/levelhead" in one for one in replies) == 1
    token = f"/MP/%/%/levelhead/%imu%data/sensor_msgs::msg::dds_::Imu_/{HASH}/::,10:,:,:,,"
    assert sum(one.endswith(token) for one in replies) == 1
    assert keep is not None
    router.close()
