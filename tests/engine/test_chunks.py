"""A recording in chunks gives the bits of the recording in one piece."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import levelhead as lh
from levelhead import filters
from levelhead.errors import LevelheadError

FIELDS = ("t", "quat", "bias", "sigma", "health", "position", "velocity", "sigma_position", "sigma_velocity")


@pytest.fixture(scope="module")
def recording():
    return lh.simulate.recording("ICM-20948", "walking", duration=12.0, rate=100.0, seed=3)


def cut(recording, *rows):
    edges = [0, *rows, len(recording)]
    return [recording[a:b] for a, b in pairwise(edges)]


def assert_same(tracks, whole):
    for name in FIELDS:
        parts = [getattr(track, name) for track in tracks]
        if getattr(whole, name) is None:
            assert all(part is None for part in parts)
        else:
            assert np.array_equal(np.concatenate(parts), getattr(whole, name), equal_nan=True), name


@pytest.mark.parametrize("flt", filters.ALL, ids=lambda flt: flt.name)
def test_bits_of_one_piece(recording, flt):
    whole = lh.fuse(recording, flt.params())
    tracks = list(lh.fuse_chunks(iter(cut(recording, 1, 2, 400, 933)), flt.params()))
    assert_same(tracks, whole)
    if whole.calibration is not None:
        assert tracks[-1].calibration.to_dict() == whole.calibration.to_dict()
        assert tracks[0].calibration.to_dict() != whole.calibration.to_dict()


@pytest.mark.slow
def test_bits_of_one_piece_in_plain_python_with_a_prior_and_no_guard(recording):
    prior = lh.fuse(recording).calibration
    short = recording[:300]
    for options in ({"prior": prior}, {"guard": None}):
        whole = lh.fuse(short, engine="python", **options)
        assert_same(list(lh.fuse_chunks(cut(short, 100, 101), engine="python", **options)), whole)


def test_readings_of_pressure_and_gnss(recording):
    t = np.arange(0.05, 12.0, 0.2)
    pressure = lh.Pressure(t + 0.003, 101_000.0 + np.sin(t))
    gnss = lh.Gnss(t + 0.007, position=np.stack([t, 0.1 * t, 0.0 * t], axis=1))
    whole = replace(recording, pressure=pressure, gnss=gnss)
    chunks, before = [], 0.0
    for part in cut(recording, 250, 700):
        end = float(part.t[-1])
        after = np.nextafter(before, np.inf)  # what came between two chunks belongs to the later one
        chunks.append(replace(part, pressure=pressure.between(after, end), gnss=gnss.between(after, end)))
        before = end
    assert_same(list(lh.fuse_chunks(chunks)), lh.fuse(whole))


def test_aiding_that_begins_in_a_later_chunk_and_ends(recording):
    pressure = lh.Pressure(np.arange(4.5, 7.5, 0.5), np.full(6, 101_000.0))
    parts = cut(recording, 400, 800)
    parts[1] = replace(parts[1], pressure=pressure)
    tracks = list(lh.fuse_chunks(parts))
    whole = lh.fuse(replace(recording, pressure=pressure))
    assert [track.position is None for track in tracks] == [True, False, False]
    assert np.array_equal(np.concatenate([track.quat for track in tracks]), whole.quat)
    assert np.array_equal(np.concatenate([track.position for track in tracks[1:]]), whole.position[400:])


def test_chunks_are_taken_one_by_one(recording):
    taken = []

    def source():
        for part in cut(recording, 400, 800):
            taken.append(len(part))
            yield part

    tracks = lh.fuse_chunks(source())
    assert taken == []
    next(tracks)
    assert taken == [400]


def test_chunks_that_do_not_follow(recording):
    with pytest.raises(LevelheadError, match="a chunk begins at 0.000000 s, after one that ended at 11.99"):
        list(lh.fuse_chunks([recording, recording]))
    bare = replace(recording[600:], mag=None)
    with pytest.raises(LevelheadError, match="only one of two chunks has a magnetometer"):
        list(lh.fuse_chunks([recording[:600], bare]))
    with pytest.raises(LevelheadError, match="there is no chunk"):
        list(lh.fuse_chunks([]))
    with pytest.raises(LevelheadError, match="no engine 'fast'"):
        lh.fuse_chunks([recording], engine="fast")
