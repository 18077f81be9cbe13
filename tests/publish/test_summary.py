"""Summaries, tables and progress bars: what people read."""

import io
import sys
from dataclasses import replace
from time import monotonic, sleep

import numpy as np
import pytest

from levelhead.engine import fuse
from levelhead.evaluate import compare, evaluate
from levelhead.filters import ESKF, Complementary, Kalman
from levelhead.filters.health import ACC_MISSING, AT_REST, NAMES
from levelhead.guard import Guard
from levelhead.publish import print_table, progress, rich_table, summary
from levelhead.publish.summary import ADVICE, KINDS, LINES
from levelhead.recording import Recording
from levelhead.simulate import lesson, recording
from levelhead.track import Track
from levelhead.tune import sweep


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_summary_says_what_came_in_and_what_came_out():
    recording = lesson(42)
    track = fuse(recording, Kalman(r_measure=4))
    text = summary(recording, track, evaluate(recording, track), verbose=True)
    assert "6,000 samples, 59.99 s, 100 Hz, gyroscope + accelerometer" in text
    assert "q_bias = 0.003 (deg/s)²/s, r_measure = 4 deg²" in text
    assert "°/s at the end" in text
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
    text = summary(recording, Track(t, turn, health=health), verbose=True)
    assert "1 gap (longest 0.31 s)" in text
    assert "3 incomplete samples (3 %)" in text
    assert "magnetometer" in text
    assert "3 samples (3 %): accelerometer missing, tilt not corrected" in text
    assert "38 % of the time, where the bias was measured" in text
    assert repr(Track(t, turn, health=health)) == "Track(orientation, 100 samples, 3 with health bits)"
    assert "57.30° at 0 s" in text
    assert text.count("not estimated by this filter") == 2


def test_summary_has_few_lines_whatever_happened():
    """Everything at once: every fault, many notes, truth, a guard of its own, declination, a calibration, hard iron."""
    rec = recording("ICM-20948", "hand", duration=60.0)
    track = fuse(rec, ESKF(acc_noise=0.02)).to_true_north(3.0)
    flags = np.zeros(len(rec), np.uint32)
    for i, bit in enumerate(NAMES):
        flags[: 10 + i] |= np.uint32(bit)
    track = replace(track, health=flags)
    notes = [f"note number {i}" for i in range(7)]
    score = evaluate(rec, track)
    text = summary(rec, track, score, Guard(rest_time=3), notes=notes)
    lines = text.splitlines()
    assert len(lines) <= LINES <= 18
    for words in ("ESKF(acc_noise=0.02)", "rest_time=3", "roll ", "tilt ", "declination", "errors of the sensor"):
        assert words in text
    assert "5 more with --verbose" in text
    assert f"{len(NAMES) - 1 - KINDS} more with --verbose" in text
    assert "gyr_noise" not in text and "could not be learned" not in text
    full = summary(rec, track, score, Guard(rest_time=3), notes=notes, verbose=True)
    assert (
        full.count("note number") == 7
        and f"gyr_noise = {ESKF().gyr_noise:g} (deg/s)/√Hz" in full
        and "could not be learned" in full
    )
    for words in (words for bit, words in NAMES.items() if bit != AT_REST):
        assert words in full


def test_every_fault_that_a_user_can_mend_says_how():
    assert set(ADVICE) <= set(NAMES) and AT_REST not in ADVICE
    track = Track([0.0, 0.01], np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)), health=[ACC_MISSING, 0])
    rec = Recording([0.0, 0.01], np.zeros((2, 3)), np.ones((2, 3)))
    assert "1 sample (50 %): accelerometer missing, tilt not corrected: check the logger" in summary(rec, track)


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
        deadline = monotonic() + 20.0
        while "fusing" not in terminal.getvalue() and monotonic() < deadline:  # another thread draws it
            sleep(0.01)
        report(0.7)
        raise ZeroDivisionError
    assert "fusing" in terminal.getvalue()


def test_a_comparison_without_truth_prints():
    out = Terminal()
    print_table(compare(replace(lesson(42)[:300], truth=None), [Complementary, Kalman]), out)
    assert "whose σ is the smallest" in out.getvalue()
