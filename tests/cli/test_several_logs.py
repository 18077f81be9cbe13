"""``levelhead fuse`` of several logs: each has a result of its own, and one that fails does not stop the others."""

import json

import pytest

import levelhead as lh
from levelhead.cli import main
from levelhead.sources.formats.csv_writer import write_csv


@pytest.fixture
def logs(tmp_path):
    folder = tmp_path / "logs"
    folder.mkdir()
    for seed in (1, 2):
        write_csv(lh.simulate.recording("MPU-6050", "hand", duration=5, seed=seed), folder / f"flight{seed}.csv")
    return folder


def test_a_folder_and_a_damaged_file(logs, tmp_path, capsys):
    (logs / "broken.csv").write_text("t,gx,gy,gz,ax,ay,az\n1,2\n")
    (logs / "notes.md").write_text("no log")
    out = tmp_path / "results"
    assert main(["fuse", str(logs), "-o", str(out), "--no-plot", "--filter", "Mahony"]) == 2
    said = capsys.readouterr()
    assert sorted(path.name for path in out.iterdir()) == ["flight1-track.csv", "flight2-track.csv"]
    lines = said.out.splitlines()
    assert [line.split()[1] for line in lines[1:4]] == ["failed", "Mahony", "Mahony"]
    assert said.err.startswith("levelhead: 1 of 3 logs failed:") and said.err.count("broken.csv") == 1
    assert len(said.err.splitlines()) == 2


def test_json_of_several(logs, tmp_path, capsys):
    given = [str(logs / "flight1.csv"), str(logs / "none.csv"), "--json", "--no-plot", "-o", str(tmp_path / "out")]
    assert main(["fuse", *given]) == 2
    one, other = json.loads(capsys.readouterr().out)["logs"]
    assert one["written"] and "error" not in one
    assert "none.csv" in other["error"]


def test_equal_names_are_told_apart(logs, tmp_path):
    other = tmp_path / "evening"
    other.mkdir()
    (other / "flight1.csv").write_bytes((logs / "flight1.csv").read_bytes())
    given = [str(logs / "flight1.csv"), str(other / "flight1.csv"), str(logs / "flight2.csv")]
    assert main(["fuse", *given, "--no-plot", "-o", str(tmp_path / "out")]) == 0
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["evening-flight1-track.csv", "flight2-track.csv", "logs-flight1-track.csv"]
    assert main(["fuse", *[given[0]] * 2, "-o", str(tmp_path / "out")]) == 2


def test_what_cannot_be_written_is_said_before_a_log_is_read(logs, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("levelhead.cli.options.Reading.read", lambda *_: pytest.fail("read"))
    (tmp_path / "file").write_text("")
    assert main(["fuse", str(logs / "flight1.csv"), "-o", str(tmp_path / "file" / "out")]) == 2
    assert "is a file" in capsys.readouterr().err
    assert main(["fuse"]) == 2
    assert "there is no log" in capsys.readouterr().err
    (tmp_path / "empty").mkdir()
    assert main(["fuse", str(tmp_path / "empty")]) == 2
    assert "there is no log in the folder" in capsys.readouterr().err


@pytest.mark.slow
def test_without_matplotlib_there_are_tables(tmp_path, capsys, monkeypatch):
    for verb in ("demo", "compare", "sweep", "fuse"):
        monkeypatch.setattr(f"levelhead.cli.{verb}.can_draw", lambda: False)
    out = ["-o", str(tmp_path / "out")]
    for words in (
        ["demo", *out],
        ["compare", "--simulate", "lesson", "-f", "Complementary", *out],
        [
            "sweep",
            "--simulate",
            "lesson",
            "--parameter",
            "alpha",
            "--filter",
            "Complementary",
            "--values",
            "0.98",
            *out,
        ],
    ):
        assert main(words) == 0, words
        said = capsys.readouterr().out
        assert "no picture: it needs matplotlib" in said and "levelhead[plot]" in said
    assert not (tmp_path / "out").exists()
