"""The node: every sample once, deadlines, calibration, warnings, the safe state, and the same bits as a batch."""

import math
import os
import threading
import tty

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import levelhead as lh
from levelhead.live import Node, SourceLost, open_source
from levelhead.live.bus import Command, LocalBus
from levelhead.live.events import EVENTS
from levelhead.live.realtime import realtime_scheduling
from levelhead.sample import Sample
from levelhead.sources import npz
from levelhead.sources.replay import Replay
from levelhead.sources.sensors import AxisMap, SensorError

pytestmark = pytest.mark.slow


class Given:
    """A source that gives what it is told, one list per poll."""

    name, rate, gyr_range, acc_range = "a list", 0.0, 0.0, 0.0

    def __init__(self, *batches) -> None:
        self.batches = list(batches)
        self.closed = 0

    @property
    def ended(self) -> bool:
        return not self.batches

    def start(self) -> None:
        pass

    restart = start

    def poll(self):
        return self.batches.pop(0) if self.batches else []

    def troubles(self):
        return []

    def close(self) -> None:
        self.closed += 1


def level(t: float, gyr=(0.0, 0.0, 0.001), acc=(0.0, 0.1, 9.8), mag=None) -> Sample:
    return Sample(t, gyr, acc, mag)


@pytest.mark.parametrize("text", ["mpu6050", "lsm6dso32+qmc5883l", "icm20948"])
def test_every_sample_once_and_the_bits_of_a_batch(rig, text):
    one = rig(text)
    figures = one.node.run(duration=20.0)
    said, raw = one.drain(one.orientations), one.drain(one.raw)
    assert figures["samples"] == len(raw) == pytest.approx(20.0 * one.node.source.rate * 1.005, abs=3)
    assert [message.seq for message in raw] == list(range(len(raw)))
    assert figures["lost"] == figures["missed"] == 0 and figures["ticks"] == pytest.approx(4000, abs=2)
    last, *_ = said[-1:]
    assert not last.valid and last.seq == said[-2].seq  # the safe state, once
    said = said[:-1]
    assert [message.seq for message in said] == list(range(len(raw) - len(said), len(raw)))
    fused = raw[-len(said) :]
    (calibrated,) = [event for event in one.drain(one.health) if event.name == "calibrated"]
    bias = np.array(calibrated.data["bias"])
    mag = np.array([message.mag or (math.nan,) * 3 for message in fused])
    recording = lh.Recording(
        [message.t for message in fused], np.array([message.gyr for message in fused]) - bias,
        [message.acc for message in fused], mag if np.isfinite(mag).any() else None,
    )  # fmt: skip
    track = lh.fuse(recording, one.node.params, guard=one.node.guard)
    np.testing.assert_array_equal([message.quat for message in said], track.quat)
    np.testing.assert_array_equal([message.sigma for message in said], track.sigma)
    np.testing.assert_array_equal([message.bias for message in said], track.bias + bias)


def test_it_follows_the_truth(rig, felt):
    """Tilt within 2° through calibration, bus, FIFO and stamps, though the chip's clock is half a percent fast."""
    one = rig("lsm6dso32")
    one.node.run(duration=14.0)
    said = one.drain(one.orientations)[:-1]
    began = next(iter(one.wires.chips.values())).world.began
    rows = (np.array([message.t for message in said]) - began) * 200.0
    truth = felt.truth.quat[np.round(rows).astype(int)]
    have, want = (lh.Track(np.arange(len(q)) * 1.0, q).as_rotation() for q in (np.array([m.quat for m in said]), truth))
    tilt = np.degrees(np.arccos(np.clip((have.apply([0, 0, 1], inverse=True) * want.apply([0, 0, 1], inverse=True)).sum(axis=1), -1, 1)))  # fmt: skip # noqa: E501
    assert tilt.max() < 2.5 and len(said) > 2000


def test_calibration_takes_the_bias_off(rig, felt):
    one = rig()
    one.node.run(duration=6.0)
    assert one.events()[:4] == ["started", "calibrating", "-calibrating", "calibrated"]
    drawn = felt.truth.bias[: 4 * 200].mean(axis=0)
    assert np.abs(np.array(one.node.path.bias) - drawn).max() < 2e-3
    first = one.drain(one.orientations)[0]
    assert first.seq == 500 and np.abs(np.array(first.bias) - drawn).max() < 2e-3


def test_the_filter_is_told_that_the_bias_was_taken_off(rig):
    """Or it would doubt for seconds what the node has just measured; who wants less doubt still keeps it."""
    one = rig()
    one.node.run(duration=6.0)
    (event,) = [event for event in one.drain(one.health) if event.name == "parameters"]
    first = one.drain(one.orientations)[0]
    assert event.data["from"] == first.seq == 500 and one.node.params.bias_start == event.data["params"]["bias_start"]
    assert one.node.params.bias_start < lh.filters.default().bias_start
    for params in (lh.EKF(bias_start=0.01), lh.Madgwick()):
        one = rig(params=params)
        one.node.run(duration=4.0)
        assert one.node.params == params and "parameters" not in one.events()


def test_an_emulated_sensor_is_still_at_the_start_however_late_that_is(rig, felt):
    """The first start on a machine compiles for longer than the hand holds still."""
    one = rig()
    one.clock.now += 10.0
    one.node.run(duration=4.0)
    assert "calibrated" in one.events()


def test_calibration_is_refused_while_it_moves_and_then_goes_on(rig, felt):
    moving = felt[1600:]  # begins to move at once, and is still at its end
    one = rig(felt=lh.Recording(moving.t - moving.t[0], moving.gyr, moving.acc, moving.mag))
    with pytest.raises(lh.LevelheadError, match="was not still for 500 samples on end, in 3001; hold it still"):
        one.node.run(duration=60.0)
    assert "calibration_refused" in one.events()
    assert one.drain(one.orientations) == []
    assert one.node.journal.counts["calibration_refused"] > 50 and one.node.bus.troubles() == []


def test_late_ticks_are_skipped_and_only_the_newest_is_said(rig):
    one = rig(calibrate=0)
    for second in range(1, 9):
        one.clock.at(second, lambda: setattr(one.clock, "extra", 0.0312))
    figures = one.node.run(duration=10.0)
    said, raw = one.drain(one.orientations)[:-1], one.drain(one.raw)
    assert figures["missed"] == 8 * 6 and figures["lost"] == 0 and figures["samples"] == len(raw)
    gaps = np.diff([message.seq for message in said])
    assert (gaps > 1).sum() == 8 and set(gaps[gaps > 1]) <= {6, 7, 8}  # what had grown stale in the FIFO is not said
    assert figures["lateness"]["max_us"] == pytest.approx(31_200, rel=0.01)
    assert "late" in one.events()


def test_budget_is_watched(rig, monkeypatch):
    one = rig(calibrate=0)
    add = one.node.path.monitor.add
    monkeypatch.setattr(one.node.path.monitor, "add", lambda *what: (setattr(one.clock, "now", one.clock.now + 3e-4), add(*what)))  # fmt: skip # noqa: E501
    figures = one.node.run(duration=1.0)
    assert figures["over_budget"] > 150 and figures["work"]["p50_us"] == pytest.approx(300, rel=0.06)
    assert one.events().count("over_budget") <= 2  # said once a second, not 200 times


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


def test_a_slow_source_is_not_silent(rig):
    """Five samples a second are few, but not none."""
    one = rig(calibrate=0)
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
    with pytest.raises(SensorError, match="says that it is 0x71"):
        one.node.run(duration=1.0)
    assert one.drain(one.orientations) == []


def test_another_chip_that_is_plugged_in_while_it_runs_is_refused(rig):
    one = rig(calibrate=0, give_up=4.0)

    def swap():
        one.wires.chips[0x68].identity = 0x71
        one.wires.chips[0x68].reset()

    one.clock.at(3.0, swap)
    with pytest.raises(SourceLost, match="says that it is 0x71; expected 0x68"):
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


def test_parameters_change_while_it_runs(rig):
    one = rig(params=lh.Madgwick(), calibrate=0)
    one.clock.at(2.0, lambda: one.node.set(beta=0.2))
    one.node.run(duration=4.0)
    (event,) = [event for event in one.drain(one.health) if event.name == "parameters"]
    assert one.node.params.beta == 0.2 and event.data["params"]["beta"] == 0.2
    assert event.data["from"] == pytest.approx(380, abs=5) and event.text == "beta=0.2"
    with pytest.raises(lh.LevelheadError, match="beta"):
        one.node.set(beta=-1.0)
    with pytest.raises(lh.LevelheadError, match="did you mean 'beta'"):
        one.node.set(bet=0.1)


def test_parameters_that_somebody_asks_for_are_checked(rig):
    one = rig(params=lh.Madgwick(), calibrate=0)
    config = one.node.bus.subscribe("imu/config")
    for second, wanted in enumerate(
        [{"beta": 0.2}, {"beta": -1}, {"bet": 1}, {"beta": "much"}, {"beta": [1]}, {"beta": "0.3"}]
    ):
        one.clock.at(1.0 + 2.0 * second, lambda wanted=wanted: one.node.bus.commands.append(Command(wanted)))
    one.node.run(duration=13.0)
    assert one.node.params.beta == 0.3
    texts = [event.text for event in one.drain(one.health) if event.name == "not_set"]
    assert len(texts) == 4 and "did you mean 'beta'" in texts[1]
    assert [message.data["params"]["beta"] for message in one.drain(config)][1:] == [0.2, 0.3]


def test_a_replay_ends_by_itself_and_gives_the_bits_of_fuse():
    recording = lh.simulate.recording("ICM-20948", "walking", duration=4.0)
    node = Node(Replay(recording, math.inf), calibrate=0)
    said = node.bus.subscribe("imu/orientation", history=1000, max_age=math.inf)
    node.run()
    quats = [said.get(timeout=0.0).quat for _ in range(len(recording))]
    np.testing.assert_array_equal(quats, lh.fuse(recording).quat)
    assert node.journal.counts["ended"] == 1


def test_a_replay_of_a_sensor_that_sits_otherwise(tmp_path):
    recording = lh.simulate.recording("ICM-20948", "walking", duration=2.0)
    turned = AxisMap.parse("-y,x,z")
    sensor = [values @ turned.matrix for values in (recording.gyr, recording.acc, recording.mag)]
    npz.write_npz(lh.Recording(recording.t, *sensor), tmp_path / "log.npz")
    node = Node(open_source(f"replay:{tmp_path / 'log.npz'}", speed=math.inf, axes=turned), calibrate=0)
    said = node.bus.subscribe("imu/orientation", history=1000, max_age=math.inf)
    node.run()
    quats = [said.get(timeout=0.0).quat for _ in range(len(recording))]
    np.testing.assert_array_equal(quats, lh.fuse(recording).quat)


def test_real_time_priority_is_for_all_threads_that_run_python_and_given_back():
    here, over = threading.get_native_id(), threading.Event()
    beside = threading.Thread(target=over.wait)
    beside.start()
    try:
        before = os.sched_getscheduler(here)
        with realtime_scheduling(True) as lacking:
            if lacking:
                assert "CAP_SYS_NICE" in lacking
                pytest.skip("real-time priority is not allowed here")
            assert os.sched_getscheduler(here) == os.sched_getscheduler(beside.native_id) == os.SCHED_FIFO
            own, other = (os.sched_getparam(one).sched_priority for one in (here, beside.native_id))
            assert own > other
        assert os.sched_getscheduler(here) == os.sched_getscheduler(beside.native_id) == before
    finally:
        over.set()
        beside.join()


def test_stop_from_another_thread(rig):
    one = rig(calibrate=0)
    one.clock.at(1.0, lambda: threading.Thread(target=one.node.stop).start())
    one.node.run()
    assert one.drain(one.orientations)[-1].valid is False


def test_two_nodes_on_one_bus_and_a_rate_that_is_none():
    bus = LocalBus()
    first = Node(Given(), bus=bus)
    with pytest.raises(lh.LevelheadError, match="another node publishes on imu/orientation"):
        Node(Given(), bus=bus)
    first.close()
    Node(Given(), bus=bus).close()
    with pytest.raises(lh.LevelheadError, match="the rate is 0 Hz"):
        Node(Given(), rate=0.0)


def test_every_event_has_a_meaning(rig):
    one = rig(calibrate=0)
    one.clock.at(1.0, lambda: setattr(one.wires, "unplugged", True))
    with pytest.raises(SourceLost):
        one.node.run(duration=60.0)
    assert {name.strip("-") for name in one.events()} <= set(EVENTS)
