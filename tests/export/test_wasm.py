"""A filter as a package for npm: its self-test, Python's bits on real samples, parameters, and what it refuses."""

import json
import shutil
import subprocess

import numpy as np
import pytest
from tests.reference.node import run_in_node

import levelhead as lh
from levelhead.cli import main
from levelhead.errors import LevelheadError
from levelhead.export import ExportConfig, write_package
from levelhead.export.config import LEAN
from levelhead.sources import read

TOOLS = ("clang", "wasm-ld", "node")
BUILT = pytest.mark.skipif(not all(map(shutil.which, TOOLS)), reason=f"needs {', '.join(TOOLS)}")
SAMPLES = 3000
USE = """
import { Filter } from './index.js';
const filter = await Filter.load(), said = {};
filter.parameters.kp = 0.2;
filter.update([0.1, 0.2, 0.3], [0, 1, 9.8], null, 0.01);
for (let i = 0; i < 20; i++) filter.update([0.1, 0.2, 0.3], [1, 1, 9.7], null, 0.01);
said.quaternion = [...filter.quaternion];
const kept = filter.save();
filter.reset();
said.reset = [...filter.quaternion];
filter.restore(kept);
said.restored = [...filter.quaternion];
said.refused = [
  () => { filter.parameters.kp = -1; },
  () => { filter.parameters.kq = 1; },
  () => filter.update([1, 2], [0, 0, 9.8], null, 0.01),
  () => filter.updateRows({ gyr: [1, 2, 3], acc: [1, 2], dt: [0.01] }),
  () => filter.restore(kept.slice(1)),
].map((act) => { try { act(); } catch (error) { return error.name; } });
said.none = filter.updateRows({ gyr: [], dt: [] }).taken;
console.log(JSON.stringify(said));
"""
pytestmark = pytest.mark.compiled


def run_node(package, name):
    done = subprocess.run(["node", name], cwd=package, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def make_package(config, folder):
    write_package(config, folder)
    return folder / config.name.replace("_", "-")


@BUILT
@pytest.mark.parametrize(
    "config",
    [
        ExportConfig(lh.EKF(), real="float", without=frozenset({"sigma"})),
        ExportConfig(lh.Mahony(), None, without=LEAN | {"mag", "bias"}),
        ExportConfig(lh.Kalman(), axis=True),
    ],
    ids=lambda config: config.name,
)
def test_its_self_test_passes(config, tmp_path):
    package = make_package(config, tmp_path)
    assert "samples are right" in run_node(package, "selftest.js")
    manifest = json.loads((package / "package.json").read_text())
    assert all((package / name).exists() for name in (*manifest["files"], manifest["types"]))


@BUILT
def test_it_gives_the_bits_of_python_on_real_samples(data_dir, tmp_path):
    """Rows in one call, and sample by sample; σ, bias and health too. The benchmark takes 100,000 samples."""
    recording = read(data_dir / "broad" / "21_undisturbed_fast_combined.mat")[:SAMPLES]
    track = lh.fuse(recording, lh.ESKF())
    package = make_package(ExportConfig(lh.ESKF()), tmp_path)
    found = run_in_node(package, recording).track
    for name in ("quaternion", "live"):
        np.testing.assert_array_equal(found[name], track.quat, err_msg=name)
    for name in ("bias", "sigma", "health"):
        np.testing.assert_array_equal(found[name], getattr(track, name), err_msg=name)


@BUILT
def test_parameters_states_and_refusals(tmp_path):
    package = make_package(ExportConfig(lh.Mahony()), tmp_path)
    (package / "use.js").write_text(USE, encoding="utf-8")
    said = json.loads(run_node(package, "use.js"))
    stream = lh.Stream(lh.Mahony(kp=0.2), engine="python")
    stream.update(gyr=(0.1, 0.2, 0.3), acc=(0.0, 1.0, 9.8), dt=0.01)
    for _ in range(20):
        stream.update(gyr=(0.1, 0.2, 0.3), acc=(1.0, 1.0, 9.7), dt=0.01)
    assert tuple(said["quaternion"]) == tuple(stream.quat)
    assert said["reset"] == [1, 0, 0, 0] and said["restored"] == said["quaternion"]
    assert said["refused"] == ["RangeError", "TypeError", "TypeError", "TypeError", "TypeError"]
    assert said["none"] == 0


def test_without_a_compiler_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(LevelheadError, match="needs clang and wasm-ld"):
        write_package(ExportConfig(lh.Mahony()), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_it_is_for_no_board(capsys, tmp_path):
    assert main(["export", "Mahony", "--wasm", "--arduino", "-o", str(tmp_path)]) == 2
    assert "leave --arduino and --board out" in capsys.readouterr().err
