"""The node: every sample once, deadlines, calibration, warnings, the safe state, and the same bits as a batch."""

import math
import os
import threading

import numpy as np
import pytest
from tests.reference.given_source import Given

import levelhead as lh
from levelhead import filters
from levelhead.live import Node, SourceLost, open_source
from levelhead.live.bus import Command, LocalBus
from levelhead.live.events import EVENTS
from levelhead.live.realtime import realtime_scheduling
from levelhead.sources.devices.replay import Replay
from levelhead.sources.formats import npz
from levelhead.sources.sensors import AxisMap

pytestmark = pytest.mark.slow


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
        [{"beta": 0.2}, {"bet": 1}, *({"beta": bad} for bad in (-1, "0.1", True, [1], 10**400)), {"beta": 0.3}]
    ):
        one.clock.at(1.0 + 2.0 * second, lambda wanted=wanted: one.node.bus.commands.append(Command(wanted)))
    one.node.run(duration=17.0)
    assert one.node.params.beta == 0.3
    texts = [event.text for event in one.drain(one.health) if event.name == "not_set"]
    assert len(texts) == 6 and "did you mean 'beta'" in texts[0]
    assert [message.data["params"]["beta"] for message in one.drain(config)][1:] == [0.2, 0.3]


def test_a_replay_ends_by_itself_and_gives_the_bits_of_fuse():
    recording = lh.simulate.recording("ICM-20948", "walking", duration=4.0)
    node = Node(Replay(recording, math.inf), calibrate=0)
    said = node.bus.subscribe("imu/orientation", history=1000, max_age=math.inf)
    node.run()
    quats = [said.get(timeout=0.0).quat for _ in range(len(recording))]
    np.testing.assert_array_equal(quats, lh.fuse(recording, filters.live()).quat)
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
    np.testing.assert_array_equal(quats, lh.fuse(recording, filters.live()).quat)


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


def test_a_heading_is_set_like_a_parameter():
    recording = lh.simulate.recording("MPU-6050", "hand", duration=2.0, seed=2)
    node = Node(Replay(recording, math.inf), calibrate=0)
    said = node.bus.subscribe("imu/orientation", history=1000, max_age=math.inf)
    node.set(heading=70.0)
    with pytest.raises(lh.LevelheadError, match="expected degrees"):
        node.set(heading=math.nan)
    node.run()
    yaws = [math.degrees(said.get(timeout=0.0).euler.yaw) for _ in range(len(recording))]
    plain = lh.fuse(recording).euler()[:, 2]
    turned = (np.array(yaws) - plain + 180.0) % 360.0 - 180.0
    assert np.ptp(turned[-100:]) < 1e-9 and abs(turned[-1]) > 1.0
    assert "heading" in node.journal.counts
