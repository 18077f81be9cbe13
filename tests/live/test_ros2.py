"""ROS 2 without ROS: an independent process reads what a node publishes, and a node reads what one publishes."""

import json
import math
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest

from levelhead.live import LocalBus
from levelhead.live.messages import Health, Orientation, Raw
from levelhead.live.ros2 import LOOPBACK, Ros2Publisher, Ros2Source, open_participant, ros_qos

pytest.importorskip("cyclonedds", reason="cyclonedds is not installed (extra levelhead[ros2])")
typesys = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed (extra levelhead[ros])")

pytestmark = pytest.mark.slow
STAMP = 1_700_000_000_000_000_005
QUAT = (math.cos(0.1), math.sin(0.1), 0.0, 0.0)
SAID = Orientation(
    7, 3, 1.5, STAMP, QUAT, (0.1, 0.2, 0.3), (0.5, 0.0, 0.0), 0, True,
    rate=(1.0, 2.0, 3.0), sigma_rate=(0.1,) * 3, force=(0.0, 0.0, 9.81), sigma_force=(0.2,) * 3,
)  # fmt: skip
READ = Raw(7, 3, 1.5, STAMP, (1.5, 2.0, 3.0), (0.0, 0.0, 9.81), (10.0, 20.0, 30.0), None)

READER = """
    import json, sys, time
    from dataclasses import dataclass
    from cyclonedds.core import Policy, Qos
    from cyclonedds.domain import Domain, DomainParticipant
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.types import array, float64, int32, uint32
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    @dataclass
    class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
        sec: int32
        nanosec: uint32

    @dataclass
    class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
        stamp: Time
        frame_id: str

    @dataclass
    class Vector(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
        x: float64
        y: float64
        z: float64

    @dataclass
    class Turn(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
        x: float64
        y: float64
        z: float64
        w: float64

    @dataclass
    class Imu(IdlStruct, typename="sensor_msgs::msg::dds_::Imu_"):
        header: Header
        orientation: Turn
        orientation_covariance: array[float64, 9]
        angular_velocity: Vector
        angular_velocity_covariance: array[float64, 9]
        linear_acceleration: Vector
        linear_acceleration_covariance: array[float64, 9]

    domain = int(sys.argv[1])
    keep = Domain(domain, sys.argv[2])
    participant = DomainParticipant(domain)
    qos = Qos(Policy.Reliability.BestEffort)
    reader = DataReader(participant, Topic(participant, "rt/imu/data", Imu, qos=qos), qos=qos)
    print("ready", flush=True)
    end = time.monotonic() + 30
    while time.monotonic() < end:
        for one in reader.take(10):
            if isinstance(one, Imu):
                h, q, w, a = one.header, one.orientation, one.angular_velocity, one.linear_acceleration
                numbers = [q.x, q.y, q.z, q.w, *one.orientation_covariance, w.x, w.y, w.z]
                numbers += [*one.angular_velocity_covariance, a.x, a.y, a.z, *one.linear_acceleration_covariance]
                print(json.dumps([h.stamp.sec, h.stamp.nanosec, h.frame_id, numbers]), flush=True)
                sys.exit()
        time.sleep(0.02)
"""


@pytest.fixture
def domain():
    return 100 + time.time_ns() // 1000 % 90


def test_a_process_of_its_own_reads_imu_data(domain):
    """Its subscriber knows the topic, the name of the type and the order of the fields, from the ROS packages alone."""
    bus = LocalBus()
    with Ros2Publisher(bus.subscribe, domain, "chip", "odom"):
        program = [sys.executable, "-c", textwrap.dedent(READER), str(domain), LOOPBACK]
        with subprocess.Popen(program, stdout=subprocess.PIPE, text=True) as reader:
            assert reader.stdout.readline() == "ready\n"
            while reader.poll() is None:
                bus.publish("imu/raw", READ)
                bus.publish("imu/orientation", SAID)
                time.sleep(0.02)
            sec, nanosec, frame, numbers = json.loads(reader.stdout.read())
    assert (sec, nanosec, frame) == (1_700_000_000, 5, "chip")
    w, x, y, z = QUAT
    assert numbers[:4] == [x, y, z, w]
    np.testing.assert_allclose(numbers[4:13], np.diag([0.01, 0.04, 0.09]).ravel())
    assert numbers[13:16] == [1.0, 2.0, 3.0] and numbers[25:28] == [0.0, 0.0, 9.81]  # the bias is taken off
    np.testing.assert_allclose([numbers[16:25], numbers[28:]], [np.diag([v] * 3).ravel() for v in (0.01, 0.04)])


@pytest.mark.parametrize("valid", [True, False])
def test_bytes_of_each_message_are_those_of_rosbags(domain, valid):
    """What Cyclone DDS serializes is what rosbags decodes: all messages."""
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    sent: dict = {}
    bus = LocalBus()
    with Ros2Publisher(bus.subscribe, domain, "chip", "odom") as publisher:
        publisher._write = lambda name, message: sent.update({name: message.serialize(use_version_2=False)})
        bus.publish("imu/raw", READ)
        time.sleep(0.05)
        bus.publish("imu/orientation", SAID._replace(valid=valid))
        bus.publish("imu/health", Health(7, 0, 0.0, STAMP, "silent", True, "no sample", {"since": 1}))
        end = time.monotonic() + 10.0
        while len(sent) < 3 + 3 * valid and time.monotonic() < end:
            time.sleep(0.01)
    imu = store.deserialize_cdr(sent["imu/data"], "sensor_msgs/msg/Imu")
    assert imu.orientation_covariance[0] == (pytest.approx(0.01) if valid else -1.0)
    assert imu.orientation.w == QUAT[0] and imu.linear_acceleration.z == 9.81
    field = store.deserialize_cdr(sent["imu/mag"], "sensor_msgs/msg/MagneticField")
    assert field.magnetic_field.y == pytest.approx(20e-6)
    (status,) = store.deserialize_cdr(sent["diagnostics"], "diagnostic_msgs/msg/DiagnosticArray").status
    assert (status.level, status.name, status.message) == (2, "levelhead: silent", "no sample")
    assert ("tf" in sent) is ("imu/linear_acceleration" in sent) is valid
    if valid:
        (one,) = store.deserialize_cdr(sent["tf"], "tf2_msgs/msg/TFMessage").transforms
        assert (one.header.frame_id, one.child_frame_id, one.transform.rotation.x) == ("odom", "chip", QUAT[1])
        for name, frame in (("linear", "chip"), ("earth", "odom")):
            kind = "geometry_msgs/msg/AccelWithCovarianceStamped"
            one = store.deserialize_cdr(sent[f"imu/{name}_acceleration"], kind)
            found, at = SAID.accelerations, ("body" if name == "linear" else "earth")
            assert one.header.frame_id == frame and one.accel.accel.linear.y == getattr(found, at)[1]
            covariance = one.accel.covariance.reshape(6, 6)
            np.testing.assert_allclose(np.diag(covariance)[:3], np.square(getattr(found, f"sigma_{at}")))
            assert covariance[3, 3] == -1.0


def test_a_node_reads_imu_data_raw(domain):
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic

    from levelhead.live import ros2_types as types

    source = Ros2Source(domain)
    source.start()
    participant, qos = open_participant(domain), ros_qos()
    imu = DataWriter(participant, Topic(participant, "rt/imu/data_raw", types.Imu, qos=qos), qos=qos)
    mag = DataWriter(participant, Topic(participant, "rt/imu/mag", types.MagneticField, qos=qos), qos=qos)
    header = types.Header(types.Time(1_700_000_000, 500_000_000), "chip")
    none, zero = types.Quaternion(0.0, 0.0, 0.0, 1.0), [0.0] * 9
    found, end = [], time.monotonic() + 20.0
    while not any(one.mag for one in found) and time.monotonic() < end:
        mag.write(types.MagneticField(header, types.Vector3(1e-6, 2e-6, 3e-6), zero))
        time.sleep(0.02)
        vectors = types.Vector3(0.1, 0.2, 0.3), types.Vector3(1.0, 2.0, 9.0)
        imu.write(types.Imu(header, none, zero, vectors[0], zero, vectors[1], zero))
        time.sleep(0.02)
        found += source.poll()
    last = next(one for one in found if one.mag)
    assert (last.t, last.gyr, last.acc) == (1_700_000_000.5, (0.1, 0.2, 0.3), (1.0, 2.0, 9.0))
    assert last.mag == pytest.approx((1.0, 2.0, 3.0))
    source.close()
