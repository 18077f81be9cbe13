"""A node's messages on a Zenoh session as ``rmw_zenoh`` of ROS 2 (Jazzy and later) has them.

Facts of docs/design.md of ros2/rmw_zenoh and its ``liveliness_utils`` and ``attachment_helpers``: a key is
DOMAIN/TOPIC/TYPE/HASH; each message has an attachment of number, time and id; tokens name the node and its publishers.
"""

import os
import struct
import time
from collections.abc import Callable

from levelhead.live.messages import ORIENTATION, RAW, Message, Orientation, Raw
from levelhead.live.output import NodeOutput
from levelhead.live.subscription import Subscription
from levelhead.live.zenoh_session import configuration, open_session
from levelhead.open_types import Untyped
from levelhead.sources.formats import ros_messages as ros

ATTACHMENT = struct.Struct("<qqB16s")  # number from 1, ns since 1970, length of the id, id of the publisher
QOS = "::,10:,:,:,,"  # reliable and volatile as by default, the last ten
KINDS = {
    "imu/data": ros.IMU, "imu/mag": ros.FIELD, "imu/linear_acceleration": ros.ACCELERATION,
    "imu/earth_acceleration": ros.ACCELERATION,
}  # fmt: skip


def dds_name(kind: str) -> str:
    """``sensor_msgs/msg/Imu`` as DDS calls it: ``sensor_msgs::msg::dds_::Imu_``."""
    package, _, name = kind.split("/")
    return f"{package}::msg::dds_::{name}_"


class RmwZenohPublisher(NodeOutput):
    """Publishes ``imu/data``, ``imu/mag`` and the two accelerations without gravity until it is closed.

    Args:
        subscribe: gives the Subscription of a topic.
        endpoint: of ROS's Zenoh router, such as tcp/127.0.0.1:7447.
        domain: ROS_DOMAIN_ID.
        frame: of the sensor.

    Raises:
        LevelheadError: Zenoh is not installed, or an endpoint on the network without certificates.
    """

    def __init__(
        self, subscribe: Callable[..., Subscription], endpoint: str, domain: int = 0, frame: str = ros.FRAME
    ) -> None:
        self._session = open_session(configuration(endpoint, False))
        self._frame = frame
        session = str(self._session.zid())
        start = f"@ros2_lv/{domain}/{session}/0"
        declare = self._session.liveliness().declare_token
        self._tokens: list[Untyped] = [declare(f"{start}/0/NN/%/%/levelhead")]
        self._publishers: dict[str, Untyped] = {}
        self._ids: dict[str, bytes] = {}
        self._counts = dict.fromkeys(KINDS, 0)
        for number, (topic, kind) in enumerate(KINDS.items(), 1):
            where = f"{dds_name(kind)}/{ros.HASHES[kind]}"
            self._publishers[topic] = self._session.declare_publisher(f"{domain}/{topic}/{where}")
            self._tokens.append(declare(f"{start}/{number}/MP/%/%/levelhead/%{topic.replace('/', '%')}/{where}/{QOS}"))
            self._ids[topic] = os.urandom(16)
        self._begin(subscribe, (RAW, ORIENTATION))

    def _send(self, message: Message) -> None:
        if isinstance(message, Raw):
            if message.mag is not None:
                self._put("imu/mag", ros.pack_field(message.stamp, message.mag, self._frame))
        elif isinstance(message, Orientation):
            stamp, quat = message.stamp, message.quat if message.valid else None
            data = ros.pack_imu(
                stamp, message.rate, message.force, quat, message.sigma, self._frame, message.sigma_rate,
                message.sigma_force,
            )  # fmt: skip
            self._put("imu/data", data)
            if message.valid:
                found = message.accelerations
                body = ros.pack_acceleration(stamp, found.body, found.sigma_body, self._frame)
                self._put("imu/linear_acceleration", body)
                earth = ros.pack_acceleration(stamp, found.earth, found.sigma_earth, ros.WORLD)
                self._put("imu/earth_acceleration", earth)

    def _put(self, topic: str, data: bytes) -> None:
        self._counts[topic] += 1
        attachment = ATTACHMENT.pack(self._counts[topic], time.time_ns(), 16, self._ids[topic])
        self._publishers[topic].put(data, attachment=attachment)

    def close(self) -> None:
        """No more messages."""
        super().close()
        self._session.close()
