"""The smoother over chunks gives the bits of one piece, and leaves no file behind."""

from itertools import pairwise

import numpy as np
import pytest
from tests.reference.engines import NATIVE
from tests.reference.hard import hard_recording

import levelhead as lh
from levelhead.engine import smooth_chunks, smoothing
from levelhead.errors import LevelheadError

smooth = lh.smooth_chunks
NATIVE_ONLY = NATIVE.marks[0]


def cut(recording, *rows):
    return [recording[a:b] for a, b in pairwise([0, *rows, len(recording)])]


def assert_same(tracks, whole):
    for name in ("t", "quat", "bias", "sigma", "health"):
        parts = [getattr(track, name) for track in tracks]
        np.testing.assert_array_equal(np.concatenate(parts), getattr(whole, name), err_msg=name)
    assert tracks[0].calibration.to_dict() == tracks[-1].calibration.to_dict() == whole.calibration.to_dict()
    assert tracks[0].params == whole.params


@NATIVE_ONLY
@pytest.mark.parametrize("with_mag", [False, True])
def test_bits_of_one_piece(tmp_path, monkeypatch, with_mag):
    """Over several stretches, so that what the forward run saved comes from the file."""
    monkeypatch.setattr(smoothing, "MOST_BLOCKS", 4)
    monkeypatch.setattr(smooth_chunks, "OFTEN", 2)
    recording = hard_recording(with_mag)
    done = []
    tracks = list(smooth(iter(cut(recording, 1, 2, 333)), folder=tmp_path, progress=done.append))
    assert [len(track) for track in tracks] == [1, 1, 331, len(recording) - 333]
    assert_same(tracks, lh.smooth(recording))
    assert done == sorted(done) and done[-1] == 1.0 and len(done) > 8
    assert list(tmp_path.iterdir()) == []


@NATIVE_ONLY
def test_with_a_prior_and_without_a_guard():
    recording = hard_recording(True)
    prior = lh.fuse(recording).calibration
    for options in ({"prior": prior}, {"guard": None}):
        assert_same(list(smooth(iter(cut(recording, 300)), **options)), lh.smooth(recording, **options))


def test_wrong_chunks(tmp_path):
    recording = lh.simulate.recording("MPU-6050", "hand", duration=2.0, mag="HMC5883L")
    without = lh.Recording(recording.t, recording.gyr, recording.acc)
    for chunks, words in (
        ([], "there is no chunk"),
        ([recording, recording], "expected later samples"),
        ([recording[:50], without[50:]], "only one of two chunks has a magnetometer"),
    ):
        with pytest.raises(LevelheadError, match=words):
            list(smooth(iter(chunks), folder=tmp_path))
    with pytest.raises(LevelheadError, match="Mahony has no smoother"):
        smooth(iter([recording]), "Mahony")
    assert list(tmp_path.iterdir()) == []
