"""The command line as a user meets it, but in this process: what it said, and how it left."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from levelhead import simulate
from levelhead.cli import main
from levelhead.sources.formats import npz
from levelhead.sources.formats.csv_writer import write_csv


class Said(NamedTuple):
    """Exit code, standard output and standard error of one run."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """Standard output as JSON, and as JSON alone; NaN and Infinity are none."""
        return json.loads(self.out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


Levelhead = Callable[..., Said]


def sentence(err: str) -> str:
    """The sentence of an error on its one line; below it only the topic of ``levelhead help`` may stand."""
    found = re.fullmatch(r"levelhead: (.+)\n(?:  more: levelhead help \w+\n)?", err)
    assert found, err
    return found[1].strip()


@pytest.fixture
def levelhead(capsys: pytest.CaptureFixture[str]) -> Levelhead:
    """Runs ``levelhead WORDS`` and returns what came of it."""

    def run(*words: object) -> Said:
        code = main([str(word) for word in words])
        return Said(code, *capsys.readouterr())

    return run


@pytest.fixture
def refused(levelhead: Levelhead) -> Callable[..., str]:
    """Runs ``levelhead WORDS``, which must be bad input: exit code 2, a sentence and a topic of help on stderr; that
    sentence.
    """

    def run(*words: object) -> str:
        said = levelhead(*words)
        assert said.code == 2, said
        assert said.out == ""
        return sentence(said.err)

    return run


@pytest.fixture(scope="session")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with logs: hand.csv and hand.npz (truth, no magnetometer), nine.npz (with one), plain.csv (no truth)."""
    folder = tmp_path_factory.mktemp("logs")
    hand = simulate.recording("BMI160", "hand", duration=8.0)
    write_csv(hand, folder / "hand.csv")
    npz.write_npz(hand, folder / "hand.npz")
    npz.write_npz(simulate.recording("ICM-20948", "hand", duration=8.0), folder / "nine.npz")
    rows = np.column_stack([hand.t, hand.gyr, hand.acc])
    head = "t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s²],ay [m/s²],az [m/s²]"
    np.savetxt(folder / "plain.csv", rows, delimiter=",", header=head, comments="", encoding="utf-8")
    return folder
