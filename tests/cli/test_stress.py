"""``levelhead stress``: what is printed, drawn and refused."""

from dataclasses import replace

import pytest

from levelhead import simulate
from levelhead.sources.formats.csv_writer import write_csv


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("stress") / "hand.csv"
    write_csv(simulate.recording("BMI160", "hand", 40, seed=2), path)
    return path


@pytest.mark.slow
def test_a_log_under_two_faults_with_a_peer(levelhead, log, tmp_path):
    words = ("stress", log, "--fault", "gyr_stuck@20+5", "--fault", "dropped=30", "-f", "default", "-f", "Mahony")
    said = levelhead(*words, "-o", tmp_path)
    assert said.code == 0
    assert "gyr_stuck=1@20+5" in said.out and "dropped=30@16+10" in said.out and "ESKF is right again" in said.out
    assert {path.name for path in tmp_path.iterdir()} == {"stress.png"}
    found = levelhead(*words, "--json").json
    assert [(one["fault"], one["method"]) for one in found["responses"]] == [
        ("gyr_stuck", "ESKF"), ("gyr_stuck", "Mahony"), ("dropped", "ESKF"), ("dropped", "Mahony"),
    ]  # fmt: skip
    stuck, dropped = found["responses"][0], found["responses"][2]
    assert stuck["start_s"] == 20.0 and stuck["length_s"] == 5.0 and "gyr_stuck" in stuck["said"]
    assert stuck["tilt_deg"] > stuck["tilt_without_deg"]
    assert "gaps" in dropped["doctor"] or "jitter" in dropped["doctor"]


@pytest.mark.slow
def test_without_a_magnetometer_or_truth_the_output_says_so(levelhead, log, tmp_path):
    said = levelhead("stress", log, "-f", "Complementary")
    assert said.code == 0
    assert "There is no magnetometer in the log" in said.out and "mag_late" not in said.out
    blind = tmp_path / "blind.csv"
    write_csv(replace(simulate.recording("BMI160", "hand", 40, seed=2), truth=None), blind)
    said = levelhead("stress", blind, "--fault", "shock", "-f", "Complementary")
    assert "There is no truth: errors are differences from the same filter's run without the fault" in said.out


@pytest.mark.slow
def test_what_tune_has_found_is_what_is_broken(levelhead, log, tmp_path):
    """A filter's file is a method of its own, before those that are named; a guard stands in front of all of ours."""
    tuned = tmp_path / "tuned.json"
    tuned.write_text('{"filter": "Mahony", "params": {"kp": 2.5}}', "utf-8")
    words = ("stress", log, "--fault", "shock", "--params", tuned, "-f", "default")
    found = levelhead(*words, "--json").json
    assert [one["method"] for one in found["responses"]] == ["Mahony(kp=2.5)", "ESKF"]
    assert found["finding"].startswith("Mahony(kp=2.5) is right again")
    assert "Guard off" in levelhead(*words, "--guard", "off").out


def test_the_list_names_every_fault(levelhead):
    said = levelhead("stress", "--list")
    assert said.code == 0
    assert all(kind.name in said.out for kind in simulate.fault.KINDS)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((), "give either a log or --simulate"),
        (("--simulate", "hamd"), "did you mean 'hand'?"),
        (("--simulate", "hand", "--calibration", "LOG"), "--calibration is for a log"),
        (("LOG", "--calibration", "LOG"), "is not a calibration"),
        (("LOG", "--fault", "acc_spike"), "did you mean 'acc_spikes'?"),
        (("LOG", "--fault", "shock@50"), "starts at 50 s, but the recording ends at 39.99 s"),
        (("LOG", "--fault", "mag_late"), "the recording has none"),
        (("LOG", "--fault", "dropped=300"), "expected 0 to 100 %"),
        (("LOG", "-f", "Kalmann"), "Kalman"),
        (("SHORT",), "a fault needs 20 s"),
    ],
)
def test_bad_input(levelhead, log, tmp_path, words, sentence):
    short = tmp_path / "short.csv"
    write_csv(simulate.recording("BMI160", "hand", 10), short)
    known = {"LOG": log, "SHORT": short}
    out = tmp_path / "out"
    said = levelhead("stress", *(known.get(word, word) for word in words), "-o", out)
    assert said.code == 2 and sentence in said.err
    assert said.err.count("\n") == 2 and not out.exists()
