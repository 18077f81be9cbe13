"""One driver: plain Python, native, compiled, streamed and chunked give the same bits; no engine has to be chosen."""

import functools
import subprocess
import sys

import numpy as np
import pytest
from tests.reference.engines import COMPILED, EVERY_ENGINE, MACHINE_CODE, NATIVE
from tests.reference.hard import assert_same, hard_recording

import levelhead as lh
from levelhead import filters
from levelhead.engine import batch, binding

EVERY = pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
ALONE = [  # Numba compiles that driver once: it is the same with every filter
    *(pytest.param(flt, *NATIVE.values, marks=NATIVE.marks, id=f"native-{flt.name}") for flt in filters.ALL),
    pytest.param(filters.of(lh.EKF()), *COMPILED.values, marks=COMPILED.marks, id="compiled-EKF"),
]
AXIS = pytest.mark.parametrize("flt", [f for f in filters.ALL if f.axis], ids=lambda f: f.name)


@pytest.fixture(scope="module", params=[False, True], ids=["6-D", "9-D"])
def recording(request):
    return hard_recording(request.param)


@pytest.fixture(scope="module")
def in_python(recording):
    """``fuse`` in plain Python, once for all machine code that is compared with it."""
    return functools.cache(lambda name, guard: lh.fuse(recording, name, guard=guard, engine="python"))


@EVERY
@MACHINE_CODE
def test_machine_code_is_plain_python(flt, engine, recording, in_python):
    assert_same(in_python(flt.name, lh.Guard()), lh.fuse(recording, flt.params(), engine=engine))


@pytest.mark.parametrize(("flt", "engine"), ALONE)
def test_machine_code_without_a_guard_is_plain_python(flt, engine, recording, in_python):
    assert_same(in_python(flt.name, None), lh.fuse(recording, flt.params(), guard=None, engine=engine))


@EVERY
@EVERY_ENGINE
def test_streamed_is_batch(flt, engine, recording, in_python):
    expected = in_python(flt.name, lh.Guard())
    live = lh.Stream(flt.params(), engine=engine)
    for i in range(len(recording)):
        mag = None if recording.mag is None else recording.mag[i]
        quat = live.update(gyr=recording.gyr[i], acc=recording.acc[i], mag=mag, t=float(recording.t[i]))
        assert tuple(quat) == tuple(expected.quat[i])
        assert live.health == expected.health[i]
    assert live.quat == tuple(expected.quat[-1])
    assert (live.bias is None) == (expected.bias is None)
    if live.bias is not None:
        assert live.bias == tuple(expected.bias[-1])
    assert (live.sigma is None) == (expected.sigma is None)
    if live.sigma is not None:
        assert live.sigma == tuple(expected.sigma[-1])


@EVERY
@EVERY_ENGINE
def test_chunked_is_whole(flt, engine, recording, in_python, monkeypatch):
    monkeypatch.setattr(batch, "STRETCH", 111)
    seen = []
    chunked = lh.fuse(recording, flt.params(), engine=engine, progress=seen.append)
    assert_same(chunked, in_python(flt.name, lh.Guard()))
    assert seen == sorted(seen) and seen[-1] == 1.0 and len(seen) == 7


@AXIS
@EVERY_ENGINE
def test_axis_is_plain_and_streamed(flt, engine):
    rng = np.random.default_rng(4)
    t = np.cumsum(rng.uniform(0.005, 0.02, 300))
    level, rate = rng.normal(0, 100, 300), rng.normal(0, 50, 300)
    plain = lh.fuse_axis(t, level, rate, flt.params(), period=360.0, engine="python")
    found = lh.fuse_axis(t, level, rate, flt.params(), period=360.0, engine=engine)
    for name, column in plain._asdict().items():
        np.testing.assert_array_equal(column, getattr(found, name), err_msg=name)
    live = lh.AxisStream(flt.params(), angle=level[0], engine=engine)
    for i in range(1, 300):
        assert live.update(level[i], rate[i], t[i] - t[i - 1]) == plain.level[i]
    assert live.report == tuple(column[-1] for column in plain)


@pytest.mark.slow
def test_small_work_never_imports_numba():
    code = (
        "import sys, numpy as np, levelhead as lh; n = 6000;"
        "rec = lh.Recording(np.arange(n) / 100, np.zeros((n, 3)), np.tile([0, 0, 9.81], (n, 1)));"
        "lh.fuse(rec, lh.Kalman()); lh.fuse(rec, lh.Complementary());"
        "sys.exit('numba' in sys.modules or 'scipy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_auto_and_wrong_engines():
    assert binding.choose_engine("auto", 10_000_000) == "compiled"
    assert binding.choose_engine("auto", 10) == "python"
    assert binding.choose_engine("auto", 10, native=True) == "native"
    with pytest.raises(lh.LevelheadError, match="no engine 'compild'; did you mean 'compiled'"):
        lh.fuse(lh.simulate.lesson(), lh.Kalman(), engine="compild")
    with pytest.raises(lh.LevelheadError, match="no engine 'gpu'"):
        lh.Stream(engine="gpu")


def test_fuse_takes_a_recording():
    with pytest.raises(lh.LevelheadError, match="fuse takes a Recording, not str"):
        lh.fuse("flight.csv")
