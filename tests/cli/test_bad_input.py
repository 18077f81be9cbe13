"""Bad input: one clear line on standard error, exit code 2, and nothing written."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

HEAD = "t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s²],ay [m/s²],az [m/s²]"
ROWS = [f"{i / 100:.2f},0.01,0.02,0.03,0.1,0.2,9.8" for i in range(60)]


def text(head: str = HEAD, rows: list[str] = ROWS) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        (folder / "log.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
        return folder / "log.csv"

    return make


def changed(row: int, line: str) -> list[str]:
    return [*ROWS[:row], line, *ROWS[row + 1 :]]


def empty(folder: Path) -> Path:
    (folder / "log.csv").touch()
    return folder / "log.csv"


def truncated_mat(folder: Path) -> Path:
    scipy_io = pytest.importorskip("scipy.io")
    values = {"gyr": np.ones((500, 3)), "acc": np.ones((500, 3)), "t": np.arange(500.0)}
    scipy_io.savemat(folder / "log.mat", values)
    whole = (folder / "log.mat").read_bytes()
    (folder / "log.mat").write_bytes(whole[: len(whole) // 2])
    return folder / "log.mat"


def pickle_in_npz(folder: Path) -> Path:
    np.savez(folder / "log.npz", gyr=np.array([{}, {}], dtype=object), acc=np.ones((2, 3)), t=np.arange(2.0))
    return folder / "log.npz"


LOGS: dict[str, tuple[Callable[[Path], Path], tuple[str, ...]]] = {
    "missing": (lambda folder: folder / "flight.csv", ("there is no file", "flight.csv")),
    "empty": (empty, ("empty",)),
    "header only": (text(rows=[]), ("no line of numbers",)),
    "no header": (text(ROWS[0]), ("no header", "map gyr=…", "7 9.8 to 9.8")),
    "text in a number column": (
        text(rows=changed(30, "0.30,0.01,oops,0.03,0.1,0.2,9.8")),
        ("line 32", "gy [rad/s]", "'oops' is not a number"),
    ),
    "unknown unit": (text(HEAD.replace("gx [rad/s]", "gx [furlong/s]")), ("furlong/s", "not a unit")),
    "time stands still": (
        text(rows=[f"0.1,{row.partition(',')[2]}" for row in ROWS[:15]]),
        ("line 3", "time stands still"),
    ),
    "time goes back in every row": (text(rows=ROWS[::-1]), ("line 3", "time goes back from 0.59 to 0.58")),
    "no accelerometer": (
        text("t [s],gx [rad/s],gy [rad/s],gz [rad/s]", [",".join(row.split(",")[:4]) for row in ROWS]),
        ("no accelerometer", "acc_x"),
    ),
    "infinite": (text(rows=changed(5, "0.05,0.01,inf,0.03,0.1,0.2,9.8")), ("line 7", "infinite")),
    "a row too short": (text(rows=changed(5, "0.05,0.01")), ("line 7", "2 cells")),
    "truncated .mat": (truncated_mat, ("log.mat", "truncated")),
    "a pickle": (pickle_in_npz, ("log.npz", "pickle")),
    "unknown suffix": (lambda folder: empty(folder).replace(folder / "log.docx"), ("log.docx",)),
    "a folder": (lambda folder: folder, ("folder",)),
}


@pytest.mark.parametrize("case", LOGS)
def test_bad_logs(refused, tmp_path, case):
    make, words = LOGS[case]
    (tmp_path / "in").mkdir()
    log = make(tmp_path / "in")
    old = tmp_path / "old"
    old.mkdir()
    (old / "log-track.csv").write_text("what was there before")
    for verb in ("fuse", "compare"):
        said = refused(verb, log, "-o", old)
        assert all(word in said for word in words), said
    refused("fuse", log, "-o", tmp_path / "new")
    assert not (tmp_path / "new").exists()
    assert [path.name for path in old.iterdir()] == ["log-track.csv"]
    assert (old / "log-track.csv").read_text() == "what was there before"


@pytest.mark.parametrize(
    "words, said",
    [
        (["--filter", "Kalmann"], "no filter 'Kalmann'; did you mean 'Kalman'?"),
        (["--filter", "Kalman", "--set", "r_mesure=1"], "no parameter 'r_mesure'; did you mean 'r_measure'?"),
        (["--set", "acc_bais=1"], "ESKF has no parameter 'acc_bais'; did you mean 'acc_bias'?"),
        (["--set", "r_measure=1"], "ESKF, the best filter for these sensors, has no parameter 'r_measure'; name one"),
        (["--filter", "Kalman", "--set", "r_measure=0"], "r_measure = 0 is not allowed; it must be greater than"),
        (["--filter", "Kalman", "--set", "r_measure=-1"], "must be greater than 0 deg²"),
        (["--filter", "Kalman", "--set", "r_measure=nan"], "must be greater than 0 deg²"),
        (["--filter", "Kalman", "--set", "r_measure=much"], "r_measure is 'much', but it must be a number"),
        (["--filter", "Complementary", "--set", "alpha=1"], "alpha = 1 is not allowed; it must be at least 0 and"),
        (["--filter", "Complementary", "--set", "alpha=-0.1"], "must be at least 0 and below 1"),
        (["--set", "alpha=0.98"], "--filter Complementary"),
        (["--set", "acc_tau"], "'acc_tau' sets nothing; write a parameter and its value, such as r_measure=0.1"),
        (["--set", "acc_tau=1", "--set", "acc_tau=2"], "set twice"),
        (["--guard", "rest_tim=3"], "Guard has no parameter 'rest_tim'; did you mean 'rest_time'?"),
        (["--guard", "rest_time"], "'rest_time' sets nothing; write a parameter and its value, such as rest_time=3"),
        (["--guard", "on"], "such as rest_time=3, or off"),
        (["--guard", "rest_time=-1"], "rest_time = -1 is not allowed; it must be at least 0 s"),
        (["--guard", "off", "--guard", "rest_time=3"], "--guard off leaves no threshold to set"),
        (["--declination", "3.5"], "there is no magnetometer: heading is relative; leave it out"),
        (["--declination", "400"], "within ±180"),
        (["--declination", "east"], "--declination"),
        (["--units", "gyr=dgs"], "'dgs' is not a unit"),
        (["--units", "gyro=deg/s"], "did you mean 'gyr'?"),
        (["--units", "deg/s"], "has no '='"),
        (["--counts", "gyr=131"], "131/deg/s"),
        (["--map", "gyr=a,b"], "expected 3"),
        (["--map", "gyr=a,b,c"], "no column 'a'"),
        (["--rate", "100"], "time stamps"),
        (["--rate", "fast"], "--rate"),
        (["--format", "xlsx"], "csv"),
        (["--flter", "Kalman"], "Did you mean --filter?"),
    ],
)  # fmt: skip
def test_bad_options(refused, logs, tmp_path, words, said):
    assert said in refused("fuse", logs / "plain.csv", *words, "-o", tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    "words, said",
    [
        (["fuze", "log.csv"], 'Did you mean "fuse"?'),
        (["fuse"], "LOG"),
        (["compare"], "either a log or --simulate"),
        (["compare", "log.csv", "--simulate", "lesson"], "either a log or --simulate"),
        (["compare", "--simulate", "leson"], "did you mean 'lesson'?"),
        (["compare", "--simulate", "lesson", "--seed", "-1"], "seed"),
        (["compare", "--simulate", "lesson", "--rate", "50"], "--simulate needs none"),
        (["compare", "--simulate", "lesson", "-f", "Kalman:r_measure"], "sets nothing"),
        (["compare", "--simulate", "lesson", "-f", "Kalmann"], "did you mean 'Kalman'?"),
        (["sweep", "--simulate", "lesson"], "--parameter"),
        (["sweep", "--simulate", "hand", "-p", "alpha"], "--filter Complementary"),
        (["sweep", "--simulate", "lesson", "-p", "alpa", "--filter", "Complementary"], "did you mean 'alpha'?"),
        (["sweep", "--simulate", "lesson", "-p", "alpha", "--filter", "Complementary", "--values", "1.5"], "below 1"),
        (["sweep", "--simulate", "lesson", "-p", "r_measure", "--filter", "Kalman", "--values", "0"], "greater than 0"),
        (["simulate"], "--out"),
        (["simulate", "wlaking", "-o", "x.csv"], "did you mean 'walking'?"),
        (["simulate", "-o", "x.mat"], "expected .csv, .npz or .bag"),
        (["simulate", "-o", "nowhere/x.csv", "--duration", "1"], "there is no folder nowhere"),
        (["simulate", "-o", "x.csv", "--sensor", "MPU6000"], "did you mean 'MPU-6050'?"),
        (["simulate", "-o", "x.csv", "--duration", "0"], "duration"),
        (["simulate", "-o", "x.csv", "--rate", "0"], "rate"),
        (["simulate", "-o", "x.csv", "--seed", "-3"], "seed"),
        (["simulate", "lesson", "-o", "x.csv", "--duration", "5"], "only --seed"),
        (["demo", "--seed", "first"], "--seed"),
    ],
)  # fmt: skip
def test_bad_commands(refused, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    assert said in refused(*words)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("flt", ["AccelTilt", "GyroIntegration", "RollPitchKalman"])
def test_no_true_north_for_a_filter_that_knows_no_north(refused, logs, tmp_path, flt):
    said = refused("fuse", logs / "nine.npz", "--declination", "3.5", "--filter", flt, "-o", tmp_path / "new")
    assert f"{flt} does not follow the magnetometer: heading is relative" in said
    assert not (tmp_path / "new").exists()


def test_no_truth_no_sweep(refused, logs):
    assert "truth" in refused("sweep", logs / "plain.csv", "-f", "Kalman", "-p", "r_measure")


def test_a_seed_means_nothing_to_a_log(refused, logs):
    assert "--seed is for --simulate" in refused("compare", logs / "hand.csv", "--seed", "3")


def test_more_memory_than_there_is(refused, tmp_path):
    assert "memory" in refused("simulate", "-o", tmp_path / "x.csv", "--duration", "1e14")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("verb", ["fuse", "compare", "sweep", "demo"])
def test_a_folder_that_cannot_be_made(refused, logs, tmp_path, verb):
    (tmp_path / "file").write_text("no folder")  # holds for root too, whom no permission stops
    log = [] if verb == "demo" else [logs / "hand.csv"]
    parameter = ["-f", "Kalman", "-p", "r_measure", "--values", "1"] if verb == "sweep" else []
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        assert "cannot make the folder" in refused(verb, *log, *parameter, "-o", out)
    assert (tmp_path / "file").read_text() == "no folder" and len(list(tmp_path.iterdir())) == 1


def test_the_name_of_a_file_for_a_folder(refused, logs, tmp_path):
    error = refused("fuse", logs / "hand.csv", "-o", tmp_path / "track.csv")
    assert f"It is the name of a file; expected a folder for the results, such as -o {tmp_path / 'track'}" in error
    assert not (tmp_path / "track.csv").exists()


def test_a_result_where_a_folder_stands(refused, logs, tmp_path):
    (tmp_path / "hand-track.csv").mkdir()
    assert "it is a folder" in refused("fuse", logs / "hand.csv", "-o", tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
