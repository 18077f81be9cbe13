"""Quaternion columns of a log as a Track, on the clock of its recording."""

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from levelhead import read, simulate
from levelhead.errors import LevelheadError
from levelhead.sources import orientation
from levelhead.sources.formats import npz
from levelhead.sources.interpret.roles import quaternions

SENSORS = ["t", "gyr_x", "gyr_y", "gyr_z", "acc_x", "acc_y", "acc_z"]


@pytest.mark.parametrize(
    ("names", "shared", "order"),
    [
        ("q0 q1 q2 q3", "q", "0123"),
        ("q1 q2 q3 q4", "q", "0123"),
        ("qw qx qy qz", "q", "0123"),
        ("qx qy qz qw", "q", "3012"),
        ("quat_w quat_x quat_y quat_z", "quat", "0123"),
        ("ahrs_qw ahrs_qx ahrs_qy ahrs_qz", "ahrs_q", "0123"),
        ("Quat_q0 Quat_q1 Quat_q2 Quat_q3", "Quat_q", "0123"),
        ("pose.orientation.x pose.orientation.y pose.orientation.z pose.orientation.w", "pose.orientation", "3012"),
        ("est[0] est[1] est[2] est[3]", "est", "0123"),
    ],
)
def test_four_columns_are_known_by_what_they_share(names, shared, order):
    found = quaternions([*SENSORS, *names.split()])
    assert found == {shared: tuple(len(SENSORS) + int(i) for i in order)}


def test_sensors_are_no_quaternions():
    assert quaternions(SENSORS) == {}


@pytest.fixture(scope="module")
def made():
    return simulate.recording("BMI160", "hand", duration=2.0)


@pytest.fixture(scope="module")
def vendor(made):
    quat = Rotation.from_euler("x", np.linspace(0.0, 1.0, len(made.t))[:, None]).as_quat(scalar_first=True)
    quat[5] = 0.0
    return quat


@pytest.fixture
def log(made, vendor, tmp_path):
    path = tmp_path / "log.csv"
    head = "time_us," + ",".join(SENSORS[1:]) + ",ahrs_qw,ahrs_qx,ahrs_qy,ahrs_qz"
    stamps = 1.7e15 + 1e6 * made.t  # since 1970
    table = np.column_stack([stamps, made.gyr, made.acc, 16384 * vendor])
    np.savetxt(path, table, delimiter=",", header=head, comments="", fmt=["%.0f"] + ["%.9f"] * 10)
    return path


@pytest.mark.parametrize("name", ["ahrs_q", "AHRS q", "ahrs_qy", "ahrs_qw,ahrs_qx,ahrs_qy,ahrs_qz"])
def test_on_the_recordings_clock_and_of_unit_length(log, vendor, name):
    track = orientation(log, name)
    np.testing.assert_array_equal(track.t, read(log).t)
    assert np.isnan(track.quat[5]).all()
    rest = np.arange(len(vendor)) != 5
    np.testing.assert_allclose(track.quat[rest], vendor[rest], atol=1e-9)


def test_arrays(made, vendor, tmp_path):
    arrays = {"gyr": made.gyr, "acc": made.acc, "fs": 100.0, "vendor_out": vendor}
    savemat(tmp_path / "log.mat", arrays)
    np.savez(tmp_path / "log.npz", **arrays)
    for path in (tmp_path / "log.mat", tmp_path / "log.npz"):
        track = orientation(path, "vendor_out")
        np.testing.assert_array_equal(track.t, read(path).t)
        np.testing.assert_allclose(track.quat[6:], vendor[6:], atol=1e-15)


def test_levelheads_own_archive(made, tmp_path):
    npz.write_npz(made, tmp_path / "own.npz")
    track = orientation(tmp_path / "own.npz", "truth_quat")
    np.testing.assert_array_equal(track.t, made.t)
    np.testing.assert_allclose(track.quat, made.truth.quat, atol=1e-15)


def test_what_is_not_there_names_what_is(log, tmp_path):
    with pytest.raises(LevelheadError, match="has no quaternion 'ahrs'; did you mean 'ahrs_q'"):
        orientation(log, "ahrs")
    with pytest.raises(LevelheadError, match="names 2 columns; expected the four"):
        orientation(log, "ahrs_qw,ahrs_qx")
    plain = tmp_path / "plain.csv"
    plain.write_text(",".join(SENSORS) + "\n0,0,0,0,0,0,9.8\n1,0,0,0,0,0,9.8\n", encoding="utf-8")
    with pytest.raises(LevelheadError, match="has no quaternion 'q': no four columns"):
        orientation(plain, "q")


def test_what_is_no_quaternion_is_refused_with_its_line(log):
    lines = log.read_text(encoding="utf-8").splitlines()
    cells = lines[11].split(",")
    lines[11] = ",".join([*cells[:-1], "99999"])
    log.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(LevelheadError, match=r"line 12: ahrs_qw, .* have length .* elsewhere 1.638e\+04"):
        orientation(log, "ahrs_q")
    log.write_text("\n".join([lines[0], *(line.rsplit(",", 4)[0] + ",,,," for line in lines[1:])]), encoding="utf-8")
    with pytest.raises(LevelheadError, match="blank or zero on every line"):
        orientation(log, "ahrs_q")
