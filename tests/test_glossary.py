"""The glossary: each term once, and each place in the code exists."""

import importlib
import re
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[1] / "docs" / "reference" / "glossary.md"
ROWS = [
    [cell.strip() for cell in line.strip("|\n").split("|")]
    for line in PAGE.read_text(encoding="utf-8").splitlines()
    if line.startswith("|") and not line.startswith(("| term", "|---"))
]


def resolve(place: str) -> object:
    """The module, or the attribute or field of one, that a dotted name stands for.

    Raises:
        AttributeError, ModuleNotFoundError: there is none.
    """
    names = place.split(".")
    found: object = importlib.import_module(names[0])
    for i, name in enumerate(names[1:], 2):
        if name in getattr(found, "__annotations__", {}) and isinstance(found, type):
            return name  # a field without a default, the end of a path
        try:
            found = getattr(found, name)
        except AttributeError:
            found = importlib.import_module(".".join(names[:i]))
    return found


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_the_place_in_the_code_exists(row):
    (place,) = re.findall(r"`(levelhead[\w.]*)`", row[-1])
    assert resolve(place) is not None


def test_a_wrong_place_would_be_found():
    for wrong in ("levelhead.track.Track.quaternion", "levelhead.nothing", "levelhead.evaluate.Score.tilt_doubt"):
        with pytest.raises((AttributeError, ModuleNotFoundError)):
            resolve(wrong)


def test_each_term_stands_once_and_has_a_meaning():
    terms = [term for row in ROWS for term in row[0].split(", ")]
    assert len(terms) == len(set(terms)) > 50
    assert all(len(row) in (3, 5) and all(row) for row in ROWS)
