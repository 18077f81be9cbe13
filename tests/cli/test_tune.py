"""``levelhead tune`` and the commands that take its file."""

import json

import pytest

from levelhead import simulate
from levelhead.sources.formats.csv_writer import write_csv

pytest.importorskip("scipy")


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "hand.csv"
    write_csv(simulate.recording("LSM6DSO32", "hand", 60.0, 50.0, seed=1, mag="HMC5883L"), path)
    return path


@pytest.mark.slow
def test_the_first_thing_a_user_types(levelhead, log, tmp_path):
    said = levelhead("tune", log, "--filter", "Mahony", "-p", "kp", "--set", "kp=3", "-o", tmp_path)
    assert said.code == 0, said.err
    assert said.out.startswith("Take Mahony with kp=")
    assert "left out: quarter 4" in said.out
    assert {path.name for path in tmp_path.iterdir()} == {"tuned.json", "tuned.png"}


@pytest.mark.slow
def test_the_file_is_taken_by_the_others(levelhead, log, tmp_path):
    words = ("-p", "kp=0.01:5", "--set", "kp=3", "--runs", 40, "--no-plot", "--json")
    said = levelhead("tune", log, "-f", "Mahony", *words, "-o", tmp_path).json
    tuned = tmp_path / "tuned.json"
    assert said["worth"] and said["params"]["kp"] == said["found"]["kp"] != 3.0
    assert said["written"] == [str(tuned)]
    assert json.loads(tuned.read_text("utf-8"))["params"] == said["params"]
    fused = levelhead("fuse", log, "--params", tuned, "-o", tmp_path, "--no-plot", "--json").json
    assert fused["params"] == said["params"]
    changed = levelhead("fuse", log, "--params", tuned, "--set", "ki=0.01", "-o", tmp_path, "--no-plot", "--json").json
    assert changed["params"] == said["params"] | {"ki": 0.01}
    exported = levelhead("export", "Mahony", "--params", tuned, "-o", tmp_path / "c", "--json").json
    assert exported["params"] == said["params"]
    words = ("--calibrate", 0, "--speed", "inf", "--no-realtime", "--json")
    box = tmp_path / "run.mcap"
    pytest.importorskip("mcap")
    assert levelhead("run", "--source", f"replay:{log}", "--params", tuned, *words, "--box", box).code == 0
    again = levelhead("fuse", box, "-o", tmp_path, "--no-plot", "--json").json
    assert again["params"]["kp"] == said["params"]["kp"]


@pytest.mark.slow
def test_the_files_go_from_hand_to_hand(levelhead, tmp_path, monkeypatch):
    """The five lines of README for one specimen of a sensor, as docs/howto/tuning.md has them, calibration included."""
    monkeypatch.chdir(tmp_path)
    specimen = ("--sensor", "ICM-20948", "--seed", 5, "--rate", 50)
    known = ("--calibration", "poses-calibration.json")
    for words in (
        ("simulate", "still", *specimen, "-o", "still.csv"),
        ("simulate", "poses", *specimen, "-o", "poses.csv"),
        ("simulate", "hand", *specimen, "-o", "motion.csv"),
        ("noise", "still.csv", "--no-plot"),
        ("calibrate", "poses.csv", "--no-plot"),
        ("tune", "motion.csv", "-f", "EKF", "--noise", "still-noise.json", *known, "--runs", 20, "--no-plot"),
        ("stress", "motion.csv", "--params", "tuned.json", *known, "-f", "default", "--fault", "mag_passing"),
        ("export", "EKF", "--params", "tuned.json", *known, "--float", "--arduino", "-o", "board"),
    ):
        said = levelhead(*words)
        assert said.code == 0, (words, said.err)
    assert (tmp_path / "board" / "lh_ekf" / "src" / "lh_ekf.c").exists()
    raw, whole = (
        levelhead("compare", "motion.csv", "-f", "EKF", *more, "--json").json["filters"][0]["score"]
        for more in ((), (*known, "--params", "tuned.json"))
    )
    assert whole["tilt"] < 0.8 * raw["tilt"]
    assert whole["heading"] < 0.8 * raw["heading"]  # an offset of three fields; raw, its magnetometer is left out


def test_the_filter_in_the_file_must_be_the_one_named(refused, log, tmp_path):
    (tmp_path / "own.json").write_text('{"filter": "Mahony", "params": {"kp": 0.2}}', "utf-8")
    for verb in ("fuse", "tune"):
        line = refused(verb, log, "-f", "Kalman", "--params", tmp_path / "own.json", "-o", tmp_path)
        assert "holds parameters of Mahony, not of Kalman" in line
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((), "needs the filter"),
        (("-f", "Mahoni"), "did you mean 'Mahony'"),
        (("-f", "Mahony", "-p", "tau"), "has no parameter 'tau'"),
        (("-f", "AccelTilt"), "no parameter to tune"),
        (("-f", "Mahony", "-p", "kp=5:1"), "not a range to search"),
        (("-f", "Mahony", "--runs", "1"), "not a search"),
        (("-f", "Mahony", "--params", "nowhere.json"), "nowhere.json"),
    ],
)
def test_bad_wishes_are_refused(refused, log, tmp_path, words, sentence):
    assert sentence in refused("tune", log, *words, "-o", tmp_path)
    assert not list(tmp_path.iterdir())


def test_logs_that_cannot_serve_are_refused(refused, tmp_path):
    out = tmp_path / "out"
    write_csv(simulate.recording("LSM6DSO32", "still", 60.0, 50.0), tmp_path / "still.csv")
    assert "still.csv" in refused("tune", tmp_path / "still.csv", "-f", "Mahony", "-o", out)
    write_csv(simulate.recording("LSM6DSO32", "hand", 5.0, 50.0), tmp_path / "short.csv")
    assert "too short to tune on" in refused("tune", tmp_path / "short.csv", "-f", "Mahony", "-o", out)
    assert "LOGS requires an argument" in refused("tune", "-f", "Mahony", "-o", out)
    assert not out.exists()
