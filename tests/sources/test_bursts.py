"""Samples that came in bursts, stamped as they arrived, are spread evenly; a logger that pauses is left alone."""

import numpy as np
import pytest

import levelhead as lh
from levelhead import simulate
from levelhead.evaluate import evaluate
from levelhead.recording import Recording
from levelhead.sources.interpret.clock_repair import first_of_bursts


def write(path, t, recording):
    names = "time (s),gx (rad/s),gy (rad/s),gz (rad/s),ax (m/s^2),ay (m/s^2),az (m/s^2)"
    rows = np.column_stack([t, recording.gyr, recording.acc])
    np.savetxt(path, rows, delimiter=",", header=names, comments="", fmt="%.6f")
    return path


@pytest.mark.parametrize("digits", [6, 3])
def test_a_log_of_bursts_gives_the_angles_of_the_even_log(tmp_path, digits):
    sound = simulate.recording("BMI160", "hand", 60.0, seed=1)
    late = simulate.apply_fault(sound, simulate.parse_fault("bursts=100@0+60")).recording
    recording = lh.read(write(tmp_path / "log.csv", np.round(late.t, digits), sound))
    assert any("in bursts" in note or "bursts of about 10" in note for note in recording.meta["notes"])
    np.testing.assert_allclose(np.diff(recording.t), 0.01, rtol=0.02)
    spread = Recording(recording.t, sound.gyr, sound.acc, truth=sound.truth)
    of = {name: evaluate(rec, lh.fuse(rec)).tilt for name, rec in (("even", sound), ("spread", spread), ("late", late))}
    print(" ".join(f"{name} {tilt:.2f}°" for name, tilt in of.items()))
    assert of["spread"] < 1.1 * of["even"]
    assert of["late"] > 3.0 * of["even"]


def test_what_comes_in_no_bursts_is_left_alone():
    random = np.random.default_rng(1)
    even = np.arange(3000) * 0.01
    assert first_of_bursts(even) is None
    assert first_of_bursts(even + random.uniform(0.0, 0.009, 3000)) is None  # jitter
    assert first_of_bursts(np.sort(random.choice(even, 1500, replace=False))) is None  # samples lost
    assert first_of_bursts(np.concatenate([even[:100] + 60.0 * k for k in range(20)])) is None  # 1 s of each minute
    assert first_of_bursts(np.array([0.0])) is None
