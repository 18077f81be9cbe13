"""``levelhead bench``: the table, the files, and bad input."""

import csv
import json

import pytest

from levelhead import simulate
from levelhead.sources.formats import npz

FILES = ["accuracy.csv", "accuracy.json", "accuracy.md", "accuracy.png"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("recordings")
    for name, seed in (("05_undisturbed_slow_rotation_A", 1), ("24_disturbed_tapping_A", 2)):
        npz.write_npz(simulate.recording("MPU-6050", duration=20.0, seed=seed, mag="HMC5883L"), made / f"{name}.npz")
    return made


@pytest.mark.slow
def test_table_and_files(levelhead, folder, tmp_path):
    words = ("-f", "default", "-f", "accel-tilt", "-f", "Kalman:r_measure=9", "--jobs", "1", "-o", tmp_path / "new")
    said = levelhead("bench", "accuracy", folder, *words, "--per-recording")
    assert (said.code, said.err) == (0, "")
    assert all(word in said.out for word in ("rotation", "tapping", "Kalman(r_measure=9)", "24_disturbed_tapping_A"))
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == FILES
    rows = list(csv.DictReader((tmp_path / "new" / "accuracy.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) == 2 * 3 and float(rows[0]["total"]) > 0.0
    found = json.loads((tmp_path / "new" / "accuracy.json").read_text(encoding="utf-8"))
    assert [one["method"] for one in found["methods"]] == ["default", "AccelTilt", "Kalman(r_measure=9)"]
    assert str(folder) not in (tmp_path / "new" / "accuracy.json").read_text(encoding="utf-8")
    assert (tmp_path / "new" / "accuracy.png").stat().st_size > 20_000


def test_json_without_magnetometer(levelhead, folder):
    found = levelhead("bench", "accuracy", folder, "-f", "default", "--no-mag", "--jobs", "1", "--json").json
    assert found["magnetometer"] is False and found["figure_of_groups"] == "tilt"
    assert found["methods"][0]["errors"]["all: drift in 60 s"] > 0.0  # over half of them, for they are shorter
    assert found["written"] == []


@pytest.mark.slow
def test_several_processes_from_the_command_line(levelhead, folder):
    said = levelhead("bench", "accuracy", folder, "-f", "Kalman", "-f", "default", "--jobs", "2", "--json")
    assert (said.code, said.err) == (0, "") and len(said.json["runs"]) == 4


@pytest.mark.parametrize(
    "words, said",
    [
        (["nowhere"], "there is no folder nowhere"),
        ([], "no folder to look into"),
        (["."], "holds no recordings"),
        (["{folder}", "-f", "Kalmann"], "no filter or contender 'Kalmann'; did you mean 'Kalman'?"),
        (["{folder}", "-f", "vqf"], "did you mean 'vqf.VQF'?"),
        (["{folder}", "-f", "Kalman:r_mesure=1"], "did you mean 'r_measure'?"),
        (["{folder}", "--jobs", "0"], "--jobs must be at least 1"),
        (["{logs}/plain.csv"], "no recording can be compared"),
    ],
)
def test_bad_input(refused, folder, logs, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    filled = [word.format(folder=folder, logs=logs) for word in words]
    assert said in refused("bench", "accuracy", *filled, "-o", tmp_path / "new")
    assert list(tmp_path.iterdir()) == []


def test_an_unreadable_recording_is_left_out_with_a_line(levelhead, folder, tmp_path):
    for path in folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "broken.npz").write_bytes(b"PK\x03\x04 nothing")
    said = levelhead("bench", "accuracy", tmp_path, "-f", "default", "--jobs", "1")
    assert said.code == 0 and "Left out: " in said.out and "broken.npz" in said.out


def test_the_folder_for_results_is_looked_at_before_the_work(refused, folder, tmp_path):
    (tmp_path / "file").write_text("no folder")
    assert "cannot make the folder" in refused("bench", "accuracy", folder, "-f", "default", "-o", tmp_path / "file")


@pytest.mark.full
def test_speed(levelhead):
    found = levelhead("bench", "speed", "--samples", "1000", "--repeats", "1", "--json").json
    assert len(found["tables"]) == 4 and found["machine"]["python"]
    assert all(table["rows"] for table in found["tables"])


def test_speed_of_too_little(refused):
    assert "too few to time anything" in refused("bench", "speed", "--repeats", "0")
