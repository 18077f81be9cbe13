"""What all tests share: where the real recordings are, and what the marks of the tiers mean."""

import gc
import importlib.util
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.reference.compile_once import compile_once
from tests.reference.export_once import export_once

from levelhead.engine import native

MARKS = ("compiled", "full")
LONGEST = (
    "test_lanes.py", "test_suites_in_c.py", "test_sensor.py", "test_same_bits.py", "test_selftest.py",
    "test_real_recordings.py", "test_smoothing.py", "test_aided_smoothing.py",
)  # fmt: skip
COMPILED_SOONER = ("EKF",)  # in blocks, with a σ of its own

if importlib.util.find_spec("hypothesis"):  # .ci/pythons has none
    from hypothesis import HealthCheck, settings

    settings.register_profile("levelhead", deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile("levelhead")  # no test fails because the machine is busy


def find_data() -> Path | None:
    """The folder with the real recordings: $LEVELHEAD_DATA, or shared/data beside the repository; None elsewhere."""
    named = os.environ.get("LEVELHEAD_DATA")
    folder = Path(named) if named else Path(__file__).resolve().parents[2] / "shared" / "data"
    return folder if folder.is_dir() else None


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--update``: write the golden files anew instead of comparing with them."""
    parser.addoption("--update", action="store_true", help="write the golden files of tests/export/golden anew")


def pytest_collection() -> None:
    """Thousands of tests are made and stay until the end: looking for garbage among them would take long."""
    gc.disable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Numba takes 10 to 60 s for each filter: in the second tier it compiles one, in the third all of them.

    The native engine, which users have, is compared with plain Python for all filters in the first. Files that take
    longest begin first: at the end no process has one of them to itself while the others have none.
    """
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: item.path.name not in LONGEST)
    for item in items:
        callspec = getattr(item, "callspec", None)  # what a parametrised test is called with
        flt = callspec.params.get("flt") if callspec is not None else None
        in_numba = item.path.parent.name == "engine" and item.get_closest_marker("compiled")
        faults_in_c = item.path.name == "test_suites_in_c.py" and item.function.__module__.endswith("test_faults")
        if faults_in_c or (flt is not None and in_numba and flt.name not in COMPILED_SOONER):
            item.add_marker("full")


def pytest_collection_finish() -> None:
    """From here on garbage is looked for among what is made later."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder with the real recordings (broad/, repoimu/, samples/); skips where it is not there."""
    folder = find_data()
    if folder is None:
        pytest.skip(
            "no real recordings here: set LEVELHEAD_DATA to the folder that holds broad/, repoimu/ and samples/"
        )
    return folder


@pytest.fixture(scope="session")
def _one_compilation(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Of the processes that run the tests, one compiles a function and the others take it from the cache."""
    with compile_once(tmp_path_factory.getbasetemp().parent):  # which xdist's processes share
        yield


@pytest.fixture(scope="session", autouse=True)
def _one_trace() -> Iterator[None]:
    """A filter is translated once for all tests that export it alike."""
    with export_once():
        yield


@pytest.fixture(scope="session")
def _native_stands_in(request: pytest.FixtureRequest) -> bool:
    """Whether nothing needs Numba: in ``make quick``, where there is a native engine of these sources."""
    return "not compiled" in request.config.option.markexpr and native.up_to_date()


@pytest.fixture(autouse=True)
def _tier(request: pytest.FixtureRequest, _native_stands_in: bool) -> Iterator[None]:
    """What the marks promise: one compilation for all, and in ``make quick`` a test that imports Numba fails."""
    if any(request.node.get_closest_marker(mark) for mark in MARKS):
        request.getfixturevalue("_one_compilation")
    before = "numba" in sys.modules
    yield
    if _native_stands_in:
        assert before or "numba" not in sys.modules, "this test imports Numba: mark it with pytest.mark.compiled"
