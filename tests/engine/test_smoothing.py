"""The smoother: its step back against NumPy, stretches that change nothing, and what it is for: smaller errors."""

import numpy as np
import pytest
from tests.reference.engines import NATIVE, skip_second_compilation
from tests.reference.hard import assert_same, hard_recording

import levelhead as lh
from levelhead import simulate
from levelhead.engine import smoothing
from levelhead.evaluate import evaluate
from levelhead.filters.eskf import rts
from levelhead.filters.eskf.state import DRIVEN, ROW
from levelhead.filters.eskf.state import POSITION as KNOWN
from levelhead.filters.eskf.state import VELOCITY as SPEED

NATIVE_ONLY = NATIVE.marks[0]


def spd(rng):
    root = rng.normal(0, 0.1, (KNOWN, KNOWN))
    return root @ root.T + 0.01 * np.eye(KNOWN)


def padded(matrix):
    """As it lies in memory, where there is room for states that only aiding knows."""
    wide = np.zeros((matrix.shape[0], ROW))
    wide[:, :KNOWN] = matrix
    return wide.ravel()


@pytest.mark.parametrize("cut", [False, True])
def test_a_step_back_is_rauch_tung_striebels(cut):
    rng = np.random.default_rng(2)
    here, noise, later = spd(rng), spd(rng), spd(rng)
    f = np.eye(KNOWN)
    f[SPEED : SPEED + DRIVEN] += rng.normal(0, 0.1, (DRIVEN, KNOWN))
    ahead = f @ here @ f.T + noise
    m = np.zeros(rts.SIZE)
    for place, matrix in ((rts.AHEAD, ahead), (rts.GAIN, f @ here), (rts.LATER, later), (rts.NOW, here)):
        m[place : place + KNOWN * ROW] = padded(matrix)
    d = rng.normal(size=KNOWN)
    m[rts.OFF : rts.OFF + KNOWN] = d
    left = np.array([cut and SPEED <= i < SPEED + DRIVEN for i in range(KNOWN)])
    stay = np.flatnonzero(~left)
    gain = np.zeros((KNOWN, KNOWN))
    gain[:, stay] = (f @ here)[stay].T @ np.linalg.inv(ahead[np.ix_(stay, stay)])
    rts.step_back(m, cut)
    np.testing.assert_allclose(m[rts.SMOOTHED : rts.SMOOTHED + KNOWN], gain @ d, atol=1e-9)
    after = m[rts.NOW : rts.NOW + rts.WHOLE].reshape(ROW, ROW)[:KNOWN, :KNOWN]
    np.testing.assert_allclose(after, here + gain @ (later - ahead) @ gain.T, atol=1e-9)
    np.testing.assert_array_equal(after, after.T)


@pytest.fixture(scope="module")
def walk():
    return simulate.recording("LSM6DSO32", "hand", seed=7, mag="HMC5883L", duration=60.0)


@NATIVE_ONLY
def test_every_instant_knows_the_whole_recording(walk):
    online, offline = evaluate(walk, lh.fuse(walk, lh.ESKF())), evaluate(walk, lh.smooth(walk))
    assert offline.total_aligned < 0.9 * online.total_aligned
    assert offline.tilt < online.tilt
    track = lh.smooth(walk)
    online_sigma = lh.fuse(walk, lh.ESKF()).sigma  # its heading is relative, and that of the smoothed track is north
    assert track.sigma[50:500, :2].mean() < 0.6 * online_sigma[50:500, :2].mean(), "the start knows it as well"
    np.testing.assert_allclose(np.linalg.norm(track.quat, axis=1), 1.0, atol=1e-12)


@NATIVE_ONLY
def test_stretches_change_nothing(walk, monkeypatch):
    whole = lh.smooth(walk)
    monkeypatch.setattr(smoothing, "MOST_BLOCKS", 40)
    cut = lh.smooth(walk)
    np.testing.assert_allclose(np.abs((whole.quat * cut.quat).sum(axis=1)), 1.0, atol=1e-12)
    np.testing.assert_allclose(whole.sigma, cut.sigma, rtol=1e-6)
    np.testing.assert_allclose(whole.bias, cut.bias, atol=1e-9)
    np.testing.assert_array_equal(whole.health, cut.health)


@NATIVE_ONLY
def test_without_a_magnetometer_and_across_a_gap(walk):
    keep = np.r_[0:2000, 3000:6000]
    short = lh.Recording(walk.t[keep], walk.gyr[keep], walk.acc[keep])
    track = lh.smooth(short)
    assert np.isfinite(track.quat).all() and np.isfinite(track.sigma).all()
    truth = walk.truth.quat[keep]
    up = lh.Track(short.t, track.quat).as_rotation().inv().apply([0.0, 0.0, 1.0])
    real = lh.Track(short.t, truth).as_rotation().inv().apply([0.0, 0.0, 1.0])
    assert np.degrees(np.arccos(np.clip((up * real).sum(axis=1), -1, 1)))[200:].max() < 6.0


@NATIVE_ONLY
@pytest.mark.parametrize("n", [1, 2, 15])
def test_recordings_shorter_than_a_block(walk, n):
    track = lh.smooth(walk[:n])
    assert np.isfinite(track.quat).all() and len(track.t) == n


def test_another_filter_has_no_smoother(walk):
    with pytest.raises(lh.LevelheadError, match="Mahony has no smoother"):
        lh.smooth(walk, "Mahony")
    with pytest.raises(lh.LevelheadError, match="takes a Recording"):
        lh.smooth("log.csv")


@NATIVE_ONLY
def test_progress_reaches_one(walk):
    said = []
    lh.smooth(walk[:1000], progress=said.append)
    assert said == sorted(said) and said[-1] == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("guard", [lh.Guard(), None], ids=["guarded", "unguarded"])
@pytest.mark.parametrize("with_mag", [True, False], ids=["mag", "no mag"])
@pytest.mark.parametrize("engine", [NATIVE, pytest.param("compiled", marks=pytest.mark.full)])
def test_the_same_bits(engine, guard, with_mag, monkeypatch):
    """Gaps, missing readings, disturbances; in several stretches, so that runs forward are repeated."""
    skip_second_compilation(engine, guard)
    recording = hard_recording(with_mag)[:700]
    monkeypatch.setattr(smoothing, "MOST_BLOCKS", 12)
    tracks = [lh.smooth(recording, guard=guard, engine=one) for one in ("python", engine)]
    assert_same(*tracks)
    assert np.isfinite(tracks[0].quat).all()
    known = [track.calibration.gyr_matrix for track in tracks]
    np.testing.assert_array_equal(known[0].value, known[1].value)


@NATIVE_ONLY
def test_auto_needs_no_numba(walk, monkeypatch):
    monkeypatch.setattr(smoothing, "numba_installed", lambda: False)
    monkeypatch.setattr(smoothing, "for_engine", None)
    assert len(lh.smooth(walk[:300])) == 300


def test_without_machine_code_of_any_kind(walk, monkeypatch):
    monkeypatch.setattr(smoothing, "numba_installed", lambda: False)
    monkeypatch.setattr(smoothing, "has_smoother", lambda *_: False)
    assert smoothing.choose_smoother_engine("auto", lh.filters.of(lh.ESKF()), True, False) == "python"
    with pytest.raises(lh.LevelheadError, match="no native engine"):
        lh.smooth(walk[:300], engine="native")


@NATIVE_ONLY
def test_the_extension_refuses_what_does_not_fit():
    from levelhead.engine import native

    module, rows = native.extension(), np.zeros(3)
    with pytest.raises(KeyError):
        module.correct_stretch("Nothing", *[rows] * 13)
    with pytest.raises(TypeError):
        module.correct_stretch("ESKF", rows)
    with pytest.raises(ValueError, match="bytes instead of"):
        module.correct_stretch("ESKF", 1, 1, *[rows] * 11)
    with pytest.raises(ValueError, match="keeps no blocks"):
        lh.Stream(lh.EKF(), engine="native")._stepper._machine.filter.forward()
