import os
from pathlib import Path

import pytest

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError


def test_a_file_appears_whole(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    with atomic_path(target) as temporary:
        temporary.write_text("new")
        assert not target.exists() and temporary.suffix == ".txt"
    assert target.read_text() == "new" and os.listdir(tmp_path) == ["a.txt"]


def test_or_not_at_all(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")

    def fail() -> None:
        with atomic_path(target) as temporary:
            temporary.write_text("half")
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert target.read_text() == "old" and os.listdir(tmp_path) == ["a.txt"]


def test_where_nothing_can_be_written(tmp_path: Path) -> None:
    for target, sentence in ((tmp_path, "is a folder"), (tmp_path / "b" / "a.txt", "no folder")):
        with pytest.raises(LevelheadError, match=sentence), atomic_path(target):
            pass
