"""Summaries, tables and progress bars: what people read."""

import io
import sys
from dataclasses import replace

import numpy as np
import pytest

from levelhead.engine import fuse
from levelhead.evaluate import compare, evaluate
from levelhead.filters import Complementary, Kalman
from levelhead.filters.health import ACC_MISSING, AT_REST
from levelhead.publish import print_table, progress, rich_table, summary
from levelhead.recording import Recording
from levelhead.simulate import lesson
from levelhead.track import Track
from levelhead.tune import sweep


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_summary_says_what_came_in_and_what_came_out():
    recording = lesson(42)
    track = fuse(recording, Kalman(r_measure=4))
    text = summary(recording, track, evaluate(recording, track))
    assert "6,000 samples, 59.99 s, 100 Hz, gyroscope + accelerometer" in text
    assert "q_bias = 0.003 (deg/s)²/s, r_measure = 4 deg²" in text
    assert "°/s learned by the end" in text
    assert "nothing missing, stuck, at full scale or rejected; no gap in time" in text
    assert "against truth" in text
    assert max(len(line) for line in text.splitlines()) <= 120
    assert len(text.splitlines()) <= 24


def test_summary_counts_gaps_missing_samples_and_health():
    t = np.concatenate([np.arange(50), np.arange(80, 130)]) * 0.01
    acc = np.tile([0.0, 0.0, 9.8], (100, 1))
    acc[10:13] = np.nan
    recording = Recording(t, np.zeros((100, 3)), acc, np.ones((100, 3)))
    health = np.zeros(100, np.uint32)
    health[10:13] = ACC_MISSING
    health[12:50] |= AT_REST
    turn = np.tile([np.cos(0.5), np.sin(0.5), 0.0, 0.0], (100, 1))
    text = summary(recording, Track(t, turn, health=health))
    assert "1 gap (longest 0.31 s)" in text
    assert "3 incomplete samples (3 %)" in text
    assert "magnetometer" in text
    assert "3 samples (3 %): accelerometer missing, tilt not corrected" in text
    assert "at rest       38 % of the time, bias read off" in text
    assert repr(Track(t, turn, health=health)) == "Track(orientation, 100 samples, 3 with health bits)"
    assert "57.30° at 0 s" in text
    assert text.count("not estimated by this filter") == 2


def test_summary_uses_the_minus_sign():
    down = np.tile([np.cos(0.1), -np.sin(0.1), 0.0, 0.0], (2, 1))
    recording = Recording([0.0, 0.01], np.zeros((2, 3)), np.ones((2, 3)))
    assert "roll −11.46°" in summary(recording, Track(recording.t, down))


def test_tables_are_rich_on_a_terminal_and_plain_in_a_pipe():
    found = compare(lesson(42)[:500], [Complementary, Kalman])
    pipe, terminal = io.StringIO(), Terminal()
    print_table(found, pipe)
    assert pipe.getvalue() == f"{found}\n"
    print_table(found, terminal)
    assert "Complementary" in terminal.getvalue()
    assert "ns/sample" in terminal.getvalue()


def test_the_best_of_each_column_is_bold():
    found = compare(lesson(42)[:2000], [Complementary(alpha=0.5), Complementary(alpha=0.98)])
    table = rich_table(found)
    total = list(table.columns[1].cells)
    assert [str(cell.style) for cell in total] == ["", "bold"]
    assert table.columns[1].header.plain == "total\n°"


def test_a_sweep_as_a_table():
    found = sweep(lesson(42)[:500], Complementary, "alpha", [0.5, 0.9, 0.98])
    out = Terminal()
    print_table(found, out)
    assert "minimum" in out.getvalue()
    assert len(rich_table(found).columns) == 5


def test_no_bar_in_a_pipe(monkeypatch):
    pipe = io.StringIO()
    monkeypatch.setattr(sys, "stderr", pipe)
    monkeypatch.setattr(sys.modules["levelhead.publish.progress"], "PATIENCE", 0.0)
    with progress("fusing") as report:
        report(0.3)
        report(1.0)
    assert pipe.getvalue() == ""


def test_no_bar_for_what_is_done_at_once(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with progress("fusing") as report:
        report(0.5)
        report(1.0)
    assert terminal.getvalue() == ""


def test_a_bar_on_a_terminal_that_goes_away_even_after_an_error(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(sys.modules["levelhead.publish.progress"], "PATIENCE", 0.0)
    monkeypatch.setenv("TERM", "xterm")
    with pytest.raises(ZeroDivisionError), progress("fusing") as report:
        report(0.2)
        report(0.7)
        raise ZeroDivisionError
    assert "fusing" in terminal.getvalue()


def test_a_comparison_without_truth_prints():
    out = Terminal()
    print_table(compare(replace(lesson(42)[:300], truth=None), [Complementary, Kalman]), out)
    assert "tilt is compared with the first filter's" in out.getvalue()
