"""The C gives the bits of Python: on a hard recording, on real ones, with both compilers."""

import re

import numpy as np
import pytest
from tests.reference import c_engine
from tests.reference.hard import assert_same, hard_recording

import levelhead as lh
from levelhead import filters
from levelhead.evaluate import evaluate
from levelhead.export import ExportConfig, project
from levelhead.export.kinds import Machine

pytestmark = [
    pytest.mark.compiled,
    pytest.mark.skipif(not c_engine.COMPILERS, reason="no C compiler (gcc or clang) on the PATH"),
]
EVERY = pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
AXIS = pytest.mark.parametrize("flt", [f for f in filters.ALL if f.axis], ids=lambda f: f.name)
COMPILER = pytest.mark.parametrize(
    "compiler, level", [("gcc", "-O2"), pytest.param("clang", "-O3", marks=pytest.mark.full)]
)
REAL = ("05_undisturbed_slow_rotation_with_breaks_B", "21_undisturbed_fast_combined")


def there(compiler):
    if compiler not in c_engine.COMPILERS:
        pytest.skip(f"{compiler} is not on the PATH")


@pytest.mark.full
@EVERY
@COMPILER
@pytest.mark.parametrize("guard", [lh.Guard(), pytest.param(None, marks=pytest.mark.full)], ids=["guarded", "alone"])
def test_hard_recordings(flt, compiler, level, guard):
    there(compiler)
    if guard is None and compiler == "clang":
        pytest.skip("the guard is the same C with it and without")
    program = c_engine.built(ExportConfig(flt.params(), guard), compiler, level)
    for mag in (False, True):
        recording = hard_recording(mag)
        assert_same(lh.fuse(recording, flt.params(), guard=guard, engine="python"), program.fuse(recording))


def test_the_field_of_a_place():
    params, recording = lh.ESKF(field_strength=48.6, field_dip=64.0), hard_recording(True)
    found = c_engine.built(ExportConfig(params)).fuse(recording)
    assert_same(lh.fuse(recording, params, engine="python"), found)
    assert np.any(found.quat != lh.fuse(recording, lh.ESKF()).quat)


@AXIS
@COMPILER
def test_axis(flt, compiler, level):
    there(compiler)
    rng = np.random.default_rng(4)
    t = np.cumsum(rng.uniform(0.005, 0.02, 300))
    pair = rng.normal(0, 100, 300), rng.normal(0, 50, 300)
    for period in (0.0, 360.0):
        report = lh.fuse_axis(t, *pair, flt.params(), period=period, engine="python")
        found = c_engine.built(ExportConfig(flt.params(), axis=True), compiler, level).fuse_axis(t, *pair, period)
        np.testing.assert_array_equal(found, np.stack(report, axis=1)[1:])


@EVERY
@pytest.mark.parametrize("real", ["double", pytest.param("float", marks=pytest.mark.full)])
def test_the_header_tells_the_size(flt, real):
    for axis in (False, True) if flt.axis else (False,):
        config = ExportConfig(flt.params(), real=real, axis=axis)
        size = c_engine.built(config, level="-O2").size
        one = project.build_c_api(config)
        header = one.write()[f"{config.name}.h"]
        assert one.size(Machine("this one", 8 if real == "double" else 4, 8)) == size
        assert re.search(rf"64 bit \(Cortex-A, x86-64\) +{size} bytes", header)


def test_the_lesson_in_88_bytes():
    """The two-state filter of the lesson: five numbers that it carries, five parameters, two switches."""
    assert c_engine.built(ExportConfig(lh.Kalman(), axis=True)).size == 88
    assert c_engine.built(ExportConfig(lh.Kalman(), axis=True, real="float")).size == 44


@pytest.mark.full
@EVERY
@pytest.mark.parametrize("trial", REAL, ids=lambda name: f"BROAD {name[:2]}")
def test_real_recordings(flt, trial, data_dir):
    """59,212 and 53,612 samples with magnetometer: the same bits in double, hardly another error in float."""
    recording = lh.read(data_dir / "broad" / f"{trial}.mat")
    expected = lh.fuse(recording, flt.params(), engine="compiled")
    assert_same(expected, c_engine.built(ExportConfig(flt.params()), level="-O2").fuse(recording))
    single = c_engine.built(ExportConfig(flt.params(), real="float"), level="-O2").fuse(recording)
    np.testing.assert_array_equal(single.health, expected.health)
    right, off = (evaluate(recording, track) for track in (expected, single))
    assert off.tilt < 1.001 * right.tilt, "2 % were asked for"
    assert np.degrees((expected.as_rotation() * single.as_rotation().inv()).magnitude()).max() < 0.05
