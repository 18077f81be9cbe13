"""``levelhead calibrate`` and the commands that take its file."""

import pytest

from levelhead import simulate
from levelhead.sources.csv_writer import write_csv

pytest.importorskip("scipy")


@pytest.fixture(scope="module")
def poses(tmp_path_factory):
    path = tmp_path_factory.mktemp("poses") / "sensor.csv"
    write_csv(simulate.observe(simulate.poses(12, 4, rate=25.0), simulate.imu("MPU-6050"), 4), path)
    return path


def test_the_first_thing_a_user_types(levelhead, poses, tmp_path):
    said = levelhead("calibrate", poses, "-o", tmp_path)
    assert said.code == 0, said.err
    assert "better than no calibration by" in said.out
    assert "accelerometer scale x" in said.out
    assert {path.name for path in tmp_path.iterdir()} == {"sensor-calibration.json", "sensor-poses.png"}


@pytest.mark.slow
def test_its_file_goes_on(levelhead, poses, tmp_path):
    said = levelhead("calibrate", poses, "--json", "--no-plot", "-o", tmp_path).json
    assert said["poses"] == 12
    assert said["turns"] == 11
    assert said["residuals"]["accelerometer"]["ratio"] > 3.0
    file, out = tmp_path / "sensor-calibration.json", tmp_path / "out"
    assert levelhead("fuse", poses, "--prior", file, "-o", out, "--no-plot").code == 0
    assert levelhead("export", "Mahony", "--calibration", file, "-o", out).code == 0
    assert levelhead("export", "ESKF", "--prior", file, "-o", out).code == 0
    assert any("accelerometer scale" in path.read_text("utf-8") for path in out.rglob("*mahony*.h"))


def test_a_log_that_is_never_still_is_refused(levelhead, tmp_path):
    write_csv(simulate.recording("MPU-6050", "hand", 40.0, 50.0)[500:], tmp_path / "hand.csv")
    said = levelhead("calibrate", tmp_path / "hand.csv", "-o", tmp_path / "out")
    assert (said.code, said.out) == (2, "")
    assert "never still in 30 s" in said.err
    assert not (tmp_path / "out").exists()


def test_without_a_log(levelhead):
    assert levelhead("calibrate").code == 2
