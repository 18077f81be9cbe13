"""An export without what a program does not ask for: the same bits, and no more state than they need."""

import ctypes
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.reference import c_engine
from tests.reference.c_engine import run_selftest
from tests.reference.hard import assert_same, hard_recording

import levelhead as lh
from levelhead.cli import main
from levelhead.errors import LevelheadError
from levelhead.export import ExportConfig, files, write
from levelhead.export.config import LEAN

GCC = pytest.mark.skipif("gcc" not in c_engine.COMPILERS, reason="no gcc on the PATH")
LEAN_FILTERS = pytest.mark.parametrize("params", [lh.Mahony(ki=0.01), lh.EKF()], ids=lambda one: type(one).__name__)


class Quat(ctypes.Structure):
    """A quaternion as the C returns it."""

    _fields_ = [(name, ctypes.c_double) for name in "wxyz"]


def lean_quaternions(folder, config, recording):
    """The quaternions of the exported C, sample by sample."""
    write(config, folder)
    command = [
        "gcc",
        *c_engine.WARNINGS,
        "-Werror",
        "-O2",
        "-shared",
        "-fPIC",
        f"{config.name}.c",
        "-lm",
        "-o",
        "one.so",
    ]
    subprocess.run(command, cwd=folder, check=True)
    library = ctypes.CDLL(str(folder / "one.so"))
    memory = ctypes.create_string_buffer(4096)
    read = getattr(library, f"{config.name}_quaternion")
    read.restype = Quat
    getattr(library, f"{config.name}_init")(memory)
    found, three = [], ctypes.c_double * 3
    steps = np.diff(recording.t, prepend=recording.t[0] - 1.0)
    for gyr, acc, mag, dt in zip(recording.gyr, recording.acc, recording.mag, steps, strict=True):
        vectors = [three(*vector) for vector in (gyr, acc, mag)]
        getattr(library, f"{config.name}_update")(memory, *vectors, ctypes.c_double(dt))
        quat = read(memory)
        found.append((quat.w, quat.x, quat.y, quat.z))
    return np.array(found)


@pytest.mark.compiled
@GCC
@LEAN_FILTERS
def test_lean_gives_the_bits_of_the_filter_alone(tmp_path, params):
    recording = hard_recording(True)
    found = lean_quaternions(tmp_path, ExportConfig(params, None, without=LEAN), recording)
    np.testing.assert_array_equal(found, lh.fuse(recording, params, guard=None, engine="python").quat)


@pytest.mark.compiled
@GCC
@LEAN_FILTERS
def test_the_whole_filter_gives_the_bits(params):
    """With guard and sigma, whose parts change the state in arms of branches, through calls and back."""
    recording = hard_recording(True)
    program = c_engine.built(ExportConfig(params), level="-O2")
    assert_same(lh.fuse(recording, params, engine="python"), program.fuse(recording))


@pytest.mark.compiled
@GCC
@pytest.mark.parametrize(
    "words", [("--lean",), ("--without", "mag"), ("--without", "sigma", "--without", "bias")], ids=str
)
def test_the_self_test_asks_for_no_more_than_there_is(tmp_path, words):
    assert main(["export", "Mahony", *words, "-o", str(tmp_path)]) == 0
    code, said = run_selftest(tmp_path, "lh_mahony", "-O1")
    assert code == 0 and "all 96 samples are right" in said


@pytest.mark.compiled
@pytest.mark.skipif("gcc" not in c_engine.COMPILERS, reason="no gcc on the PATH")
def test_bits_where_a_processor_multiplies_and_adds_at_once(tmp_path):
    """The source itself forbids contraction, under any standard of the command line."""
    write(ExportConfig(lh.EKF()), tmp_path)
    if subprocess.run(["gcc", "-mfma", "-E", "-"], input=b"", capture_output=True, check=False).returncode != 0:
        pytest.skip("gcc here has no -mfma")
    if "fma" not in Path("/proc/cpuinfo").read_text(encoding="utf-8").split():
        pytest.skip("this processor has no fused multiply-add")
    command = ["gcc", "-std=gnu99", "-O3", "-mavx2", "-mfma", "lh_ekf.c", "lh_ekf_selftest.c", "-lm", "-o", "test"]
    subprocess.run(command, cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "test"], capture_output=True, check=False).returncode == 0


@pytest.mark.slow
def test_what_nobody_asks_for_is_not_there():
    whole, lean = (
        files(ExportConfig(lh.EKF(), guard, without=parts))
        for guard, parts in ((lh.Guard(), frozenset()), (None, LEAN))
    )
    for word in ("lh_ekf_sigma", "lh_ekf_health", "gyr_extreme", "acc_rejected", "settings"):
        assert word in whole["lh_ekf.h"]
    for word in ("lh_ekf_sigma", "lh_ekf_health", "gyr_extreme", "observer_covariance", "settings"):
        assert word not in lean["lh_ekf.h"]
    assert "double acc_rejected" in lean["lh_ekf.h"], "the filter's own gate needs it"
    assert len(lean["lh_ekf.c"]) < 0.6 * len(whole["lh_ekf.c"])


def test_what_cannot_be_left_out_is_refused():
    with pytest.raises(LevelheadError, match="there is no 'sigmas' to leave out"):
        ExportConfig(lh.EKF(), without=frozenset({"sigmas"}))
    with pytest.raises(LevelheadError, match="one level and its rate have none of these parts"):
        ExportConfig(lh.Kalman(), axis=True, without=LEAN)
