"""MAVLink: bytes that pymavlink makes and reads, and attitudes in its frames."""

import math
import socket
import time

import numpy as np
import pytest

import levelhead as lh
from levelhead.kernels.quat import to_euler
from levelhead.live import LocalBus
from levelhead.live.mavlink import MavlinkPublisher, MavlinkSource, parse_place, to_ned
from levelhead.live.messages import Orientation
from levelhead.sources.formats import mavlink_codec as codec
from levelhead.units import GRAVITY


@pytest.fixture(params=["v10", "v20"])
def dialect(request):
    """pymavlink is LGPL: for tests alone."""
    name = f"pymavlink.dialects.{request.param}.common"
    return pytest.importorskip(name, reason="pymavlink is not installed (extra levelhead[test])")


NINE = (1, -2, -1000, 100, -200, 300, 210, -50, 430)


def made(dialect) -> dict:
    """A message of each kind, by pymavlink's own names."""
    return {
        codec.HEARTBEAT: dialect.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3),
        codec.SCALED_IMU: dialect.MAVLink_scaled_imu_message(1500, *NINE),
        codec.RAW_IMU: dialect.MAVLink_raw_imu_message(1_500_000, *NINE),
        codec.SCALED_PRESSURE: dialect.MAVLink_scaled_pressure_message(1500, 1013.25, 0.5, 2510),
        codec.ATTITUDE: dialect.MAVLink_attitude_message(1500, 0.1, -0.2, 3.0, 0.01, 0.02, 0.0),
        codec.ATTITUDE_QUATERNION: dialect.MAVLink_attitude_quaternion_message(
            1500, 1.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0
        ),
        codec.HIGHRES_IMU: dialect.MAVLink_highres_imu_message(
            1_500_000, 0.1, -0.2, -9.8, 0.01, 0.02, 0.03, 0.2, -0.05, 0.4, 1013.25, 0.0, 0.0, 25.0, 0
        ),
    }


def test_what_pymavlink_packs_is_read(dialect):
    sender = dialect.MAVLink(None, srcSystem=7, srcComponent=1)
    for number, message in made(dialect).items():
        data = message.pack(sender)
        (read,) = codec.unpack_mavlink(b"\x00noise" + data)
        assert (read.number, read.system, read.component) == (number, 7, 1)
        for name, value in read.fields.items():
            assert value == pytest.approx(getattr(message, name), rel=1e-6), name
        for i in range(len(data)):
            broken = data[:i] + bytes([data[i] ^ 0x55]) + data[i + 1 :]
            assert list(codec.unpack_mavlink(broken)) == [] or i < 1
            assert list(codec.unpack_mavlink(data[:i])) == []


def test_several_in_a_datagram_and_those_that_are_not_known_are_passed(dialect):
    sender = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    other = dialect.MAVLink_system_time_message(5, 6).pack(sender)
    attitude = made(dialect)[codec.ATTITUDE].pack(sender)
    assert [one.number for one in codec.unpack_mavlink(attitude + other + attitude)] == [codec.ATTITUDE] * 2


@pytest.mark.parametrize("number", codec.LAYOUTS)
def test_what_is_packed_is_read_by_pymavlink(number):
    common = pytest.importorskip("pymavlink.dialects.v20.common", reason="pymavlink is not installed")
    layout = codec.LAYOUTS[number]
    values = [float(i + 1) if "f" in layout.format.format else i + 1 for i in range(len(layout.fields))]
    values = [int(one) for one in values]
    (read,) = common.MAVLink(None).parse_buffer(codec.pack_mavlink(number, 3, *values))
    assert read.get_msgId() == number and read.get_seq() == 3
    assert [getattr(read, name) for name in layout.fields] == values


def datagrams(source: MavlinkSource, *data: bytes) -> list:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for one in data:
            out.sendto(one, source._socket.getsockname())
    found, until = [], time.monotonic() + 5.0
    while not found and time.monotonic() < until:
        found += source.poll()
    return found


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


@pytest.fixture
def source():
    one = MavlinkSource(f"udp:{free_port()}")
    one.start()
    yield one
    one.close()


def test_highres_imu_in_si_units_and_our_axes(source):
    values = (1_500_000, 0.5, -0.25, -9.75, 0.5, 0.25, -0.125, 0.25, -0.125, 0.5, 1000.0, 0.0, 0.0, 25.0, 0)
    (sample,) = datagrams(source, codec.pack_mavlink(codec.HIGHRES_IMU, 0, *values))
    assert sample.t == 1.5 and sample.acc == (0.5, 0.25, 9.75) and sample.gyr == (0.5, -0.25, 0.125)
    assert sample.mag == (25.0, 12.5, -50.0) and sample.pressure == pytest.approx(1e5)
    assert source.troubles() == []


def test_raw_imu_is_taken_as_ardupilot_sends_it(source):
    pressure = codec.pack_mavlink(codec.SCALED_PRESSURE, 0, 1500, 1000.0, 0.0, 2500)
    raw = codec.pack_mavlink(codec.RAW_IMU, 1, 1_500_000, 0, 0, -1000, 100, 200, 300, 0, 0, 0)
    (sample,) = datagrams(source, pressure + raw, raw)  # the second one has the same stamp
    assert sample.acc == (0.0, 0.0, pytest.approx(GRAVITY)) and sample.gyr == pytest.approx((0.1, -0.2, -0.3))
    assert sample.mag is None and sample.pressure == pytest.approx(1e5)
    assert [name for name, _ in source.troubles()] == ["assumed"]
    other = codec.pack_mavlink(codec.HIGHRES_IMU, 0, 2_000_000, *(0.0,) * 13, 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.sendto(other, source._socket.getsockname())
    time.sleep(0.05)
    assert source.poll() == [], "the kind that came first is kept to"


def test_the_autopilot_s_own_attitude_goes_with_its_next_sample(source):
    imu = [codec.pack_mavlink(codec.HIGHRES_IMU, 0, stamp, *(0.0,) * 13, 0) for stamp in (1000, 2000, 3000, 4000)]
    said = (math.cos(0.1), math.sin(0.1), 0.0, 0.0)
    angles = codec.pack_mavlink(codec.ATTITUDE, 0, 1, *to_euler(to_ned(said)), 0.0, 0.0, 0.0)
    quaternion = codec.pack_mavlink(codec.ATTITUDE_QUATERNION, 0, 1, *to_ned(said), 0.0, 0.0, 0.0)
    other = codec.pack_mavlink(codec.ATTITUDE_QUATERNION, 0, 1, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, system=9)
    found = datagrams(source, angles + imu[0], imu[1], quaternion + other + imu[2], angles + imu[3])
    assert found[0].attitude == pytest.approx(said, abs=1e-6) and found[2].attitude == pytest.approx(said, abs=1e-6)
    assert found[1].attitude is None and found[3].attitude is None  # the angles are those of a quaternion that came


@pytest.mark.parametrize("yaw, heading", [(0.0, 90.0), (90.0, 0.0), (180.0, -90.0)])
def test_attitude_in_north_east_down(yaw, heading):
    """A body that points to the east (our x) has heading 90°; nose up is negative with us and positive there."""
    half = math.radians(0.5 * yaw)
    level = to_ned((math.cos(half), 0.0, 0.0, math.sin(half)))
    angles = np.degrees(to_euler(level))
    assert angles == pytest.approx([0.0, 0.0, heading], abs=1e-9)
    nose_up = np.degrees(to_euler(to_ned((math.cos(0.1), 0.0, -math.sin(0.1), 0.0))))
    assert nose_up[1] == pytest.approx(math.degrees(0.2)) and nose_up[0] == pytest.approx(0.0, abs=1e-9)
    right_down = np.degrees(to_euler(to_ned((math.cos(0.1), math.sin(0.1), 0.0, 0.0))))
    assert right_down[0] == pytest.approx(math.degrees(0.2))


@pytest.mark.slow
def test_the_node_s_attitude_arrives(source):
    said = Orientation(
        7, 3, 1.5, 5, (math.cos(0.1), math.sin(0.1), 0.0, 0.0), (0.1,) * 3, (0.0,) * 3, 0, rate=(1.0, 2.0, 3.0)
    )
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
        autopilot.bind(("127.0.0.1", 0))
        autopilot.settimeout(10.0)
        bus = LocalBus()
        with MavlinkPublisher(bus.subscribe, f"udp:{autopilot.getsockname()[1]}"):
            bus.publish("imu/orientation", said)
            messages = [next(codec.unpack_mavlink(autopilot.recv(1000))) for _ in range(2)]
    assert [one.number for one in messages] == [codec.ATTITUDE, codec.ATTITUDE_QUATERNION]
    assert messages[0].fields["roll"] == pytest.approx(0.2, abs=1e-6) and messages[0].fields["time_boot_ms"] == 1500
    for one in messages:
        assert [one.fields[f"{axis}speed"] for axis in ("roll", "pitch", "yaw")] == [1.0, -2.0, -3.0]
    fields = messages[1].fields
    assert [fields[f"q{i}"] for i in (1, 2, 3, 4)] == pytest.approx(list(to_ned(said.quat)), abs=1e-6)


@pytest.mark.parametrize("text", ["udp:0", "udp:80000", "tcp:14550", "udp:example.org:1", "udp:"])
def test_places_that_are_none(text):
    with pytest.raises(lh.LevelheadError, match="expected such as udp:14550"):
        parse_place(text)
