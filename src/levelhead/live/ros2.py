"""A node on ROS 2 without ROS: publishes and reads its topics over Cyclone DDS, as ``rmw_cyclonedds`` does.

Published are ``imu/data`` (sensor_msgs/Imu), ``imu/mag``, ``/diagnostics``, acceleration without gravity as
``imu/linear_acceleration`` in the sensor's frame and ``imu/earth_acceleration`` in the earth's
(geometry_msgs/AccelWithCovarianceStamped) and, with a parent frame, ``/tf``. Frames are those of REP 103 and 145: the
body's x is forward, y left, z up; the earth's x is east, y north, z up. Only this
machine is reached, unless CYCLONEDDS_URI holds a configuration of the user's own.
"""

import os
import time
from collections.abc import Callable

from levelhead.errors import LevelheadError
from levelhead.live.events import EXPECTED
from levelhead.live.messages import HEALTH, ORIENTATION, RAW, Health, Message, Orientation, Raw
from levelhead.live.output import HISTORY, NodeOutput
from levelhead.live.subscription import Subscription
from levelhead.open_types import Untyped
from levelhead.sample import Sample, Triple
from levelhead.sources.formats.ros_messages import (
    ABSENT,
    ERROR,
    FRAME,
    NANO,
    OK,
    TESLA,
    UNKNOWN,
    WARN,
    WORLD,
    acceleration_covariance,
    variances,
)

LAST_DOMAIN = 232  # the port numbers of DDS end there
DEPTH = 10  # messages that DDS keeps, as ROS does
LOOPBACK = """<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""
_domains: dict[int, Untyped] = {}  # configured in this process, which DDS allows once each


def default_domain() -> int:
    """ROS_DOMAIN_ID, or 0."""
    text = os.environ.get("ROS_DOMAIN_ID", "0")
    return int(text) if text.isdecimal() else 0


def open_participant(domain: int) -> Untyped:
    """A participant of DDS.

    Raises:
        LevelheadError: cyclonedds is not installed, or no such domain.
    """
    try:
        from cyclonedds.domain import Domain, DomainParticipant
    except ImportError:
        raise LevelheadError("ROS 2 needs Cyclone DDS: pip install 'levelhead[ros2]'") from None
    if not 0 <= domain <= LAST_DOMAIN:
        raise LevelheadError(f"there is no domain {domain}; expected 0 to {LAST_DOMAIN}, as ROS_DOMAIN_ID")
    if "CYCLONEDDS_URI" not in os.environ and domain not in _domains:
        _domains[domain] = Domain(domain, LOOPBACK)
    return DomainParticipant(domain)


def ros_qos() -> Untyped:
    """The quality of service of ROS: reliable, the last ten, the first representation of data."""
    from cyclonedds.core import Policy, Qos

    return Qos(
        Policy.Reliability.Reliable(max_blocking_time=0), Policy.History.KeepLast(DEPTH), Policy.Durability.Volatile,
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
    )  # fmt: skip


class Ros2Publisher(NodeOutput):
    """Publishes a node's messages on ROS 2 until it is closed.

    Args:
        subscribe: gives the Subscription of a topic.
        domain: of DDS.
        frame: of the sensor.
        parent: frame of the earth for /tf; "": no /tf.

    Raises:
        LevelheadError: as for ``open_participant``.
    """

    def __init__(
        self, subscribe: Callable[..., Subscription], domain: int, frame: str = FRAME, parent: str = ""
    ) -> None:
        participant = open_participant(domain)
        from cyclonedds.pub import DataWriter
        from cyclonedds.topic import Topic

        from levelhead.live import ros2_types as types

        self._types: Untyped = types
        self._frame, self._parent = frame, parent
        kinds = {"imu/data": types.Imu, "imu/mag": types.MagneticField, "diagnostics": types.DiagnosticArray}
        kinds |= dict.fromkeys(("imu/linear_acceleration", "imu/earth_acceleration"), types.AccelWithCovarianceStamped)
        if parent:
            kinds["tf"] = types.TFMessage
        qos = ros_qos()
        self._writers: dict[str, Untyped] = {
            name: DataWriter(participant, Topic(participant, f"rt/{name}", kind, qos=qos), qos=qos)
            for name, kind in kinds.items()
        }
        self._begin(subscribe, (RAW, ORIENTATION, HEALTH))

    def _send(self, message: Message) -> None:
        if isinstance(message, Raw):
            if message.mag is not None:
                field = self._vector([TESLA * one for one in message.mag])
                self._write("imu/mag", self._types.MagneticField(self._header(message), field, list(UNKNOWN)))
        elif isinstance(message, Orientation):
            self._send_orientation(message)
        elif message.name != "config":
            self._send_event(message)

    def _send_orientation(self, message: Orientation) -> None:
        """The orientation with rate and specific force of its sample, and the accelerations without gravity."""
        types = self._types
        w, x, y, z = message.quat
        turn = types.Quaternion(x, y, z, w)
        covariance = variances(message.sigma) if message.valid else ABSENT
        header = self._header(message)
        self._write("imu/data", types.Imu(
            header, turn, list(covariance), self._vector(message.rate), list(variances(message.sigma_rate)),
            self._vector(message.force), list(variances(message.sigma_force)),
        ))  # fmt: skip
        if message.valid:
            found = message.accelerations
            earth = types.Header(header.stamp, self._parent or WORLD)
            self._write_acceleration("imu/linear_acceleration", header, found.body, found.sigma_body)
            self._write_acceleration("imu/earth_acceleration", earth, found.earth, found.sigma_earth)
        if self._parent and message.valid:
            parent = types.Header(header.stamp, self._parent)
            place = types.Transform(self._vector([0.0, 0.0, 0.0]), turn)
            self._write("tf", types.TFMessage([types.TransformStamped(parent, self._frame, place)]))

    def _write_acceleration(self, name: str, header: object, value: Triple, sigma: Triple) -> None:
        types, covariance = self._types, list(acceleration_covariance(sigma))
        accel = types.Accel(self._vector(value), self._vector([0.0, 0.0, 0.0]))
        message = types.AccelWithCovarianceStamped(header, types.AccelWithCovariance(accel, covariance))
        self._write(name, message)

    def _send_event(self, message: Health) -> None:
        types = self._types
        bad = message.on and message.name not in EXPECTED
        level = ERROR if bad and message.name in ("silent", "invalid") else WARN if bad else OK
        values = [types.KeyValue(str(key), str(value)) for key, value in message.data.items()]
        status = types.DiagnosticStatus(level, f"levelhead: {message.name}", message.text, "", values)
        header = types.Header(self._header(message).stamp, "")
        self._write("diagnostics", types.DiagnosticArray(header, [status]))

    def _write(self, name: str, message: object) -> None:
        self._writers[name].write(message)

    def _header(self, message: Message) -> Untyped:
        return self._types.Header(self._types.Time(message.stamp // NANO, message.stamp % NANO), self._frame)

    def _vector(self, values: Untyped) -> Untyped:
        return self._types.Vector3(*values)

    def close(self) -> None:
        """No more messages."""
        super().close()
        self._writers.clear()


class Ros2Source:
    """Samples from ``imu/data_raw`` and ``imu/mag``, as the filters of imu_tools take them; see ``Source``.

    Args:
        domain: of DDS.
        imu: topic of sensor_msgs/Imu.
        mag: topic of sensor_msgs/MagneticField.
    """

    rate = gyr_range = acc_range = 0.0
    ended = False

    def __init__(self, domain: int, imu: str = "imu/data_raw", mag: str = "imu/mag") -> None:
        self.name, self._domain, self._topics = f"ROS 2 topic {imu}", domain, (imu, mag)
        self._readers: list[Untyped] = []
        self._began = time.monotonic()

    def start(self) -> None:
        """Subscribes.

        Raises:
            LevelheadError: as for ``open_participant``.
        """
        participant = open_participant(self._domain)
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        from levelhead.live import ros2_types as types

        qos = ros_qos()
        self._readers = [
            DataReader(participant, Topic(participant, f"rt/{name}", kind, qos=qos), qos=qos)
            for name, kind in zip(self._topics, (types.Imu, types.MagneticField), strict=True)
        ]

    def restart(self) -> None:
        """DDS finds publishers by itself."""

    def poll(self) -> list[Sample]:
        """The samples since the last call; a field goes to the sample that is read with it."""
        imu, mag = self._readers
        field = None
        for message in mag.take(N=DEPTH):
            if hasattr(message, "magnetic_field"):
                one = message.magnetic_field
                field = (one.x / TESLA, one.y / TESLA, one.z / TESLA)
        samples = []
        for message in imu.take(N=HISTORY):
            if not hasattr(message, "angular_velocity"):
                continue  # of a publisher that ended
            w, a, stamp = message.angular_velocity, message.linear_acceleration, message.header.stamp
            t = stamp.sec + 1e-9 * stamp.nanosec
            samples.append(Sample(t, (w.x, w.y, w.z), (a.x, a.y, a.z), field))
            field = None
        return samples

    def troubles(self) -> list[tuple[str, str]]:
        """None."""
        return []

    def close(self) -> None:
        """Unsubscribes."""
        self._readers.clear()
