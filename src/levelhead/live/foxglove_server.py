"""A websocket for viewers, on this machine alone: Foxglove connects to it, and so does any client of its protocol.

The protocol is ``foxglove.sdk.v1`` (https://github.com/foxglove/ws-protocol): the server names its channels with their
schemas, a client subscribes to some, and messages are JSON (``viewer_messages``). Parameters of the filter are those of
the protocol; a client may set them. Three more are the node's: ``record`` (a client sets it to begin or end a black
box), ``recording`` (its file) and, where a client asks for it by name, ``ports`` (words for ``--source``).
"""

import json
import time
from collections.abc import Callable
from pathlib import Path

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.live.messages import TOPICS, Health, Message
from levelhead.live.output import NodeOutput
from levelhead.live.subscription import Subscription
from levelhead.live.viewer_messages import SCHEMAS, viewer_messages
from levelhead.open_types import JsonObject, Untyped
from levelhead.sources.devices.ports import list_sources

PORT, LAST_PORT = 8765, 65_535


class FoxgloveServer(NodeOutput):
    """Serves the messages of a node until it is closed.

    Args:
        subscribe: gives the Subscription of a topic.
        set_params: sets parameters of the node, by keyword; raises LevelheadError where it refuses.
        port: on 127.0.0.1; 0: one that is free.

    Attributes:
        url: where it is.
        params: the filter's parameters as the node published them last.
        recording: path of the black box that the node writes; "": none.

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
        self.recording = ""
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
        self._begin(subscribe, TOPICS)

    def _fail(self, text: str) -> None:
        super()._fail(text)
        self._log("reader", text)

    def _send(self, message: Message) -> None:
        if isinstance(message, Health) and message.name == "config":
            self.params, self.recording = message.data.get("params", {}), message.data.get("record", "")
            self._server.publish_parameter_values(self.parameters())
            return
        for topic, data in viewer_messages(message):
            channel = self._channels[topic]
            if channel.has_sinks():
                channel.log(data, log_time=message.stamp)

    def parameters(self) -> list[Untyped]:
        """All parameters as the protocol has them, but for "ports"."""
        hint = self._foxglove.websocket.ParameterType.Float64
        own: JsonObject = {"record": bool(self.recording), "recording": self.recording}
        return [
            self._foxglove.Parameter(name, value=float(value), type=hint)
            if isinstance(value, int | float) and not isinstance(value, bool)
            else self._foxglove.Parameter(name, value=value)
            for name, value in (self.params | own).items()
        ]

    def ports(self) -> Untyped:
        """The parameter "ports"."""
        found: Untyped = []
        try:
            found = list_sources()
        except LevelheadError as error:
            self._log("ports", str(error))
        return self._foxglove.Parameter("ports", value=found)

    def set(self, changes: JsonObject) -> None:
        """Asks the node for other parameters; a refusal is a line of the log, and the old values go out again."""
        try:
            self._set_params(**changes)
            self.params = self.params | {name: value for name, value in changes.items() if name in self.params}
        except (LevelheadError, TypeError) as error:
            self._log("not_set", str(error))

    def _log(self, name: str, text: str) -> None:
        self._send(Health(0, 0, 0.0, time.time_ns(), name, True, text))

    def close(self) -> None:
        """No more messages."""
        super().close()
        self._server.stop()


class _ParameterListener:
    """Answers the requests of clients for parameters; called from a thread of the server."""

    def __init__(self, server: FoxgloveServer) -> None:
        self._owner = server

    def on_get_parameters(self, client: Untyped, names: list[str], request: str | None = None) -> list[Untyped]:
        """Those that are asked for; without names all but "ports"."""
        found = [one for one in self._owner.parameters() if not names or one.name in names]
        return [*found, self._owner.ports()] if "ports" in names else found

    def on_set_parameters(
        self, client: Untyped, parameters: list[Untyped], request: str | None = None
    ) -> list[Untyped]:
        """Sets them, and gives them as they are now."""
        names = [one.name for one in parameters]
        self._owner.set({one.name: one.get_value() for one in parameters})
        return [one for one in self._owner.parameters() if one.name in names]

    def __getattr__(self, name: str) -> Callable[..., None]:
        """The server calls more methods, which do nothing here."""
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
