"""``levelhead compare LOG --track NAME``: a vendor's own orientation in the table."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelhead import simulate


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log with truth, and with a vendor's orientation in NED, xyzw, 1° wrong in roll."""
    rec = simulate.recording("ICM-20948", "hand", duration=10.0)
    truth = Rotation.from_quat(rec.truth.quat, scalar_first=True)
    swap, flip = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]]), Rotation.from_matrix(np.diag([1, -1, -1]))
    vendor = (swap * Rotation.from_euler("x", 1.0, degrees=True) * truth * flip).as_quat()
    names = ["t", *(f"{s}_{axis}" for s in ("gyr", "acc", "mag") for axis in "xyz")]
    names += [*(f"truth_q{axis}" for axis in "wxyz"), *(f"ahrs_{i}" for i in range(4))]
    path = tmp_path_factory.mktemp("with") / "log.csv"
    rows = np.column_stack([rec.t, rec.gyr, rec.acc, rec.mag, rec.truth.quat, vendor])
    np.savetxt(path, rows, delimiter=",", header=",".join(names), comments="")
    return path


HINTS = ("--units", "gyr=rad/s", "--units", "acc=m/s²", "--units", "mag=µT", "--units", "t=s")


@pytest.mark.slow
def test_it_stands_in_the_table_and_in_the_picture(levelhead, log, tmp_path):
    said = levelhead("compare", log, *HINTS, "-f", "Complementary", "--track", "ahrs", "-o", tmp_path)
    assert (said.code, said.err) == (0, "")
    row = next(line for line in said.out.splitlines() if line.startswith("ahrs "))
    assert row.split()[1] == "1.000" and row.split()[-1] == "–"
    assert "ahrs: order xyzw, frames NED and forward-right-down; " in said.out
    assert (tmp_path / "compare.png").stat().st_size > 10_000


@pytest.mark.slow
def test_as_json_and_several_times(levelhead, log):
    words = ("compare", log, *HINTS, "-f", "Complementary", "--track", "ahrs", "--track", "truth_q")
    filters = levelhead(*words, "--json").json["filters"]
    assert [row["filter"] for row in filters] == ["Complementary", "ahrs", "truth_q"]
    assert filters[1]["score"]["total"] == pytest.approx(1.0, abs=1e-3)
    assert filters[1]["alignment"]["order"] == "xyzw" and filters[2]["score"]["total"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
def test_bad_words_are_refused(refused, log):
    start = ("compare", log, *HINTS, "-f", "Complementary", "--track")
    assert "did you mean 'ahrs'?" in refused(*start, "ahr")
    assert "such as --track ahrs_q" in refused(*start, " ")
    assert "given twice" in refused(*start, "ahrs", "--track", "ahrs")
    assert "a simulation has none" in refused("compare", "--simulate", "hand", "--track", "q")


def test_help_says_it(levelhead):
    assert "--track" in levelhead("compare", "--help").out


def test_a_log_without_truth_gets_its_table_and_a_line_instead_of_the_picture(levelhead, logs, tmp_path):
    said = levelhead("compare", logs / "plain.csv", "-f", "EKF", "-f", "Madgwick", "-o", tmp_path / "new")
    assert said.code == 0 and "Madgwick" in said.out and "no picture: the four panels need" in said.out
    assert not (tmp_path / "new").exists()


@pytest.mark.slow
def test_one_angle_of_a_board(levelhead, refused, log, tmp_path):
    names, *rows = log.read_text().splitlines()
    values = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    truth = Rotation.from_quat(values[:, 10:14], scalar_first=True)
    roll = np.degrees(np.unwrap(truth.as_euler("ZYX")[:, 2])) + 2.0
    path = tmp_path / "axis.csv"
    np.savetxt(path, np.column_stack([values, (roll + 180.0) % 360.0 - 180.0]), "%.9g", ",",
               header=f"{names},board_roll", comments="")  # fmt: skip
    words = ("compare", path, *HINTS, "-f", "Complementary", "--track")
    score = levelhead(*words, "column:board_roll", "--json").json["filters"][1]["score"]
    assert score["total"] == pytest.approx(2.0, abs=1e-3)
    assert "did you mean 'board_roll'?" in refused(*words, "column:bord_roll")
    assert "must have roll, pitch or yaw in its name" in refused(*words, "column:gyr_x")
