"""A reader believes the node that it heard first, and no message ends it."""

import json
import socket
import time

import pytest

import levelhead as lh
from levelhead.live.messages import ORIENTATION, TOPICS, VERSION, Health, Orientation, Raw, pack_message
from levelhead.live.sender_check import SenderCheck

MOTION = {name: (0.1, 0.2, 0.3) for name in ("rate", "sigma_rate", "force", "sigma_force")}
OWN = Orientation(7, 1, 1.5, 123, (1.0, 0.0, 0.0, 0.0), (0.1, 0.2, 0.3), (1e-3, 0.0, -1e-3), 0, **MOTION)
TURNED = OWN._replace(quat=(0.0, 1.0, 0.0, 0.0))
READ = Raw(7, 3, 1.5, 123, (0.1, 0.2, 0.3), (0.0, 0.0, 9.81), None, None)
DEEP = b'{"name":' + b"[" * 100_000


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"LH",
        b"nonsense" * 20,
        pack_message(OWN)[:-1],
        pack_message(OWN)[:3] + b"\x09" + pack_message(OWN)[4:],  # no such kind
        pack_message(READ),  # another topic's
        pack_message(TURNED._replace(node=8, seq=9)),  # another node
        pack_message(TURNED),  # a number that came already
        pack_message(TURNED._replace(seq=0)),
        pack_message(OWN)[:3] + b"\x02" + pack_message(OWN)[4:32] + DEEP,
        pack_message(OWN)[:3] + b"\x02" + pack_message(OWN)[4:32] + json.dumps({"name": 3}).encode(),
    ],
)
def test_what_is_not_the_node_s_next_message_is_left(data):
    check = SenderCheck(ORIENTATION)
    assert check.accept(pack_message(OWN)) == OWN
    assert check.accept(data) is None and check.rejected == 1 and check.error is None
    assert check.accept(pack_message(OWN._replace(seq=2))).seq == 2
    assert not check.accept(pack_message(OWN._replace(seq=2, valid=False))).valid  # the safe state


def test_a_copy_of_the_node_from_another_session_is_left():
    check = SenderCheck(ORIENTATION)
    assert check.accept(pack_message(OWN), "one") == OWN
    assert check.accept(pack_message(TURNED._replace(seq=10**6)), "two") is None
    assert check.accept(pack_message(OWN._replace(seq=2)), "one").quat == OWN.quat


def test_when_the_node_is_gone_the_next_one_is_believed():
    check = SenderCheck(ORIENTATION)
    check.accept(pack_message(OWN))
    check.lose(8)
    assert check.accept(pack_message(OWN._replace(node=8))) is None
    check.lose(7)
    assert check.accept(pack_message(OWN._replace(node=8, seq=0))).node == 8


def test_events_share_a_number():
    check, event = SenderCheck(TOPICS[2]), Health(7, 3, 1.5, 123, "late", True, "", {})
    assert check.accept(pack_message(event)) == event
    assert check.accept(pack_message(event._replace(name="lost"))).name == "lost"


def test_another_version_alone_is_an_error_and_beside_a_node_none(monkeypatch):
    now = [10.0]
    monkeypatch.setattr("levelhead.live.sender_check.time.monotonic", lambda: now[0])
    other = pack_message(OWN)[:2] + bytes([VERSION + 1]) + pack_message(OWN)[3:]
    alone, beside = SenderCheck(ORIENTATION), SenderCheck(ORIENTATION)
    beside.accept(pack_message(OWN))
    for _ in range(2):
        assert alone.error is None
        assert alone.accept(other) is None and beside.accept(other) is None
        now[0] += 2.0
    assert f"version {VERSION + 1}, this levelhead reads {VERSION}" in str(alone.error) and beside.error is None


@pytest.mark.slow
def test_a_session_that_writes_on_the_orientation_s_key_is_an_event_and_no_reader_believes_it():
    """Damaged bytes, another node's id, the node's own id with a number far ahead: the reader gets the node's alone."""
    zenoh = pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed (extra levelhead[bus])")
    from levelhead.live.zenoh_bus import ZenohBus
    from levelhead.live.zenoh_reader import subscribe
    from levelhead.live.zenoh_session import configuration, open_session

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    bus = ZenohBus(endpoint)
    for topic in TOPICS:
        bus.advertise(topic, 7)
    reader = subscribe(ORIENTATION, endpoint, history=4096, max_age=60.0)
    stranger = open_session(configuration(endpoint, False))
    seq, got, troubles, until = 1, [], [], time.monotonic() + 20.0
    while time.monotonic() < until and (len(got) < 50 or len({name for name, _ in troubles}) < 2):
        seq += 1
        bus.publish(ORIENTATION, OWN._replace(seq=seq, stamp=time.time_ns()))
        while (message := reader.get(timeout=0.005)) is not None:
            got.append(message)
        if got:  # the node was there first
            stamped = TURNED._replace(stamp=time.time_ns())
            for fake in (stamped._replace(node=9, seq=10**6), stamped._replace(seq=10**6)):
                stranger.put(ORIENTATION, pack_message(fake))
            stranger.put(ORIENTATION, b"LH but nothing else")
        troubles += bus.troubles()
    assert {name for name, _ in troubles} == {"second_node", "foreign_message"}
    assert any("messages on imu/orientation do not come from this node" in text for _, text in troubles)
    assert len(got) >= 50 and {(one.node, one.quat) for one in got} == {(7, OWN.quat)}
    stranger.close()
    reader.close()
    bus.close()
    assert zenoh is not None


def test_a_reader_of_another_version_gets_the_sentence():
    from levelhead.live.subscription import Subscription

    subscription = Subscription(ORIENTATION)
    subscription.fail(lh.LevelheadError("the message has version 2"))
    with pytest.raises(lh.LevelheadError, match="version 2"):
        subscription.get(timeout=1.0)
