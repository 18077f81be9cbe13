"""A log whose rate alone is missing: the proposal in one line, taken by --yes or by Enter."""

import io
from pathlib import Path

import numpy as np
import pytest

from levelhead import inspection, simulate


class Terminal(io.StringIO):
    """A keyboard, or a screen."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def log(tmp_path: Path) -> Path:
    made = simulate.recording("MPU-6050", "hand", duration=10, seed=4)
    rows = np.column_stack([made.acc, np.degrees(made.gyr)])
    np.savetxt(tmp_path / "bare.csv", rows, "%.4f", ",", header="ax,ay,az,gx,gy,gz", comments="")
    return tmp_path / "bare.csv"


def test_without_a_word_it_is_refused_and_nothing_is_written(levelhead, log):
    said = levelhead("fuse", log, "-o", log.parent / "out")
    assert said.code == 2 and said.err.count("\n") == 2 and "try: levelhead fuse" in said.err
    assert not (log.parent / "out").exists()


def test_yes_reads_on_and_says_with_what(levelhead, log):
    said = levelhead("fuse", log, "--yes", "--no-plot", "-o", log.parent / "out")
    assert said.code == 0
    assert said.err.count("\n") == 1 and "read on with --rate" in said.err
    assert "1,000 samples" in said.out
    assert (log.parent / "out" / "bare-track.csv").exists()


@pytest.mark.parametrize(("typed", "code"), [("\n", 0), ("n\n", 2), ("", 2)])
def test_a_terminal_asks_for_enter(levelhead, log, monkeypatch, typed, code):
    monkeypatch.setattr("sys.stdin", Terminal(typed))
    screen = Terminal()
    monkeypatch.setattr("sys.stderr", screen)
    said = levelhead("fuse", log, "--no-plot", "-o", log.parent / "out")
    assert said.code == code
    assert "Enter reads on with --rate" in screen.getvalue()


def test_the_doctor_does_not_call_it_broken(log):
    report = inspection.inspect(log)
    assert report.verdict.startswith("good for tilt")
    assert all(one.severity != "broken" for one in report.findings)
    assert any(one.name == "no_time" and "--rate" in one.cure for one in report.findings)


def test_an_unreadable_log_gets_its_sentence_once(tmp_path):
    path = tmp_path / "ride.fit"
    path.write_bytes(b"\x0e\x10\x5c\x08\0\0\0\0.FIT" + bytes(40))
    report = inspection.inspect(path)
    assert str(report).count("FIT activity") == 1 and str(report).count("\n") == 0
