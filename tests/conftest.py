"""What all tests share: where the real recordings are."""

import os
from pathlib import Path

import pytest


def find_data() -> Path | None:
    """The folder with the real recordings: $LEVELHEAD_DATA, or shared/data beside the repository; None elsewhere."""
    named = os.environ.get("LEVELHEAD_DATA")
    folder = Path(named) if named else Path(__file__).resolve().parents[2] / "shared" / "data"
    return folder if folder.is_dir() else None


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--update``: write the golden files anew instead of comparing with them."""
    parser.addoption("--update", action="store_true", help="write the golden files of tests/export/golden anew")


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder with the real recordings (broad/, repoimu/, samples/); skips where it is not there."""
    folder = find_data()
    if folder is None:
        pytest.skip(
            "no real recordings here: set LEVELHEAD_DATA to the folder that holds broad/, repoimu/ and samples/"
        )
    return folder
