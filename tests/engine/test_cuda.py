"""A GPU's programs: in numba-cuda's simulator the bits of plain Python; as PTX no product contracted with a sum."""

import importlib.util
import os
import re
import subprocess
import sys

import pytest

import levelhead as lh
from levelhead.errors import LevelheadError

numba_cuda = pytest.mark.skipif(importlib.util.find_spec("numba_cuda") is None, reason="numba-cuda is not installed")
nvvm = pytest.mark.skipif(
    not any(importlib.util.find_spec(name) and importlib.util.find_spec(f"{name}.{part}")
            for name, part in (("nvidia", "cuda_nvcc"), ("nvidia", "cu13"))),
    reason="NVIDIA's compiler is not installed",
)  # fmt: skip

SETS = """
import numpy as np
import levelhead as lh
from levelhead import filters
from levelhead.engine import cuda
from tests.reference.hard import assert_same, hard_recording

cuda.CHUNK_BYTES = 8 * 72 * 9  # chunks of nine samples for two runs, a few more for others
recording = hard_recording(True)[:{samples}]
first = filters.find({name!r}).params()
sets = [first, first._replace({parameter}=1.5 * first.{parameter})]
for params, track in zip(sets, lh.fuse_parameter_sets(recording, sets, engine="cuda"), strict=True):
    alone = lh.fuse(recording, params, engine="python")
    assert_same(track, alone)
    assert (track.calibration is None) == (alone.calibration is None)
    assert track.calibration is None or track.calibration.to_dict() == alone.calibration.to_dict()
"""
RECORDINGS = """
import dataclasses
import numpy as np
import levelhead as lh
from levelhead.engine import cuda
from tests.reference.hard import assert_same

cuda.BATCH_SAMPLES = 30  # two batches
whole = lh.simulate.recording("MPU-6050", "hand", duration=1, mag="HMC5883L")
plain = dataclasses.replace(whole, mag=None)
given = [whole[:14], plain[3:12], whole[20:27]]
done = []
made = list(lh.fuse_recordings(iter(given), "Mahony", engine="cuda", progress=done.append))
assert done == [1, 2, 3]
for recording, track in zip(given, made, strict=True):
    assert_same(track, lh.fuse(recording, "Mahony", engine="python"))
"""
SWEEP = """
import numpy as np
import levelhead as lh
from levelhead.tune import sweep

recording = lh.simulate.recording("MPU-6050", "hand", duration=1)[:12]
values = [0.5, 1.0, 4.0]
found, real = (sweep(recording, "Complementary", "tau", values, engine=engine) for engine in ("cuda", "python"))
assert np.allclose(found.total, real.total, rtol=1e-9) and np.allclose(found.tilt, real.tilt, rtol=1e-9)
assert len(set(found.total.tolist())) == 3
"""
SINGLE = """
import numpy as np
import levelhead as lh

recording = lh.simulate.recording("MPU-6050", "hand", duration=1)[:15]
(found,) = lh.fuse_parameter_sets(recording, [lh.Mahony()], engine="cuda-single")
real = lh.fuse(recording, "Mahony", engine="python")
apart = float(np.abs(found.quat - real.quat).max())
assert 0.0 < apart < 1e-5, apart
assert np.array_equal(found.quat.astype(np.float32), found.quat)
"""


def simulate(script: str) -> None:
    """Runs a script in another process, in the simulator: Numba decides on that when it is imported."""
    paths = os.pathsep.join([os.getcwd(), *sys.path])
    env = os.environ | {"NUMBA_ENABLE_CUDASIM": "1", "PYTHONPATH": paths}
    ended = subprocess.run([sys.executable, "-c", script], env=env, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr[-3000:]


@pytest.mark.full
@numba_cuda
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "parameter", "samples"),
    [("Complementary", "tau", 24), ("Mahony", "kp", 24), ("EKF", "acc_tau", 24), ("ESKF", "gyr_noise", 40)],
)
def test_every_thread_has_the_bits_of_plain_python(name, parameter, samples):
    simulate(SETS.format(name=name, parameter=parameter, samples=samples))


@numba_cuda
@pytest.mark.slow
def test_recordings_of_different_length_and_sensors_in_batches():
    simulate(RECORDINGS)


@numba_cuda
@pytest.mark.slow
def test_a_sweep_scores_on_the_gpu():
    simulate(SWEEP)


@numba_cuda
@pytest.mark.slow
def test_single_precision_is_single():
    simulate(SINGLE)


def test_a_single_run_is_refused_in_a_sentence():
    recording = lh.simulate.recording("MPU-6050", "hand", duration=1)
    with pytest.raises(LevelheadError, match="many recordings or parameter sets, one thread each"):
        lh.fuse(recording, engine="cuda")


@pytest.mark.slow
def test_without_a_gpu_the_command_says_so(tmp_path):
    env = {key: value for key, value in os.environ.items() if key != "NUMBA_ENABLE_CUDASIM"}
    command = ["-m", "levelhead", "sweep", "--simulate", "hand", "-f", "Complementary", "-p", "tau", "--engine", "cuda"]
    ended = subprocess.run(
        [sys.executable, *command],
        check=False,
        env=env | {"CUDA_VISIBLE_DEVICES": "-1"},
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert ended.returncode == 2
    assert "the engine 'cuda' needs" in ended.stderr.splitlines()[-1] and "Traceback" not in ended.stderr


PTX = """
import re
import types
import numpy as np
from numba.cuda import dispatcher
from levelhead import filters
from levelhead.engine import cuda

# numba-cuda asks the GPU at hand for its generation when one function calls another; here is none.
dispatcher.get_current_device = lambda: types.SimpleNamespace(compute_capability=(9, 0))
single = {single!r}
made = cuda.compile_threads(cuda.Variant(filters.find({name!r}), True, True, None, single))
numbers = np.float32 if single else np.float64
table, whole, lengths = np.zeros((3, 2), numbers), np.zeros((3, 2), np.int64), np.zeros(2, np.int64)
samples, health = np.zeros((10, 2, 2), numbers), np.zeros((2, 2), np.uint32)
print(made.program.ptx((table, whole, lengths, samples, samples, health), (9, 0)))
"""


def compiled(name: str, single: bool) -> str:
    ended = subprocess.run(
        [sys.executable, "-c", PTX.format(name=name, single=single)], capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr[-3000:]
    return ended.stdout


@numba_cuda
@nvvm
@pytest.mark.full
@pytest.mark.parametrize("name", ["Complementary", "Mahony", "EKF", "ESKF"])
def test_double_compiles_without_contraction(name):
    """Every operation says how it rounds, so that the driver's assembler contracts none either."""
    ptx = compiled(name, False)
    assert ".visible .entry" in ptx
    assert len(re.findall(r"mul\.rn\.f64", ptx)) > 500
    assert not re.findall(r"\bfma\.|\bmad\.\S*f64|\b(?:mul|add|sub)\.f64|\.f32", ptx)


@numba_cuda
@nvvm
@pytest.mark.full
def test_single_precision_has_no_double_in_it():
    ptx = compiled("Complementary", True)
    assert len(re.findall(r"mul\.rn\.f32", ptx)) > 500
    assert not re.findall(r"\bfma\.|\b(?:mul|add|sub|div|sqrt)\S*\.f64|\b(?:mul|add|sub)\.f32", ptx)
