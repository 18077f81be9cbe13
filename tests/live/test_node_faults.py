"""A node whose source, bus, clock or reader fails: the safe state, what is said, and how it goes on."""

import math
import os
import tty

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.reference.given_source import Given, level

import levelhead as lh
from levelhead.live import Node, SourceLost, open_source
from levelhead.sample import Sample
from levelhead.sources.sensors import SensorError

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    "fault, kind",
    [({"unplugged": True}, "bus_error"), ({"stuck": "low"}, "bus_stuck"), ({"stuck": "high"}, "implausible")],
)
def test_a_bus_that_fails_gives_the_safe_state_and_recovery(rig, fault, kind):
    one = rig(calibrate=0)

    def change(values):
        for name, value in values.items():
            setattr(one.wires, name, value)

    one.clock.at(3.0, lambda: change(fault))
    one.clock.at(6.0, lambda: change({"unplugged": False, "stuck": None}))
    one.node.run(duration=9.0)
    events, said = one.events(), one.drain(one.orientations)
    assert [name for name in events if name.strip("-") in (kind, "silent", "invalid")] == [
        kind, "silent", "invalid", f"-{kind}", "-silent", "-invalid",
    ]  # fmt: skip
    (at,) = [i for i, message in enumerate(said[:-1]) if not message.valid]
    assert said[at].quat == said[at - 1].quat  # said once more, marked, and then nothing
    assert said[at + 1].t - said[at].t > 2.5 and said[at + 1].valid
    for message in said:
        assert np.isfinite(message.quat).all()


@pytest.mark.parametrize("calibrate", [0, 50])
def test_a_slow_source_is_not_silent(rig, calibrate):
    """Five samples a second are few, but not none; nor are those that the calibration takes."""
    one = rig(calibrate=calibrate)
    poll, queue = one.node.source.poll, []

    def seldom():
        queue.extend(poll())
        if len(queue) < 40:
            return []
        last = queue[-1]
        queue.clear()
        return [last]

    one.node.source.poll = seldom
    one.node.run(duration=20.0)
    assert "silent" not in one.events()
    assert 95 <= one.node.samples <= 101


def test_a_source_that_does_not_come_back_ends_the_node(rig):
    one = rig(calibrate=0, give_up=4.0)
    one.clock.at(2.0, lambda: setattr(one.wires, "unplugged", True))
    with pytest.raises(SourceLost, match="has given no sample for 4 s: the MPU-6050 at 0x68 does not answer") as caught:
        one.node.run(duration=60.0)
    assert caught.value.exit_code == 3
    assert one.events()[-1] == "stopped"


def test_a_chip_that_lost_its_settings_is_set_up_again(rig):
    one = rig(calibrate=0)
    one.clock.at(3.0, one.wires.chips[0x68].reset)
    one.node.run(duration=7.0)
    events = one.events()
    assert "silent" in events and "-silent" in events and events[-1] == "stopped"
    assert one.node.samples > 900


def test_the_wrong_chip_is_refused_at_the_start(rig):
    one = rig()
    one.wires.chips[0x68].identity = 0x71
    one.wires.chips[0x68].reset()
    with pytest.raises(SensorError, match="has identity 0x71"):
        one.node.run(duration=1.0)
    assert one.drain(one.orientations) == []


def test_another_chip_that_is_plugged_in_while_it_runs_is_refused(rig):
    one = rig(calibrate=0, give_up=4.0)

    def swap():
        one.wires.chips[0x68].identity = 0x71
        one.wires.chips[0x68].reset()

    one.clock.at(3.0, swap)
    with pytest.raises(SourceLost, match="has identity 0x71; expected 0x68"):
        one.node.run(duration=60.0)
    events = one.events()
    assert events.index("silent") < events.index("wrong_chip") < events.index("stopped")
    assert not one.drain(one.orientations)[-1].valid


def test_a_subscriber_that_sleeps_or_went_away_costs_nothing_and_is_named(rig):
    one = rig(calibrate=0)
    slow, gone = (one.node.bus.subscribe("imu/orientation", history=10, max_age=math.inf) for _ in range(2))
    gone.close()
    figures = one.node.run(duration=3.0)
    assert figures["missed"] == figures["lost"] == 0 and len(one.drain(one.orientations)) == figures["samples"] + 1
    texts = [event.text for event in one.drain(one.health) if event.name == "subscriber_slow"]
    assert texts and texts[0].startswith("a subscriber of imu/orientation missed ")
    assert slow.missed > 500 and gone.missed == 0


def test_a_serial_line_that_says_nonsense_and_goes_back_in_time_is_said():
    """Through a pty: garbage and time_backwards are events, and no orientation comes of either."""
    pytest.importorskip("serial", reason="pyserial is not installed (extra levelhead[live])")
    end, slave = os.openpty()
    tty.setraw(slave)
    node = Node(open_source(f"serial:{os.ttyname(slave)}", rate=100.0), calibrate=0)
    queues = [node.bus.subscribe(topic, history=1000, max_age=math.inf) for topic in ("imu/orientation", "imu/health")]
    node.begin()

    def say(*lines: bytes) -> None:
        os.write(end, b"".join(line + b"\n" for line in lines))
        node.tick()

    def sample(i: int) -> bytes:
        return f"{i / 100},0.001,0.0,{i % 3 * 1e-3},0.0,0.1,9.8".encode()

    say(b"t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s^2],ay [m/s^2],az [m/s^2]", *map(sample, range(50)))
    say(b"\xff\xfe\x00", b"x" * 5000, b"1,2,3", b"1e999,0,0,0,0,0,9.8")
    say(sample(20))
    say(sample(50))
    node.close()
    os.close(end)
    os.close(slave)
    messages, events = ([*iter(lambda queue=queue: queue.get(timeout=0.0), None)] for queue in queues)
    names = [event.name for event in events]
    assert "garbage" in names and "time_backwards" in names
    stamps = [message.t for message in messages if message.valid]
    assert node.samples == 51 and stamps == sorted(set(stamps)) and stamps[-1] == 0.5
    assert not messages[-1].valid


def test_samples_lost_in_the_fifo_are_said(rig):
    one = rig(calibrate=0)
    one.clock.at(2.0, lambda: setattr(one.clock, "extra", 0.6))
    one.node.run(duration=4.0)
    assert "samples_lost" in one.events() and one.node.figures()["lost"] == 1
    stamps = np.diff([message.t for message in one.drain(one.raw)])
    assert stamps.max() > 0.5 and (stamps > 0.0).all()


def test_warnings_begin_and_end():
    t, batches = 0.0, []

    def more(count, **what):
        nonlocal t
        for i in range(count):
            t += 0.005
            jitter = 1e-4 * (i % 7)
            given = {"gyr": (jitter, -jitter, 0.0), "acc": (jitter, 0.1 - jitter, 9.8 + jitter)} | what
            batches.append([level(t, **given)])

    more(400)
    more(20, acc=(0.0, 0.0, 13.0))
    more(300)
    more(200, gyr=(0.3, 0.2, 0.1), acc=(0.0, 0.0, 9.8))  # frozen
    more(300)
    more(20, gyr=(math.nan, 0.0, 0.0))
    more(300)
    node = Node(Given(*batches), calibrate=0)
    health = node.bus.subscribe("imu/health", history=1000)
    node.run_all = [node.tick() for _ in range(len(batches))] if node.begin() is None else []
    node.close()
    events = []
    while (event := health.get(timeout=0.0)) is not None:
        if event.name in ("acceleration", "stuck", "missing"):
            events.append((event.name, event.on))
    assert [name for name, on in events if on] == ["acceleration", "stuck", "missing"]
    assert sorted(name for name, on in events if not on) == ["acceleration", "missing", "stuck"]


def test_clipping_is_known_from_the_range_of_the_chip(rig, felt):
    fast = lh.Recording(felt.t, felt.gyr * 8.0, felt.acc * 5.0, felt.mag)
    one = rig(felt=fast, calibrate=0)
    assert one.node.guard.gyr_range == pytest.approx(500.0, abs=1.0) and one.node.guard.acc_range == pytest.approx(
        39.2, abs=0.1
    )
    one.node.run(duration=14.0)
    assert {"gyr_clipped", "acc_clipped", "acceleration"} <= set(one.events())


def test_a_disturbed_magnetometer_is_said(rig, felt):
    mag = felt.mag.copy()
    mag[1200:2000] += (60.0, 0.0, 0.0)
    one = rig("icm20948", felt=lh.Recording(felt.t, felt.gyr, felt.acc, mag), calibrate=0)
    one.node.run(duration=14.0)
    events = one.events()
    assert "mag_disturbed" in events and "-mag_disturbed" in events


def test_time_that_goes_back_is_dropped():
    node = Node(
        Given([level(1.0)], [level(1.005)], [level(0.5)], [level(1.005)], [level(math.nan)], [level(1.01)]), calibrate=0
    )
    node.begin()
    for _ in range(6):
        node.tick()
    assert node.samples == 3 and node.journal.counts["time_backwards"] == 3
    node.close()


anything = st.floats(allow_nan=True, allow_infinity=True, width=64)


vector = st.tuples(anything, anything, anything)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(anything, vector, vector, st.none() | vector), max_size=40))
def test_whatever_comes_the_topic_carries_finite_unit_quaternions(rows):
    node = Node(Given(*([Sample(*row)] for row in rows)), calibrate=0)
    said = node.bus.subscribe("imu/orientation", history=1000, max_age=math.inf)
    node.begin()
    for _ in rows:
        node.tick()
    node.close()
    while (message := said.get(timeout=0.0)) is not None:
        assert math.isclose(math.hypot(*message.quat), 1.0, abs_tol=1e-6)
        assert all(map(math.isfinite, (*message.sigma, *message.bias)))
