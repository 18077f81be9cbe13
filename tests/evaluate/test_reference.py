"""The truth from another system's file: its clock, frames and mounting are found, and errors are those of the truth."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.cli import main
from levelhead.errors import LevelheadError
from levelhead.evaluate.reference import with_reference
from levelhead.evaluate.score import evaluate
from levelhead.rotations import interpolate
from levelhead.sources.formats.npz import write_npz

RATE, LATE = 120.0, 3.21


@pytest.fixture(scope="module")
def recording():
    return lh.simulate.recording("ICM-20948", "hand", duration=40.0, rate=100.0, seed=4, mag=None)


@pytest.fixture(scope="module")
def moved(recording):
    """The true orientation as motion capture has it: another clock, rate, heading and mounting."""
    t = np.arange(0.0, 39.0, 1.0 / RATE)
    true = interpolate(t, recording.t, recording.truth.quat)
    turned = (
        Rotation.from_euler("z", 70.0, degrees=True)
        * Rotation.from_quat(true, scalar_first=True)
        * Rotation.from_euler("xyz", [100.0, 20.0, 5.0], degrees=True)
    )
    return lh.Track(t + LATE, turned.as_quat(scalar_first=True), relative=False)


def test_errors_are_those_against_the_truth_itself(recording, moved):
    bare = replace(recording, truth=None)
    whole, found = with_reference(bare, moved)
    assert found.shift == pytest.approx(LATE, abs=0.005)
    assert not whole.truth.north
    known = np.isfinite(whole.truth.quat).all(axis=1)
    assert 0.95 < known.mean() < 0.99  # the reference ends a second before
    for params in (lh.ESKF(), lh.Madgwick()):
        track = lh.fuse(bare, params)
        own, expected = evaluate(whole, track), evaluate(recording, track)
        assert own.tilt == pytest.approx(expected.tilt, rel=0.3)  # but for a constant one, which is the mounting


def test_another_motion_is_refused(moved):
    other = lh.simulate.recording("ICM-20948", "walking", duration=40.0, rate=100.0, seed=9, mag=None)
    with pytest.raises(LevelheadError, match="best alignment; expected an orientation of the same body"):
        with_reference(replace(other, truth=None), moved)


def test_compare_takes_a_truth_by_file_and_column(recording, moved, tmp_path, capsys):
    log, other = tmp_path / "imu.npz", tmp_path / "mocap.csv"
    bare = replace(recording, truth=None)
    write_npz(bare, log)
    rows = np.column_stack([moved.t, moved.quat])
    np.savetxt(other, rows, delimiter=",", header="t,qw,qx,qy,qz", comments="")
    assert main(["compare", str(log), "-f", "ESKF", "--truth", f"{other}:q"]) == 0
    printed = capsys.readouterr().out
    assert "Truth of " in printed and "3.21" in printed
    assert main(["compare", str(log), "--truth", str(other)]) == 2
    assert "expected FILE:COLUMN, such as mocap.csv:q" in capsys.readouterr().err
