"""Lanes: every parameter set run beside others gives the bits of its single run, and of plain Python."""

import numpy as np
import pytest
from tests.reference.hard import assert_same, hard_recording

import levelhead as lh
from levelhead import filters
from levelhead.compiler import lane_slots
from levelhead.engine import lanes
from levelhead.engine.parallel import fuse_parameter_sets
from levelhead.filters.parameters import param_table

pytestmark = pytest.mark.compiled

COUNT = lane_slots.LANES + 3  # a whole block and a part of one
EVERY = pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)


def different(flt, count=COUNT):
    """Parameter sets that differ in every number and every switch."""
    noise = np.random.default_rng(3)
    sets = []
    for k in range(count):
        values = {}
        for name, param in param_table(flt.params).items():
            if isinstance(getattr(flt.params(), name), bool):
                values[name] = bool(k % 5 < 2)
            elif param.sweep is not None:
                values[name] = float(noise.uniform(*param.sweep))
        sets.append(flt.params(**values))
    return sets


@EVERY
def test_every_lane_is_its_single_run(flt, monkeypatch):
    monkeypatch.setattr(lanes, "CHUNK", 111)
    recording = hard_recording("mag" in flt.uses)
    sets = different(flt)
    found = fuse_parameter_sets(recording, sets, engine="compiled")
    for params, track in zip(sets, found, strict=True):
        assert track.params == params
        assert_same(track, lh.fuse(recording, params, engine="compiled"))
    assert_same(found[-1], lh.fuse(recording, sets[-1], engine="python"))


@pytest.mark.full
@pytest.mark.parametrize(
    "guard",
    [
        pytest.param(None, id="none"),
        pytest.param(lh.Guard(gyr_range=250.0, acc_gate=2.0, rest_time=0.2), id="own"),
    ],
)
def test_lanes_have_the_guard_that_is_asked_for(guard):
    recording = hard_recording(True)
    sets = different(filters.of(lh.Complementary()), 9)
    found = fuse_parameter_sets(recording, sets, guard=guard, engine="compiled")
    for params, track in zip(sets, found, strict=True):
        assert_same(track, lh.fuse(recording, params, guard=guard, engine="compiled"))
    assert any((track.quat != lh.fuse(recording, track.params).quat).any() for track in found)
    few = fuse_parameter_sets(recording, sets[:2], guard=guard, engine="python")
    for params, track in zip(sets, few, strict=False):
        assert_same(track, lh.fuse(recording, params, guard=guard, engine="python"))


def test_filters_can_be_mixed_and_few():
    recording = lh.simulate.lesson(42)[:50]
    sets = [lh.EKF(acc_tau=0.1), "GyroIntegration", lh.EKF]
    for engine in ("python", "compiled"):
        for params, track in zip(sets, fuse_parameter_sets(recording, sets, engine=engine), strict=True):
            assert_same(track, lh.fuse(recording, params))
    assert fuse_parameter_sets(recording, []) == []


def test_a_recording_that_never_starts():
    n = 20
    recording = lh.Recording(np.arange(n) / 100, np.zeros((n, 3)), np.full((n, 3), np.nan))
    sets = [lh.EKF(acc_tau=0.1 * (k + 1)) for k in range(10)]
    for params, track in zip(sets, fuse_parameter_sets(recording, sets, engine="compiled"), strict=True):
        assert_same(track, lh.fuse(recording, params, engine="python"))


def test_blocks_have_equal_switches():
    sets = [lh.Kalman(joseph=k % 3 == 0) for k in range(200)]
    cut = lanes.lane_blocks(sets)
    assert sorted(i for block in cut for i in block) == list(range(200))
    for block in cut:
        assert len(block) <= lane_slots.LANES
        assert len({sets[i].joseph for i in block}) == 1


def test_numbers_lie_in_rows():
    value = (1.5, True, (7, -0.0))
    place = lane_slots.lane_rows(value, 2)
    assert (place.first, place.end, place.floats) == (2, 6, (True, False, False, True))
    table, address = lane_slots.allocate(place.end)
    assert address % 64 == 0
    lane_slots.put(table, place, np.array([lane_slots.flat(value), [2.5, 0.0, 8.0, 9.0]]))
    assert lane_slots.get(table, place, 3).tolist() == [[1.5, 1, 7, -0.0], [2.5, 0, 8, 9], [2.5, 0, 8, 9]]
    assert table[3].view(np.int64)[:2].tolist() == [1, 0]
