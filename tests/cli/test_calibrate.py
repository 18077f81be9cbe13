"""``levelhead calibrate`` and the commands that take its file."""

import os
import signal
import subprocess
import sys

import pytest

from levelhead import simulate
from levelhead.calibration import Calibration
from levelhead.sources.formats.csv_writer import write_csv

pytest.importorskip("scipy")


@pytest.fixture(scope="module")
def poses(tmp_path_factory):
    path = tmp_path_factory.mktemp("poses") / "sensor.csv"
    write_csv(simulate.observe(simulate.poses(12, 4, rate=25.0), simulate.imu("MPU-6050"), 4), path)
    return path


@pytest.mark.slow
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
    plain = ("fuse", poses, "-f", "Mahony", "--no-plot", "--json", "-o", out)
    corrected = levelhead(*plain, "--calibration", file).json["score"]
    assert levelhead(*plain, "--prior", file).json["score"] == corrected  # Mahony learns nothing
    assert corrected["tilt"] < 0.5 * levelhead(*plain).json["score"]["tilt"]
    assert levelhead(*plain, "--prior", file, "--calibration", file).code == 2
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


@pytest.mark.slow
def test_live_with_a_replay_says_what_to_do_and_ends_like_a_log(levelhead, poses, tmp_path):
    said = levelhead("calibrate", "--live", "-s", f"replay:{poses}", "--speed", "inf", "--json", "-o", tmp_path)
    assert said.code == 0, said.err
    assert "put it down" in said.err
    assert {path.name for path in tmp_path.iterdir()} == {"sensor-calibration.json", "sensor-poses.png"}
    log = levelhead("calibrate", poses, "--json", "--no-plot", "-o", tmp_path / "log").json
    assert {**said.json, "written": None} == {**log, "written": None}


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "calibrate needs a log"),
        (["--live"], "needs a source"),
        (["--live", "-s", "emulated:mpu6050", "a.csv"], "either logs or --live"),
        (["a.csv", "--poses", "9"], "are for calibrate --live"),
        (["--live", "-s", "emulated:mpu6050", "--poses", "3"], "expected 6 or more"),
        (["--live", "-s", "nothing:at-all"], "there is no source 'nothing:at-all'"),
    ],
)
def test_live_or_logs(refused, tmp_path, words, sentence):
    assert sentence in refused("calibrate", *words, "-o", tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_replay_without_poses_is_refused(levelhead, tmp_path):
    write_csv(simulate.recording("MPU-6050", "hand", 40.0, 50.0)[500:], tmp_path / "hand.csv")
    said = levelhead(
        "calibrate", "--live", "-s", f"replay:{tmp_path / 'hand.csv'}", "--speed", "inf", "-o", tmp_path / "out"
    )
    assert said.code == 2
    assert "never still in 30 s" in said.err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="needs signals")
def test_ctrl_c_leaves_nothing_behind(tmp_path):
    code = (
        "import signal, sys; from levelhead import cli\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"sys.exit(cli.main(['calibrate', '--live', '-s', 'emulated:mpu6050', '-o', {str(tmp_path / 'out')!r}]))"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == b"waiting for the sensor\n"
        assert b"hold still" in process.stderr.readline()
        process.send_signal(signal.SIGINT)
        out, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert out == b"" and b"Traceback" not in said
    assert not (tmp_path / "out").exists()


def test_a_magnetometer_needs_no_poses(levelhead, tmp_path):
    write_csv(simulate.recording("ICM-20948", "hand", 30.0, rate=50.0, seed=1), tmp_path / "raw.csv")
    done = levelhead("calibrate", tmp_path / "raw.csv", "--magnetometer", "-o", tmp_path)
    assert done.code == 0, done.err
    assert "magnetometer: offset" in done.out
    assert "better than no calibration by" in done.out
    assert (tmp_path / "raw-magnetometer.png").stat().st_size > 20_000
    known = Calibration.read(tmp_path / "raw-calibration.json")
    assert known.mag_offset.known.all()
    assert not known.gyr_bias.known.any()
    said = levelhead("calibrate", tmp_path / "raw.csv", "--magnetometer", "--no-plot", "--json", "-o", tmp_path).json
    assert said["coverage"] > 0.1
    assert levelhead("export", "Mahony", "--calibration", tmp_path / "raw-calibration.json", "-o", tmp_path).code == 0
    done = levelhead("calibrate", "--live", "--source", "emulated:mpu6050", "--magnetometer")
    assert done.code == 2
    assert "leave --live out" in done.err


def test_a_filter_gets_its_magnetometer_without_iron(levelhead, tmp_path):
    """Mahony on 432 % of iron: by a first pass, by the file, and beside the same log without a magnetometer."""
    log = tmp_path / "raw.csv"
    write_csv(simulate.recording("ICM-20948", "hand", 30.0, rate=50.0, seed=1), log)
    assert levelhead("calibrate", log, "--magnetometer", "--no-plot", "-o", tmp_path).code == 0
    plain = ("fuse", log, "-f", "Mahony", "--no-plot", "-o", tmp_path, "--json")
    found = levelhead(*plain).json
    assert found["magnetometer"]
    assert any(note.startswith("raw magnetometer: offset") for note in found["notes"])
    given = levelhead(*plain, "--calibration", tmp_path / "raw-calibration.json").json
    assert given["score"]["heading"] == pytest.approx(found["score"]["heading"], abs=0.01)
    assert found["score"]["total"] < 3.0
    assert levelhead(*plain, "--map", "mag=").json["magnetometer"] is False
