"""``levelhead noise`` and the commands that take its file."""

import dataclasses
import json
import re

import numpy as np
import pytest

from levelhead import simulate
from levelhead.sources.formats.csv_writer import write_csv

pytest.importorskip("scipy")


@pytest.fixture(scope="module")
def still(tmp_path_factory):
    path = tmp_path_factory.mktemp("still") / "still.csv"
    write_csv(simulate.recording("LSM6DSO32", "still", 90.0, 50.0, seed=1), path)
    return path


@pytest.mark.slow
def test_the_first_thing_a_user_types(levelhead, still, tmp_path):
    said = levelhead("noise", still, "-o", tmp_path, "--chip", "lsm6dso32")
    assert said.code == 0, said.err
    assert "as in the LSM6DSO32's sheet (0.0038)" in said.out
    assert re.search(
        r"accelerometer: bias instability does not show in 90 s: below \d+ µg \(95 %\); .* at rest", said.out
    )
    assert {path.name for path in tmp_path.iterdir()} == {"still-noise.json", "still-noise.png"}


@pytest.mark.slow
def test_json_is_json_and_the_file_is_taken(levelhead, still, tmp_path):
    said = levelhead("noise", still, "-o", tmp_path, "--no-plot", "--json").json
    assert said["duration_s"] > 85.0
    assert len(said["allan"]["gyr"]["x"]["tau_s"]) > 20
    assert said["verdict"]
    noise, made = tmp_path / "still-noise.json", tmp_path / "made.npz"
    assert levelhead("simulate", "still", "--noise", noise, "--duration", 60, "-o", made).code == 0
    again = levelhead("noise", made, "-o", tmp_path, "--no-plot", "--json").json
    first, second = (one["gyr"]["white_noise_density"]["value"] for one in (said, again))
    assert first == pytest.approx(second, rel=0.1)
    fused = levelhead("fuse", made, "-f", "Kalman", "--noise", noise, "-o", tmp_path, "--no-plot", "--json").json
    density = json.loads(noise.read_text("utf-8"))["gyr"]["white_noise_density"]["value"]
    mean = sum(n * n for n in density) / 3.0 * (180.0 / 3.141592653589793) ** 2
    assert fused["params"]["q_angle"] == pytest.approx(mean)
    exported = levelhead("export", "Kalman", "--noise", noise, "--set", "q_bias=0.5", "-o", tmp_path, "--json").json
    assert exported["params"]["q_angle"] == pytest.approx(mean)
    assert exported["params"]["q_bias"] == 0.5


def test_kalibr_and_openvins_read_its_yaml(levelhead, still, tmp_path):
    """As their loaders do: flat keys, all above 0, for Kalibr; the same under imu0 beside intrinsics for OpenVINS."""
    yaml = pytest.importorskip("yaml")
    said = levelhead("noise", still, "-o", tmp_path, "--no-plot", "--kalibr", "--json").json
    text = (tmp_path / "still-imu.yaml").read_text("utf-8")
    assert text.startswith("%YAML 1.0\n---\n")  # OpenCV's reader needs the directive
    flat = yaml.safe_load(text)
    density = said["gyr"]["white_noise_density"]["value"]
    assert flat["gyroscope_noise_density"] == pytest.approx((sum(n * n for n in density) / 3.0) ** 0.5, rel=1e-5)
    for sensor in ("accelerometer", "gyroscope"):
        assert flat[f"{sensor}_noise_density"] > flat[f"{sensor}_random_walk"] > 0.0
    assert flat["update_rate"] == pytest.approx(50.0, abs=0.01)
    chain = flat.pop("imu0")
    assert flat.items() <= chain.items()
    assert chain["T_i_b"][3] == [0.0, 0.0, 0.0, 1.0]
    assert {"Tw", "R_IMUtoGYRO", "Ta", "R_IMUtoACC", "Tg", "model", "time_offset"} <= chain.keys()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--tau", "3600"), "needs 10800 s at rest"),
        (("--tau", "-1"), "more than 0 s"),
        (("--chip", "MPU-6500"), "did you mean 'MPU-6050'"),
    ],
)
def test_bad_wishes_are_refused(levelhead, still, tmp_path, words, sentence):
    said = levelhead("noise", still, "-o", tmp_path, *words)
    assert (said.code, said.out) == (2, "")
    assert sentence in said.err
    assert not list(tmp_path.iterdir())


def test_a_log_that_moves_is_refused(levelhead, tmp_path):
    write_csv(simulate.recording("LSM6DSO32", "hand", 60.0, 50.0), tmp_path / "hand.csv")
    said = levelhead("noise", tmp_path / "hand.csv", "-o", tmp_path)
    assert said.code == 2
    assert "put it on a table" in said.err
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("{}", "is not a noise file"),
        ('{"format": "levelhead noise 9"}', "has the format 'levelhead noise 9'; this version reads"),
        ("no", "is not a noise file"),
        ('{"format": "levelhead noise 1", "gyr": {"unit": "deg/s"}}', "gyr is not whole"),
    ],
)
def test_a_wrong_noise_file_is_refused(levelhead, tmp_path, text, sentence):
    (tmp_path / "noise.json").write_text(text, "utf-8")
    said = levelhead("simulate", "still", "--noise", tmp_path / "noise.json", "-o", tmp_path / "made.npz")
    assert said.code == 2
    assert sentence in said.err
    assert not (tmp_path / "made.npz").exists()


@pytest.mark.slow
def test_a_filter_without_noise_is_refused(levelhead, still, tmp_path):
    levelhead("noise", still, "-o", tmp_path, "--no-plot")
    said = levelhead("fuse", still, "-f", "Mahony", "--noise", tmp_path / "still-noise.json", "-o", tmp_path / "out")
    assert said.code == 2
    assert "Mahony has no noise to set" in said.err


@pytest.mark.slow
def test_a_temperature_model_goes_on_to_fuse(levelhead, tmp_path):
    """A sensor that warms up: --temperature makes a calibration, and fuse corrects the log with it."""
    recording = simulate.recording("LSM6DSO32", "still", duration=120.0, rate=20.0, seed=1)
    warm = 25.0 + 15.0 * recording.t / 120.0
    gyr = recording.gyr + np.outer(warm - 30.0, [0.002, 0.0, 0.0])
    write_csv(dataclasses.replace(recording, gyr=gyr, temperature=warm), tmp_path / "warm.csv")
    file, log = tmp_path / "warm.json", tmp_path / "warm.csv"
    assert levelhead("noise", log, "--temperature", file, "--no-plot", "-o", tmp_path).code == 0
    plain = ("fuse", log, "-f", "GyroIntegration", "--no-plot", "--json", "-o", tmp_path)
    raw = levelhead(*plain).json["score"]["total"]
    assert levelhead(*plain, "--calibration", file).json["score"]["total"] < 0.1 * raw
    assert levelhead("noise", log, "--temperature", log, "--no-plot", "-o", tmp_path).code == 2  # no calibration
