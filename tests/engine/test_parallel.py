"""Many recordings: in order, a few at a time, and a mistake names its recording."""

from dataclasses import replace

import pytest
from tests.reference.hard import assert_same

import levelhead as lh
from levelhead.engine import parallel, threads
from levelhead.engine.parallel import fuse_recordings


@pytest.fixture(scope="module")
def recordings():
    return [lh.simulate.lesson(seed)[: 40 + seed] for seed in range(9)]


@pytest.mark.full
@pytest.mark.parametrize("engine", ["python", pytest.param("compiled", marks=pytest.mark.compiled)])
@pytest.mark.parametrize("workers", [1, 3, None])
def test_each_track_in_order(recordings, engine, workers):
    seen: list[int] = []
    found = list(fuse_recordings(recordings, lh.Kalman(), engine=engine, workers=workers, progress=seen.append))
    assert seen == list(range(1, 10))
    for recording, track in zip(recordings, found, strict=True):
        assert_same(track, lh.fuse(recording, lh.Kalman(), engine="python"))


@pytest.mark.parametrize("guard", [None, lh.Guard(acc_gate=1.0)], ids=["none", "own"])
def test_each_has_the_guard_that_is_asked_for(recordings, guard):
    for recording, track in zip(recordings, fuse_recordings(recordings, lh.Kalman(), guard=guard), strict=True):
        assert_same(track, lh.fuse(recording, lh.Kalman(), guard=guard))


def test_recordings_are_taken_when_needed(recordings):
    taken = []

    def source():
        for i in range(1000):
            taken.append(i)
            yield recordings[i % 9]

    tracks = fuse_recordings(source(), lh.Kalman(), workers=2)
    next(tracks)
    assert len(taken) <= threads.AHEAD * 2
    tracks.close()


def test_the_recording_is_named(recordings):
    bad = [recordings[0], "flight.csv"]
    with pytest.raises(lh.LevelheadError, match="^recording 1: fuse takes a Recording, not str"):
        list(fuse_recordings(bad, lh.Kalman()))
    with pytest.raises(lh.LevelheadError, match="no engine 'gpu'"):
        fuse_recordings(recordings, lh.Kalman(), engine="gpu")


def test_a_broken_source_stops_it(recordings):
    def source():
        yield recordings[0]
        raise lh.LevelheadError("walk.csv has no column for time")

    tracks = fuse_recordings(source(), lh.Kalman(), workers=2)
    with pytest.raises(lh.LevelheadError, match=r"walk\.csv"):
        list(tracks)


def test_a_source_is_told(recordings, monkeypatch):

    def broken(*_, **__):
        raise lh.LevelheadError("no")

    monkeypatch.setattr(parallel, "fuse", broken)
    named = replace(recordings[0], meta={"source": "walk.csv"})
    with pytest.raises(lh.LevelheadError, match=r"^recording 0 \(walk\.csv\): no"):
        list(fuse_recordings([named], lh.Kalman()))
