"""A small run of benchmarks/fuzz.py: mutated logs of all formats give a recording or a sentence."""

import pytest

import fuzz


@pytest.mark.slow
def test_mutated_logs_give_a_recording_or_a_sentence() -> None:
    outcomes = fuzz.run(7, range(60))
    assert set(outcomes) <= {"read", "refused"}, outcomes
    assert outcomes["read"] > 5 and outcomes["refused"] > 5
