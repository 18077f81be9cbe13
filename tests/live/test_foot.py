"""A node on a foot: stances and position are those of ``GaitStream``; it says where nothing bounds position."""

import math

import numpy as np
import pytest

import levelhead as lh
from levelhead import simulate
from levelhead.live import Node
from levelhead.sources.devices.replay import Replay


def told(node, name):
    events = node.bus.subscribe("imu/health", history=1000, max_age=math.inf)
    node.run()
    found = iter(lambda: events.get(timeout=0.0), None)
    return [event for event in found if event.name == name]


def test_each_stance_is_told_with_its_position():
    recording = simulate.observe(simulate.foot(8, 200.0), simulate.imu("LSM6DSO32"), 1)
    stances = told(Node(Replay(recording, math.inf), calibrate=0, foot=True), "stance")
    live, expected = lh.GaitStream(), {}
    for t, gyr, acc in zip(recording.t, recording.gyr, recording.acc, strict=True):
        now = live.update(gyr, acc, t=t)
        if live.detector.begins:
            expected[t] = now.position
    assert len(expected) == 9  # before the first stride, and behind each
    assert [event.data["t"] for event in stances] == list(expected)
    for event in stances:
        true = recording.truth.position[np.searchsorted(recording.t, event.data["t"])]
        assert np.all(np.abs(np.array(event.data["position"]) - true) < 3.0 * np.array(event.data["sigma"]) + 0.03)
    np.testing.assert_allclose([event.data["position"] for event in stances], list(expected.values()), atol=0.05)


def test_a_pocket_is_told_that_nothing_bounds_position():
    recording = simulate.recording("ICM-20948", "walking", duration=10)[400:]
    node = Node(Replay(recording, math.inf), calibrate=0, foot=True)
    assert [event.on for event in told(node, "unbounded")] == [True]
    assert "stance" not in node.journal.counts


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"params": lh.Mahony()}, "Mahony takes no zero velocity: nothing bounds position; ESKF does"),
        ({"rate": 40.0}, "the rate is 40 Hz; a stance shows from 50 on"),
    ],
)
def test_a_node_that_cannot_have_position_is_refused(options, message):
    recording = simulate.recording("MPU-6050", "walking", duration=2)
    with pytest.raises(lh.LevelheadError, match=message):
        Node(Replay(recording, math.inf), calibrate=0, foot=True, **options)
