"""A small run of benchmarks/reader/fuzz.py: mutated logs of all formats give a recording or a sentence."""

import signal
import time
from pathlib import Path

import pytest
from tests.reference import fuzz


@pytest.mark.slow
def test_mutated_logs_give_a_recording_or_a_sentence() -> None:
    outcomes = fuzz.run(7, range(60))
    assert set(outcomes) <= {"read", "refused"}, outcomes
    assert outcomes["read"] > 5 and outcomes["refused"] > 5


@pytest.mark.slow
def test_a_reader_that_hangs_is_noticed_though_it_takes_every_exception(monkeypatch: pytest.MonkeyPatch) -> None:
    def reading(path: Path) -> str:
        try:
            while True:
                time.sleep(0.01)
        except Exception:
            return "refused, it seems"

    monkeypatch.setattr(fuzz, "reading", reading)
    monkeypatch.setattr(fuzz, "LONGEST", 1.0)
    before = signal.signal(signal.SIGALRM, fuzz._hang)
    try:
        assert fuzz.outcome(Path("log.csv"), "flip", "") == "HANG"
    finally:
        signal.signal(signal.SIGALRM, before)
