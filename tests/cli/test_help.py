"""``levelhead help``: every page of the documentation by its name."""

from pathlib import Path

import pytest

from levelhead.cli import main
from levelhead.cli.help import FOLDER, pages

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_every_page_has_a_name_of_its_own(capsys):
    files = [path for path in DOCS.glob("*/**/*.md") if path.stem not in {"index", "changes", "contributing"}]
    files = [path for path in files if path.relative_to(DOCS).parts[0] != "gallery"]
    assert FOLDER == DOCS
    assert sorted(pages().values()) == sorted(files)
    assert main(["help"]) == 0
    listed = capsys.readouterr().out
    assert all(f"  {name} " in listed for name in pages())


@pytest.mark.parametrize(("name", "words"), [("yaw-drift", "magnetometer"), ("enu-ned", "north"), ("VQF", "tauAcc")])
def test_a_page_is_shown(name, words, capsys):
    assert main(["help", name]) == 0
    shown = capsys.readouterr().out
    assert words in shown and ":::" not in shown


def test_a_page_that_does_not_exist(capsys):
    assert main(["help", "yaw-drft"]) == 2
    assert "there is no page 'yaw-drft'; did you mean 'yaw-drift'?" in capsys.readouterr().err
