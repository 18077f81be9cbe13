"""Layouts of public code that were not read at first; ``benchmarks.reader.layouts`` judges all of their rounds."""

from pathlib import Path

import pytest
from tests.reference.dialects import Motion, simulate
from tests.reference.layout_verdicts import ROUNDS, judge

MENDED = {
    "firmware": ("chiptime", "blank_for_the_time"),
    "apps": ("device_motion", "core_motion_short_names", "connect_iq_seconds", "g_force_recorder"),
    "robots": ("pandas_of_a_bag", "vectornav_control_center", "gazebo_echo", "mongo_export"),
    "laboratories": ("sis_fall",),
}


@pytest.fixture(scope="module")
def motion() -> Motion:
    return simulate("hand")


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind, names in MENDED.items() for name in names])
def test_a_layout_that_was_not_read_at_first(kind: str, name: str, motion: Motion, tmp_path: Path) -> None:
    verdict, why = judge(name, ROUNDS[kind][name], motion, tmp_path)
    assert verdict == ("command" if name == "sis_fall" else "right"), why
