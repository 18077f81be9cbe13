"""Parameters for many recordings: what ``tune_filter`` finds over the same ones, whoever runs the filter."""

import json

import numpy as np
import pytest

import levelhead as lh
from levelhead.cli import main
from levelhead.corpora import tune_corpus as room
from levelhead.corpora.tune_corpus import tune_corpus
from levelhead.errors import LevelheadError
from levelhead.sources.formats.csv_writer import write_csv

pytestmark = pytest.mark.slow
WISH = {"runs": 20, "seed": 1}


@pytest.fixture(scope="module")
def moving(tmp_path_factory):
    """Three recordings with truth, one that is too short, one that is none."""
    folder = tmp_path_factory.mktemp("moving")
    for i in range(3):
        recording = lh.simulate.recording("MPU-6050", "hand", duration=20.0, rate=50.0, seed=i)
        write_csv(recording, folder / f"{i}.csv")
    write_csv(recording[:100], folder / "short.csv")
    (folder / "broken.csv").write_text("this is no recording\n")
    return folder


def same(one, other):
    assert one.params == other.params and one.best == other.best
    np.testing.assert_array_equal(one.before, other.before)
    np.testing.assert_array_equal(one.after, other.after)
    assert [(fold.before, fold.after) for fold in one.folds] == [(fold.before, fold.after) for fold in other.folds]


def test_it_is_tune_filter_over_the_recordings_that_can_serve(moving):
    found = tune_corpus(moving, "Complementary", ["tau"], workers=0, **WISH)
    assert set(found.left_out) == {"short.csv", "broken.csv"}
    assert "too short to tune on" in found.left_out["short.csv"]
    paths = sorted(moving.glob("[0-9].csv"))
    same(found.tuning, lh.tune_filter([lh.read(path) for path in paths], "Complementary", ["tau"], **WISH))
    assert [one.name for one in found.tuning.references] == [path.name for path in paths]


@pytest.mark.full
def test_nothing_kept_and_two_processes_give_the_same(moving, monkeypatch):
    before = tune_corpus(moving, "Complementary", ["tau"], workers=0, **WISH)
    monkeypatch.setattr(room, "KEPT", 1)
    room._kept.clear()
    same(tune_corpus(moving, "Complementary", ["tau"], workers=0, **WISH).tuning, before.tuning)
    assert len(room._kept) == 1
    same(tune_corpus(moving, "Complementary", ["tau"], workers=2, **WISH).tuning, before.tuning)


def test_one_recording_is_refused(moving):
    with pytest.raises(LevelheadError, match=r"1 of 1 recordings can be tuned on; there is only one"):
        tune_corpus(moving / "0.csv", "Complementary", ["tau"], workers=0, **WISH)
    with pytest.raises(LevelheadError, match=r"1 of 2 recordings can be tuned on; short\.csv: .* too short"):
        tune_corpus([moving / "0.csv", moving / "short.csv"], "Complementary", ["tau"], workers=0, **WISH)


def test_the_command_writes_a_file_that_fuse_takes(moving, tmp_path, capsys):
    words = ["corpus", "tune", str(moving), "-f", "Complementary", "-p", "tau", "--runs", "20", "--workers", "0"]
    assert main([*words, "-o", str(tmp_path / "out"), "--no-plot"]) == 1
    said = capsys.readouterr().out
    assert "left out: short.csv: 2 s" in said and "left out: broken.csv: " in said
    assert json.loads((tmp_path / "out" / "tuned.json").read_text())["filter"] == "Complementary"
    tuned = str(tmp_path / "out" / "tuned.json")
    assert main(["fuse", str(moving / "0.csv"), "--params", tuned, "-o", str(tmp_path), "--no-plot"]) == 0
