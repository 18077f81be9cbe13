"""Where else a node's messages go: Foxglove's websocket, ROS 2. Options that ``run`` and ``view`` share."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from levelhead.cli.options import print_line
from levelhead.errors import LevelheadError

if TYPE_CHECKING:
    from levelhead.live.subscription import Subscription


@Parameter(name="*")
@dataclass(frozen=True)
class Outputs:
    """Options of a node's further outputs."""

    foxglove: Annotated[bool, Parameter(negative="")] = False
    """Serve Foxglove on 127.0.0.1 (needs the extra levelhead[foxglove])."""
    foxglove_port: Annotated[int, Parameter(metavar="N")] = 8765
    """Port of Foxglove's websocket; 0 takes a free one."""
    foxglove_layout: Annotated[Path | None, Parameter(metavar="FILE.json")] = None
    """Write a layout that Foxglove imports."""
    ros2: Annotated[bool, Parameter(negative="")] = False
    """Publish imu/data, imu/mag and diagnostics on ROS 2, without ROS (needs the extra levelhead[ros2])."""
    ros2_zenoh: Annotated[str | None, Parameter(metavar="ENDPOINT")] = None
    """Publish imu/data and imu/mag through the Zenoh router of rmw_zenoh, such as tcp/127.0.0.1:7447."""
    domain: Annotated[int | None, Parameter(metavar="N")] = None
    """ROS_DOMAIN_ID for --ros2; by default that of the environment, else 0."""
    frame: Annotated[str, Parameter(metavar="NAME")] = "imu_link"
    """Frame of the sensor in ROS messages."""
    tf: Annotated[str, Parameter(metavar="PARENT")] = ""
    """Publish /tf as well: the rotation from the frame of the sensor to this one, such as odom."""

    mavlink: Annotated[str | None, Parameter(metavar="udp:ADDRESS:PORT")] = None
    """Send ATTITUDE and ATTITUDE_QUATERNION by MAVLink to this address, such as udp:14551."""

    @property
    def any(self) -> bool:
        """Whether there is one."""
        return self.foxglove or self.ros2 or self.mavlink is not None or self.ros2_zenoh is not None

    @contextmanager
    def open(
        self, subscribe: "Callable[..., Subscription]", set_params: Callable[..., None], quiet: bool = False
    ) -> Iterator[None]:
        """Serves the outputs of the options, inside the block; ``quiet``: without lines on where.

        Raises:
            LevelheadError: a library is not installed, a port is taken, or an option lacks the one that it is for.
        """
        if not self.ros2 and ((self.domain is not None and self.ros2_zenoh is None) or self.tf):
            raise LevelheadError("--domain and --tf are for --ros2; give it as well")
        tell = (lambda _: None) if quiet else print_line
        with ExitStack() as held:
            if self.foxglove:
                from levelhead.live.foxglove_server import FoxgloveServer

                server = held.enter_context(FoxgloveServer(subscribe, set_params, self.foxglove_port))
                tell(f"Foxglove: open a connection to {server.url}")
            if self.foxglove_layout is not None:
                from levelhead.live.foxglove_server import write_layout

                write_layout(self.foxglove_layout)
                tell(f"written: {self.foxglove_layout}")
            if self.ros2:
                from levelhead.live.ros2 import Ros2Publisher, default_domain

                domain = default_domain() if self.domain is None else self.domain
                held.enter_context(Ros2Publisher(subscribe, domain, self.frame, self.tf))
                tell(f"ROS 2: imu/data, imu/mag and diagnostics in domain {domain}")
            if self.ros2_zenoh is not None:
                from levelhead.live.rmw_zenoh import RmwZenohPublisher
                from levelhead.live.ros2 import default_domain

                domain = default_domain() if self.domain is None else self.domain
                held.enter_context(RmwZenohPublisher(subscribe, self.ros2_zenoh, domain, self.frame))
            if self.mavlink is not None:
                from levelhead.live.mavlink import MavlinkPublisher

                held.enter_context(MavlinkPublisher(subscribe, self.mavlink))
            yield
