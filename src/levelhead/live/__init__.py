"""From a sensor to a published orientation: node, bus, black box, safe state.

    with Node(open_source("emulated:mpu6050", rate=200.0), rate=200.0) as node:
        node.run(duration=10.0)

>>> for message in subscribe("imu/orientation"):  # doctest: +SKIP
...     print(message.euler)
"""

from typing import TYPE_CHECKING, Any

from levelhead.live.bus import LocalBus
from levelhead.live.messages import Health, Orientation, Raw
from levelhead.live.node import Node
from levelhead.live.open import open_source
from levelhead.live.safe_state import SourceLost
from levelhead.live.subscription import Subscription

if TYPE_CHECKING:
    from levelhead.live.zenoh_reader import subscribe

__all__ = ["Health", "LocalBus", "Node", "Orientation", "Raw", "SourceLost", "Subscription", "open_source", "subscribe"]


def __getattr__(name: str) -> Any:
    if name != "subscribe":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from levelhead.live.zenoh_reader import subscribe  # with zenoh, which most nodes do without

    return subscribe
