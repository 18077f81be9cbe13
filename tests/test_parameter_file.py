"""A file of parameters: written and read again, by hand, of a sweep, and everything that can be wrong with it."""

import json

import numpy as np
import pytest

import levelhead as lh
from levelhead import filters
from levelhead.errors import LevelheadError
from levelhead.parameter_file import ParameterFile


def test_it_comes_back_to_the_last_bit(tmp_path):
    file = ParameterFile(lh.Mahony(kp=0.1 + 0.2, whole_field=True), lh.Guard(rest_time=3.0), {"gain": 0.25})
    file.save(tmp_path / "tuned.json")
    assert ParameterFile.read(tmp_path / "tuned.json") == file


def test_by_hand_filter_and_params_are_enough(tmp_path):
    (tmp_path / "own.json").write_text('{"filter": "mahony", "params": {"kp": 0.15}}', "utf-8")
    read = ParameterFile.read(tmp_path / "own.json")
    assert (read.params, read.guard) == (lh.Mahony(kp=0.15), None)
    rec = lh.simulate.recording("MPU-6050", "hand", duration=2)
    live = lh.Stream(read.params)
    last = [live.update(gyr, acc, dt=0.01) for gyr, acc in zip(rec.gyr, rec.acc, strict=True)][-1]
    np.testing.assert_allclose(np.linalg.norm(np.asarray(last)), 1.0)


def test_of_a_sweep_the_minimum_counts(tmp_path):
    sweep = lh.sweep(lh.simulate.lesson(42)[:300], lh.Complementary(tau_heading=5.0), "tau", [0.3, 1.0])
    (tmp_path / "sweep.json").write_text(json.dumps(sweep.to_dict()), "utf-8")
    assert ParameterFile.read(tmp_path / "sweep.json").params == lh.Complementary(tau=sweep.minimum, tau_heading=5.0)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[1]", "is not a file of parameters"),
        ("no", "is not a file of parameters"),
        ("{}", "has no parameters"),
        ('{"params": {}}', "does not name the filter"),
        ('{"filter": "Kalman", "params": {}}', "holds parameters of Kalman, not of Mahony"),
        ('{"filter": "Mahny", "params": {}}', "did you mean 'Mahony'"),
        ('{"filter": "Mahony", "params": {"kp": -1}}', "kp = -1 is not allowed"),
        ('{"filter": "Mahony", "params": {"k": 1}}', "has no parameter 'k'"),
        ('{"filter": "Mahony", "params": {}, "guard": 3}', "it must hold thresholds by name"),
        ('{"format": "levelhead noise 1", "filter": "Mahony", "params": {}}', "this version reads"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, text, sentence):
    (tmp_path / "file.json").write_text(text, "utf-8")
    with pytest.raises(LevelheadError, match=sentence):
        ParameterFile.read(tmp_path / "file.json", None if "does not name" in sentence else filters.find("Mahony"))
