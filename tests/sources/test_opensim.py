"""OpenSim's storage files, read by hand-made files and by what is written."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead.publish.joint_files import write_joint
from levelhead.publish.opensim import write_sto

DATA = Path(os.environ.get("LEVELHEAD_DATA", Path(__file__).parents[3] / "shared" / "data")) / "joints"
STO = """DataRate=10.000000
DataType=Quaternion
version=3
OpenSimVersion=4.4
endheader
time	femur_r_imu	tibia_r_imu
0	1,0,0,0	0.6,0.8,0,0
0.1	0,1,0,0	0.8,0,-0.6,0
"""
MOT = "Coordinates\nversion=1\nnRows=2\nnColumns=2\ninDegrees={}\nendheader\ntime\tknee_angle_r\n0.5\t1\n0.6\t2\n"


def test_each_sensor_of_a_file_of_orientations_is_a_track(tmp_path):
    (tmp_path / "a.sto").write_text(STO)
    tracks = lh.read_sto(tmp_path / "a.sto")
    assert list(tracks) == ["femur_r_imu", "tibia_r_imu"]
    np.testing.assert_array_equal(tracks["tibia_r_imu"].t, [0.0, 0.1])
    np.testing.assert_allclose(tracks["tibia_r_imu"].quat, [[0.6, 0.8, 0.0, 0.0], [0.8, 0.0, -0.6, 0.0]])


def test_what_is_written_is_read_back(tmp_path):
    track = lh.fuse(lh.simulate.recording("MPU-6050", "hand", duration=6))
    write_sto(track, tmp_path / "b.sto")
    back = lh.read_sto(tmp_path / "b.sto")["imu"]
    np.testing.assert_array_equal(back.t, track.t)
    np.testing.assert_allclose(back.quat, track.quat, atol=1e-12)


@pytest.mark.parametrize(("unit", "factor"), [("yes", 1.0), ("no", 180.0 / np.pi)])
def test_angles_of_a_motion_file_are_in_degrees(tmp_path, unit, factor):
    (tmp_path / "c.mot").write_text(MOT.format(unit))
    t, angles = lh.read_mot(tmp_path / "c.mot")
    np.testing.assert_array_equal(t, [0.5, 0.6])
    np.testing.assert_allclose(angles["knee_angle_r"], [factor, 2.0 * factor])


def test_a_joint_that_is_written_as_motion_is_read_back(tmp_path):
    t = np.arange(100) * 0.1
    joint = lh.Joint(t, 30.0 * np.sin(t), np.ones(100), fit=None)
    write_joint(joint, tmp_path / "d.mot")
    np.testing.assert_allclose(lh.read_mot(tmp_path / "d.mot")[1]["joint_angle"], joint.angle, atol=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("endheader", "", "not a storage file of OpenSim"),
        ("Quaternion", "double", "holds double; expected DataType=Quaternion"),
        ("0.6,0.8,0,0", "0.6,0.8,0", "tibia_r_imu is '0.6,0.8,0' at 0 s; expected w,x,y,z"),
        ("0.6,0.8,0,0", "0.6,0.8,0,9", "length 9.06 at 0 s"),
        ("0.6,0.8,0,0", "nan,0,0,0", "no finite number in row 1"),
        ("0.6,0.8,0,0", "a,b,c,d", "a cell of tibia_r_imu is not a number"),
        ("0.1\t", "0\t", "the time steps back in row 2"),
        ("\t0.8,0,-0.6,0", "", "has 2 cells in row 2; expected 3"),
    ],
)
def test_a_bad_file_is_one_sentence(tmp_path, old, new, words):
    (tmp_path / "e.sto").write_text(STO.replace(old, new))
    with pytest.raises(lh.LevelheadError, match=words):
        lh.read_sto(tmp_path / "e.sto")


def test_a_missing_file_and_a_missing_sensor_are_named_on_the_command_line(tmp_path):
    (tmp_path / "f.sto").write_text(STO)
    for first, words in (
        ("g.sto:femur_r_imu", "cannot read"),
        ("f.sto:femur", "no sensor femur"),
        ("f.sto", "name one"),
    ):
        command = [sys.executable, "-m", "levelhead", "joint", first, "f.sto:tibia_r_imu"]
        ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert ended.returncode == 2 and words in ended.stderr and len(ended.stderr.splitlines()) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["f.sto"]


@pytest.mark.skipif(not DATA.is_dir(), reason=f"no recordings in {DATA}; LEVELHEAD_DATA names their folder")
def test_a_real_file_has_fourteen_sensors():
    tracks = lh.read_sto(DATA / "MT_01200651-000-000_orientations.sto")
    assert len(tracks) == 14 and len(tracks["femur_r_imu"].t) == 2368
