"""A websocket for viewers, on this machine alone: Foxglove connects to it, and so does any client of its protocol.

The protocol is ``foxglove.sdk.v1`` (https://github.com/foxglove/ws-protocol): the server names its channels with their
schemas, a client subscribes to some, and messages are JSON (``viewer_messages``). Parameters of the filter are those of
the protocol; a client may set them.
"""

import json
import math
import threading
import time
from collections.abc import Callable
from pathlib import Path

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.live.messages import CONFIG, HEALTH, ORIENTATION, RAW, Health, Message
from levelhead.live.subscription import Subscription
from levelhead.live.viewer_messages import SCHEMAS, viewer_messages
from levelhead.open_types import JsonObject, Untyped

PORT, LAST_PORT = 8765, 65_535
PERIOD = 0.01  # s between two looks for new messages
HISTORY = 4096  # messages that may wait


class FoxgloveServer:
    """Serves the messages of a node until it is closed.

    Args:
        subscribe: gives the Subscription of a topic.
        set_params: sets parameters of the node, by keyword; raises LevelheadError where it refuses.
        port: on 127.0.0.1; 0: one that is free.

    Attributes:
        url: where it is.
        params: the filter's parameters as the node said them last.

    Raises:
        LevelheadError: foxglove-sdk is not installed, no such port, or it is taken.
    """

    def __init__(
        self, subscribe: Callable[..., Subscription], set_params: Callable[..., None], port: int = PORT
    ) -> None:
        try:
            import foxglove
            from foxglove.websocket import Capability
        except ImportError:
            raise LevelheadError("Foxglove needs its library: pip install 'levelhead[foxglove]'") from None
        if not 0 <= port <= LAST_PORT:
            raise LevelheadError(f"there is no port {port}; expected 1 to {LAST_PORT}, such as {PORT}")
        self._foxglove, self._set_params = foxglove, set_params
        self.params: JsonObject = {}
        context = self._context = foxglove.Context()  # the channels live in it
        self._channels = {
            topic: foxglove.Channel(
                topic, message_encoding="json", context=context,
                schema=foxglove.Schema(name=name, encoding="jsonschema", data=json.dumps(schema).encode()),
            )
            for topic, (name, schema) in SCHEMAS.items()
        }  # fmt: skip
        try:
            self._server: Untyped = foxglove.start_server(
                name="levelhead", host="127.0.0.1", port=port, context=context,
                capabilities=[Capability.Parameters], server_listener=_ParameterListener(self),
            )  # fmt: skip
        except Exception as error:  # RuntimeError of its Rust side
            raise LevelheadError(f"cannot serve Foxglove on 127.0.0.1:{port}: {error}; is the port taken?") from None
        self.url = f"ws://127.0.0.1:{self._server.port}"
        self._subscriptions = [
            subscribe(topic, history=HISTORY, max_age=math.inf) for topic in (ORIENTATION, RAW, HEALTH, CONFIG)
        ]
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="foxglove", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.wait(PERIOD):
            try:
                for one in self._subscriptions:
                    while (message := one.get(timeout=0.0)) is not None:
                        self._send(message)
            except LevelheadError as error:  # this reader gets nothing from the node
                self._send(Health(0, 0, 0.0, time.time_ns(), "reader", True, str(error)))
                return

    def _send(self, message: Message) -> None:
        if isinstance(message, Health) and message.name == "config":
            self.params = message.data.get("params", {})
            self._server.publish_parameter_values(self.parameters())
            return
        for topic, data in viewer_messages(message):
            channel = self._channels[topic]
            if channel.has_sinks():
                channel.log(data, log_time=message.stamp)

    def parameters(self) -> list[Untyped]:
        """The filter's parameters as the protocol has them."""
        hint = self._foxglove.websocket.ParameterType.Float64
        return [
            self._foxglove.Parameter(name, value=value)
            if isinstance(value, bool)
            else self._foxglove.Parameter(name, value=float(value), type=hint)
            for name, value in self.params.items()
        ]

    def set(self, changes: JsonObject) -> None:
        """Asks the node for other parameters; what it refuses is a line of the log, and the old values go out again."""
        try:
            self._set_params(**changes)
            self.params = self.params | changes
        except (LevelheadError, TypeError) as error:
            self._send(Health(0, 0, 0.0, time.time_ns(), "not_set", True, str(error)))

    def wait(self) -> None:
        """Until it is closed."""
        while not self._over.wait(1.0):
            pass

    def close(self) -> None:
        """No more messages."""
        self._over.set()
        self._thread.join(timeout=2.0)
        for one in self._subscriptions:
            one.close()
        self._server.stop()

    def __enter__(self) -> "FoxgloveServer":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _ParameterListener:
    """What clients ask of the parameters; called from a thread of the server."""

    def __init__(self, server: FoxgloveServer) -> None:
        self._owner = server

    def on_get_parameters(self, client: Untyped, names: list[str], request: str | None = None) -> list[Untyped]:
        """Those that are asked for; without names all."""
        return [one for one in self._owner.parameters() if not names or one.name in names]

    def on_set_parameters(
        self, client: Untyped, parameters: list[Untyped], request: str | None = None
    ) -> list[Untyped]:
        """Sets them, and gives them as they are now."""
        names = [one.name for one in parameters]
        self._owner.set({one.name: one.get_value() for one in parameters})
        return [one for one in self._owner.parameters() if one.name in names]

    def __getattr__(self, name: str) -> Callable[..., None]:
        """The server tells of more, which does not matter here."""
        if name.startswith("on_"):
            return lambda *_: None
        raise AttributeError(name)


LAYOUT: JsonObject = {
    "configById": {
        "3D!levelhead": {
            "followTf": "odom", "followMode": "follow-none", "scene": {"transforms": {"labelSize": 0.1}},
            "transforms": {"frame:imu_link": {"visible": True}},
            "topics": {"/imu/pose": {"visible": True, "type": "axis", "axisScale": 0.8}},
        },
        "Plot!angles": {"title": "Angles, °", "showLegend": True, "paths": [
            {"value": f"/imu/angles.angles.{name}", "enabled": True} for name in ("roll", "pitch", "yaw")]},
        "Plot!sigma": {"title": "1σ, °", "showLegend": True, "paths": [
            {"value": f"/imu/angles.sigma.{name}", "enabled": True} for name in ("tilt", "heading")]},
        "Plot!gyr": {"title": "Rates, rad/s", "showLegend": True, "paths": [
            {"value": f"/imu/raw.gyr.{axis}", "enabled": True} for axis in "xyz"]},
        "RosOut!log": {"topicToRender": "/imu/log", "minLogLevel": 1, "searchTerms": []},
        "Parameters!set": {"title": "Parameters of the filter"},
    },
    "globalVariables": {}, "userNodes": {},
    "layout": {
        "direction": "row", "splitPercentage": 45,
        "first": {"direction": "column", "splitPercentage": 65, "first": "3D!levelhead", "second": {
            "direction": "row", "first": "RosOut!log", "second": "Parameters!set"}},
        "second": {"direction": "column", "splitPercentage": 40, "first": "Plot!angles", "second": {
            "direction": "column", "first": "Plot!sigma", "second": "Plot!gyr"}},
    },
}  # fmt: skip


def write_layout(path: Path) -> None:
    """A layout for Foxglove: import it once (Layouts, Import from file).

    Raises:
        LevelheadError: the file cannot be written.
    """
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(LAYOUT, indent=2), encoding="utf-8")
