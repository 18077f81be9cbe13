"""Foxglove's websocket, read by a client that knows nothing but the protocol and ``websockets``."""

import json
import math
import struct
import time

import pytest

import levelhead as lh
from levelhead.live import LocalBus
from levelhead.live.messages import TOPICS, Health, Orientation, Raw
from levelhead.live.viewer_messages import SCHEMAS, viewer_messages

SAID = Orientation(7, 3, 1.5, 1_700_000_000_000_000_005, (math.cos(0.1), math.sin(0.1), 0.0, 0.0), (0.1, 0.2, 0.3), (1e-3, 0.0, -1e-3), 2048)  # fmt: skip # noqa: E501
READ = Raw(7, 3, 1.5, 123, (0.1, 0.2, math.nan), (0.0, 0.0, 9.81), None, 101325.0)


def test_messages_are_json_without_nan():
    found = {topic: json.loads(data) for topic, data in [*viewer_messages(SAID), *viewer_messages(READ)]}
    assert found["/imu/angles"]["angles"]["roll"] == pytest.approx(math.degrees(0.2))
    assert found["/imu/angles"]["sigma"] == pytest.approx({"tilt": 12.8117, "heading": 17.18873}, abs=1e-3)
    assert found["/tf"]["timestamp"] == {"sec": 1_700_000_000, "nsec": 5}
    assert found["/tf"]["rotation"]["w"] == SAID.quat[0]
    assert found["/imu/raw"]["gyr"] == {"x": 0.1, "y": 0.2, "z": None} and "mag" not in found["/imu/raw"]
    for topic, value in found.items():
        assert set(value) <= set(SCHEMAS[topic][1]["properties"])


def test_an_invalid_orientation_turns_no_body():
    assert [topic for topic, _ in viewer_messages(SAID._replace(valid=False))] == ["/imu/angles"]


class Client:
    """The protocol foxglove.sdk.v1, in a few lines."""

    def __init__(self, url: str) -> None:
        from websockets.sync.client import connect

        self.socket = connect(url, subprotocols=["foxglove.sdk.v1"]).__enter__()  # ended by close below
        self.channels: dict[str, dict] = {}
        self.messages: dict[str, list] = {}
        self.values: dict[str, object] = {}

    def ask(self, op: str, **fields) -> None:
        self.socket.send(json.dumps({"op": op} | fields))

    def read(self, until, seconds: float = 20.0) -> None:
        end = time.monotonic() + seconds
        while not until():
            assert time.monotonic() < end, "it never came"
            try:
                data = self.socket.recv(timeout=0.1)
            except TimeoutError:
                continue
            if isinstance(data, bytes):
                code, number, _ = struct.unpack_from("<BIQ", data)
                assert code == 1  # message data
                self.messages.setdefault(self.topic_of(number), []).append(json.loads(data[13:]))
                continue
            given = json.loads(data)
            if given["op"] == "advertise":
                self.channels |= {one["topic"]: one for one in given["channels"]}
            elif given["op"] == "parameterValues":
                self.values |= {one["name"]: one["value"] for one in given["parameters"]}

    def topic_of(self, number: int) -> str:
        return next(topic for topic, one in self.channels.items() if one["id"] == number)


@pytest.mark.slow
def test_an_independent_client_gets_messages_and_sets_parameters(monkeypatch):
    pytest.importorskip("foxglove", reason="foxglove-sdk is not installed (extra levelhead[foxglove])")
    pytest.importorskip("websockets", reason="websockets is not installed")
    from levelhead.live.foxglove_server import FoxgloveServer

    bus, asked = LocalBus(), []
    monkeypatch.setattr("levelhead.live.foxglove_server.list_sources", lambda: ["serial:/dev/ttyUSB0", "mpu6050@1"])

    def set_params(**changes) -> None:
        if changes.get("beta", 0.0) < 0.0:
            raise lh.LevelheadError("beta = -1 is not allowed")
        asked.append(changes)

    bus.publish("imu/config", Health(7, 0, 0.0, 1, "config", True, "", {"filter": "Madgwick", "params": {"beta": 0.1}}))
    with FoxgloveServer(bus.subscribe, set_params, port=0) as server:
        client = Client(server.url)
        client.read(lambda: set(client.channels) == set(SCHEMAS))
        assert client.channels["/tf"]["schemaName"] == "foxglove.FrameTransform"
        assert json.loads(client.channels["/imu/raw"]["schema"]) == SCHEMAS["/imu/raw"][1]
        wanted = [{"id": one["id"], "channelId": one["id"]} for one in client.channels.values()]
        client.ask("subscribe", subscriptions=wanted)
        time.sleep(0.5)
        for seq in range(200):
            bus.publish("imu/orientation", SAID._replace(seq=seq, stamp=SAID.stamp + seq))
            bus.publish("imu/raw", READ._replace(seq=seq))
        bus.publish("imu/health", Health(7, 0, 0.0, 5, "late", True, "a tick was missed"))
        client.read(lambda: len(client.messages.get("/imu/raw", ())) == 200 and "/imu/log" in client.messages)
        assert [one["seq"] for one in client.messages["/imu/angles"]] == list(range(200))
        log = client.messages["/imu/log"][0]
        assert log["level"] == 3 and log["message"] == "late: a tick was missed"
        client.ask("getParameters", parameterNames=[], id="1")
        client.read(lambda: client.values == {"beta": 0.1, "record": False, "recording": ""})
        client.ask("setParameters", parameters=[{"name": "beta", "value": 0.5}], id="2")
        client.read(lambda: client.values["beta"] == 0.5)
        client.ask("setParameters", parameters=[{"name": "beta", "value": -1.0}], id="3")
        client.read(lambda: any("not_set" in one["message"] for one in client.messages["/imu/log"]))
        assert asked == [{"beta": 0.5}] and client.values["beta"] == 0.5
        client.ask("getParameters", parameterNames=["ports"], id="4")
        client.read(lambda: client.values.get("ports") == ["serial:/dev/ttyUSB0", "mpu6050@1"])
        client.ask("subscribeParameterUpdates", parameterNames=["record", "recording"])
        client.ask("setParameters", parameters=[{"name": "record", "value": True}], id="5")
        client.read(lambda: {"record": True} in asked)
        data = {"params": {"beta": 0.5}, "record": "turn.mcap"}
        bus.publish("imu/config", Health(7, 0, 0.0, 1, "config", True, "", data))
        client.read(lambda: client.values["record"] is True and client.values["recording"] == "turn.mcap")
        client.socket.close()
        with pytest.raises(lh.LevelheadError, match="is the port taken"):
            FoxgloveServer(bus.subscribe, set_params, port=int(server.url.rpartition(":")[2]))
    assert set(TOPICS) and bus.troubles() == []
