"""The native engine: which filters have it, what happens when sources change, and what its objects refuse."""

import logging
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from tests.reference.engines import NATIVE
from tests.reference.hard import assert_same, hard_recording

import levelhead as lh
from levelhead import filters
from levelhead.engine import binding, native

pytestmark = list(NATIVE.marks)


def test_every_filter_of_the_house_has_it():
    for flt in filters.ALL:
        assert native.has_imu(flt, True) and native.has_imu(flt, False)
        assert native.has_axis(flt) == (flt.axis is not None)
        for guarded in (True, False):
            assert native.has_smoother(flt, guarded, False) == (flt.smoothing is not None)
            assert native.has_smoother(flt, guarded, True) == (flt.aided_smoothing is not None)
    other = filters.find("EKF")._replace(step=filters.find("Mahony").step)
    assert not native.has_imu(other, True), "another filter of the same name is not the one that was compiled"


@pytest.fixture
def _changed(monkeypatch):
    """A file of the EKF is not what it was when the extension was built."""
    before = native._file_digest
    monkeypatch.setattr(native, "_file_digest", lambda name: b"changed" if "mekf" in name else before(name))
    for remembered in (native._load_filter, native._warn_stale):
        remembered.cache_clear()
    yield
    for remembered in (native._load_filter, native._warn_stale):
        remembered.cache_clear()


@pytest.mark.usefixtures("_changed")
def test_changed_sources_never_run_old_code(caplog):
    recording = hard_recording(False)
    with caplog.at_level(logging.WARNING, "levelhead"):
        assert not native.has_imu(filters.find("EKF"), True)
        assert native.has_imu(filters.find("Mahony"), True)
        assert not native.up_to_date()
        assert_same(lh.fuse(recording[:50], lh.EKF()), lh.fuse(recording[:50], lh.EKF(), engine="python"))
    assert [record.getMessage().count("make native") for record in caplog.records] == [1]
    with pytest.raises(lh.LevelheadError, match="no native engine"):
        lh.fuse(recording, lh.EKF(), engine="native")


def test_a_source_that_is_gone_is_a_change():
    """As after an update that renames a file: the extension in the folder was made from one that is no more."""
    there = "guard/rate_jump.py"
    assert native.digest([there, "guard/no_such_file.py"]) != native.digest([there, there])


def test_many_threads_say_once_that_sources_have_changed(monkeypatch):
    def say(message):
        time.sleep(0.05)  # the other threads come meanwhile
        said.append(message)

    said: list[str] = []
    monkeypatch.setattr(logging.getLogger("levelhead"), "warning", say)
    native._warn_stale.cache_clear()
    native._load_filter.cache_clear()
    monkeypatch.setattr(native, "digest", lambda files: "changed")
    with ThreadPoolExecutor(4) as pool:
        assert not any(pool.map(lambda flt: native.has_imu(flt, True), filters.ALL[:4]))
    native._load_filter.cache_clear()
    native._warn_stale.cache_clear()
    assert len(said) == 1


def test_without_numba(monkeypatch):
    monkeypatch.setattr(binding, "numba_installed", lambda: False)
    assert binding.choose_engine("auto", 10_000_000) == "python"
    with pytest.raises(lh.LevelheadError, match=r"needs Numba: pip install 'levelhead\[numba\]'"):
        lh.fuse(hard_recording(False), lh.EKF(), engine="compiled")


@pytest.mark.slow
def test_pressure_and_gnss():
    recording = lh.simulate.recording("ICM-20948", "walking", duration=20, seed=3)
    stamps = recording.t[5::20] - 0.003
    gnss = lh.Gnss(stamps, position=np.cumsum(np.full((len(stamps), 3), 0.1), axis=0), sigma_position=2.0)
    recording = lh.Recording(recording.t, recording.gyr, recording.acc, recording.mag, gnss=gnss)
    found = [lh.fuse(recording, lh.ESKF(), engine=engine) for engine in ("python", "native")]
    assert_same(*found)
    assert found[0].position is not None


def test_objects_of_the_extension_refuse_what_does_not_fit():
    module = native.extension()
    with pytest.raises(KeyError):
        module.Imu("Nothing", b"", b"")
    with pytest.raises(ValueError, match="bytes instead of"):
        module.Imu("EKF", b"", b"")
    loop = lh.Stream(lh.EKF(), engine="native")._stepper
    for wrong in ((0.0, 0.0), 9.8, ("a", 0.0, 0.0)):
        with pytest.raises(TypeError):
            loop.tick(loop.place, wrong, (0.0, 0.0, 9.8), 0.01)
    for dt in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="dt"):
            loop.tick(loop.place, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8), dt)
    short = np.zeros(2)
    outs = [np.zeros(4), np.zeros(3), np.zeros(3), np.zeros(1, np.uint32)]
    with pytest.raises(ValueError, match="an array of 16 bytes instead of 24"):
        loop.place.run(0.0, np.ones(1), short, np.zeros(3), np.zeros(0), *outs)
    with pytest.raises(ValueError, match="mag"):
        loop.place.run(0.0, np.ones(1), np.zeros(3), np.zeros(3), short, *outs)
    with pytest.raises(ValueError, match="takes no row"):
        loop.place.tick_aiding(0, 1.0, 1.0, 0.0)
