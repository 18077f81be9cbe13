"""``levelhead demo``, ``compare``, ``sweep`` and ``simulate``: tables for people, JSON for programs, pictures."""

from pathlib import Path

import numpy as np
import pytest

from levelhead import filters, simulate, sources
from levelhead.guard import Guard
from levelhead.recording import Recording, Truth
from levelhead.sources.formats import npz
from levelhead.units import GRAVITY


def is_png(path: Path) -> bool:
    return path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_demo(levelhead, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = levelhead("demo")
    assert (said.code, said.err) == (0, "")
    assert is_png(tmp_path / "demo-output" / "lesson.png")
    for words in ("AccelTilt", "GyroIntegration", "Complementary", "RollPitchKalman", "total [°]", "lesson.png"):
        assert words in said.out
    assert max(map(len, said.out.splitlines())) <= 160


@pytest.mark.compiled
def test_demo_full_as_json_is_json_alone(levelhead, tmp_path):
    said = levelhead("demo", "--full", "--json", "-o", tmp_path)
    assert (said.code, said.err) == (0, "")
    shown = said.json
    names = ["lesson.png", "sweep-alpha.png", "sweep-r_measure.png", "gain.png", "hard.png"]
    assert shown["written"] == [str(tmp_path / name) for name in names]
    assert all(is_png(tmp_path / name) for name in names)
    assert [words.partition(":")[0] for words in shown["findings"]] == [
        "Sweep of alpha", "Sweep of r_measure", "Kalman gain",
    ]  # fmt: skip
    error = {row["filter"]: row["score"]["total"] for row in shown["filters"]}
    liars, fused = (error["AccelTilt"], error["GyroIntegration"]), list(error.values())[2:]
    assert max(fused) < min(liars)


@pytest.mark.slow
def test_compare_a_log(levelhead, logs, tmp_path):
    said = levelhead("compare", logs / "hand.csv", "-o", tmp_path)
    assert (said.code, said.err) == (0, "")
    assert all(flt.name in said.out for flt in filters.ALL)
    assert is_png(tmp_path / "compare.png") and f"written: {tmp_path / 'compare.png'}" in said.out


def test_compare_as_json(levelhead, logs):
    said = levelhead(
        "compare", logs / "nine.npz", "-f", "Kalman:r_measure=4,q_bias=0.001", "-f", "complementary", "--json"
    )
    rows = said.json["filters"]
    assert [row["filter"] for row in rows] == ["Kalman(q_bias=0.001, r_measure=4)", "Complementary"]
    assert rows[0]["params"]["r_measure"] == 4.0 and rows[0]["score"]["total"] > 0.0
    assert said.json["units"]["total"] == "°" and said.json["written"] == []


def test_compare_without_truth_says_so(levelhead, logs):
    said = levelhead("compare", logs / "plain.csv", "-f", "Kalman", "-f", "Complementary", "--json")
    assert [row["score"] for row in said.json["filters"]] == [None, None]
    assert "No true orientation" in said.json["notes"][0]


@pytest.mark.slow
@pytest.mark.parametrize("what", ["lesson", "hard", "hand", "still"])
def test_compare_a_simulation(levelhead, what):
    said = levelhead("compare", "--simulate", what, "-f", "AccelTilt", "--json")
    assert said.json["samples"] == 6000
    again = levelhead("compare", "--simulate", what, "-f", "AccelTilt", "--json", "--seed", "5")
    assert again.json["filters"][0]["score"] != said.json["filters"][0]["score"]


def test_the_lesson_is_that_of_seed_42_everywhere(levelhead, tmp_path):
    levelhead("simulate", "lesson", "-o", tmp_path / "lesson.npz")
    from_file = levelhead("compare", tmp_path / "lesson.npz", "-f", "AccelTilt", "--json").json["filters"][0]["score"]
    assert (
        levelhead("compare", "--simulate", "lesson", "-f", "AccelTilt", "--json").json["filters"][0]["score"]
        == from_file
    )
    np.testing.assert_array_equal(sources.read(tmp_path / "lesson.npz").acc, simulate.lesson(42).acc)


@pytest.mark.compiled
def test_sweep(levelhead, tmp_path):
    values = ["--values", "0.9", "0.98", "0.95"]
    words = ["sweep", "-p", "alpha", "--simulate", "lesson", "--filter", "Complementary", *values]
    said = levelhead(*words, "-o", tmp_path)
    assert (said.code, said.err) == (0, "")
    assert "Smallest total error" in said.out and is_png(tmp_path / "sweep-alpha.png")
    found = levelhead(*words, "--json").json
    assert found["values"] == [0.9, 0.95, 0.98] and found["minimum"]["value"] == 0.98
    assert found["minimum"]["error_deg"] == min(found["total_deg"])


def test_sweep_a_log_with_another_parameter_held(levelhead, logs):
    words = [
        "sweep",
        logs / "hand.npz",
        "--parameter",
        "mag_noise",
        "--set",
        "acc_noise=0.3",
        "--values",
        "0.1",
        "1",
        "10",
    ]
    found = levelhead(*words, "--json").json
    assert found["params"]["acc_noise"] == 0.3 and found["unit"] == "√s" and len(found["tilt_deg"]) == 3


def test_the_guard_in_compare_and_sweep(levelhead, logs):
    """The recording begins with three seconds at rest, in which the guard reads the bias off."""
    words = ["compare", logs / "nine.npz", "-f", "Madgwick"]
    guarded, alone = levelhead(*words, "--json").json, levelhead(*words, "--guard", "off", "--json").json
    assert alone["guard"] is None and guarded["guard"] == Guard()._asdict()
    assert alone["filters"][0]["score"]["tilt"] > 1.5 * guarded["filters"][0]["score"]["tilt"]
    assert "Guard off: every filter saw all readings as they are." in levelhead(*words, "--guard", "off").out
    assert "In front of every filter: Guard(rest_time=3)." in levelhead(*words, "--guard", "rest_time=3").out
    words = ["sweep", logs / "nine.npz", "-f", "Kalman", "-p", "r_measure", "--values", "4", "--json"]
    guarded, alone = levelhead(*words).json, levelhead(*words, "--guard", "off").json
    assert guarded["tilt_deg"] != alone["tilt_deg"]


def test_a_sweep_of_what_never_moved_says_so(levelhead, tmp_path):
    """Readings of a turn beside a reference that stands: every filter is further off than no filter."""
    t = np.arange(1500) / 100.0
    angle = 0.8 * np.sin(2.0 * t)
    gyr = np.outer(1.6 * np.cos(2.0 * t), [1.0, 0.0, 0.0])
    acc = GRAVITY * np.stack([0.0 * t, np.sin(angle), np.cos(angle)], axis=1)
    standing = Recording(t, gyr, acc, None, Truth(np.tile([1.0, 0.0, 0.0, 0.0], (len(t), 1))))
    npz.write_npz(standing, tmp_path / "standing.npz")
    said = levelhead("sweep", tmp_path / "standing.npz", "-f", "Kalman", "-p", "r_measure", "--values", "0.1", "1")
    assert said.code == 0 and "a sensor that never moved from its first orientation has" in said.out


def test_a_switch_has_no_range_to_widen(levelhead, logs):
    said = levelhead("sweep", logs / "hand.npz", "-p", "q_per_sample", "--filter", "Kalman")
    assert said.code == 0 and "widen" not in said.out


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".NPZ"])
def test_simulate_and_read_back(levelhead, tmp_path, suffix):
    path = tmp_path / f"drone{suffix}"
    words = ["simulate", "drone", "-o", path, "--sensor", "BMI160", "--duration", "3", "--rate", "200", "--seed", "7"]
    facts = levelhead(*words, "--json").json
    assert facts["written"] == [str(path)] and facts["samples"] == 600 and facts["seed"] == 7
    recording, made = sources.read(path), simulate.recording("BMI160", "drone", 3.0, 200.0, 7)
    np.testing.assert_array_equal(recording.gyr, made.gyr)
    assert recording.truth is not None and made.truth is not None
    np.testing.assert_array_equal(recording.truth.quat, made.truth.quat)
    assert levelhead("fuse", path, "--no-plot", "-o", tmp_path).code == 0


def test_simulate_says_what_it_made(levelhead, tmp_path):
    said = levelhead("simulate", "-o", tmp_path / "hand.csv", "--duration", "2")
    assert said.out.splitlines() == [
        "Recording(200 samples, 2.0 s at 100.0 Hz: gyr, acc, truth)", f"written: {tmp_path / 'hand.csv'}",
    ]  # fmt: skip


@pytest.mark.parametrize("verb", ["", "demo", "fuse", "compare", "sweep", "simulate"])
def test_help_fits_a_terminal_and_names_the_filters(levelhead, verb, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    said = levelhead(*[verb] * bool(verb), "--help")
    assert said.code == 0 and said.err == ""
    assert "()" not in said.out and "default: False" not in said.out and "default: None" not in said.out
    assert max(map(len, said.out.splitlines())) <= 80
    if verb in ("fuse", "compare", "sweep"):
        assert all(flt.name in said.out for flt in filters.ALL)


def test_version(levelhead):
    import levelhead as lh

    assert levelhead("--version").out.strip() == lh.__version__
