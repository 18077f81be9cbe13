"""The hint behind each conclusion, given to the log that caused it, gives the same readings: no circle, no trap."""

from pathlib import Path

import numpy as np
import pytest
from tests.reference import (  # noqa: F401  (each registers its layouts)
    dialects_of_boards,
    dialects_of_datasets,
    dialects_of_protocols,
    layouts_of_firmware,
    layouts_of_robots,
)
from tests.reference.dialects import DIALECTS, Motion, simulate
from tests.reference.layouts import ROUNDS

import levelhead as lh

LAYOUTS = {**ROUNDS["firmware"], **ROUNDS["robots"], **DIALECTS}
NAMES = [
    "counts_of_a_badge", "vectornav_control_center", "msp_raw", "physics_toolbox", "whole_mg_and_mrad", "shl",
    "betaflight_explorer",
]  # fmt: skip
SUPERSEDED = {("gyr.unit", "vendor")}  # a later conclusion against it has the hint that counts


@pytest.fixture(scope="module")
def motion() -> Motion:
    return simulate("hand")


def differences(path: Path) -> list[str]:
    """The conclusions about a log whose hint is refused or changes its readings."""
    recording = lh.read(path)
    found = []
    for one in recording.meta["conclusions"]:
        if not one.confirm or (one.about, one.reason) in SUPERSEDED:
            continue
        try:
            again = lh.read(path, **one.confirm)
        except lh.LevelheadError as error:
            found.append(f"{one.confirm}: {error}")
            continue
        same = all(np.array_equal(getattr(again, k), getattr(recording, k), equal_nan=True) for k in ("gyr", "acc"))
        if not same or not np.allclose(again.t, recording.t):
            found.append(f"{one.confirm} gives other readings")
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_hints_of_a_layout(name: str, motion: Motion, tmp_path: Path) -> None:
    assert differences(LAYOUTS[name](tmp_path, motion)) == []


@pytest.mark.full
@pytest.mark.parametrize("folder", ["wild", "wild2"])
def test_hints_of_real_logs(folder: str, data_dir: Path) -> None:
    if not (data_dir / folder).is_dir():
        pytest.skip(f"no folder {folder}/ among the real recordings")
    logs = [path for path in sorted((data_dir / folder).iterdir()) if path.suffix != ".json" and not path.is_symlink()]
    found = {}
    for path in logs:
        if path.is_dir() or path.stat().st_size < 1_000_000:
            try:
                found[path.name] = differences(path)
            except lh.LevelheadError:
                continue  # refused: tests/sources/test_wild*.py paste the commands of messages
    assert len(found) > 5 and not any(found.values()), found
