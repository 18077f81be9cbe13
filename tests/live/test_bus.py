"""The bus inside a process, and the bytes between processes."""

import math
import threading
import time

import pytest

import levelhead as lh
from levelhead.live import Health, LocalBus, Orientation, Raw
from levelhead.live.messages import pack_message, unpack

SAID = Orientation(
    7, 3, 1.5, 123, (1.0, 0.0, 0.0, 0.0), (0.1, 0.2, 0.3), (1e-3, 0.0, -1e-3), 2048, True, (0.1, 0.2, 0.3),
    (0.01, 0.02, 0.03), (0.0, 0.0, 9.81), (0.1, 0.2, 0.3),
)  # fmt: skip
READ = Raw(7, 3, 1.5, 123, (0.1, 0.2, 0.3), (0.0, 0.0, 9.81), None, None)
EVENT = Health(7, 3, 1.5, 123, "late", True, "2 ticks µ", {"n": [1, 2.5]})


@pytest.mark.parametrize(
    "message", [SAID, SAID._replace(valid=False), READ, READ._replace(mag=(1.0, 2.0, 3.0), pressure=1e5), EVENT]
)
def test_messages_survive_the_wire(message):
    assert unpack(pack_message(message)) == message


def test_messages_are_compact_and_versioned():
    data = pack_message(SAID)
    assert len(data) == 213 and data[:3] == b"LH\x02"
    with pytest.raises(lh.LevelheadError, match="version 1, this levelhead reads 2"):
        unpack(data[:2] + b"\x01" + data[3:])
    for bad in (b"", b"nonsense", data[:-1], b"XX" + data[2:], pack_message(EVENT)[:-2]):
        with pytest.raises(lh.LevelheadError, match="not a message|cut off"):
            unpack(bad)


def test_angles_and_words():
    tilted = SAID._replace(quat=(math.cos(0.1), math.sin(0.1), 0.0, 0.0))
    assert tilted.euler.roll == pytest.approx(0.2)
    assert tilted.words == ["at rest, gyroscope bias learned"]


def test_who_comes_late_gets_the_last_message():
    bus = LocalBus()
    for seq in range(3):
        bus.publish("imu/orientation", SAID._replace(seq=seq))
    late = bus.subscribe("imu/orientation")
    assert late.get(timeout=0.0).seq == 2 and late.get(timeout=0.01) is None
    with pytest.raises(lh.LevelheadError, match="did you mean 'imu/orientation'"):
        bus.subscribe("imu/orientaton")


def test_a_slow_subscriber_misses_the_oldest_and_is_named_once():
    bus = LocalBus()
    slow, quick = bus.subscribe("imu/raw", history=10), bus.subscribe("imu/raw", history=1000)
    for seq in range(100):
        bus.publish("imu/raw", READ._replace(seq=seq))
    assert (
        bus.troubles() == [("subscriber_slow", "a subscriber of imu/raw missed 90 messages")] and bus.troubles() == []
    )
    assert slow.get().seq == 90 and quick.get().seq == 0
    assert slow.latest().seq == 99
    slow.close()
    bus.publish("imu/raw", READ)
    assert slow.get(timeout=0.0) is None


def test_iterating_in_another_thread_until_the_bus_closes():
    bus, seen = LocalBus(), []
    subscription = bus.subscribe("imu/orientation", history=100)
    reader = threading.Thread(target=lambda: seen.extend(message.seq for message in subscription))
    reader.start()
    for seq in range(50):
        bus.publish("imu/orientation", SAID._replace(seq=seq))
    until = time.monotonic() + 5.0
    while len(seen) < 50 and time.monotonic() < until:
        time.sleep(0.001)
    bus.close()
    reader.join(timeout=5.0)
    assert seen == list(range(50)) and not reader.is_alive()
